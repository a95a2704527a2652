"""SampledBoundary: points on the six faces of a trivariate spline, and the triangles between them."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from .bspline import breakpoints, divided_spans
from .orientation import FACES
from .volume import BSplineVolume

SAMPLES = 160  # a direction and cube face, at least
PER_SPAN = 3  # samples a direction in every span, at least


@dataclass(frozen=True, eq=False)
class SampledBoundary:
    """The spline's boundary, sampled on a grid on each face of the cube, and the triangles between the samples."""

    parameters: Array  # (n, 3), face after face in the order of FACE_NAMES
    points: Array  # (n, 3)
    triangles: IntArray  # (m, 3), wound outwards where F keeps orientation
    cube_faces: IntArray  # (m,) of the triangles

    @classmethod
    def of(cls, volume: BSplineVolume, samples: int = SAMPLES) -> "SampledBoundary":
        """Sample all six faces with their edges, each span alike, and at least `samples` times a direction.

        Raises ValueError for fewer than two samples.
        """
        if samples < 2:
            raise ValueError(f"samples must be at least 2, got {samples}")
        spans = [len(breakpoints(row)) - 1 for row in volume.knots]
        u, v, w = (
            divided_spans(row, max(PER_SPAN, -(-(samples - 1) // count)))
            for row, count in zip(volume.knots, spans, strict=True)
        )
        return cls.on(volume, u, v, w)

    @classmethod
    def on(cls, volume: BSplineVolume, *rows: Array) -> "SampledBoundary":
        """Sample all six faces at three rows of parameters, each from 0 to 1."""
        parameters, points, triangles, cube_faces, count = [], [], [], [], 0
        for k, (axis, side) in enumerate(FACES):
            u, v, w = (np.array([float(side)]) if d == axis else row for d, row in enumerate(rows))
            parameters.append(np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3))
            points.append(volume.grid(u, v, w).reshape(-1, 3))
            face = _halved_cells(*(len(row) for d, row in enumerate(rows) if d != axis))
            inwards = (side == 1) == (axis == 1)  # (u, w) is left-handed seen along v
            triangles.append(count + (face[:, ::-1] if inwards else face))
            cube_faces.append(np.full(len(face), k))
            count += len(parameters[-1])
        return cls(*(np.concatenate(parts) for parts in (parameters, points, triangles, cube_faces)))


def _halved_cells(n_a: int, n_b: int) -> IntArray:
    """Return two triangles for each cell of a grid of n_a x n_b points, numbered row by row."""
    number = np.arange(n_a * n_b, dtype=np.int64).reshape(n_a, n_b)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
