"""SampledBoundary: points on the faces of a body's boundary, and the triangles between them."""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from .bspline import breakpoints, divided_spans
from .interface import axis_side
from .multipatch import MultiPatch, as_multipatch
from .volume import BSplineVolume

SAMPLES = 160  # a direction and cube face, at least
PER_SPAN = 3  # samples a direction in every span, at least


@dataclass(frozen=True, eq=False)
class SampledBoundary:
    """The boundary of a body, sampled on a grid on each face that is not glued, and the triangles between the samples.

    A face has the number 6 * patch + face, in the order of FACE_NAMES.
    """

    parameters: Array  # (n, 3), face after face
    points: Array  # (n, 3)
    triangles: IntArray  # (m, 3), wound outwards where F keeps orientation
    cube_faces: IntArray  # (m,) of the triangles
    sample_faces: IntArray  # (n,) of the samples

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
    def on(cls, body: BSplineVolume | MultiPatch, *rows: Array) -> "SampledBoundary":
        """Sample all faces of the boundary at three rows of parameters, each from 0 to 1; patches keep orientation."""
        body = as_multipatch(body)
        parameters, points, triangles, cube_faces, sample_faces, count = [], [], [], [], [], 0
        for patch, (volume, names) in enumerate(zip(body, body.outer, strict=True)):
            for axis, side in map(axis_side, names):
                u, v, w = (np.array([float(side)]) if d == axis else row for d, row in enumerate(rows))
                parameters.append(np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3))
                points.append(volume.grid(u, v, w).reshape(-1, 3))
                face = _halved_cells(*(len(row) for d, row in enumerate(rows) if d != axis))
                inwards = (side == 1) == (axis == 1)  # (u, w) is left-handed seen along v
                triangles.append(count + (face[:, ::-1] if inwards else face))
                number = 6 * patch + 2 * axis + side
                cube_faces.append(np.full(len(face), number))
                sample_faces.append(np.full(len(parameters[-1]), number))
                count += len(parameters[-1])
        return cls(*(np.concatenate(parts) for parts in (parameters, points, triangles, cube_faces, sample_faces)))


def _halved_cells(n_a: int, n_b: int) -> IntArray:
    """Return two triangles for each cell of a grid of n_a x n_b points, numbered row by row."""
    number = np.arange(n_a * n_b, dtype=np.int64).reshape(n_a, n_b)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
