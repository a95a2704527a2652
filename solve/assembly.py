"""Assembles the operator and the load of a problem, with the data on faces and regions."""

from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.patch_groups import groups_of
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from .discretization.coupling import couplings_of
from .discretization.face_data import FaceRule, coefficients_of_patches, face_rules, has_face
from .discretization.grouped import BodyMatrix, Law, assemble_body
from .discretization.groups import CoefficientLayout, OnPatches
from .discretization.on_regions import Stated, renewed, weak_faces
from .discretization.operator import FormOperator, Operator
from .discretization.roughness import Measured, rules_of
from .discretization.shared_out import shared_out
from .discretization.space import TrialSpace
from .discretization.unknowns import Unknowns, Window
from .discretization.weak import WeakFace
from .field import Points
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.conditions import Condition
from .forms.coupled import demand_uncoupled
from .forms.form import Form, check_law
from .forms.mass import Mass, WithMass
from .forms.problem import Problem
from .options import SolveOptions

SAMPLES = np.array([0.07, 0.35, 0.62, 0.91])  # parameters a direction at which a user's law is checked
LARGEST_IMBALANCE = 0.01  # of the data's size; quadrature leaves far less of data in balance


class Assembled(NamedTuple):
    """Hold the matrix of a body, and for each patch the loads and the fixed coefficients (c, n_u, n_v, n_w).

    conditions: those of the body on regions, with what their totals come to at each point.
    """

    matrix: BodyMatrix
    loads: OnPatches
    known: OnPatches
    conditions: tuple[Condition, ...]

    def stated(self, patches: Sequence[Any]) -> list[Any]:
        """Return the problems on patches, with what their totals come to at each point."""
        if not patches[0].problem.has_totals:
            return list(patches)
        return [stated_by(patch, patch.problem.sharing(self.conditions)) for patch in patches]

    def shifted(self, factors: Array) -> "Assembled":
        """Return the same with the mass in the matrix, times the factor (n,) of each patch."""
        each = zip(self.matrix.laws, factors.tolist(), strict=True)
        laws = [
            law._replace(form=WithMass(law.form, factor), source=None, same=(law.same, factor)) for law, factor in each
        ]
        return self._replace(matrix=self.matrix.of(laws).with_faces(self.matrix.faces, self.matrix.couplings))

    def mass(self, factors: Array) -> BodyMatrix:
        """Return the mass matrix of one component, times the factor (n,) of each patch.

        It has the same quadrature rules: that of others would be a source.
        """
        each = zip(self.matrix.laws, factors.tolist(), strict=True)
        laws = [law._replace(form=Mass(factor), source=None, component=0, same=factor) for law, factor in each]
        return self.matrix.of(laws)

    def renewed(self, patches: Sequence[Stated]) -> "Assembled":
        """Return the same matrix with other data, which act on the same places."""
        matrix = self.matrix
        each = zip(matrix.laws, patches, _in_volumes(patches), strict=True)
        laws = [
            law._replace(form=_OfLoads(patch.problem.form), source=patch.problem.source_at, component=None, same=same)
            for law, patch, same in each
        ]
        _, loads = assemble_body(matrix.layout, laws, matrix.parts[0].threads)
        conditions = patches[0].problem.conditions
        if conditions:
            conditions = shared_out(conditions, matrix.weak, patches[0].space)
            stated = [patch.problem.sharing(conditions) for patch in patches]
            for face in matrix.weak:
                _add_load(renewed(face, stated[face.patches[0]]), loads)
        else:
            _on_faces(patches, _in_volumes(patches), loads)
        return Assembled(matrix, loads, _known(patches, matrix.layout), conditions)


class _OfLoads(Form):
    """Stand for a law of which the loads alone are assembled."""

    def __init__(self, law: Form) -> None:
        self.law, self.components = law, law.components

    @property
    def has_initial_flux(self) -> bool:
        """Return whether the law has an initial flux."""
        return self.law.has_initial_flux

    def initial_flux(self, x: Any) -> Any:
        """Return that of the law."""
        return self.law.initial_flux(x)


