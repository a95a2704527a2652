"""Evaluates a problem's conditions on regions at the points of a face, for `weak.WeakFace`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csr_array

from parameterize.arrays import Array, IntArray, Mask, in_brackets
from parameterize.spline.body import all_control_points, size_of
from parameterize.spline.bspline import basis_derivatives, breakpoints, sparse_rows
from parameterize.spline.interface import axis_side
from parameterize.spline.orientation import orientations
from parameterize.spline.patch_groups import groups_of
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from ..field import Points, part_of
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.conditions import Condition, Value
from ..forms.form import Form
from ..forms.region import FacesOfPoints, tolerances
from .face_data import has_face
from .processes import Processes
from .space import TrialSpace
from .surface_rule import Codes, Faces, SurfaceRule, surface_rules
from .weak import WeakFace

Patches = Sequence[BSplineVolume]

MOST = 60  # conditions: a bit of a code each
MARGIN = 2.0  # gamma over the least that keeps the form coercive
DEPTHS = (0.5, 1.0)  # of the span behind a face, at which the map's change is looked at
CONTRADICTION = 1e-6  # share of their size by which two values of one component may differ
RIM = 1e-6  # share of a region's area on a face that may lie in another one, too, as "y < 1e-9" beside "x > 1"
PARALLEL = 1e-6  # length of a direction's part that no other direction holds, from which on it is held too
AT_REST = 1e-15  # share of the largest mean square of a motion at the supports, up to which another leaves them at rest
SLIDES = 1e-10  # share of the mean square of a motion that supports hold, up to which it slides along them
WHOLE = 0.999  # share of a face's parameters that a region must cover to count as all of it


class Stated(Protocol):
    """Describe a problem on one patch of a body: its volume, the problem with the patch's data, and the trial space."""

    @property
    def volume(self) -> BSplineVolume:
        """Return the map."""

    @property
    def problem(self) -> BoundaryValueProblem:
        """Return the problem with the data of the patch."""

    @property
    def space(self) -> TrialSpace:
        """Return the trial space."""


class Coupled(Protocol):
    """Describe terms that couple regions, as they hold motions of a body."""

    @property
    def weights(self) -> Array:
        """Return the weights (m,) of integrals."""

    def moves(self, motions: Callable[[Array], Array]) -> tuple[Array, Array]:
        """Return motions (k, c, m) at the points, functions of points (3, m), and what of them the terms hold."""


def weak_faces(patches: Sequence[Stated], same: Sequence[Hashable]) -> list[WeakFace]:
    """Return the terms of the conditions on regions of problems, those on faces of patches that are alike as one.

    same: equal for patches with the same law. Raises ValueError where conditions contradict each other, also on faces
    that the trial space holds.
    """
    conditions = patches[0].problem.conditions
    if len(conditions) > MOST:
        raise ValueError(f"at most {MOST} regions, got {len(conditions)}")
    groups = groups_of([patch.volume for patch in patches])
    found = []
    for group in groups:
        hands = orientations(group)
        for name in FACE_NAMES:
            axis, side = axis_side(name)
            for places, strong in _alike([patches[i] for i in group.numbers], [same[i] for i in group.numbers], name):
                faces = Faces(group.rows(places), axis, side, hands[places])
                own = [patches[i] for i in faces.group.numbers]
                face = _weak_face(own, faces, name, strong)
                found += [] if face is None else [face]
    return found


def _alike(patches: Sequence[Stated], same: Sequence[Hashable], name: str) -> Iterator[tuple[IntArray, Value | None]]:
    """Yield the places of patches whose faces of a name are cut at once, and the condition that their spaces hold."""
    found = defaultdict[Any, list[int]](list)
    for place, (patch, law) in enumerate(zip(patches, same, strict=True)):
        problem, space = patch.problem, patch.space
        if name not in space.outer:
            continue
        strong = problem.strong_on(name) if name in space.dirichlet else None
        if strong is None or _may_overlap(problem, name, strong):
            held = None if strong is None else strong.role
            found[space.key, law, problem.on_regions, held].append(place)
    for places in found.values():
        first = patches[places[0]]
        if has_face(first.space, name):
            strong = first.problem.strong_on(name) if name in first.space.dirichlet else None
            yield np.array(places), strong


