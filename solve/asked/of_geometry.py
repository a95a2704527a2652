"""Finds the part of the geometry in the interval of each asked quantity."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from parameterize.spline.interface import axis_side

from ..field import BodyField
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.conditions import Foundation, shares_out
from ..mixed import MixedSystem
from ..solution import Solution
from ..system import System
from .adjoint import adjoint, adjoint_of, why_no_adjoint
from .functional import Functional, Reaction
from .geometry import GeometryPart, TrueSurface, geometry_parts
from .own_change import OwnChange

AT_RIMS = 2.0  # factor where stress is infinite: at a rim on a smooth face the change was 0.45 to 4 times the true one
NO_SURFACE = "no surface is given"


def surface_of(solution: Solution, functionals: Sequence[Functional]) -> TrueSurface | None:
    """Return the part's surface mesh that a problem's regions or the asks know; None where they know none."""
    known: list[Any] = [condition.region.surface for condition in solution.problem.conditions]
    known += [one.ask.surface for one in functionals]
    return next((one for one in known if isinstance(one, TrueSurface)), None)


def of_geometry(
    system: System, solution: Solution, functionals: Sequence[Functional], surface: TrueSurface | None = None
) -> list[GeometryPart | str]:
    """Return what the distance to the true surface changes in each quantity of a solution, or why it is not known.

    surface: by default that of `surface_of`.
    """
    surface = surface or surface_of(solution, functionals)
    if surface is None:
        return [NO_SURFACE] * len(functionals)
    if why := _why_no_change(solution.problem):
        return [why] * len(functionals)
    own = [OwnChange.of(one, solution) for one in functionals]
    adjoints = [_adjoint(system, solution, one) for one in own]
    chosen = [number for number, z in enumerate(adjoints) if isinstance(z, BodyField)]
    fields = [z for z in adjoints if isinstance(z, BodyField)]
    try:
        parts = geometry_parts(solution, fields, surface, [own[number].density for number in chosen])
    except ValueError as error:  # of data that are not defined beside the boundary
        return [str(error)] * len(functionals)
    found, wider = dict(zip(chosen, parts, strict=True)), AT_RIMS if len(solution.singular) else 1.0
    for number in chosen:
        change = found[number].change + own[number].beside(surface)
        found[number] = replace(found[number], change=change, wider=wider)
    return [found[number] if isinstance(z, BodyField) else z for number, z in enumerate(adjoints)]


def _why_no_change(problem: BoundaryValueProblem) -> str:
    """Return which condition changes with the surface in a way that the density lacks; "" where none does."""
    found = [one for one in problem.conditions if shares_out(one) or isinstance(one, Foundation)]
    return f"{found[0].role} changes with the surface" if found else ""


def _adjoint(system: System, solution: Solution, own: OwnChange) -> BodyField | str:
    """Return the adjoint of a quantity, or why there is none."""
    if why := why_no_adjoint(system):
        return why
    if not np.isfinite(own.value):
        return "the quantity has no value"
    if isinstance(own.functional, Reaction):
        return _of_reaction(system, own.functional)
    if own.functional.ask.kind == "energy" and own.functional.ask.region is None and _does_no_work(system):
        return solution.field  # a(v, z) = a(u, v) for all v
    samples = own.functional.samples(solution)
    return "the quantity has no linearisation" if samples is None else adjoint(system, samples)


def _does_no_work(system: System) -> bool:
    """Return whether supports do no work: all given values are zero, and no exchange takes a part of the energy.

    An initial flux makes the energy another one than 1/2 a(u, u).
    """
    if system.problem.form.has_initial_flux:
        return False
    patches = [patch.problem for patch in system.stated]
    exchanges = any(one.factor is not None for own in patches for one in (*own.conditions, *own.faces))
    return not system.has_given_values and not exchanges


def _of_reaction(system: System, reaction: Reaction) -> BodyField | str:
    """Return the adjoint of a reaction, which is -1 on its supports along its direction, and 0 on other ones."""
    problem = system.problem
    is_elastic = any(one.role in reaction.roles and one.factor is not None for one in problem.conditions)
    if isinstance(system, MixedSystem) or is_elastic or problem.faces and not problem.dirichlet:
        return "the adjoint of this reaction is not known"
    unit = np.zeros(problem.form.components)
    unit[reaction.component] = 1.0
    layout = system.matrix.layout
    shift, right = layout.empty(len(unit)), layout.empty(len(unit))
    for number, patch in enumerate(system.patches):
        for name in patch.space.dirichlet:
            support = patch.problem.strong_on(name)
            if support is not None and (
                support.role in reaction.roles or reaction.is_on_face(patch.problem.prefix + name)
            ):
                axis, side = axis_side(name)
                layer = tuple(-side if a == axis else slice(None) for a in range(3))
                shift[number][:, *layer] = unit[:, None, None]
    for face in system.matrix.weak:
        held = np.zeros(len(face.weights), dtype=bool)
        for i, condition in enumerate(problem.conditions):
            held |= face.holds(i) & (condition.is_essential and condition.role in reaction.roles)
        own = np.zeros((len(face.patches), *right.of(face.patches).shape[1:]))
        face.add_force(unit, held, own)
        right.add(face.patches, own)
    whole = layout.joined(system.unknowns.completed(shift))
    total = system.unknowns.collect(right + system.matrix.apply(whole))
    return adjoint_of(system, total, known=-1.0 * whole)
