"""Couples two regions of a body weakly: u on one is u on the other, turned about an axis.

With R the rotation, x a point of the first region, y its image on the second, t = flux(u) . n at x, and the jump
[u] = u(y) - R u(x), Nitsche's symmetric method has the terms

    int R t(u) . [v] + int R t(v) . [u] + int gamma [u] . [v].

The flux is that of the first region alone: gamma of `weak` then keeps the form coercive whatever the meshes, and the
integrals are those of points on the first region. docs/solver.md says more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, vstack

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import size_of
from parameterize.spline.bspline import basis_derivatives, evaluate_at
from parameterize.spline.spline_stack import VALUE
from parameterize.spline.volume import UNITS

from ..field import Points
from ..forms.condition import Condition
from ..forms.coupled import Cyclic
from .groups import CoefficientLayout, OnPatches
from .images import Located, nearest_on
from .on_regions import Stated
from .space import TrialSpace
from .weak import WeakFace

# Share of gamma of `weak`, whose bound is for faces that share their span with others. With all of gamma the sum of
# w t . t / gamma is 0.05 to 0.28 of the energy, on boxes, flat, tall and sheared ones of degrees 1 to 3: the form is
# coercive down to that share. On a sector of a flange a half takes 82 iterations, all 110, and no coupling 56.
GAMMA = 0.5
FIT = 2e-3  # share of a body's size by which the image of a region may lie off the other region
WHOLE = 0.01  # share by which 360 degrees over the angle may differ from a whole number
AREAS = 0.01  # share by which the areas of the regions may differ
COVERED = 1e-3  # share of a cut, or of another condition's region, from which on that condition acts on the cut
OPPOSITE = 0.99  # cosine of the angle between normals, on average, of an image and minus the other region


@dataclass(frozen=True, eq=False)
class Coupling:
    """Hold the terms that couple two regions.

    condition: the cyclic symmetry. count: how many sectors make up the whole. turn: (3, 3), R in space. rotation: (c,
    c), R for the components of u. first, second: the points of the first region and their images. weights: (m,), of
    integrals. gamma: (m,), Nitsche's parameter. distance: the largest one of an image from the region. jump: (c m,
    size), [u] of the coefficients of all patches, as `OnPatches.flat` has them; flux: the same of R t. patches: of the
    body. x, normal: (3, m), of the first region. first_faces, other_faces: the terms of conditions with points of the
    two regions, and which points of theirs. layout: of the coefficients. is_tied: whether the coefficients themselves
    are coupled, so that there are no terms.
    """

    condition: Cyclic
    count: int
    turn: Array
    rotation: Array
    first: Located
    second: Located
    weights: Array
    gamma: Array
    distance: float
    jump: csr_array
    flux: csr_array
    patches: Sequence[Stated]
    x: Array
    normal: Array
    first_faces: Sequence[tuple[WeakFace, IntArray]]
    other_faces: Sequence[tuple[WeakFace, IntArray]]
    layout: CoefficientLayout
    is_tied: bool = False

    @cached_property
    def matrix(self) -> csr_array:
        """Return the matrix (size, size) of the terms."""
        if self.is_tied:
            return csr_array((self.jump.shape[1],) * 2)
        c = len(self.rotation)
        weights = diags_array(np.tile(self.weights, c))
        mixed = self.jump.T @ weights @ self.flux
        return csr_array(mixed + mixed.T + self.jump.T @ diags_array(np.tile(self.weights * self.gamma, c)) @ self.jump)

    def penalty(self, spaces: Sequence[TrialSpace], layout: CoefficientLayout, share: float) -> csr_array:
        """Return the matrix of a share of int gamma [u] . [v] for functions of other spaces on the patches."""
        jump = _jump(self.rotation, spaces, layout, self.first, self.second)
        return csr_array(jump.T @ diags_array(np.tile(share * self.weights * self.gamma, len(self.rotation))) @ jump)

    def is_within(self, part: Sequence[int]) -> bool:
        """Return whether both regions lie on some patches, given by their numbers."""
        return bool(np.isin(np.concatenate([self.first.patches, self.second.patches]), part).all())

    def moves(self, motions: Callable[[Array], Array]) -> tuple[Array, Array]:
        """Return motions (k, c, m) at the points, functions of points (3, m), and their jumps."""
        here, there = motions(self.x), motions(self.condition.axis.turned(self.turn, self.x))
        return here, there - np.einsum("cd,kdm->kcm", self.rotation, here)

    def completed(self, face: WeakFace, coefficients: OnPatches) -> WeakFace:
        """Return terms of conditions whose loads at points of the regions are the fluxes of the other region.

        On the second region they are the own fluxes: what is missing there counts on the first one.
        """
        loads, start = face.loads, 0
        for own, rows in self.first_faces:
            if own is face:
                loads = loads.copy()
                loads[:, rows] = self._from_images(coefficients)[:, start : start + len(rows)]
            start += len(rows)
        for own, rows in self.other_faces:
            if own is face:
                loads = loads.copy()
                loads[:, rows] = face.traces(coefficients.of(face.patches))[1][:, rows]
        return face if loads is face.loads else replace(face, loads=loads)

    def _from_images(self, coefficients: OnPatches) -> Array:
        """Return the flux (c, m) into the first region that the flux at the images is."""
        turn, found = self.turn, np.zeros((len(self.rotation), len(self.first)))
        for number in np.unique(self.second.patches).tolist():
            rows, patch = np.flatnonzero(self.second.patches == number), self.patches[number]
            where, own = self.second.parameters[rows], np.moveaxis(coefficients[number], 0, -1)
            basis = patch.space.degrees, patch.space.knots, own, where
            u, *slopes = (evaluate_at(*basis, order) for order in (VALUE, *UNITS))
            inverse = np.linalg.inv(patch.volume.jacobian(where))
            grad = np.einsum("mca,mad->cdm", np.stack(slopes, axis=-1), inverse)
            x = Points.at(np.ascontiguousarray(patch.volume(where).T), where)
            flux = np.asarray(patch.problem.form.flux(u.T, grad, x), dtype=np.float64)
            found[:, rows] = (flux * (turn @ self.normal[:, rows])).sum(axis=1)
        return self.rotation.T @ found

    def forces(self, coefficients: OnPatches) -> OnPatches:
        """Return the integrals (c, n_u, n_v, n_w) over each patch of the force of the coupling on the body."""
        return replace(coefficients, flat=-(self.matrix @ coefficients.flat))


def couplings_of(patches: Sequence[Stated], faces: Sequence[WeakFace], layout: CoefficientLayout) -> list[Coupling]:
    """Return the couplings of a problem's conditions. faces: the terms of all conditions on regions.

    Raises ValueError for regions that do not fit each other.
    """
    conditions = patches[0].problem.conditions
    found = []
    for number, condition in enumerate(conditions):
        if isinstance(condition, Cyclic):
            one = _coupling(condition, number, number + 1, patches, faces, layout)  # its image follows
            found += [] if one is None else [one]
    return found


def _coupling(
    condition: Cyclic,
    number: int,
    other: int,
    patches: Sequence[Stated],
    faces: Sequence[WeakFace],
    layout: CoefficientLayout,
) -> Coupling | None:
    ones = [face for face in faces if face.holds(number).any()]
    others = [face for face in faces if face.holds(other).any()]
    if not ones or not others:
        return None  # refused with the region's name, as every one without area
    _demand_disjoint(condition, number, other, faces)
    form = patches[0].problem.form
    if not form.symmetric:
        raise ValueError(f"{condition.role}: cyclic symmetry needs a law with `symmetric = True`")
    rows = [np.flatnonzero(face.holds(number)) for face in ones]
    x, normal = (
        np.concatenate([np.asarray(part)[:, own] for part, own in zip(parts, rows, strict=True)], axis=1)
        for parts in ([face.x for face in ones], [face.normal for face in ones])
    )
    weights, gamma = (
        np.concatenate([part[own] for part, own in zip(parts, rows, strict=True)])
        for parts in ([face.weights for face in ones], [face.gamma for face in ones])
    )
    volumes = [patch.volume for patch in patches]
    turn, count = _turn(condition, (x, weights), _points(others, other))
    _demand_alike(condition, turn, (x, weights), _points(others, other), FIT * size_of(volumes))
    _demand_opposite(condition, turn, normal @ weights, np.sum([_outward(face, other) for face in others], axis=0))
    images = condition.axis.turned(turn, x)
    masks = [face.holds(other) for face in others]
    second, distances = nearest_on(others, masks, volumes, images)
    size, farthest = size_of(volumes), float(distances.max())
    if farthest > FIT * size:
        raise ValueError(
            f"{condition.role}: the regions do not fit each other: a point of the first, turned by "
            f"{_degrees(turn, condition):.6g} degrees, lies {farthest:.3g} off the second"
        )
    _demand_no_others(patches[0].problem.conditions, number, other, faces)
    first = Located(
        np.concatenate([face.patches[face.owners[own]] for face, own in zip(ones, rows, strict=True)]),
        np.concatenate([face.places[own] for face, own in zip(ones, rows, strict=True)]),
    )
    rotation = turn if form.components == 3 else np.eye(form.components)
    spaces = [patch.space for patch in patches]
    jump = _jump(rotation, spaces, layout, first, second)
    flux = _turned(rotation, _fluxes(ones, rows, layout))
    return Coupling(
        condition=condition,
        count=count,
        turn=turn,
        rotation=rotation,
        first=first,
        second=second,
        weights=weights,
        gamma=GAMMA * gamma,
        distance=farthest,
        jump=jump,
        flux=flux,
        patches=patches,
        x=x,
        normal=normal,
        first_faces=list(zip(ones, rows, strict=True)),
        layout=layout,
        other_faces=[(face, np.flatnonzero(mask)) for face, mask in zip(others, masks, strict=True)],
    )


def _points(faces: Sequence[WeakFace], condition: int) -> tuple[Array, Array]:
    """Return the points (3, m) and weights (m,) of the region of a condition."""
    masks = [face.holds(condition) for face in faces]
    x = np.concatenate([np.asarray(face.x)[:, own] for face, own in zip(faces, masks, strict=True)], axis=1)
    return x, np.concatenate([face.weights[own] for face, own in zip(faces, masks, strict=True)])


def _demand_disjoint(condition: Cyclic, number: int, other: int, faces: Sequence[WeakFace]) -> None:
    """Raise ValueError where the two regions share a part of the boundary."""
    if any((face.holds(number) & face.holds(other)).any() for face in faces):
        raise ValueError(f"{condition.role}: the two regions overlap: give the two cuts of a sector")


def _demand_no_others(conditions: Sequence[Condition], number: int, other: int, faces: Sequence[WeakFace]) -> None:
    """Raise ValueError where another condition acts on a cut: inside of the whole body nothing acts."""
    for i, condition in enumerate(conditions):
        for cut in (number, other) if i not in (number, other) else ():
            shared, *whole = (_area(faces, *both) for both in ((cut, i), (cut,), (i,)))
            if shared > COVERED * min(whole):
                region, at = str(condition.region), conditions[cut].region
                region = f"({region})" if " or " in region else region
                raise ValueError(
                    f"{condition.role} acts on a cut of {conditions[number].role}, where the whole body goes on: "
                    f"write '{region} and not ({at})'"
                )


def _area(faces: Sequence[WeakFace], *conditions: int) -> float:
    """Return the area on which all of some conditions hold."""
    return float(sum(face.weights[np.all([face.holds(i) for i in conditions], axis=0)].sum() for face in faces))


def _demand_alike(
    condition: Cyclic, turn: Array, first: tuple[Array, Array], second: tuple[Array, Array], most: float
) -> None:
    """Raise ValueError where the turned first region has another middle or other extents than the second.

    first, second: points (3, m) of the regions, and weights (m,). most: the largest distance that counts as none.
    """
    found = []
    for x, weights in ((condition.axis.turned(turn, first[0]), first[1]), second):
        middle = x @ weights / weights.sum()
        spread = (x - middle[:, None]) * weights @ (x - middle[:, None]).T / weights.sum()
        found.append((middle, np.sqrt(np.linalg.eigvalsh(spread).clip(0.0))))
    apart = float(np.linalg.norm(found[0][0] - found[1][0]) + np.abs(found[0][1] - found[1][1]).max())
    if apart > most:
        raise ValueError(
            f"{condition.role}: the regions do not fit each other: the first, turned by "
            f"{_degrees(turn, condition):.6g} degrees, and the second lie {apart:.3g} apart"
        )


def _outward(face: WeakFace, condition: int) -> Array:
    """Return the integral (3,) of the outward normal over the region of a condition."""
    return np.asarray((face.normal * face.weights * face.holds(condition)).sum(axis=1))


def _demand_opposite(condition: Cyclic, rotation: Array, first: Array, second: Array) -> None:
    """Raise ValueError unless the second region faces the body from the other side than the turned first one.

    first, second: (3,), integrals of the outward normals.
    """
    if -float((rotation @ first) @ second) < OPPOSITE * float(np.linalg.norm(first) * np.linalg.norm(second)):
        raise ValueError(f"{condition.role}: the body does not lie between the regions: give the two cuts of a sector")


def _turn(condition: Cyclic, first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[Array, int]:
    """Return the rotation (3, 3) from the first region to the second, and how many sectors make up the whole.

    first, second: points (3, m) of the regions, and weights (m,). Raises ValueError where the areas differ, and for an
    angle that is no whole part of 360 degrees.
    """
    areas = [float(weights.sum()) for _, weights in (first, second)]
    if abs(areas[0] - areas[1]) > AREAS * max(areas):
        raise ValueError(
            f"{condition.role}: the regions do not fit each other: their areas are {areas[0]:.5g} and {areas[1]:.5g}"
        )
    axis = np.array(condition.axis.direction)
    arms = []
    for x, weights in (first, second):
        arm = x @ weights / weights.sum() - np.array(condition.axis.point)
        arms.append(arm - axis * (axis @ arm))
    angle = math.atan2(float(axis @ np.cross(arms[0], arms[1])), float(arms[0] @ arms[1]))
    count = round(2.0 * math.pi / abs(angle)) if angle else 0
    if count < 2 or abs(2.0 * math.pi / abs(angle) / count - 1.0) > WHOLE:
        raise ValueError(
            f"{condition.role}: the regions are {math.degrees(abs(angle)):.6g} degrees apart about the axis, which is "
            "no whole part of 360 degrees: check the regions, the axis and its point"
        )
    return condition.axis.rotation(math.copysign(2.0 * math.pi / count, angle)), count


def _jump(
    rotation: Array, spaces: Sequence[TrialSpace], layout: CoefficientLayout, first: Located, second: Located
) -> csr_array:
    """Return the matrix (c m, size) from coefficients of all patches to u at second points minus R u at first ones."""
    here, there = (values_at(spaces, layout, points, len(rotation)) for points in (first, second))
    rows = [
        there[i] - sum(factor * own for factor, own in zip(row, here, strict=True)) for i, row in enumerate(rotation)
    ]
    return csr_array(vstack(rows))


def values_at(
    spaces: Sequence[TrialSpace], layout: CoefficientLayout, points: Located, components: int
) -> list[csr_array]:
    """Return for each component the matrix (m, size) from coefficients of all patches to its values at points."""
    rows, patches, functions, values = [], [], [], []
    of_space = {id(space): number for number, space in enumerate(spaces)}
    kinds = np.array([of_space[id(space)] for space in spaces])[points.patches]
    for kind in np.unique(kinds).tolist():
        space, chosen = spaces[kind], np.flatnonzero(kinds == kind)
        each = [basis_derivatives(space.knots[a], space.degrees[a], points.parameters[chosen, a]) for a in range(3)]
        (u, bu), (v, bv), (w, bw) = [(first[:, None] + np.arange(b.shape[-1]), b[0]) for first, b in each]
        own = (bu[:, :, None, None] * bv[:, None, :, None] * bw[:, None, None, :]).reshape(len(chosen), -1)
        place = (u[:, :, None, None] * space.shape[1] + v[:, None, :, None]) * space.shape[2] + w[:, None, None, :]
        row, column = np.nonzero(own)
        rows.append(chosen[row])
        patches.append(points.patches[chosen[row]])
        functions.append(place.reshape(len(chosen), -1)[row, column])
        values.append(own[row, column])
    row, patch, function, value = map(np.concatenate, (rows, patches, functions, values))
    shape = len(points), components * layout.starts[-1]
    return [
        coo_array((value, (row, _flat(layout, components, patch, component, function))), shape=shape).tocsr()
        for component in range(components)
    ]


def _flat(layout: CoefficientLayout, components: int, patch: IntArray, component: Any, function: IntArray) -> IntArray:
    """Return the places of coefficients in `OnPatches.flat`."""
    sizes = np.prod(layout.shapes, axis=1)
    return np.asarray(components * layout.starts[patch] + component * sizes[patch] + function)


def _fluxes(faces: Sequence[WeakFace], rows: Sequence[IntArray], layout: CoefficientLayout) -> list[csr_array]:
    """Return for each component the matrix (m, size) from coefficients of all patches to t at some points of faces."""
    parts = []
    for face, own in zip(faces, rows, strict=True):
        c, shape = face.form.components, layout.shapes[face.patches[0]]
        found = face.flux_matrix(own, (c, *shape)).tocoo()
        component, place, function = np.unravel_index(found.col, (c, len(face.patches), math.prod(shape)))
        columns = _flat(layout, c, face.patches[place], component, function)
        whole = coo_array((found.data, (found.row, columns)), shape=(found.shape[0], c * layout.starts[-1])).tocsr()
        parts.append([whole[i * len(own) : (i + 1) * len(own)] for i in range(c)])
    return [csr_array(vstack(own)) for own in zip(*parts, strict=True)]


def _turned(rotation: Array, rows: Sequence[csr_array]) -> csr_array:
    """Return R times vectors, both as matrices of their components."""
    return csr_array(vstack([sum(factor * own for factor, own in zip(row, rows, strict=True)) for row in rotation]))


def _degrees(rotation: Array, condition: Cyclic) -> float:
    axis = np.array(condition.axis.direction)
    skew = np.array([rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]])
    return math.degrees(math.atan2(0.5 * float(axis @ skew), 0.5 * (float(np.trace(rotation)) - 1.0)))
