"""Estimates the time and the memory of a run, and the memory of a solve, before it starts.

The way that a map will take counts its work in pieces, see parameterize/ways/cost.py: passes and products, whose time
is measured on all threads, and seconds by the pace of this machine. The cost of a solve follows from counts alone.
"""

from __future__ import annotations

import logging
import math
import platform
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from parameterize.checkpoint import Checkpoints
from parameterize.config import Config, SplineConfig
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.surface import Surface
from parameterize.ways.sharp import has_long_edges
from solve.discretization.error_norms import POINTS
from solve.discretization.roughness import rule_of
from solve.discretization.space import Places, trial_space
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.options import SolveOptions

from ..figures.fields import problems_on
from ..rounding import rounded
from .pace import PARTS, SHARP, SMOOTH, Clock, end_seconds, fastest, pace, solve_seconds

log = logging.getLogger(__name__)

PASS_POINTS = 4096  # that a pass is timed with, on all threads
LARGEST = 30  # control points per direction that the product is timed with; beyond, it grows with their number

CALLS = 0.12  # passes: least cost of a product
PASS = 0.0103  # seconds of a pass on the CPU at pace 1

# Megabytes
LIBRARIES, FIGURES, PER_CONTROL_POINT, PER_VERTEX, PER_UNKNOWN = 560.0, 400.0, 8e-3, 16e-3, 1.6e-3

# Of a solve, counted in numbers of 8 bytes; tests compare them with the memory of real solves.
SYMMETRIC, OTHER = 25, 85  # an unknown: vectors of conjugate gradients or GMRES, preconditioner, norms
BLOCK, CONSTANT = 6, 9  # a quadrature point: a tensor, kept or for a moment; the geometry of a constant law
TANGENTS = 2  # at a quadrature point of a law that is not linear: derivatives of u and its gradient, now and at rest
PLANES = 30  # arrays of a plane of points, where the error is measured
EVERYWHERE = 3  # an unknown: the solution, whole on every process


@dataclass(frozen=True)
class Forecast:
    """Hold the cost of one start, the section `estimate` of report.json.

    seconds: from here to the end of the run, for an easy and for a hard surface, None if the work of the way is not
    known. memory_mb: the peak of the resident memory. way: the name of the way, "" if none suits. pace: the seconds
    that now pass in one of those that stages were measured in. before: the same seconds from before the layout,
    which is known by now; None where none is laid.
    """

    seconds: tuple[float, float] | None
    memory_mb: float
    way: str = ""
    pace: float = 1.0
    before: tuple[float, float] | None = None

    def __str__(self) -> str:
        if self.seconds is None:
            way = f"the way: {self.way}" if self.way else "this body"
            return f"no forecast of the time for {way}, {rounded(self.memory_mb / 1000.0, 1)} GB of memory"
        return f"about {span_in_words(*self.seconds)}, {rounded(self.memory_mb / 1000.0, 1)} GB of memory"


def span_in_words(low: float, high: float) -> str:
    """Return two numbers of seconds in words, such as "12 to 89 seconds" or "2 minutes"."""
    unit, size = ("minute", 60.0) if high >= 90.0 else ("second", 1.0)
    first, last = max(1, round(low / size)), max(1, round(high / size))
    return f"{first} to {last} {unit}s" if first < last else f"{last} {unit}{'s' * (last > 1)}"


def before_layout(surface: Surface, now: float) -> tuple[float, float] | None:
    """Return the seconds of a run before the blocks of its body are known; None for one cube, whose work is counted.

    now: the pace of the machine.
    """
    if surface.brep or not surface.is_plain:
        kind = PARTS
    elif surface.genus:
        kind = SHARP if has_long_edges(surface) else SMOOTH
    else:
        return None
    return now * kind[0], now * kind[1]


def forecast(
    surface: Surface,
    config: Config,
    *,
    device: str,
    unknowns: int = 0,
    levels: Sequence[int] = (),
    components: int = 1,
    corners: Sequence[int] | None = None,
    checkpoints: Checkpoints | None = None,
    clock: Clock = time.perf_counter,
) -> Forecast:
    """Return the estimate for this machine under its present load, by the first way that the map will take.

    unknowns: the number of unknowns of the largest problem that is solved afterwards, for its memory. levels,
    components: of this problem, for its time. corners: the vertices (8,) that
    the user gives. checkpoints: of a run that resumes, whose way is known. A second way, if the first map is not
    certified, takes the same time again.
    """
    from parameterize.ways.mapping_task import MappingTask
    from parameterize.ways.network import NETWORK
    from parameterize.ways.strategy import WAYS, cost_of_first, ways_of

    vertices, given = len(surface.vertices), None if corners is None else np.array(corners)
    kept = checkpoints or Checkpoints.none()
    task = MappingTask(surface, config, 0, device, "float32", given, {}, {}, kept)
    way, cost = cost_of_first(task, ways_of(config.ways) or WAYS)
    points = config.spline.control_points**3 if cost is None else cost.control_points
    mapped = PER_CONTROL_POINT * points + PER_VERTEX * vertices
    memory = LIBRARIES + FIGURES + max(cost.memory_mb if cost else 0.0, mapped, PER_UNKNOWN * unknowns)
    if cost is None:
        return Forecast(None, memory, way)
    now, degree = pace(clock), config.spline.degree
    low, high = (now * seconds for seconds in cost.seconds)
    if any(cost.passes) or any(cost.products):
        one_pass = PASS * now if device == "cpu" or way != NETWORK.name else _pass_seconds(config, device, clock)
        product = _product_seconds(config.spline, clock) + CALLS * one_pass
        pairs = zip(cost.passes, cost.products, strict=True)
        more = [passes * one_pass + products * product for passes, products in pairs]
        low, high = low + min(more), high + max(more)
    last = end_seconds(vertices, cost.patches, bool(levels))
    last += solve_seconds(levels, cost.control_points, cost.patches, degree, components)
    return Forecast((low + now * last, high + now * last), memory, way, now)


