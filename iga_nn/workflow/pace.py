"""Measures how fast this machine is now, and holds what was measured of stages whose work is not counted otherwise.

All numbers are processor seconds of one machine, on which `work` takes REFERENCE of them; `pace` compares a machine,
as it is now and with what else runs on it, with that one. docs/benchmarks/forecasts.md has forecasts beside the times.
"""

import os
import time
from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from parameterize.threads import one_blas_thread

Clock = Callable[[], float]
REPEATS = 3
REFERENCE = 0.0134  # of `work`

END, END_VERTEX = 7.0, 4e-4  # libraries, figures, page; for each vertex of the surface
END_SOLVED, END_PATCH = 6.0, 1.5e-3  # the same of a solution; for each of several patches
LEVEL = 0.5  # of a solve
SCALAR, VECTOR = (1.5e-5, 5e-5), (6e-5, 2.2e-4)  # for each unknown, on one patch and on several
# Before the layout is known, from the fastest to the slowest of parts, smooth handles, and handles with sharp edges.
PARTS, SMOOTH, SHARP = (8.0, 100.0), (20.0, 110.0), (80.0, 480.0)


def pace(clock: Clock = time.perf_counter) -> float:
    """Return how many seconds now pass in a second of the numbers of this module.

    Of the machine that is the time of `work`, measured once; of what else runs on it the system's mean over a minute,
    if it has one: a few tenths of a second say little of the minutes to come.
    """
    if clock is not time.perf_counter or not hasattr(os, "getloadavg"):
        return fastest(work, clock) / REFERENCE
    crowd = max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
    return crowd * _of_machine() / REFERENCE


@cache
def _of_machine() -> float:
    """Return the processor seconds of `work` on this machine."""
    with one_blas_thread():  # those that wait would count, too
        return fastest(work, time.process_time)


def work() -> float:
    """Do what stages do: products of matrices, elementwise functions, sorting, and plain Python."""
    square, row, total = np.linspace(0.0, 1.0, 90_000).reshape(300, 300), np.linspace(0.0, 1.0, 50_000), 0.0
    for _ in range(2):
        square = np.sqrt(np.abs(square @ square)) / 300.0 + 1e-3
    for _ in range(5):
        total += float(np.sort(np.sin(7.0 * row))[1000])
    counts: dict[int, int] = {}
    for number in range(8_000):
        counts[number % 97] = counts.get(number % 97, 0) + number
    return total + float(square[0, 0])


def fastest(run: Callable[[], object], clock: Clock) -> float:
    """Return the seconds of the fastest run; the first run only warms up and does not count."""
    seconds = []
    for _ in range(REPEATS + 1):
        start = clock()
        run()
        seconds.append(clock() - start)
    return max(min(seconds[1:]), 1e-6)


def level_seconds(unknowns: float, components: int, patches: int) -> float:
    """Return the seconds of a solve; unknowns: of all components."""
    each = (SCALAR if components == 1 else VECTOR)[patches > 1]
    return LEVEL + each * unknowns


def end_seconds(vertices: int, patches: int, is_solved: bool) -> float:
    """Return the seconds of figures and page, of the map and, where a problem is solved, of its solution."""
    solved = END_SOLVED + END_PATCH * patches if is_solved else 0.0
    return END + END_VERTEX * vertices + solved


def unknowns_of(control_points: float, patches: int, degree: int, refine: int) -> float:
    """Return about how many unknowns a component has, those at interfaces once.

    control_points: of the map, those at interfaces for each of the patches.
    """
    spans = max(1.0, (control_points / patches) ** (1.0 / 3.0) - degree)
    shared = 1.0 if patches > 1 else 0.0  # layers of each direction that belong to a neighbour
    return patches * (spans * 2.0**refine + degree - shared) ** 3


def solve_seconds(levels: Sequence[int], control_points: float, patches: int, degree: int, components: int) -> float:
    """Return the seconds of the solves on all levels of a map."""
    counts = [components * unknowns_of(control_points, patches, degree, level) for level in levels]
    return sum(level_seconds(count, components, patches) for count in counts)
