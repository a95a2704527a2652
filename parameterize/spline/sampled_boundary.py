"""SampledBoundary: points on the outer faces of a body of trivariate splines, and the triangles between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from ..arrays import Array, IntArray
from .body import Body, BodyLike, as_body
from .bspline import breakpoints, divided_spans
from .interface import axis_side
from .orientation import FACES
from .volume import BSplineVolume

SAMPLES = 160  # a direction and face of a cube, at least; more faces than six share as many samples
PER_SPAN = 3  # samples a direction in every span, at least
_NONE: IntArray = np.empty((0, 3), dtype=np.int64)


@dataclass(frozen=True, eq=False)
class SampledBoundary:
    """The boundary of a body, sampled on a grid on each face that is not glued, and the triangles between the samples.

    A volume is a body of one patch, with six faces.
    """

    parameters: Array  # (n, 3), face after face in the order of FACE_NAMES, patch after patch
    points: Array  # (n, 3)
    triangles: IntArray  # (m, 3), wound outwards where the patch keeps orientation
    cube_faces: IntArray  # (m,) of the triangles
    patches: IntArray  # (n,) of the samples; all three corners of a triangle have the same

    @classmethod
    def of(cls, body: BodyLike, samples: int = SAMPLES) -> "SampledBoundary":
        """Sample all outer faces with their edges, each span alike.

        On six faces or fewer there are at least `samples` a direction; on more, about as many in all as on six, and
        PER_SPAN in every span.
        Raises ValueError for fewer than two samples.
        """
        if samples < 2:
            raise ValueError(f"samples must be at least 2, got {samples}")
        several = as_body(body)
        share = min(1.0, sqrt(len(FACES) / sum(map(len, several.outer))))
        least = max(2, ceil(share * samples))
        return cls._at(several, [_rows(patch, least) for patch in several])

    @classmethod
    def on(cls, body: BodyLike, *rows: Array) -> "SampledBoundary":
        """Sample all outer faces, those of all patches at the same three rows of parameters, each from 0 to 1."""
        several = as_body(body)
        return cls._at(several, [rows] * len(several))

    @property
    def sample_faces(self) -> IntArray:
        """Return the outer face of each sample, (n,): 6 * patch + face."""
        faces = np.empty(len(self.points), dtype=np.int64)
        faces[self.triangles] = (6 * self.patches[self.triangles[:, 0]] + self.cube_faces)[:, None]
        return faces

    @classmethod
    def _at(cls, body: Body, rows: Sequence[Sequence[Array]]) -> "SampledBoundary":
        """Sample the outer faces of each patch at its three rows of parameters."""
        parts, count = [(np.empty((0, 3)), np.empty((0, 3)), _NONE, _NONE[:, 0], _NONE[:, 0])], 0
        for number, (patch, names) in enumerate(zip(body, body.outer, strict=True)):
            for name in names:
                axis, side = axis_side(name)
                u, v, w = (np.array([float(side)]) if d == axis else row for d, row in enumerate(rows[number]))
                points = patch.grid(u, v, w).reshape(-1, 3)
                places = np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3)
                face = _halved_cells(*(len(row) for d, row in enumerate(rows[number]) if d != axis))
                inwards = (side == 1) == (axis == 1)  # (u, w) is left-handed seen along v
                triangles = count + (face[:, ::-1] if inwards else face)
                faces, owners = np.full(len(face), 2 * axis + side), np.full(len(points), number)
                parts.append((places, points, triangles, faces, owners))
                count += len(points)
        return cls(*map(np.concatenate, zip(*parts, strict=True)))


def _rows(volume: BSplineVolume, samples: int) -> tuple[Array, Array, Array]:
    """Return three rows of parameters, each span alike: at least `samples` of them, and PER_SPAN a span."""
    spans = [len(breakpoints(row)) - 1 for row in volume.knots]
    u, v, w = (
        divided_spans(row, max(PER_SPAN, -(-(samples - 1) // count)))
        for row, count in zip(volume.knots, spans, strict=True)
    )
    return u, v, w


def _halved_cells(n_a: int, n_b: int) -> IntArray:
    """Return two triangles for each cell of a grid of n_a x n_b points, numbered row by row."""
    number = np.arange(n_a * n_b, dtype=np.int64).reshape(n_a, n_b)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
