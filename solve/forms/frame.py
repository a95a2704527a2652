"""Defines UnitFrame: the scaled coordinates X, Y, Z, in which a formula means the same in millimetres and in metres."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.bspline import divided_spans
from parameterize.spline.orientation import FACES, enclosed_volumes, face_vectors, orientation
from parameterize.spline.volume import BSplineVolume

from ..field import Points

PATCHES = 2**10  # that are sampled at once
BOX_SAMPLES = 8  # intervals a span and direction in which the boundary is sampled for its bounding box


@dataclass(frozen=True)
class UnitFrame:
    """Map x to (X, Y, Z) = (x - center) / length, so that a body has volume 1 about the middle of its bounding box.

    center: (3,), in the body's units. length: the cube root of the body's volume.
    """

    center: tuple[float, float, float]
    length: float

    @classmethod
    def of(cls, body: BodyLike) -> "UnitFrame":
        """Return the frame of a body.

        The size of the volume follows from the six faces (`enclosed_volumes`); the bounding box is that of points on
        outer faces, BOX_SAMPLES a span and direction. The folded parts of a map count with the opposite sign.
        Raises ValueError where the volume encloses nothing.
        """
        glued = as_body(body)
        known: BodyLike = glued.only if glued.is_single else glued
        if known not in _KNOWN:
            _KNOWN[known] = cls._measured(glued)
        return _KNOWN[known]

    @classmethod
    def _measured(cls, glued: Body) -> "UnitFrame":
        ends = np.concatenate(list(_boxes(glued)))  # (f, 2, 3)
        middle = (ends[:, 0].min(axis=0) + ends[:, 1].max(axis=0)) / 2.0
        enclosed = sum(float(np.abs(enclosed_volumes(group, middle)).sum()) for group in glued.groups)
        if enclosed == 0.0:
            raise ValueError("X, Y, Z have no scale here: the volume encloses nothing; check it with `iga-nn check`")
        x, y, z = middle.tolist()
        return cls((x, y, z), float(np.cbrt(enclosed)))

    def to_units(self, points: Array) -> Array:
        """Return points (..., 3), given in X, Y, Z, in the body's own units."""
        return self.length * points + np.asarray(self.center)

    def as_dict(self) -> dict[str, Any]:
        """Return the frame for report.json."""
        return {"center": list(self.center), "length": self.length}


_KNOWN: WeakKeyDictionary[BodyLike, UnitFrame] = WeakKeyDictionary()  # a run asks for that of its body ten times


def _boxes(body: Body) -> Iterator[Array]:
    """Yield the least and the largest coordinates (k, 2, 3) of points on outer faces, those of one name at once."""
    outer = ~body.glued.reshape(len(body), -1)
    for group in body.groups:
        rows = [divided_spans(knots, BOX_SAMPLES) for knots in group.knots]
        for face, (axis, side) in enumerate(FACES):
            for some in group.rows(outer[group.numbers, face]).divided(PATCHES):
                points = face_vectors(some, rows, axis, side)[0]  # (3, k, ..)
                yield np.stack([points.min(axis=(2, 3)).T, points.max(axis=(2, 3)).T], axis=1)


def face_geometry(volume: BSplineVolume, rows: Sequence[Array], axis: int, side: int) -> tuple[Points, Array]:
    """Return points on a face, and outward normals with the length of the surface element: (3, q_b, q_c) each.

    rows: parameters of a tensor grid in the cube. The volume may be left-handed. Where a map is folded, normals point
    inward.
    """
    x, area = face_vectors(volume, rows, axis, side)
    u, v, w = (np.array([float(side)]) if a == axis else row for a, row in enumerate(rows))
    b, c = (a for a in range(3) if a != axis)
    return Points.of(x, (u, v, w), (b, c)), orientation(volume) * area
