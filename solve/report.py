"""SolveReport: the numbers of one solve."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from .discretization.norms import Errors
from .estimate import Estimate

NORMS = ("l2_relative", "l2", "h1_relative", "h1_seminorm", "error_estimate_relative", "error_estimate")  # as shown


def _known(part: str, norm: str) -> property:
    """Return a property: a norm of a report's errors or estimate, None where it is unknown."""
    return property(lambda report: getattr(getattr(report, part), norm, None))


@dataclass(frozen=True)
class SolveReport:
    """One entry of `poisson.levels` in report.json.

    elements, dofs: totals; the unknowns fixed by boundary data count as dofs.
    h: longest straight edge of a mapped element, in the volume's units.
    errors: the norms, None without an exact solution; `l2_relative`, `l2`, `h1_relative` and `h1_seminorm` are its.
    estimate: of the L2 error, from the residual, where there is no exact solution, or on request; `error_estimate` and
        `error_estimate_relative` are its.
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

    l2 = _known("errors", "l2")
    l2_relative = _known("errors", "l2_relative")
    h1_relative = _known("errors", "h1_relative")
    h1_seminorm = _known("errors", "h1_seminorm")
    error_estimate = _known("estimate", "l2")
    error_estimate_relative = _known("estimate", "l2_relative")

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
