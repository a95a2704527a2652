"""Discretizes data on the images of the cube's faces: Dirichlet values projected, Neumann and Robin data integrated."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import apply_along, collocation
from parameterize.spline.interface import axis_side
from parameterize.spline.orientation import face_vectors, orientations
from parameterize.spline.patch_groups import PatchGroup, group_of, groups_of
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from ..field import Points
from ..forms.boundary_value_problem import BoundaryValueProblem
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
    """Hold Gauss points on faces of one name of k patches, degree + 1 a span and direction, and the functions there.

    patches: (k,), their numbers; coefficients are those of these patches. name: of the faces. points, normal: (3, k,
    q_b, q_c), positions in space and outward unit normals. area: (k, q_b, q_c), surface element times weight. measure:
    the same, for Robin's term also times alpha. rows: the parameters of the points. bases: (q_b, n_b) and (q_c, n_c),
    the functions of the two directions along the faces. layer: the index of a face's coefficients in an array (n_u,
    n_v, n_w).
    """

    patches: IntArray
    name: str
    points: Array
    normal: Array
    area: Array
    measure: Array
    rows: tuple[Array, ...]
    bases: tuple[csr_array, csr_array]
    layer: tuple[int | slice, ...]

    def data(self, problem: BoundaryValueProblem) -> tuple[Array | None, Array]:
        """Return alpha (k, q_b, q_c), None for Neumann's data, and g (c, k, q_b, q_c); see `on_face`."""
        shape, axis = self.measure.shape, axis_side(self.name)[0]
        x, normal = self.points, self.normal
        if len(self.patches) == 1:  # fields are evaluated at the parameters of their patch
            along = [a for a in range(3) if a != axis]
            x, normal = Points.of(x[:, 0], self.rows, (along[0], along[1])), normal[:, 0]
        alpha, given = problem.on_face(self.name, x, normal)
        return None if alpha is None else alpha.reshape(shape), given.reshape(-1, *shape)

    def integrate(self, density: Array) -> Array:
        """Return the integrals (k, n_b, n_c) of a density (k, q_b, q_c) times each trial function."""
        b, c = (basis.T.tocsr() for basis in self.bases)
        return apply_along(c, apply_along(b, density * self.measure, 1), 2)

    def values_of(self, coefficients: Array) -> Array:
        """Return the values (c, k, q_b, q_c) of coefficients (k, c, n_u, n_v, n_w)."""
        b, c = self.bases
        return apply_along(c, apply_along(b, np.moveaxis(coefficients[:, :, *self.layer], 1, 0), 2), 3)

    def add_load(self, given: Array, load: Array) -> None:
        """Add the integrals of a flux (c, k, q_b, q_c) to a load (k, c, n_u, n_v, n_w)."""
        for component, density in enumerate(given):
            layer = load[:, component][:, *self.layer]
            layer += self.integrate(density)

    def add_product(self, coefficients: Array, result: Array) -> None:
        """Add Robin's term, the integral of alpha u v, of coefficients (k, c, n_u, n_v, n_w) to a result like them."""
        self.add_load(self.values_of(coefficients), result)

    def matrix(self, shape: tuple[int, ...]) -> coo_array:
        """Return the matrix of Robin's term for coefficients of a shape (c, n_u, n_v, n_w) of each patch, as a vector.

        The k patches come one after another.
        """
        values = kron(eye_array(len(self.patches)), kron(*self.bases), format="csr")
        values = on_layer(values, self.layer, shape)
        one = values.T @ diags_array(self.measure.ravel()) @ values
        return by_patches(kron(eye_array(shape[0]), one, format="coo"), shape)

    def add_diagonal(self, component: int, diagonal: Array) -> None:
        """Add the diagonal of Robin's term, the same for each component, to an array (k, n_u, n_v, n_w)."""
        b, c = (basis.power(2) for basis in self.bases)
        layer = diagonal[:, *self.layer]
        layer += replace(self, bases=(b, c)).integrate(np.ones(self.measure.shape))

    def add_lumped(self, component: int, diagonal: Array, share: float = 1.0) -> None:
        """Add the integral of alpha times each function to an array (k, n_u, n_v, n_w)."""
        layer = diagonal[:, *self.layer]
        layer += self.integrate(np.ones(self.measure.shape))

    def stiffness(self, component: int) -> Array:
        """Return the integral (k,) of alpha over each face."""
        return np.asarray(self.measure.sum(axis=(1, 2)))


def on_layer(table: csr_array, layer: tuple[int | slice, ...], shape: tuple[int, ...]) -> csr_array:
    """Return a table (m, k ..) of the functions of a layer of k patches as one (m, k n_u n_v n_w) of all functions.

    layer: its index in an array (n_u, n_v, n_w). shape: (c, n_u, n_v, n_w).
    """
    functions = math.prod(shape[1:])
    numbers = np.arange(functions).reshape(shape[1:])[layer].ravel()
    patch, function = np.divmod(table.indices, len(numbers))
    count = table.shape[1] // len(numbers) * functions
    columns = patch.astype(np.int64) * functions + numbers[function]
    return csr_array((table.data, columns, table.indptr), shape=(table.shape[0], count))


def by_patches(matrix: coo_array, shape: tuple[int, ...]) -> coo_array:
    """Return a matrix of coefficients in the order of components, patches, functions, with the patches first.

    shape: (c, n_u, n_v, n_w), of each patch.
    """
    functions, found = math.prod(shape[1:]), matrix
    sizes = shape[0], found.shape[0] // (shape[0] * functions), functions
    component, patch, function = np.unravel_index(np.stack(found.coords), sizes)
    rows, columns = (patch * shape[0] + component) * functions + function
    return coo_array((found.data, (rows, columns)), shape=found.shape)


def has_face(space: TrialSpace, name: str) -> bool:
    """Return whether the face `name`, one of FACE_NAMES, is outer, and this process integrates over a part of it."""
    if name not in space.outer:
        return False
    u = space.breaks[0]
    return len(u) > 1 and (name[0] != "u" or bool(u[-int(name[1])] == float(name[1])))


def face_rule(volume: BSplineVolume, space: TrialSpace, name: str) -> FaceRule:
    """Return the rule of a face, one of FACE_NAMES."""
    return face_rules(group_of(volume), space, name)


def face_rules(group: PatchGroup, space: TrialSpace, name: str) -> FaceRule:
    """Return the rule of the faces of one name of a group of patches, whose trial space is the same."""
    axis, side = axis_side(name)
    rule = gauss_rule(space, [degree + 1 for degree in space.degrees])
    b, c = (a for a in range(3) if a != axis)
    points, area = face_vectors(group, rule.points, axis, side)
    area *= orientations(group)[:, None, None]
    size = np.linalg.norm(area, axis=0)
    measure = size * np.multiply.outer(rule.weights[b], rule.weights[c])
    bases = [collocation(space.knots[a], space.degrees[a], rule.points[a]) for a in (b, c)]
    return FaceRule(
        patches=group.numbers,
        name=name,
        points=points,
        normal=area / np.where(size > 0.0, size, 1.0),  # a face may shrink to a point at a corner
        area=measure,
        measure=measure,
        rows=tuple(np.array([float(side)]) if a == axis else row for a, row in enumerate(rule.points)),
        bases=(bases[0], bases[1]),
        layer=tuple(-side if a == axis else slice(None) for a in range(3)),
    )
