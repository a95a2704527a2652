"""Forecasts the memory of a solve from counts, and says what helps where that much is not free."""

import logging
import math
import platform
from dataclasses import dataclass
from typing import Any

import numpy as np

from parameterize.spline.volume import BSplineVolume
from solve.discretization.errors import POINTS
from solve.discretization.planes import rule_of
from solve.discretization.space import trial_space

from ..options import Equation, ProblemOptions
from .cost_estimate import available_memory_mb

log = logging.getLogger(__name__)

# Counted in numbers of 8 bytes; tests compare them with what a solve takes.
SYMMETRIC, OTHER = 25, 85  # an unknown: vectors of conjugate gradients or GMRES, preconditioner, norms
BLOCK, CONSTANT = 6, 9  # a quadrature point: a tensor, kept or for a moment; the geometry of a constant law
PLANES = 30  # arrays of a plane of points, where the error is measured
EVERYWHERE = 3  # an unknown: the solution, whole on every process


@dataclass(frozen=True)
class SolveMemory:
    """Hold what a solve takes beside the program: megabytes that processes share, and those that each of them takes."""

    shared_mb: float
    each_mb: float

    def on(self, processes: int) -> float:
        """Return the megabytes of each of some processes."""
        return self.shared_mb / processes + self.each_mb


def solve_memory(volume: BSplineVolume, equation: Equation, options: ProblemOptions) -> SolveMemory:
    """Return the forecast for the finest level."""
    form, space = equation.form, trial_space(volume, max(options.refine), options.degree)
    rule = rule_of(volume, space, equation.on(volume).form.tensor, options.quadrature)
    points = float(np.prod(rule.shape, dtype=float))
    unknowns = float(form.components * space.dofs)
    kept = CONSTANT * form.constant + BLOCK + form.has_reaction
    (_, *degrees), (_, *functions) = space.degrees, space.shape
    plane = min(POINTS, math.prod((p + 2) * n for p, n in zip(degrees, functions, strict=True)))
    shared = points * kept + unknowns * (SYMMETRIC if form.symmetric else OTHER)
    each = plane * PLANES + EVERYWHERE * unknowns + volume.control_points.size
    return SolveMemory(8e-6 * shared, 8e-6 * each)


def tell_memory(volume: BSplineVolume, equation: Equation, options: ProblemOptions, comm: Any = None) -> None:
    """Log what the finest level will take, warn where that is not free, and say how many processes could solve it."""
    processes, here = 1, 1
    if comm is not None:
        processes, here = comm.size, comm.allgather(platform.node()).count(platform.node())
    wanted, free = solve_memory(volume, equation, options), available_memory_mb(here)
    needed = wanted.on(processes)
    log.info("estimate: %.2f GB of memory%s", needed / 1000.0, f" on each of {processes} processes" * (processes > 1))
    if free is None or needed <= free:
        return
    spans = len(trial_space(volume, max(options.refine), options.degree).breaks[0]) - 1
    enough = next((count for count in range(processes + 1, spans + 1) if wanted.on(count) <= free), None)
    more = f", or take {enough} processes with as much memory each: mpiexec -n {enough} iga-nn solve .. --mpi"
    log.warning(
        "%.2f GB of memory are needed, %.2f GB are free: lower --refine%s",
        needed / 1000.0,
        free / 1000.0,
        more if enough else "",
    )
