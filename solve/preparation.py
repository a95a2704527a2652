"""Prepares a solve: checks body and problem, builds the trial space of each patch, and assembles the linear system."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from parameterize.arrays import listed
from parameterize.compilation import compilation_told
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume

from .discretization.slab import shared_space
from .discretization.space import TrialSpace, trial_space
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.elasticity import Elasticity
from .forms.poisson import Poisson
from .forms.rigid import demand_known_motions
from .mixed import build_mixed, is_mixed
from .options import SolveOptions
from .patch_system import PatchProblem
from .system import System, build


def discretized(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions, is_loose: bool = False) -> System:
    """Return the system of `discretize`; that of a loose body, for its modes, needs no supports."""
    glued = as_body(body)
    placed, patches = prepared(glued, problem, options)
    if not is_loose:
        problem.demand_held()
        if is_mixed(problem, patches, options):
            return build_mixed(glued, placed, patches, options)
    return build(glued, placed, patches, options, is_loose=is_loose)


def prepared(
    body: Body, problem: BoundaryValueProblem, options: SolveOptions
) -> tuple[BoundaryValueProblem, list[PatchProblem]]:
    """Check body and problem; return the problem placed in the body, and the problem on each patch."""
    placed, patches = on_patches(body, problem, options)
    demand_known_motions(problem)
    if all(any(part.stop <= part.start for part in patch.space.free) for patch in patches):
        raise ValueError(
            f"degree {patches[0].space.degrees} leaves no unknown inside the volume: raise refine or degree"
        )
    for of_map in {patch.volume.degrees for patch in patches}:
        _warm_up(of_map, options.degree, placed.form.components == 1 and placed.form.symmetric)
    return placed, patches


def on_patches(
    body: Body, problem: BoundaryValueProblem, options: SolveOptions
) -> tuple[BoundaryValueProblem, list[PatchProblem]]:
    """Return the problem placed in the body, and the problem on each patch."""
    if not isinstance(problem, BoundaryValueProblem):
        raise TypeError(f"problem must be a Poisson, an Elasticity or a Problem, got {type(problem).__name__}")
    _demand_known_faces(body, problem)
    placed, spaces = problem.on(body), dict[Any, TrialSpace]()
    patches, grading = [], options.grading
    if grading is not None:
        grading.check(body)
    for number, (volume, own, outer) in enumerate(zip(body, placed.on_patches(body), body.outer, strict=True)):
        places = None if grading is None else grading.places(number)
        key = volume.degrees, *(row.tobytes() for row in volume.knots), own.dirichlet, outer, places
        if key not in spaces:
            spaces[key] = trial_space(volume, options.refine, options.degree, own.dirichlet, outer, places)
        patches.append(PatchProblem(volume, own, spaces[key]))
    if body.is_single:
        patches = [replace(patches[0], space=shared_space(patches[0].space, options.comm))]
    return placed, patches


def _demand_known_faces(body: Body, problem: BoundaryValueProblem) -> None:
    """Raise ValueError for data of faces that are not outer faces of the body."""
    outer = {body.face_name(*face) for face in body.outer_faces}
    if unknown := sorted(problem.patch_faces - outer):
        faces = "u0 to w1" if body.is_single else listed(sorted(outer), 12)
        raise ValueError(f"{unknown[0]} is no outer face of the body; its faces are {faces}")


@functools.cache
def _warm_up(degrees: tuple[int, int, int], degree: int | None, is_scalar: bool) -> None:
    """Compile the kernels, or load them from the cache, so that the seconds of no level include the compilation."""
    # A large block freed teaches glibc (mallopt(3), M_MMAP_THRESHOLD) to keep freed memory. Else every temporary of a
    # plane goes back to the system and is faulted in again: formulas take five times as long.
    np.empty(2**21)
    knots = [open_uniform_knots(p + 1, p) for p in degrees]
    rows = [greville(row, p) for row, p in zip(knots, degrees, strict=True)]
    cube = as_body(BSplineVolume(degrees, tuple(knots), np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)))  # type: ignore[arg-type]
    problem = Poisson(exact="sin(x)") if is_scalar else Elasticity(exact=("sin(x)", "y", "z"))
    with compilation_told():
        options = SolveOptions(refine=1, degree=degree, threads=1)
        build(cube, *on_patches(cube, problem, options), options).solve()