def _pass_seconds(config: Config, device: str, clock: Clock) -> float:
    """Return the seconds of a pass of the network on a GPU."""
    from parameterize.training.network import a_pass  # it loads torch, which takes a second

    return fastest(a_pass(config.network, device, PASS_POINTS), clock) * 1000.0 / PASS_POINTS


def _product_seconds(spline: SplineConfig, clock: Clock) -> float:
    from parameterize.optimization.distortion import BlockDistortion
    from parameterize.spline.bspline import greville, open_uniform_knots

    count = min(spline.control_points, LARGEST)
    knots = open_uniform_knots(count, spline.degree)
    rows = greville(knots, spline.degree)
    control = np.stack(np.meshgrid(rows, rows, rows, indexing="ij"))
    product = BlockDistortion((knots, knots, knots), spline.degree).curvature(control)
    single = control.astype(np.float32)
    seconds = fastest(lambda: float(product(single).sum()), clock)
    return seconds * (spline.control_points / count) ** 3


def available_memory_mb(processes: int = 1) -> float | None:
    """Return the megabytes of memory that each process can still use; None where the system does not say.

    This is the machine's free memory, within the limit on this process's address space (`ulimit -v`), shared by
    `processes` processes.
    """
    try:
        lines = Path("/proc/meminfo").read_text(encoding="utf-8").splitlines()
        pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[0])
    except OSError:
        return None
    import resource  # where there is /proc there is this module

    found = [int(line.split()[1]) / 1000.0 / processes for line in lines if line.startswith("MemAvailable:")]
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        found.append(max(0.0, (limit - pages * resource.getpagesize()) / 1e6))
    return min(found, default=None)


def warn_of_memory(wanted_mb: float, what: str, remedy: str) -> None:
    """Warn where `wanted_mb` megabytes of memory are not free.

    what: the purpose of the memory, in words. remedy: the remedy, in words.
    """
    free = available_memory_mb()
    if free is not None and wanted_mb > free:
        log.warning("%s, %s GB are free: %s", what, rounded(free / 1000.0, 1), remedy)


@dataclass(frozen=True)
class SolveMemory:
    """Hold the memory of a solve without the program itself, in megabytes: all processes together, and each process."""

    shared_mb: float
    each_mb: float

    def on(self, processes: int) -> float:
        """Return the megabytes of each process, for a number of processes."""
        return self.shared_mb / processes + self.each_mb


def solve_memory(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions) -> SolveMemory:
    """Return the forecast for one solve: the sum over the patches of a body."""
    parts, grading = zip(as_body(body), problems_on(problem, body), strict=True), options.grading
    found = [
        _patch_memory(patch, own, options, None if grading is None else grading.places(number))
        for number, (patch, own) in enumerate(parts)
    ]
    return SolveMemory(sum(one.shared_mb for one in found), sum(one.each_mb for one in found))


def _patch_memory(
    volume: BSplineVolume, problem: BoundaryValueProblem, options: SolveOptions, places: Places | None
) -> SolveMemory:
    form, space = problem.form, trial_space(volume, options.refine, options.degree, places=places)
    rule = rule_of(volume, space, problem.form.tensor, options.quadrature)
    points = float(np.prod(rule.shape, dtype=float))
    unknowns = float(form.components * space.dofs)
    kept = CONSTANT * form.constant + BLOCK + form.has_reaction
    kept += 0 if form.linear else TANGENTS * (4 * form.components) ** 2 + 2 * form.history
    (_, *degrees), (_, *functions) = space.degrees, space.shape
    plane = min(POINTS, math.prod((p + 2) * n for p, n in zip(degrees, functions, strict=True)))
    shared = points * kept + unknowns * (SYMMETRIC if form.symmetric else OTHER)
    each = plane * PLANES + EVERYWHERE * unknowns + volume.control_points.size
    return SolveMemory(8e-6 * shared, 8e-6 * each)


def tell_memory(body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions) -> None:
    """Log the memory of a solve.

    Where it is not free, warn, and name the number of processes that could solve the problem.
    """
    processes, here = 1, 1
    if options.comm is not None:
        names = options.comm.allgather(platform.node())
        processes, here = len(names), names.count(platform.node())
    wanted, free = solve_memory(body, problem, options), available_memory_mb(here)
    needed = wanted.on(processes)
    each = f" on each of {processes} processes" * (processes > 1)
    log.info("estimate: %s GB of memory%s", rounded(needed / 1000.0, 1), each)
    if free is None or needed <= free:
        return
    spans = len(trial_space(as_body(body).patches[0], options.refine, options.degree).breaks[0]) - 1
    most = spans if as_body(body).is_single else len(as_body(body))
    enough = next((count for count in range(processes + 1, most + 1) if wanted.on(count) <= free), None)
    more = f", or take {enough} processes with as much memory each: mpiexec -n {enough} iga-nn solve .. --mpi"
    log.warning(
        "%s GB of memory are needed, %s GB are free: lower --refine%s",
        rounded(needed / 1000.0, 2),
        rounded(free / 1000.0, 2),
        more if enough else "",
    )
