"""Integrals over the images of the cube's faces: Neumann's load and Robin's term."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, collocation, gauss_points
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from ..field import Points
from .space import TrialSpace


@dataclass(frozen=True, eq=False)
class FaceRule:
    """Gauss points on the image of one face, degree + 1 a span and direction, and the trial functions there.

    points, normal: (3, q_b, q_c) in space, the normal outward and of unit length. measure: (q_b, q_c), surface element
    times weight. bases: (q_b, n_b) and (q_c, n_c), of the two directions that run along the face.
    layer: the face's coefficients in an array (n_u, n_v, n_w).
    """

    points: Points
    normal: Array
    measure: Array
    bases: tuple[csr_array, csr_array]
    layer: tuple[int | slice, ...]

    def values(self, coefficients: Array) -> Array:
        """A spline at the points, (q_b, q_c, ...), from its coefficients on the face, (n_b, n_c, ...)."""
        return apply_along(self.bases[1], apply_along(self.bases[0], coefficients, 0), 1)

    def integrate(self, density: Array) -> Array:
        """Integrals (n_b, n_c, ...) of a density (q_b, q_c, ...) times each trial function."""
        return _integrate(self.bases, (density.T * self.measure.T).T)


def face_rule(volume: BSplineVolume, space: TrialSpace, name: str) -> FaceRule:
    """The rule of the face called `name` (one of FACE_NAMES). Where the map is folded its normal points inward."""
    axis, side = divmod(FACE_NAMES.index(name), 2)
    rows = [gauss_points(knots, degree + 1) for knots, degree in zip(space.knots, space.degrees, strict=True)]
    rows[axis] = (np.array([float(side)]), np.ones(1))
    u, v, w = (points.ravel() for points, _ in rows)
    b, c = (a for a in range(3) if a != axis)
    jacobian = np.squeeze(volume.grid_jacobian(u, v, w), axis)  # (q_b, q_c, 3, 3)
    ahead, further = (axis + 1) % 3, (axis + 2) % 3
    outward = 1.0 if side else -1.0
    area = outward * np.moveaxis(np.cross(jacobian[..., ahead], jacobian[..., further]), -1, 0)
    size = np.linalg.norm(area, axis=0)
    return FaceRule(
        points=Points.of(np.moveaxis(np.squeeze(volume.grid(u, v, w), axis), -1, 0), (u, v, w), (b, c)),
        normal=area / np.where(size > 0.0, size, 1.0),  # a face may shrink to a point at a corner
        measure=size * np.multiply.outer(rows[b][1].ravel(), rows[c][1].ravel()),
        bases=(_basis(space, b, rows[b][0]), _basis(space, c, rows[c][0])),
        layer=tuple((-1 if side else 0) if a == axis else slice(None) for a in range(3)),
    )


@dataclass(frozen=True, eq=False)
class FaceMass:
    """Robin's term: the integral over one face of alpha u v; weights (q_b, q_c) hold alpha times the rule's measure."""

    rule: FaceRule
    weights: Array

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add the product with coefficients (n_u, n_v, n_w) to `result` of the same shape."""
        rule = self.rule
        result[rule.layer] += _integrate(rule.bases, self.weights * rule.values(coefficients[rule.layer]))

    def add_diagonal(self, diagonal: Array) -> None:
        """Add the term's diagonal to an array (n_u, n_v, n_w)."""
        b, c = self.rule.bases
        diagonal[self.rule.layer] += _integrate((b.power(2), c.power(2)), self.weights)

    @property
    def mean(self) -> float:
        """Average over the face's parameters of alpha times the surface element."""
        return float(self.weights.sum())


def _basis(space: TrialSpace, axis: int, points: Array) -> csr_array:
    return collocation(space.knots[axis], space.degrees[axis], points.ravel())


def _integrate(bases: tuple[csr_array, csr_array], density: Array) -> Array:
    return apply_along(csr_array(bases[1].T), apply_along(csr_array(bases[0].T), density, 0), 1)
