"""Defines Answer: the value of an asked quantity with the interval in which the true value lies."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from parameterize.arrays import in_brackets

Dimension = Literal["length", "stress", "force", "energy", "frequency", ""]

NOT_ESTIMATED = "not estimated"


@dataclass(frozen=True)
class Answer:
    """Hold the answer to an ask.

    Attributes
    ----------
    ask : str
        The text of the ask.
    value : float
        The quantity of the discrete solution.
    lower, upper : float or None
        Ends of the interval in which the true value is expected; None where it is not estimated.
    why : str
        Where the interval comes from, or why there is none.
    parts : dict of str to float
        Half-widths of the interval by their source, such as "discretization", "geometry" and "iteration".
    at : three float, optional
        The point at which a largest or smallest value was found.
    said : str
        What a reader should know of the quantity, such as its definition; "" for nothing.
    dimension : str
        "length", "stress", "force", "energy" or "frequency", for its unit; "" where it is unknown.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z"), ask="u at (0.5, 0.5, 0.5)")
    >>> (answer,) = solution.answers
    >>> 0.12 < answer.value < 0.13
    True
    """

    ask: str
    value: float
    lower: float | None = None
    upper: float | None = None
    why: str = NOT_ESTIMATED
    parts: Mapping[str, float] = field(default_factory=dict)
    at: tuple[float, float, float] | None = None
    said: str = ""
    dimension: Dimension = ""

    def __post_init__(self) -> None:
        assert (self.lower is None) == (self.upper is None)
        assert self.lower is None or self.upper is None or self.lower <= self.value <= self.upper

    @property
    def width(self) -> float | None:
        """Return half of the interval's width over the size of the value; None without an interval.

        Of a value of zero it is infinite, or zero for an interval without a width.
        """
        if self.lower is None or self.upper is None:
            return None
        half = 0.5 * (self.upper - self.lower)
        return half / abs(self.value) if self.value else float("inf") if half else 0.0

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of report.json; what is unknown or empty is absent, but for the interval's ends."""
        found: dict[str, Any] = {name: getattr(self, name) for name in ("ask", "value", "lower", "upper", "why")}
        rest = {"parts": dict(self.parts), "at": self.at, "said": self.said, "dimension": self.dimension}
        return found | {name: value for name, value in rest.items() if value}

    def __str__(self) -> str:
        place = f" at {in_brackets(self.at)}" if self.at else ""
        rest = f", {self.said}" if self.said else ""
        if self.lower is None or self.upper is None:
            return f"{self.ask} = {self.value:.6g}{place}{rest}; interval: {self.why}"
        return f"{self.ask} = {self.value:.6g}{place}, between {self.lower:.6g} and {self.upper:.6g}: {self.why}{rest}"
