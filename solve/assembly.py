"""Assembles the operator and the load of a problem, with the data on faces and regions."""

from dataclasses import replace
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from .discretization.face_data import FaceRule, boundary_coefficients, face_rule, has_face
from .discretization.on_regions import weak_faces
from .discretization.operator import FormOperator, Operator, assemble
from .discretization.quadrature import rule_of
from .discretization.space import TrialSpace
from .discretization.unknowns import Unknowns
from .discretization.weak import WeakFace
from .field import Points
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.form import check_law
from .forms.problem import Problem
from .options import SolveOptions

SAMPLES = np.array([0.07, 0.35, 0.62, 0.91])  # parameters a direction at which a user's law is checked
LARGEST_IMBALANCE = 0.01  # of the data's size; quadrature leaves far less of data in balance


def assemble_data(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, options: SolveOptions
) -> tuple[Operator | FormOperator, Array, Array]:
    """Return the operator, the load with the data on faces and regions, and the fixed coefficients.

    The load and the coefficients have the shape (c, n_u, n_v, n_w).
    """
    form, couples = problem.form, False
    if isinstance(problem, Problem):
        samples = np.moveaxis(volume.grid(SAMPLES, SAMPLES, SAMPLES), -1, 0).reshape(3, -1)
        couples = check_law(form, Points.of(samples, (SAMPLES, SAMPLES, SAMPLES)))
    operator, load = assemble(
        volume,
        space,
        form,
        problem.source_at,
        rule_of(volume, space, form.tensor, options.quadrature),
        component=0 if form.components == 1 and form.symmetric and not couples else None,
        threads=options.thread_count,
    )
    with space.agreed():
        if problem.conditions:
            terms: dict[str, Any] = _on_regions(volume, problem, space, load)
        else:
            terms = _on_faces(volume, problem, space, load)
    known = boundary_coefficients(volume, space.whole, problem.boundary_at, form.components)
    return replace(operator, faces=terms), load, known[:, space.rows].copy()


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


def balanced(load: Array, unknowns: Unknowns, space: TrialSpace) -> Array:
    """Return the free coefficients' load (1, ...) minus its mean, for problems that leave the solution's constant open.

    The basis functions sum to one, so the returned load is orthogonal to constants. space: for sums over all processes.
    Raises ValueError where the load's sum, the integral of source and fluxes, is not nearly zero.
    """
    total, size = float(space.total(load.sum())), float(space.total(np.abs(load).sum()))
    if abs(total) > LARGEST_IMBALANCE * size:
        raise ValueError(
            f"incompatible Neumann data: source plus flux integrate to {total:.4g}, must be 0 where no Dirichlet face, "
            "no Robin face and no reaction fixes the solution"
        )
    return load - total / unknowns.count
