"""Defines SolveOptions: the discretization of a problem, and the iteration for its linear system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any, Protocol, Self

from parameterize.threads import default_threads

from .ask import Ask, asks_of
from .discretization.grading import Grading
from .field import FieldOnBody
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.coupled import demand_uncoupled

DEVICES = ("cpu", "cuda")
FORMULATIONS = ("mixed", "displacement")


class KeptSteps(Protocol):
    """Describe where load steps are kept, so that an interrupted solve goes on after the last one."""

    def save(self, arrays: Mapping[str, Any], state: Mapping[str, Any]) -> None:
        """Keep arrays and a state of plain JSON values, in the place of those before."""

    def load(self) -> tuple[Mapping[str, Any], Mapping[str, Any]] | None:
        """Return what was kept last; None for nothing."""


@dataclass(frozen=True, kw_only=True)
class IterationOptions:
    """Hold the options of the linear solver, keywords of `System.solve`; `iga_nn.solve` describes them.

    Raises ValueError where a tolerance or a number of iterations is out of range.
    """

    tolerance: float = 1e-10
    max_iterations: int = 1000
    certified: str | None = None
    device: str = "cpu"
    start: FieldOnBody | None = None
    estimate: bool | None = None
    strict: bool = False

    def __post_init__(self) -> None:
        if not (isinstance(self.tolerance, Real) and 0.0 < self.tolerance < 1.0):
            raise ValueError(f"tolerance must be a number between 0 and 1, got {self.tolerance!r:.80}")
        if not (isinstance(self.max_iterations, Integral) and self.max_iterations >= 1):
            raise ValueError(f"max_iterations must be a whole number, at least 1, got {self.max_iterations!r:.80}")

    @classmethod
    def of(cls, keywords: dict[str, Any]) -> Self:
        """Return the options of a user's keywords. Raises TypeError for a keyword that is no option."""
        known = [field.name for field in fields(cls)]
        if unknown := [name for name in keywords if name not in known]:
            raise TypeError(f"{unknown[0]}: is no option of a solve; the options are {', '.join(known)}")
        return cls(**keywords)


@dataclass(frozen=True, kw_only=True)
class SolveOptions(IterationOptions):
    """Hold all options of a solve, of its discretization too: keywords of `iga_nn.solve`, which describes them.

    Raises ValueError also where the number of threads is out of range, ExpressionError for an ask that is refused.
    """

    refine: int = 0
    degree: int | None = None
    grading: Grading | None = None
    threads: int | None = None
    quadrature: str = "spline"
    comm: Any = None
    formulation: str | None = None
    ask: tuple[Ask, ...] = ()
    load_steps: int = 10
    keep: KeptSteps | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "ask", asks_of(self.ask))
        if self.formulation not in (None, *FORMULATIONS):
            raise ValueError(f"formulation must be one of {', '.join(FORMULATIONS)}, got {self.formulation!r:.80}")
        if not (self.grading is None or isinstance(self.grading, Grading)):
            raise ValueError(f"grading must be a Grading, such as Grading.of(body), got {self.grading!r:.80}")
        if not (isinstance(self.load_steps, Integral) and self.load_steps >= 1):
            raise ValueError(f"load_steps must be a whole number, at least 1, got {self.load_steps!r:.80}")
        if self.threads is not None and self.threads < 1:
            raise ValueError(f"threads must be at least 1, got {self.threads}; leave it out for {default_threads()}")

    @property
    def thread_count(self) -> int:
        """Return the number of threads of a process.

        By default a process uses all threads of the machine, or one thread where the processes of `comm` share the
        work.
        """
        return self.threads or (default_threads() if self.comm is None else 1)


def check_device(device: str, problem: BoundaryValueProblem) -> None:
    """Raise ValueError for a device that is unknown or absent, or that cannot solve the problem."""
    if device not in DEVICES:
        raise ValueError(f"device must be one of {', '.join(DEVICES)}, got {device!r}")
    if device != "cpu":
        form = problem.form
        demand_uncoupled(problem, f"it is solved on device='cpu' only, got device={device!r}")
        if not form.symmetric or (form.components > 1 and not form.constant):
            raise ValueError(
                f"{type(form).__name__} is solved on device='cpu' only, got device={device!r}: on a GPU laws are "
                "symmetric, and those of several components constant"
            )
        from .linear.cuda import check_available  # torch comes in here only

        check_available(device)
