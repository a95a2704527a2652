"""SolverOptions: how a linear system is solved."""

from __future__ import annotations

from dataclasses import dataclass

from .field import SplineField
from .threads import checked_threads


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """Hold what `solve_poisson` and `solve_elasticity` are told about the linear solver; its keywords are theirs.

    Raises ValueError where a tolerance, a number of iterations or a number of threads is out of range.
    """

    tolerance: float = 1e-10
    max_iterations: int = 1000
    certified: str | None = None
    threads: int | None = None
    device: str = "cpu"
    start: SplineField | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < 1.0:
            raise ValueError(f"tolerance must lie between 0 and 1, got {self.tolerance}")
        if self.max_iterations < 1:
            raise ValueError(f"max_iterations must be at least 1, got {self.max_iterations}")
        checked_threads(self.threads)

    @property
    def thread_count(self) -> int:
        """Return the number of threads asked for, or the default number."""
        return checked_threads(self.threads)
