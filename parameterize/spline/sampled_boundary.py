"""SampledBoundary: points on the outer faces of a body of trivariate splines, and the triangles between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from ..arrays import Array, IntArray
from .body import Body, BodyLike, as_body
from .bspline import breakpoints, divided_spans
from .orientation import FACES
from .patch_groups import PatchGroup

SAMPLES = 160  # a direction and face of a cube, at least; more faces than six share as many samples
PER_SPAN = 3  # samples a direction in every span, at least


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
        share = min(1.0, sqrt(len(FACES) / (~several.glued).sum()))
        least = max(2, ceil(share * samples))
        return cls._at(several, [_rows(group, least) for group in several.groups])

    @classmethod
    def on(cls, body: BodyLike, *rows: Array) -> "SampledBoundary":
        """Sample all outer faces, those of all patches at the same three rows of parameters, each from 0 to 1."""
        several = as_body(body)
        return cls._at(several, [rows] * len(several.groups))

    @property
    def sample_faces(self) -> IntArray:
        """Return the outer face of each sample, (n,): 6 * patch + face."""
        faces = np.empty(len(self.points), dtype=np.int64)
        faces[self.triangles] = (6 * self.patches[self.triangles[:, 0]] + self.cube_faces)[:, None]
        return faces

    @classmethod
    def _at(cls, body: Body, rows: Sequence[Sequence[Array]]) -> "SampledBoundary":
        """Sample the outer faces of the patches of each group at its three rows of parameters."""
        parts = [
            _face_samples(group.rows(~body.glued[group.numbers, face]), face, own)
            for group, own in zip(body.groups, rows, strict=True)
            for face in range(len(FACES))
        ]
        begins = np.cumsum([0, *(len(points) for _, points, *_ in parts)])
        parameters, points, faces, triangles, triangle_faces = map(np.concatenate, zip(*parts, strict=True))
        triangles += np.repeat(begins[:-1], [len(part[3]) for part in parts])[:, None]
        order, rows_of_faces = (np.argsort(numbers, kind="stable") for numbers in (faces, triangle_faces))
        place = np.empty_like(order)
        place[order] = np.arange(len(order))
        patches, cube_faces = faces[order] // len(FACES), triangle_faces[rows_of_faces] % len(FACES)
        return cls(parameters[order], points[order], place[triangles[rows_of_faces]], cube_faces, patches)


def _face_samples(
    group: PatchGroup, face: int, rows: Sequence[Array]
) -> tuple[Array, Array, IntArray, IntArray, IntArray]:
    """Return samples of a face of the patches of a group, and the triangles between them.

    They are parameters (n, 3), points (n, 3) and the numbers 6 * patch + face (n,), patch after patch; triangles
    (m, 3) and their faces' numbers (m,).
    """
    axis, side = FACES[face]
    u, v, w = (np.array([float(side)]) if d == axis else row for d, row in enumerate(rows))
    points = group.grid(u, v, w).reshape(-1, 3)
    places = np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = _halved_cells(*(len(row) for d, row in enumerate(rows) if d != axis))
    inwards = (side == 1) == (axis == 1)  # (u, w) is left-handed seen along v
    triangles = len(places) * np.arange(len(group))[:, None, None] + (cells[:, ::-1] if inwards else cells)
    numbers = len(FACES) * group.numbers + face
    return (
        np.tile(places, (len(group), 1)),
        points,
        np.repeat(numbers, len(places)),
        triangles.reshape(-1, 3),
        np.repeat(numbers, len(cells)),
    )


def _rows(group: PatchGroup, samples: int) -> tuple[Array, Array, Array]:
    """Return three rows of parameters, each span alike: at least `samples` of them, and PER_SPAN a span."""
    spans = [len(breakpoints(row)) - 1 for row in group.knots]
    u, v, w = (
        divided_spans(row, max(PER_SPAN, -(-(samples - 1) // count)))
        for row, count in zip(group.knots, spans, strict=True)
    )
    return u, v, w


def _halved_cells(n_a: int, n_b: int) -> IntArray:
    """Return two triangles for each cell of a grid of n_a x n_b points, numbered row by row."""
    number = np.arange(n_a * n_b, dtype=np.int64).reshape(n_a, n_b)
    a, b, c, d = (x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