def _weak_face(patches: Sequence[Stated], faces: Faces, name: str, strong: Value | None) -> WeakFace | None:
    """Return the terms on faces of patches that are alike; None where no condition acts, or the spaces hold them."""
    problem, space = patches[0].problem, patches[0].space
    regions = [condition.region for condition in problem.conditions]
    length = next((one.frame.length for one in regions if one.frame is not None), None)
    coder = codes_on(problem, faces.nets, [patch.problem.prefix + name for patch in patches], strong)
    rule = surface_rules(faces, space, coder, length, any(one.needs_normal for one in regions))
    if rule is None:
        return None
    present, owners = np.unique(rule.at.owners, return_inverse=True)
    rule = replace(rule, at=replace(rule.at, owners=owners))
    builder = _Builder(faces.rows(present), problem, space, name, rule)
    if strong is None:
        return builder.face()
    builder.demand_consistent()
    return None


def _may_overlap(problem: BoundaryValueProblem, name: str, strong: Value) -> bool:
    """Return whether another condition than the strong one may hold on parts of its face, as the regions' texts say."""
    names = {name, problem.prefix + name}
    others = (one for one in problem.conditions if one is not strong)
    return any(not one.faces or not names.isdisjoint(one.faces) for one in others)


def demand_area(
    problem: BoundaryValueProblem, faces: Sequence[WeakFace], processes: Processes, volumes: Patches
) -> None:
    """Raise ValueError where a region has no area on the boundary, without the faces that the trial spaces hold.

    faces: those of all patches of this process with terms of conditions. volumes: all of the body.
    """
    for i, condition in enumerate(problem.conditions):
        area = sum(face.weights[face.holds(i)].sum() for face in faces)
        if not condition.is_strong and processes.total(area) == 0.0:
            points = all_control_points(volumes)
            low, high = (in_brackets(ends.tolist()) for ends in (points.min(axis=0), points.max(axis=0)))
            strong = [one.role for one in problem.conditions if one.is_strong]
            but = f" but what {', '.join(strong)} may hold" if strong else ""
            raise ValueError(
                f"{condition.role}: no part of the boundary lies there{but}; the body lies between {low} and {high}"
            )


def demand_supports(
    problem: BoundaryValueProblem,
    faces: Sequence[WeakFace],
    processes: Processes,
    volumes: Patches,
    couplings: Sequence[Coupled] = (),
) -> None:
    """Raise ValueError where the supports leave a motion free that the law does not resist (`Form.free_motions`).

    Arguments as in `demand_area`, and couplings of regions; for a body that no Dirichlet data hold.
    """
    holding = [face.weights * (np.einsum("ccm->m", face.projector) + face.is_sprung) for face in faces]
    area = processes.total(sum(float(weights.sum()) for weights in holding))
    if not problem.form.free_motions(np.zeros((3, 1))).size:
        return
    if area == 0.0:
        raise ValueError("no support holds the body: give fix, roller, symmetry, spring or foundation")
    size = size_of(volumes)
    middle = processes.total(sum(face.x @ weights for face, weights in zip(faces, holding, strict=True))) / area
    moved = held = 0.0
    for face, weights in zip(faces, holding, strict=True):
        motions = problem.form.free_motions((np.asarray(face.x) - middle[:, None]) / size)
        kept = np.einsum("cdm,kdm->kcm", face.holding, motions)
        moved = moved + np.einsum("kcm,lcm,m->kl", motions, motions, face.weights * (weights > 0.0))
        held = held + np.einsum("kcm,lcm,m->kl", kept, kept, face.weights)
    for coupling in couplings:
        here, jump = coupling.moves(lambda x: problem.form.free_motions((x - middle[:, None]) / size))
        moved = moved + np.einsum("kcm,lcm,m->kl", here, here, coupling.weights)
        held = held + np.einsum("kcm,lcm,m->kl", jump, jump, coupling.weights)
    free = _unheld(processes.total(moved) / area, processes.total(held) / area)
    if free is not None:
        said = ", ".join(f"{part:.2g}" for part in (free / np.abs(free).max()).round(3) + 0.0)
        raise ValueError(
            "the supports leave the body free to move: of its shifts along and turns about x, y, z, "
            f"({said}) is not held"
        )


def _unheld(moved: Array, held: Array) -> Array | None:
    """Return a motion (k,) that supports do not hold, None where they hold all of them.

    moved, held: (k, k), mean products of motions at the supports, and of what supports hold of them. A motion is
    compared with itself: a turn about the edge of a foil moves little there, and is held all the same.
    """
    sizes, vectors = np.linalg.eigh(moved)
    if sizes[0] <= AT_REST * sizes[-1]:
        return np.asarray(vectors[:, 0])
    scaled = vectors / np.sqrt(sizes)
    shares, turned = np.linalg.eigh(scaled.T @ held @ scaled)
    return np.asarray(scaled @ turned[:, 0]) if shares[0] <= SLIDES else None


