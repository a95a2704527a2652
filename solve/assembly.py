"""Assembles the operator and the load of a problem, with the data on faces and regions."""

from collections import defaultdict
from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from .discretization.face_data import FaceRule, coefficients_of_patches, face_rule, has_face
from .discretization.grouped import BodyMatrix, Law, assemble_body
from .discretization.groups import CoefficientLayout, OnPatches
from .discretization.on_regions import renewed, weak_faces
from .discretization.operator import FormOperator, Operator
from .discretization.roughness import Measured, rules_of
from .discretization.space import TrialSpace
from .discretization.unknowns import Unknowns
from .discretization.weak import WeakFace
from .field import Points
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.form import Form, check_law
from .forms.mass import Mass, WithMass
from .forms.problem import Problem
from .options import SolveOptions

SAMPLES = np.array([0.07, 0.35, 0.62, 0.91])  # parameters a direction at which a user's law is checked
LARGEST_IMBALANCE = 0.01  # of the data's size; quadrature leaves far less of data in balance


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


class Assembled(NamedTuple):
    """Hold the matrix of a body, and for each patch the loads and the fixed coefficients (c, n_u, n_v, n_w)."""

    matrix: BodyMatrix
    loads: OnPatches
    known: OnPatches

    def shifted(self, factors: Array) -> "Assembled":
        """Return the same with the mass in the matrix, times the factor (n,) of each patch."""
        each = zip(self.matrix.laws, factors.tolist(), strict=True)
        laws = [
            law._replace(form=WithMass(law.form, factor), source=None, same=(law.same, factor)) for law, factor in each
        ]
        return self._replace(matrix=self.matrix.of(laws).with_faces([own.faces for own in self.matrix.parts]))

    def mass(self, factors: Array) -> BodyMatrix:
        """Return the mass matrix of one component, times the factor (n,) of each patch.

        It has the same quadrature rules: that of others would be a source.
        """
        each = zip(self.matrix.laws, factors.tolist(), strict=True)
        laws = [law._replace(form=Mass(factor), source=None, component=0, same=factor) for law, factor in each]
        return self.matrix.of(laws)

    def renewed(self, patches: Sequence[Stated]) -> "Assembled":
        """Return the same matrix with other data, which act on the same places."""
        matrix, nothing = self.matrix, Form()
        nothing.components = self.loads.components
        each = zip(matrix.laws, patches, _in_volumes(patches), strict=True)
        laws = [
            law._replace(form=nothing, source=patch.problem.source_at, component=None, same=same)
            for law, patch, same in each
        ]
        _, loads = assemble_body(matrix.layout, laws, matrix.parts[0].threads)
        for patch, own, load in zip(patches, matrix.parts, loads, strict=True):
            if patch.problem.conditions:
                for face in own.faces.values():
                    renewed(face, patch.problem).add_load(load)
            else:
                _on_faces(patch.volume, patch.problem, patch.space, load)
        return Assembled(matrix, loads, _known(patches, matrix.layout))


def assemble_body_data(patches: Sequence[Stated], options: SolveOptions) -> Assembled:
    """Return the matrix, the loads with the data on faces and regions, and the fixed coefficients of all patches."""
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
    matrix, loads = assemble_body(layout, laws, options.thread_count)
    terms: list[dict[str, Any]] = []
    for patch, load in zip(patches, loads, strict=True):
        with patch.space.agreed():
            on_boundary = _on_regions if patch.problem.conditions else _on_faces
            terms.append(on_boundary(patch.volume, patch.problem, patch.space, load))
    return Assembled(matrix.with_faces(terms), loads, _known(patches, layout))


def _known(patches: Sequence[Stated], layout: CoefficientLayout) -> OnPatches:
    """Return the fixed coefficients of each patch; those of patches with equal knots and data are found at once."""
    known, groups = layout.empty(patches[0].problem.form.components), defaultdict(list)
    for number, patch in enumerate(patches):
        volume, whole = patch.volume, patch.space.whole
        if whole.dirichlet:
            knots = (row.tobytes() for row in (*volume.knots, *whole.knots))
            data = patch.problem.on_boundary if len(patches) > 1 else None
            groups[volume.degrees, volume.weights is None, whole.degrees, *knots, data].append(number)
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
    """Return what the law and the source of each patch are made of."""
    if len(patches) == 1:
        return [None]
    return [(patch.problem.in_volume, type(patch.problem.form).__name__) for patch in patches]


def assemble_data(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, options: SolveOptions
) -> tuple[Operator | FormOperator, Array, Array]:
    """Return the operator, the load with the data on faces and regions, and the fixed coefficients of one patch.

    The load and the coefficients have the shape (c, n_u, n_v, n_w).
    """
    matrix, loads, known = assemble_body_data([OnePatch(volume, problem, space)], options)
    return matrix.parts[0], loads[0], known[0]


class OnePatch(NamedTuple):
    """State a problem on one patch."""

    volume: BSplineVolume
    problem: BoundaryValueProblem
    space: TrialSpace


def _on_faces(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, load: Array
) -> dict[str, FaceRule]:
    """Add the data on the images of the cube's faces to a load, and return the rules of the faces with Robin's term."""
    robin = {}
    for name in FACE_NAMES:
        if name in space.dirichlet or not has_face(space, name):
            continue
        face = face_rule(volume, space, name)
        alpha, data = problem.on_face(name, face.points, face.normal)
        if alpha is not None:
            robin[name] = replace(face, measure=alpha * face.measure)
        for density, total in zip(data, load, strict=True):
            total[face.layer] += face.integrate(density)
    return robin


def _on_regions(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, load: Array
) -> dict[str, WeakFace]:
    """Add the data on regions of the boundary to a load, and return the faces of the cube with terms, by name."""
    faces = weak_faces(volume, problem, space)
    for face in faces:
        face.add_load(load)
    return {face.name: face for face in faces}


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
