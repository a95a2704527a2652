"""SolverOptions: how a linear system is solved."""

from __future__ import annotations

from dataclasses import dataclass

from .field import SplineField


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """Hold what `solve_problem` and `System.solve` are told; its fields are their keywords.

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