def codes_on(problem: BoundaryValueProblem, nets: Array, names: Sequence[str], strong: Value | None = None) -> Codes:
    """Return the function from points to codes: bit i where condition i holds, bit 0 for the exact flux.

    nets: (k, n, 3), the control points of the faces. names: (k,), of the faces in the body. strong: the condition that
    the trial space holds on the faces, if any; codes are zero where it is alone.
    """
    rest = int(bool(problem.exact_formulas) and strong is None)
    alone = sum(1 << i for i, condition in enumerate(problem.conditions, 1) if condition is strong)
    near = tolerances(nets)

    def codes(x: Array, normal: Array, owners: IntArray) -> IntArray:
        found, on = np.full(x.shape[1:], rest, dtype=np.int64), FacesOfPoints(names, owners, near[owners])
        for i, condition in enumerate(problem.conditions, 1):
            found |= condition.region.holds_on(x, normal, on).astype(np.int64) << i
        return found if strong is None else np.where(found == alone, 0, found)

    return codes


def renewed(face: WeakFace, problem: BoundaryValueProblem) -> WeakFace:
    """Return a face with the loads, values and factors of another problem, whose conditions act on the same regions."""
    acting = Acting(problem, face.x, face.normal, face.weights, face.codes)
    projector, values = acting.held()
    loads, factor = acting.natural(projector)
    initial = initial_through(problem.form, face.x, face.normal)
    return replace(face, values=values, loads=loads, factor=factor, initial=initial)


def initial_through(form: Form, x: Points, normal: Array) -> Array:
    """Return the law's initial flux (c, m) at points along normals (3, m); zero of a law that has none."""
    if not form.has_initial_flux:
        return np.zeros((form.components, len(normal[0])))
    return np.asarray((form.initial_flux(x) * normal).sum(axis=1), dtype=np.float64)


