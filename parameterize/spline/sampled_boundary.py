"""SampledBoundary: points on the outer faces of a body of trivariate splines, and the triangles between them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from ..arrays import Array, IntArray
from .body import BodyLike, as_body
from .bspline import breakpoints, divided_spans
from .orientation import FACES
from .volume import FACE_NAMES, BSplineVolume

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
        parts = zip(several.patches, several.outer, strict=True)
        return cls._joined([cls._on_faces(patch, _rows(patch, least), names) for patch, names in parts])

    @classmethod
    def on(cls, body: BodyLike, *rows: Array) -> "SampledBoundary":
        """Sample all outer faces, those of all patches at the same three rows of parameters, each from 0 to 1."""
        several = as_body(body)
        parts = zip(several.patches, several.outer, strict=True)
        return cls._joined([cls._on_faces(patch, rows, names) for patch, names in parts])

    @property
    def sample_faces(self) -> IntArray:
        """Return the outer face of each sample, (n,): 6 * patch + face."""
        faces = np.empty(len(self.points), dtype=np.int64)
        faces[self.triangles] = (6 * self.patches[self.triangles[:, 0]] + self.cube_faces)[:, None]
        return faces

    @classmethod
    def _on_faces(cls, volume: BSplineVolume, rows: Sequence[Array], names: Collection[str]) -> "SampledBoundary":
        """Sample some faces of a volume, which is patch 0, at three rows of parameters."""
        parameters, points, triangles, cube_faces = [np.empty((0, 3))], [np.empty((0, 3))], [_NONE], [_NONE[:, 0]]
        count = 0
        for k, (axis, side) in enumerate(FACES):
            if FACE_NAMES[k] not in names:
                continue
            u, v, w = (np.array([float(side)]) if d == axis else row for d, row in enumerate(rows))
            parameters.append(np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3))
            points.append(volume.grid(u, v, w).reshape(-1, 3))
            face = _halved_cells(*(len(row) for d, row in enumerate(rows) if d != axis))
            inwards = (side == 1) == (axis == 1)  # (u, w) is left-handed seen along v
            triangles.append(count + (face[:, ::-1] if inwards else face))
            cube_faces.append(np.full(len(face), k))
            count += len(parameters[-1])
        places, where = np.concatenate(parameters), np.concatenate(points)
        owners = np.zeros(count, dtype=np.int64)
        return cls(places, where, np.concatenate(triangles), np.concatenate(cube_faces), owners)

    @classmethod
    def _joined(cls, parts: Sequence["SampledBoundary"]) -> "SampledBoundary":
        """Join the samples of the patches, in their order."""
        starts = np.cumsum([0, *(len(part.points) for part in parts)])
        return cls(
            np.concatenate([part.parameters for part in parts]),
            np.concatenate([part.points for part in parts]),
            np.concatenate([start + part.triangles for start, part in zip(starts, parts, strict=False)]),
            np.concatenate([part.cube_faces for part in parts]),
            np.concatenate([np.full(len(part.points), number) for number, part in enumerate(parts)]),
        )


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
