"""Rows of tables of asked quantities: interval and true value, what lies inside, and how wide the intervals are."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from solve import Solution

ROUNDING = 1e-8  # of the true value: linear solvers and the formulas' integrals leave less
WIDE = 3.0  # times the error: an interval is to be at most so wide

HEAD = (
    "case", "quantity", "degree, level", "unknowns", "value", "true value", "lower", "upper", "half-width / error",
    "inside",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """An asked quantity of a solve beside its true value; lower and upper are None where nothing is estimated."""

    case: str
    quantity: str
    mesh: str
    unknowns: int
    value: float
    truth: float
    lower: float | None
    upper: float | None

    @property
    def is_exact(self) -> bool:
        """Return whether the value is right to rounding, so that it has no error to compare with."""
        return abs(self.value - self.truth) <= ROUNDING * abs(self.truth)

    @property
    def is_inside(self) -> bool:
        """Return whether the true value lies inside of the interval, to rounding."""
        if self.lower is None or self.upper is None:
            return False
        slack = ROUNDING * abs(self.truth)
        return self.lower - slack <= self.truth <= self.upper + slack

    @property
    def ratio(self) -> float | None:
        """Return half the interval's width over the error; None where there is no error or no interval."""
        if self.lower is None or self.upper is None or self.is_exact:
            return None
        return 0.5 * (self.upper - self.lower) / abs(self.value - self.truth)

    def cells(self) -> list[str]:
        """Return the cells of the table."""
        numbers = [
            "" if number is None else f"{number:.6g}" for number in (self.value, self.truth, self.lower, self.upper)
        ]
        ratio = "exact" if self.is_exact else "" if self.ratio is None else f"{self.ratio:.2f}"
        said = "yes" if self.is_inside else "not estimated" if self.lower is None else "**no**"
        return [self.case, self.quantity, self.mesh, f"{self.unknowns:,}", *numbers, ratio, said]


def rows_of(case: str, mesh: str, solution: Solution, truths: Sequence[float]) -> list[Row]:
    """Return the rows of the answers of a solve. truths: one an answer."""
    pairs = zip(solution.answers, truths, strict=True)
    return [
        Row(case, one.ask, mesh, solution.report.dofs, one.value, truth, one.lower, one.upper) for one, truth in pairs
    ]


def summary(rows: Iterable[Row]) -> str:
    """Return how many true values lie inside, and how wide the intervals are."""
    every = list(rows)
    inside, ratios = [row for row in every if row.is_inside], [row.ratio for row in every if row.ratio is not None]
    exact = sum(row.is_exact for row in every)
    text = f"The true value lies inside of the interval on {len(inside)} of {len(every)} quantities."
    if ratios:
        narrow = sum(ratio <= WIDE for ratio in ratios)
        text += (
            f" Half of the interval's width over the error: median {median(ratios):.2f}, largest {max(ratios):.3g}, at "
            f"most {WIDE:g} on {narrow} of {len(ratios)}; {exact} values are right to rounding."
        )
    return text