@dataclass(frozen=True, eq=False)
class Acting:
    """Evaluate the conditions that act at m points of a face; attributes as in WeakFace."""

    problem: BoundaryValueProblem
    x: Points
    normal: Array
    weights: Array
    codes: IntArray

    def holding(self, condition: int) -> Any:
        """Return the mask (m,) of the points where the condition with this number holds."""
        return self.codes >> (condition + 1) & 1 == 1

    @property
    def coupled(self) -> Mask:
        """Return the mask (m,) of the points whose u is coupled with that of others."""
        holding = (self.holding(i) for i, one in enumerate(self.problem.conditions) if one.is_coupled)
        return np.asarray(sum(holding, np.zeros(len(self.weights), dtype=bool)))

    def held(self) -> tuple[Array, Array]:
        """Return the projector P (c, c, m) onto the directions along which u is given, and P g (c, m)."""
        c, m = self.problem.form.components, len(self.weights)
        projector, given = np.zeros((c, c, m)), np.zeros((c, m))
        for i, condition in enumerate(self.problem.conditions):
            here = np.flatnonzero(self.holding(i))
            if not isinstance(condition, Value) or not len(here):
                continue
            points = part_of(self.x, here)
            for direction in condition.directions(c, self.normal[:, here]):
                value = condition.values_along(direction, self.problem, points)
                new = direction - np.einsum("cdm,dm->cm", projector[:, :, here], direction)
                size = np.linalg.norm(new, axis=0)
                missing = value - (direction * given[:, here]).sum(axis=0)
                held, is_new = size <= PARALLEL, size > PARALLEL
                wrong = held & (np.abs(missing) > CONTRADICTION * (np.abs(value).max() + np.abs(given).max()))
                if self._is_area(here[wrong], here):
                    self._refuse_contradiction(i, here[wrong][0])
                new, place = new[:, is_new] / size[is_new], here[is_new]
                projector[:, :, place] += new[:, None] * new
                given[:, place] += new * (missing[is_new] / size[is_new])
        return projector, given

    def _refuse_contradiction(self, condition: int, point: int) -> None:
        conditions = self.problem.conditions
        others = [c.role for i, c in enumerate(conditions[:condition]) if self.holding(i)[point] and c.is_essential]
        raise ValueError(
            f"{conditions[condition].role} and {others[-1]} overlap and contradict each other at {self._place(point)}"
        )

    def _is_area(self, points: Any, region: Any) -> bool:
        """Return whether some points form more of a region than the rim along which two regions touch."""
        return bool(self.weights[points].sum() > RIM * self.weights[region].sum())

    def _place(self, point: int) -> str:
        return "(" + ", ".join(f"{value:.4g}" for value in self.x[:, point]) + ")"

    def natural(self, projector: Array) -> tuple[Array, Array]:
        """Return the given flux into the body (c, m), beside held directions, and the factor (c, c, m) of exchanges.

        Raises ValueError where a load acts on a held part of the boundary.
        """
        c, m = self.problem.form.components, len(self.weights)
        loads, factor, named = np.zeros((c, m)), np.zeros((c, c, m)), np.zeros(m, dtype=bool)
        for i, condition in enumerate(self.problem.conditions):
            here = np.flatnonzero(self.holding(i))
            named[here] = True
            if condition.is_essential or not len(here):
                continue
            points = part_of(self.x, here)
            found = condition.flux_at(self.problem, points, self.normal[:, here])
            lost = np.abs(np.einsum("cdm,dm->cm", projector[:, :, here], found)).max(axis=0)
            wrong = here[lost > CONTRADICTION * np.abs(found).max()]
            if condition.datum is not None and self._is_area(wrong, here):
                self._refuse_load(condition, wrong[0])
            loads[:, here] += found
            if condition.factor is not None:
                factor[:, :, here] += condition.factors_at(c, points, self.normal[:, here])
        rest = np.flatnonzero((self.codes & 1 == 1) & ~named | self._partly_held(projector, named))
        if self.problem.exact_formulas and len(rest):
            points = part_of(self.x, rest)
            loads[:, rest] += self.problem.exact_flux("flux", points, self.normal[:, rest])
        free = np.eye(c)[:, :, None] - projector
        sprung = np.flatnonzero(factor.any(axis=(0, 1)))
        own = np.einsum("cdm,dem->cem", free[..., sprung], factor[..., sprung])
        factor[..., sprung] = np.einsum("cdm,dem->cem", own, free[..., sprung])
        return np.einsum("cdm,dm->cm", free, loads), factor

    def _partly_held(self, projector: Array, named: Array) -> Array:
        """Return the mask of points with the exact solution's flux in the components that a value leaves free."""
        natural = np.zeros(len(named), dtype=bool)
        for i, condition in enumerate(self.problem.conditions):
            natural |= self.holding(i) & (not condition.is_essential)
        trace = np.einsum("ccm->m", projector)
        return (trace > 0.5) & (trace < self.problem.form.components - 0.5) & ~natural

    def _refuse_load(self, condition: Condition, point: int) -> None:
        held = [c for i, c in enumerate(self.problem.conditions) if c.is_essential and self.holding(i)[point]]
        is_same = condition.region == held[0].region
        region = f"({condition.region})" if " or " in str(condition.region) else str(condition.region)
        remedy = "give one of them" if is_same else f"write '{region} and not ({held[0].region})'"
        raise ValueError(
            f"{condition.role} acts where {held[0].role} holds the body, as at {self._place(point)}: {remedy}"
        )


