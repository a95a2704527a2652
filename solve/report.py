"""SolveReport: the numbers of one solve."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .discretization.norms import Errors
from .estimate import Estimate

NORMS = ("l2_relative", "l2", "h1_relative", "h1_seminorm", "error_estimate_relative", "error_estimate")  # as shown


@dataclass(frozen=True)
class SolveReport:
    """One entry of `poisson.levels` in report.json.

    elements, dofs: totals; the unknowns fixed by boundary data count as dofs.
    h: longest straight edge of a mapped element, in the volume's units.
    errors: the norms, None without an exact solution; `l2_relative`, `l2`, `h1_relative` and `h1_seminorm` are its.
    estimate: of the L2 error, from the residual; where there is no exact solution, or on request.
    residual: |r| / |b| at the end; residuals: the same before the first and after every iteration.
    seconds: process CPU seconds of setup, solve and errors.
    notices: what the reader of these numbers must know, one line each.
    meaningful: False where a formula does not vary on the domain, or the mesh does not resolve the exact solution.
    """

    elements: int
    dofs: int
    h: float
    iterations: int
    converged: bool
    residual: float
    seconds: dict[str, float]
    errors: Errors | None = None
    estimate: Estimate | None = None
    notices: tuple[str, ...] = ()
    meaningful: bool = True
    residuals: tuple[float, ...] = field(default=(), repr=False)

    @property
    def l2(self) -> float | None:
        """L2 norm of the error."""
        return self.errors.l2 if self.errors else None

    @property
    def l2_relative(self) -> float | None:
        """L2 norm of the error over that of the exact solution; None where the latter is zero."""
        return self.errors.l2_relative if self.errors else None

    @property
    def h1_relative(self) -> float | None:
        """H1 seminorm of the error over that of the exact solution; None where the latter is zero or unknown."""
        return self.errors.h1_relative if self.errors else None

    @property
    def h1_seminorm(self) -> float | None:
        """L2 norm of the error's gradient; None where the exact gradient is unknown."""
        return self.errors.h1_seminorm if self.errors else None

    @property
    def error_estimate(self) -> float | None:
        """Estimated L2 norm of the error."""
        return self.estimate.l2 if self.estimate else None

    @property
    def error_estimate_relative(self) -> float | None:
        """The same over the L2 norm of the solution; None where the latter is zero."""
        return self.estimate.l2_relative if self.estimate else None

    def as_dict(self) -> dict[str, Any]:
        """The entry as report.json holds it; errors that are not known are absent."""
        names = ("elements", "dofs", "h", *NORMS, "iterations", "converged", "residual", "meaningful", "seconds")
        entry = {name: getattr(self, name) for name in names}
        return {name: value for name, value in entry.items() if value is not None}

    def __str__(self) -> str:
        names = ("relative L2", "L2", "relative H1", "H1", "estimated relative L2", "estimated L2")
        errors = [(name, getattr(self, norm)) for name, norm in zip(names, NORMS, strict=True)]
        parts = [f"{self.elements} elements", f"{self.dofs} dofs", f"h {self.h:.4g}"]
        parts += [f"{name} {value:.4e}" for name, value in errors if value is not None]
        state = "" if self.converged else f", NOT CONVERGED (residual {self.residual:.1e})"
        parts.append(f"{self.iterations} iterations{state}")
        return "\n".join([", ".join(parts), *self.notices])
