"""Discretizes data on the images of the cube's faces: Dirichlet values projected, Neumann and Robin data integrated."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron

from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, collocation
from parameterize.spline.interface import axis_side
from parameterize.spline.patch_groups import groups_of
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from ..field import Points
from ..forms.frame import face_geometry
from .quadrature import gauss_rule, spline_rule
from .space import TrialSpace

FREE = None

Values = Callable[[Array, str], Array]


def boundary_coefficients(volume: BSplineVolume, space: TrialSpace, values: Values, components: int = 1) -> Array:
    """Return the coefficients (c, n_u, n_v, n_w) of `coefficients_of_patches` for one patch."""
    return coefficients_of_patches([volume], space, values, components)[0]


def coefficients_of_patches(
    volumes: Sequence[BSplineVolume], space: TrialSpace, values: Values, components: int = 1
) -> Array:
    """Return coefficients (k, c, n_u, n_v, n_w) of an approximation of Dirichlet data on their faces, zero elsewhere.

    volumes: k patches of equal degrees and knots. space: the trial space of all of them. values: a function of points
    (3, ...) and the name of their face that returns (c, ...), one row a component. Corners are interpolated, then edges
    and faces are projected in L2, in the parametric measure; an edge or a face keeps the coefficients on its ends or
    its rim.
    """
    coefficients = np.zeros((components, *space.shape, len(volumes)))
    group = groups_of(volumes)[0] if len(volumes) > 1 else None
    points, bases, projections = zip(*map(_projection, space.knots, space.degrees), strict=True)
    for entity in sorted(product((0, 1, FREE), repeat=3), key=lambda entity: entity.count(FREE)):
        of = [FACE_NAMES[2 * axis + side] for axis, side in enumerate(entity) if side is not FREE]
        given = [name for name in of if name in space.dirichlet]
        if not given:
            continue
        free = [a for a in range(3) if entity[a] is FREE]
        u, v, w = (points[a] if side is FREE else np.array([float(side)]) for a, side in enumerate(entity))
        ends = [slice(None) if side is FREE else slice(-side, 1 - side or None) for side in entity]
        inside = [slice(1, -1) if side is FREE else end for side, end in zip(entity, ends, strict=True)]
        fixed = coefficients[:, *ends]  # on the closed entity: its own ends are known already
        for a in free:
            fixed = apply_along(bases[a], fixed, a + 1)
        x = Points.on(volumes[0], u, v, w) if group is None else np.moveaxis(group.grid(u, v, w), (-1, 0), (0, -1))
        residual = values(x, given[0]).reshape(fixed.shape) - fixed
        for a in free:
            residual = np.moveaxis(np.tensordot(projections[a], residual, (1, a + 1)), 0, a + 1)
        coefficients[:, *inside] = residual
    return np.moveaxis(coefficients, -1, 0)


def _projection(knots: Array, degree: int) -> tuple[Array, csr_array, Array]:
    """Return points (q,) of a direction, its functions there (q, n), and the L2 projection (n - 2, q).

    The projection maps onto the functions that vanish at both ends.
    """
    points, weights = spline_rule(knots, degree, 2 * degree)
    basis = collocation(knots, degree, points)
    inside = basis[:, 1:-1].toarray()
    inner = (weights[:, None] * inside).T
    return points, basis, np.linalg.solve(inner @ inside, inner)


@dataclass(frozen=True, eq=False)
class FaceRule:
    """Hold Gauss points on the image of one face, degree + 1 a span and direction, and the trial functions there.

    points, normal: (3, q_b, q_c), positions in space and outward unit normals. measure: (q_b, q_c), surface element
    times weight, for Robin's term also times alpha. bases: (q_b, n_b) and (q_c, n_c), the functions of the two
    directions along the face. layer: the index of the face's coefficients in an array (n_u, n_v, n_w).
    """

    points: Points
    normal: Array
    measure: Array
    bases: tuple[csr_array, csr_array]
    layer: tuple[int | slice, ...]

    def integrate(self, density: Array) -> Array:
        """Return the integrals (n_b, n_c) of a density (q_b, q_c) times each trial function."""
        return self.bases[0].T @ (density * self.measure) @ self.bases[1]

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add Robin's term, the integral of alpha u v, of coefficients (c, n_u, n_v, n_w) to a result of that shape."""
        for component, total in zip(coefficients, result, strict=True):
            values = self.bases[0] @ component[self.layer] @ self.bases[1].T
            total[self.layer] += self.integrate(values)

    def matrix(self, shape: tuple[int, ...]) -> coo_array:
        """Return the matrix of Robin's term for coefficients of a shape (c, n_u, n_v, n_w) as a vector."""
        values = on_layer(kron(*self.bases, format="csr"), self.layer, shape)
        return kron(eye_array(shape[0]), values.T @ diags_array(self.measure.ravel()) @ values, format="coo")

    def add_diagonal(self, component: int, diagonal: Array) -> None:
        """Add the diagonal of Robin's term, the same for each component, to an array (n_u, n_v, n_w)."""
        b, c = (basis.power(2) for basis in self.bases)
        diagonal[self.layer] += b.T @ self.measure @ c

    def add_lumped(self, component: int, diagonal: Array, share: float = 1.0) -> None:
        """Add the integral of alpha times each function to an array (n_u, n_v, n_w)."""
        diagonal[self.layer] += self.integrate(np.ones(self.measure.shape))

    def stiffness(self, component: int) -> float:
        """Return the integral of alpha over the face."""
        return float(self.measure.sum())


def on_layer(table: csr_array, layer: tuple[int | slice, ...], shape: tuple[int, ...]) -> csr_array:
    """Return a table (m, ..) of the functions of a layer as one (m, n_u n_v n_w) of all functions of a component.

    layer: its index in an array (n_u, n_v, n_w). shape: (c, n_u, n_v, n_w).
    """
    numbers = np.arange(math.prod(shape[1:])).reshape(shape[1:])[layer].ravel()
    return csr_array((table.data, numbers[table.indices], table.indptr), shape=(table.shape[0], math.prod(shape[1:])))


def has_face(space: TrialSpace, name: str) -> bool:
    """Return whether the face `name`, one of FACE_NAMES, is outer, and this process integrates over a part of it."""
    if name not in space.outer:
        return False
    u = space.breaks[0]
    return len(u) > 1 and (name[0] != "u" or bool(u[-int(name[1])] == float(name[1])))


def face_rule(volume: BSplineVolume, space: TrialSpace, name: str) -> FaceRule:
    """Return the rule of a face, one of FACE_NAMES."""
    axis, side = axis_side(name)
    rule = gauss_rule(space, [degree + 1 for degree in space.degrees])
    b, c = (a for a in range(3) if a != axis)
    points, area = face_geometry(volume, rule.points, axis, side)
    size = np.linalg.norm(area, axis=0)
    bases = [collocation(space.knots[a], space.degrees[a], rule.points[a]) for a in (b, c)]
    return FaceRule(
        points=points,
        normal=area / np.where(size > 0.0, size, 1.0),  # a face may shrink to a point at a corner
        measure=size * np.multiply.outer(rule.weights[b], rule.weights[c]),
        bases=(bases[0], bases[1]),
        layer=tuple(-side if a == axis else slice(None) for a in range(3)),
    )