def assemble_body_data(patches: Sequence[Stated], options: SolveOptions, unknowns: Unknowns | None = None) -> Assembled:
    """Return the matrix, the loads with the data on faces and regions, and the fixed coefficients of all patches.

    patches: those of this process. unknowns: those of all processes that share the body; by default one has all of it.
    """
    if unknowns is not None and len(unknowns.processes.shared(None)) > 1:
        demand_uncoupled(patches[0].problem, "one process solves it: leave comm out")
    shared, conditions = unknowns or Window(patches[0].space), patches[0].problem.conditions
    has_totals = patches[0].problem.has_totals
    with shared.agreed():
        matrix, loads, same = _in_volume(patches, options)
        with patches[0].space.agreed():
            nominal = [stated_by(patch, patch.problem.nominal()) for patch in patches] if has_totals else patches
            terms: Sequence[Any] = weak_faces(nominal, same) if conditions else _on_faces(patches, same, loads)
    if has_totals:
        conditions = shared_out(conditions, terms, shared.processes)
    with shared.agreed(), patches[0].space.agreed():
        if has_totals:
            stated = [patch.problem.sharing(conditions) for patch in patches]
            terms = [renewed(face, stated[face.patches[0]]) for face in terms]
        for face in terms if conditions else ():
            _add_load(face, loads)
        known = _known(patches, loads.layout)
        if patches[0].problem.form.has_initial_flux:
            demand_uncoupled(patches[0].problem, "thermal strain goes without it: solve the whole body")
        couplings = couplings_of(patches, terms, loads.layout) if conditions else ()
    return Assembled(matrix.with_faces(terms, couplings), loads, known, conditions)


def stated_by(patch: Any, problem: BoundaryValueProblem) -> Any:
    """Return what is stated on a patch with another problem."""
    return patch._replace(problem=problem) if isinstance(patch, OnePatch) else replace(patch, problem=problem)


def _in_volume(patches: Sequence[Stated], options: SolveOptions) -> tuple[BodyMatrix, OnPatches, list[Hashable]]:
    """Return the matrix, the loads of the source, and for each patch the number of its law and source."""
    couples, same = _check_laws(patches), _in_volumes(patches)
    measured = [
        Measured(patch.volume, patch.space, patch.problem.form.tensor, law)
        for patch, law in zip(patches, same, strict=True)
    ]
    laws = []
    for patch, rule, law in zip(patches, rules_of(measured, options.quadrature), same, strict=True):
        form, source = patch.problem.form, patch.problem.source_at
        component = 0 if form.components == 1 and form.symmetric and not couples else None
        laws.append(Law(patch.volume, patch.space, rule, form, source, component, law))
    layout = CoefficientLayout.of([patch.space for patch in patches])
    return *assemble_body(layout, laws, options.thread_count), same


def _known(patches: Sequence[Stated], layout: CoefficientLayout) -> OnPatches:
    """Return the fixed coefficients of each patch; those of patches with equal knots and data are found at once."""
    known, groups = layout.empty(patches[0].problem.form.components), defaultdict(list)
    for number, patch in enumerate(patches):
        volume, whole = patch.volume, patch.space.whole
        if whole.dirichlet:
            knots = (row.tobytes() for row in volume.knots)
            data = patch.problem.on_boundary if len(patches) > 1 else None
            groups[volume.degrees, volume.weights is None, *knots, whole.key, data].append(number)
    for numbers in groups.values():
        own = [patches[number] for number in numbers]
        boundary_at, whole = own[0].problem.boundary_at, own[0].space.whole
        found = coefficients_of_patches([patch.volume for patch in own], whole, boundary_at, known.components)
        for number, patch, values in zip(numbers, own, found, strict=True):
            known[number][:] = values[:, patch.space.rows]
    return known