@dataclass(frozen=True, eq=False)
class _Builder:
    faces: Faces
    problem: BoundaryValueProblem
    space: TrialSpace
    name: str
    rule: SurfaceRule

    @property
    def _acting(self) -> Acting:
        at = self.rule.at
        x = Points.at(np.ascontiguousarray(at.x), at.parameters)
        return Acting(self.problem, x, at.normal, self.rule.weights, self.rule.codes)

    def demand_consistent(self) -> None:
        """Raise ValueError where values contradict each other, or a load acts on a held part."""
        acting = self._acting
        acting.natural(acting.held()[0])

    def face(self) -> WeakFace:
        """Return the terms of the face."""
        form, at, weights, acting = self.problem.form, self.rule.at, self.rule.weights, self._acting
        x, normal = acting.x, acting.normal
        projector, given = acting.held()
        gamma, slowest = self._gamma(x, normal, np.flatnonzero(projector.any(axis=(0, 1)) | acting.coupled))
        loads, factor = acting.natural(projector)
        axis, side = axis_side(self.name)
        tables, slope = self._tables(axis, side)
        ends = [tuple(-end if a == axis else slice(None) for a in range(3)) for end in ((1, 2) if side else (0, -1))]
        inside = np.einsum("ccm->m", projector) > 0.5
        held = np.bincount(at.owners, inside * weights / at.size, len(self.faces))
        return WeakFace(
            name=self.name,
            patches=self.faces.group.numbers,
            owners=at.owners,
            form=form,
            x=x,
            normal=normal,
            weights=weights,
            inverse=np.asarray(np.linalg.inv(at.jacobian).transpose(1, 2, 0), dtype=np.float64),
            codes=self.rule.codes,
            projector=projector,
            values=given,
            gamma=gamma,
            slowest=slowest,
            factor=factor,
            loads=loads,
            initial=initial_through(form, x, normal),
            is_whole=held > WHOLE,
            tables=tables,
            slope=slope,
            layers=(ends[0], ends[1]),
        )

    def _gamma(self, x: Points, normal: Array, held: IntArray) -> tuple[Array, Array]:
        """Return Nitsche's parameter (m,) at points with normals (3, m), and the law's factor over the cube's depth.

        held: the points with given values; the others have zero. On the span behind a face |t(u)|^2 integrates to at
        most (p + 1)^2 / thickness times the energy, times the largest eigenvalue of the law's matrix n . C . n (a
        polynomial of degree p on [0, 1] has f(0)^2 <= (p + 1)^2 int f^2), times a factor for the map's change across
        the span.
        """
        at, (axis, side) = self.rule.at, axis_side(self.name)
        gamma, slowest = np.zeros((2, len(at.owners)))
        if not len(held):
            return gamma, slowest
        law = self.problem.form.matrix_along(normal[:, held], part_of(x, held))
        strength = np.linalg.eigvalsh(law)[..., -1]
        breaks = breakpoints(self.space.whole.knots[axis])
        span = breaks[-1] - breaks[-2] if side else breaks[1] - breaks[0]
        thickness = span * np.abs(np.linalg.det(at.jacobian[held])) / at.size[held]
        change = self._change(held, span)
        steepest = MARGIN * self._sharing(held) * (self.space.degrees[axis] + 1) ** 2 * change
        gamma[held], slowest[held] = steepest * strength / thickness, strength * span / thickness
        return gamma, slowest

    def _change(self, points: IntArray, span: float) -> Array:
        """Return the factor (m,) by which the map may lower the energy inside the span behind some points."""
        at, (axis, side) = self.rule.at, axis_side(self.name)
        jacobian, change = at.jacobian[points], np.ones(len(points))
        inverse, det = np.linalg.inv(jacobian), np.abs(np.linalg.det(jacobian))
        for depth in DEPTHS:
            parameters = at.parameters[points]
            parameters[:, axis] = 1.0 - depth * span if side else depth * span
            inside = self.faces.jacobian(at.owners[points], parameters)
            stretch = np.linalg.norm(inside @ inverse, ord=2, axis=(1, 2)) ** 2
            change = np.maximum(change, stretch * det / np.abs(np.linalg.det(inside)))
        return change

    def _sharing(self, points: IntArray) -> Array:
        """Return the number (m,) of faces that share the energy of the span behind some points."""
        axis = FACE_NAMES.index(self.name) // 2
        count = np.ones(len(points))
        for a in range(3):
            if a != axis:
                breaks, t = breakpoints(self.space.whole.knots[a]), self.rule.at.parameters[points, a]
                count += (t < breaks[1]).astype(float) + (t > breaks[-2])
        return count

    def _tables(self, axis: int, side: int) -> tuple[tuple[csr_array, csr_array, csr_array], float]:
        """Return the tables of the face's functions, and the slope of the functions across the face."""
        knots, degrees = self.space.knots, self.space.degrees
        along = [a for a in range(3) if a != axis]
        found = [basis_derivatives(knots[a], degrees[a], self.rule.at.parameters[:, a], derivatives=1) for a in along]
        (first_b, b), (first_c, c) = found
        count_b, count_c = (self.space.shape[a] for a in along)
        first_b = first_b + self.rule.at.owners * count_b
        columns = (
            (first_b[:, None] + np.arange(b.shape[-1]))[:, :, None] * count_c
            + (first_c[:, None] + np.arange(c.shape[-1]))[:, None, :]
        ).reshape(len(first_b), -1)
        tables = [
            sparse_rows(
                (b[i][:, :, None] * c[j][:, None, :]).reshape(len(columns), -1),
                columns,
                len(self.faces) * count_b * count_c,
            )
            for i, j in ((0, 0), (1, 0), (0, 1))
        ]
        _, ends = basis_derivatives(knots[axis], degrees[axis], np.array([float(side)]), derivatives=1)
        return (tables[0], tables[1], tables[2]), float(ends[1][0, -1 if side else 0])
