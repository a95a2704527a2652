"""Makes convergence studies: one fixed map, refined exactly, and the observed rates."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from parameterize.display import Shown
from parameterize.old_names import takes_volume
from parameterize.spline.body import BodyLike
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume

from .forms.boundary_value_problem import BoundaryValueProblem
from .options import SolveOptions
from .solution import SolveReport
from .solver import solve_with


@dataclass(frozen=True)
class ConvergenceRow:
    """Hold one level of a study, which is printed as one line.

    Attributes
    ----------
    report : SolveReport
    rate_l2, rate_h1 : float or None
        Observed orders from the level before; None for the first level, or without errors.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> first, second = iga_nn.convergence(benchmark_volume(2), iga_nn.Poisson(), refine=range(2))
    >>> first.rate_l2, second.rate_l2 > 3
    (None, True)
    """

    report: SolveReport
    rate_l2: float | None
    rate_h1: float | None

    def __str__(self) -> str:
        rates = [f"{name} rate {r:.2f}" for name, r in (("L2", self.rate_l2), ("H1", self.rate_h1)) if r is not None]
        return ", ".join([str(self.report), *rates])


class Convergence(list[ConvergenceRow], Shown):
    """Hold the levels of a study in the order of their solves: a list of rows, printed as one line a level.

    Examples
    --------
    >>> from solve import Poisson, benchmark_volume, convergence
    >>> study = convergence(benchmark_volume(2), Poisson(exact="x*y*z"), refine=range(2))
    >>> len(study), [row.report.dofs for row in study]
    (2, [125, 343])
    """

    def __str__(self) -> str:
        return "\n".join(map(str, self))


@takes_volume
def convergence(
    body: BodyLike,
    problem: BoundaryValueProblem,
    refine: Iterable[int] = range(3),
    degree: int | None = None,
    *,
    certified: str | None = None,
    tolerance: float = 1e-13,
) -> Convergence:
    """Solve on each refinement level of one map; for smooth solutions the L2 rate tends to degree + 1.

    Parameters
    ----------
    body, problem, degree, certified
        As in `iga_nn.solve`; the errors are the same, too.
    refine : iterable of int
        Levels; level n halves every span n times.
    tolerance : float
        Tolerance of the linear solver; degree 5 needs a smaller one than the default of a solve to show its rate.

    Returns
    -------
    Convergence
        A list of ConvergenceRow, one a level.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> rows = iga_nn.convergence(benchmark_volume(2), iga_nn.Poisson(exact="exp(X+Z)*sin(Y)"), refine=range(3))
    >>> [row.report.dofs for row in rows], round(rows[-1].rate_l2)
    ([125, 343, 1331], 4)
    """
    levels = list(refine) if isinstance(refine, Iterable) else []
    if not levels:
        raise ValueError(f"refine must be levels such as range(3), got {refine!r:.80}")
    options = SolveOptions(degree=degree, certified=certified, tolerance=tolerance)
    return with_rates([solve_with(body, problem, replace(options, refine=level)).report for level in levels])


def with_rates(reports: Sequence[SolveReport]) -> Convergence:
    """Return the rows of some solves, coarsest first, with the observed orders between neighbours."""
    found = rates(reports)
    l2, h1 = ([None, *found.get(name, [None] * len(reports))] for name in ("l2", "h1"))
    return Convergence(ConvergenceRow(report, l2[i], h1[i]) for i, report in enumerate(reports))


def rates(reports: Sequence[SolveReport]) -> dict[str, list[float | None]]:
    """Return the observed orders between neighbouring levels: {"l2": [...], "h1": [...]}.

    A key is absent where its error is unknown. The mesh size is that of the parametric mesh (elements^(-1/3)), so
    halving spans counts as exactly one half. An order is None between equal meshes, and next to an error of zero.
    """
    found: dict[str, list[float | None]] = {}
    for key, name in (("l2", "l2"), ("h1", "h1_seminorm")):
        errors = [getattr(report, name) for report in reports]
        if None not in errors:
            sizes = [report.elements ** (1.0 / 3.0) for report in reports]
            found[key] = [_rate(errors[i : i + 2], sizes[i : i + 2]) for i in range(len(reports) - 1)]
    return found


def _rate(errors: list[float], sizes: list[float]) -> float | None:
    if min(errors) == 0.0 or sizes[0] == sizes[1]:
        return None
    return math.log(errors[0] / errors[1]) / math.log(sizes[1] / sizes[0])


def benchmark_volume(n: int, degree: int = 3, amplitude: float = 0.08) -> BSplineVolume:
    """Return the map on which solvers are compared: a twisted unit cube with n elements a direction.

    It has control points P = g + amplitude (sin pi(g_y + g_z), sin pi(g_x + g_z), sin pi(g_x + g_y)) at the Greville
    points g. Different n give different maps: for rates refine one map. The map folds at amplitude 0.20.
    """
    points = greville(open_uniform_knots(n + degree, degree), degree)
    g = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)  # (n + degree, ..., 3)
    twist = np.sin(np.pi * (g.sum(axis=-1, keepdims=True) - g))
    return BSplineVolume.uniform(g + amplitude * twist, degree)