def _check_laws(patches: Sequence[Stated]) -> bool:
    """Return whether a user's law couples u with its gradient. Raises ValueError for a law that is not what it says."""
    forms = {id(patch.problem.form): patch.problem.form for patch in patches if isinstance(patch.problem, Problem)}
    couples = False
    for form in forms.values():
        grids = [
            np.moveaxis(patch.volume.grid(SAMPLES, SAMPLES, SAMPLES), -1, 0).reshape(3, -1)
            for patch in patches
            if patch.problem.form is form
        ]
        one = len(grids) == 1
        couples |= check_law(form, Points.of(grids[0], (SAMPLES,) * 3) if one else np.concatenate(grids, axis=1))
    return couples


def _in_volumes(patches: Sequence[Stated]) -> list[Hashable]:
    """Return for each patch the number of its law and source among different ones."""
    if len(patches) == 1:
        return [None]
    kinds, numbers = (
        ((patch.problem.in_volume, type(patch.problem.form).__name__) for patch in patches),
        dict[Hashable, int](),
    )
    return [numbers.setdefault(kind, len(numbers)) for kind in kinds]


def assemble_data(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, options: SolveOptions
) -> tuple[Operator | FormOperator, Array, Array]:
    """Return the operator, the load with the data on faces and regions, and the fixed coefficients of one patch.

    The load and the coefficients have the shape (c, n_u, n_v, n_w).
    """
    found = assemble_body_data([OnePatch(volume, problem, space)], options)
    return found.matrix.parts[0], found.loads[0], found.known[0]


class OnePatch(NamedTuple):
    """State a problem on one patch."""

    volume: BSplineVolume
    problem: BoundaryValueProblem
    space: TrialSpace


def _on_faces(patches: Sequence[Stated], same: Sequence[Hashable], loads: OnPatches) -> list[FaceRule]:
    """Add the data on the images of the cube's faces to loads, and return the rules of the faces with Robin's term.

    Faces of patches that are alike are one rule. same: equal for patches with the same law.
    """
    robin = []
    for group in groups_of([patch.volume for patch in patches]):
        for name in FACE_NAMES:
            for places in _alike([patches[i] for i in group.numbers], [same[i] for i in group.numbers], name):
                own = group.rows(places)
                first = patches[own.numbers[0]]
                face = face_rules(own, first.space, name)
                alpha, data = face.data(first.problem)
                if alpha is not None:
                    robin.append(replace(face, measure=alpha * face.measure))
                found = np.zeros((len(own), loads.components, *first.space.shape))
                face.add_load(data, found)
                loads.add(face.patches, found)
    return robin


def _alike(patches: Sequence[Stated], same: Sequence[Hashable], name: str) -> list[IntArray]:
    """Return the places of patches whose faces of a name have the same space and data, which are not values of u."""
    found = defaultdict(list)
    for place, (patch, law) in enumerate(zip(patches, same, strict=True)):
        space = patch.space
        if name in space.outer and name not in space.dirichlet:
            found[space.key, law, patch.problem.key_on(name)].append(place)
    return [np.array(places) for places in found.values() if has_face(patches[places[0]].space, name)]


def _add_load(face: WeakFace, loads: OnPatches) -> None:
    found = np.zeros((len(face.patches), loads.components, *loads.layout.shapes[face.patches[0]]))
    face.add_load(found)
    loads.add(face.patches, found)


def balanced(load: Array, unknowns: Unknowns) -> Array:
    """Return the free coefficients' load (1, ...) minus its mean, for problems that leave the solution's constant open.

    The basis functions sum to one, so the returned load is orthogonal to constants.
    Raises ValueError where the load's sum, the integral of source and fluxes, is not nearly zero.
    """
    total, size = (float(unknowns.processes.total(part.sum())) for part in (load, np.abs(load)))
    if abs(total) > LARGEST_IMBALANCE * size:
        raise ValueError(
            f"incompatible Neumann data: source plus flux integrate to {total:.4g}, must be 0 where no Dirichlet face, "
            "no Robin face and no reaction fixes the solution"
        )
    return load - total / unknowns.count
