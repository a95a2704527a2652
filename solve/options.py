"""What a solve may be told: how the trial space is made, and how the linear system is solved."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from parameterize.threads import default_threads

from .field import SplineField


@dataclass(frozen=True, kw_only=True)
class SpaceOptions:
    """Hold what `discretize` is told; its fields are its keywords.

    refine: how often every span of the map's knots is halved for the trial space; degree: default the map's own.
    threads: default NUMBA_NUM_THREADS, OMP_NUM_THREADS or the cores at hand; the result is the same for any number.
    comm: a communicator of mpi4py whose processes share the work, a thread each by default (docs/mpi.md).
    quadrature: of the operator: "spline", Gauss rules of the spline space, as many points as the map and the law need;
        "gauss", `degree` Gauss points a span; "gauss+1", one more. Errors have degree + 2 points a span in any case.

    Raises ValueError for a `refine` or a degree that is no whole number, and for fewer threads than one.
    """

    refine: int = 0
    degree: int | None = None
    threads: int | None = None
    quadrature: str = "spline"
    comm: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.refine, int | np.integer):
            raise ValueError(f"refine must be a whole number, 0 or more, got {self.refine!r:.80}")
        if self.degree is not None and not isinstance(self.degree, int | np.integer):
            raise ValueError(f"degree must be a whole number, 1 or more, got {self.degree!r:.80}")
        if self.threads is not None and self.threads < 1:
            default = default_threads()
            raise ValueError(f"threads must be at least 1, got {self.threads}; leave it out for {default}")


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """Hold what `System.solve` is told; its fields are its keywords.

    tolerance: of |r| / |b| for the linear solver.
    certified: the verdict of the map's certificate, if known; anything but "certified" is logged and noted.
    device: "cpu", or "cuda" for the iteration on a GPU by torch (Poisson's problem, not with Robin faces).
    start: a solution in a space that this one contains, as that of one refinement less: the iteration starts there
        instead of at zero, and saves a third on maps that take many.
    estimate: the error, from the residual; default: where the problem has no exact solution.
    strict: raise ConvergenceError where the linear solver fails; otherwise the report says `converged` is False.

    Raises ValueError where a tolerance or a number of iterations is out of range.
    """

    tolerance: float = 1e-10
    max_iterations: int = 1000
    certified: str | None = None
    device: str = "cpu"
    start: SplineField | None = None
    estimate: bool | None = None
    strict: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"tolerance must lie between 0 and 1, got {self.tolerance}")
        if self.max_iterations < 1:
            raise ValueError(f"max_iterations must be at least 1, got {self.max_iterations}")
