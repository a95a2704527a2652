"""UnitFrame: the scaled coordinates X, Y, Z in which formulas mean the same in millimetres and in metres."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import divided_spans, gauss_points
from parameterize.spline.volume import BSplineVolume

BOX_SAMPLES = 8  # intervals a span and direction in which the boundary is sampled for its bounding box


@dataclass(frozen=True)
class UnitFrame:
    """The map (X, Y, Z) = (x - center) / length that gives a body volume 1 about the middle of its bounding box.

    center: (3,), in the body's units. length: the cube root of the body's volume.
    """

    center: tuple[float, float, float]
    length: float

    @classmethod
    def of(cls, volume: BSplineVolume) -> UnitFrame:
        """The frame of a spline volume.

        The volume follows exactly from the six faces (divergence theorem); the bounding box is that of points on them,
        BOX_SAMPLES a span and direction. A folded map counts its folded parts with the opposite sign.
        Raises ValueError where the volume encloses nothing.
        """
        faces = [_Face(volume, axis, side) for axis, side in product(range(3), (0, 1))]
        low = np.min([face.samples.min(axis=0) for face in faces], axis=0)
        high = np.max([face.samples.max(axis=0) for face in faces], axis=0)
        middle = (low + high) / 2.0
        enclosed = abs(sum(face.flux(middle) for face in faces))
        if enclosed == 0.0:
            raise ValueError("X, Y, Z have no scale here: the volume encloses nothing; check it with `iga-nn check`")
        x, y, z = middle.tolist()
        return cls((x, y, z), float(np.cbrt(enclosed)))

    def to_units(self, points: Array) -> Array:
        """Points (..., 3) given in X, Y, Z, in the body's own units."""
        return self.length * points + np.asarray(self.center)

    def as_dict(self) -> dict[str, Any]:
        """The frame as report.json holds it."""
        return {"center": list(self.center), "length": self.length}


@dataclass(frozen=True, eq=False)
class _Face:
    """The image of one face of the cube."""

    volume: BSplineVolume
    axis: int
    side: int

    @cached_property
    def samples(self) -> Array:
        """Points (k, 3) spread over the face."""
        rows = [divided_spans(knots, BOX_SAMPLES) for knots in self.volume.knots]
        return self.volume.grid(*self._on_face(rows)).reshape(-1, 3)

    def flux(self, middle: Array) -> float:
        """The integral of (x - middle) . n / 3 over the face: its share of the enclosed volume."""
        rules = [
            gauss_points(knots, (3 * degree + 1) // 2)  # exact for a product of three splines, two differentiated
            for knots, degree in zip(self.volume.knots, self.volume.degrees, strict=True)
        ]
        u, v, w = self._on_face([points.ravel() for points, _ in rules])
        jacobian = np.squeeze(self.volume.grid_jacobian(u, v, w), self.axis)  # (q_b, q_c, 3, 3)
        area = np.cross(jacobian[..., (self.axis + 1) % 3], jacobian[..., (self.axis + 2) % 3])
        height = ((np.squeeze(self.volume.grid(u, v, w), self.axis) - middle) * area).sum(axis=-1)  # (q_b, q_c)
        b, c = (rules[a][1].ravel() for a in range(3) if a != self.axis)
        return float((1.0 if self.side else -1.0) * (b @ height @ c) / 3.0)

    def _on_face(self, rows: list[Array]) -> tuple[Array, Array, Array]:
        """Parameters of a tensor grid on the face, from those of one in the cube."""
        u, v, w = (np.array([float(self.side)]) if a == self.axis else row for a, row in enumerate(rows))
        return u, v, w
