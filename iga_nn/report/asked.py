"""Shows the answers to asks, from report.json: each with its unit, its interval, and where the interval comes from.

Numbers have as many digits as their interval gives them, and its ends are rounded outwards.
"""

import math
from typing import Any

from . import document as reports
from .balance import unit_of
from .document import Report
from .extremes import place_of

HEAD = ("asked", "value", "between", "why")
DIGITS = 2  # of half an interval's width, which the numbers show
MOST_DIGITS = 5  # significant ones
EXACT = 1e-6  # half of an interval over its value, below which only its size is told
PLAIN = 5  # digits of a value without an interval
MOST_SHARE = 10.0  # of half an interval in its value: a larger one says nothing

Answer = dict[str, Any]


def facts(report: Report) -> list[tuple[str, str, str, list[str]]]:
    """Return for each answer the ask, its value with the unit, its interval, and remarks."""
    section = _section(report)
    return [
        (answer["ask"], _value(answer, section), _interval(answer, section), _remarks(answer, section))
        for answer in reports.asked(report)
    ]


def lines(report: Report) -> list[str]:
    """Return a line for each answer: the value with its unit, the interval, and where it comes from."""
    return [_line(*one) for one in facts(report)]


def _line(ask: str, value: str, interval: str, remarks: list[str]) -> str:
    return f"{ask} = {value}, {interval}: {'; '.join(remarks)}" if remarks else f"{ask} = {value}, {interval}"


def rows(section: dict[str, Any]) -> list[list[str]]:
    """Return a row for each answer of a section: ask, value, interval and remarks."""
    found = section.get("asked", [])
    return [
        [one["ask"], _value(one, section), _interval(one, section), "; ".join(_remarks(one, section))] for one in found
    ]


def cells(report: Report) -> dict[str, tuple[float | None, str]]:
    """Return for each ask its value, and the value with its interval as text."""
    section = _section(report)
    return {
        one["ask"]: (one["value"], f"{_value(one, section)}, {_interval(one, section)}")
        for one in reports.asked(report)
    }


def _section(report: Report) -> dict[str, Any]:
    """Return the section with the units of the answers."""
    return reports.solved(report) or report.get("modes", {})


def _value(answer: Answer, section: dict[str, Any]) -> str:
    """Return the value with its unit, and its place where that was found."""
    if answer["value"] is None or not math.isfinite(answer["value"]):
        return "–"
    digits = _decimals(answer)
    value = answer["value"]
    is_exact = digits is not None and _share(answer) < EXACT
    shown = None if digits is None or is_exact else max(digits, -_exponent(value))  # one digit at least
    text = f"{value:.{PLAIN}g}" if shown is None else _rounded(value, shown, round)
    unit = _unit(answer, section)
    return f"{text} {unit}" if unit else text


def _interval(answer: Answer, section: dict[str, Any]) -> str:
    """Return the interval with the share of its half-width in the value."""
    lower, upper = answer["lower"], answer["upper"]
    if lower is None or upper is None:
        return "no interval"
    digits, width = _decimals(answer), _share(answer)
    if digits is None or width == 0.0:
        return "exact to rounding"
    if width < EXACT:
        return f"exact to {10.0 ** math.ceil(math.log10(width)):.0e}"
    ends = _rounded(lower, digits, math.floor), _rounded(upper, digits, math.ceil)
    percent = float(f"{100.0 * width:.2g}") if width < MOST_SHARE else math.inf
    return f"between {ends[0]} and {ends[1]}" + (f" (± {percent:g} %)" if width < MOST_SHARE else "")


def _share(answer: Answer) -> float:
    """Return half of an interval over the size of its value; of zero it is infinite, or zero without a width."""
    half = 0.5 * (answer["upper"] - answer["lower"])
    return half / abs(answer["value"]) if answer["value"] else math.inf if half else 0.0


def _remarks(answer: Answer, section: dict[str, Any]) -> list[str]:
    """Return where the value was found, what it is, where its interval comes from, and the interval's parts."""
    found = [f"at {place_of(answer['at'], section)}"] if answer.get("at") else []
    found += [answer["said"]] if answer.get("said") else []
    found += [answer["why"]] if answer.get("why") else []
    parts = [f"{name} ± {size:.2g}" for name, size in (answer.get("parts") or {}).items() if size]
    return [*found, ", ".join(parts)] if len(parts) > 1 else found


def _unit(answer: Answer, section: dict[str, Any]) -> str:
    """Return the unit of a value, where it is known; "" elsewhere."""
    length, force = section.get("unit") or "", unit_of(section)
    energy = f"{force}·{length}" if force and length else ""
    units = {"length": length, "stress": section.get("stress_unit") or "", "force": force, "energy": energy}
    return units.get(answer.get("dimension", ""), "")


def _decimals(answer: Answer) -> int | None:
    """Return the digits behind the point that the interval leaves; None without an interval that has a width."""
    value, lower, upper = answer["value"], answer["lower"], answer["upper"]
    if None in (value, lower, upper) or not (width := max(upper - value, value - lower)) > 0.0:
        return None
    most = MOST_DIGITS - 1 - math.floor(math.log10(max(abs(value), width)))
    return min(DIGITS - 1 - math.floor(math.log10(width)), most)


def _rounded(value: float, decimals: int, towards: Any) -> str:
    """Return a number as text with digits behind the point; negative decimals are zeros before it."""
    scaled = towards(value * 10.0**decimals) if decimals < 300 else value * 10.0**decimals
    found = float(scaled) / 10.0**decimals
    size = _exponent(found)
    if not found:
        return "0"
    if -5 < size < 7 and decimals < 12:
        return f"{found:.{max(decimals, 0)}f}"
    return f"{found:.{max(size + decimals, 0)}e}"


def _exponent(value: float) -> int:
    """Return the power of ten of a number's first digit; 0 of zero."""
    return math.floor(math.log10(abs(value))) if value else 0
