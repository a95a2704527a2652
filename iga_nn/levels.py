"""Names the numbers of a level, which is one solve on one mesh, and writes them as text."""

from __future__ import annotations

TITLES = {  # keys of report.json and study.csv, in the order they are shown
    "degree": "degree",
    "elements": "elements",
    "dofs": "unknowns",
    "h": "h",
    "l2_relative": "relative L2 error",
    "l2": "L2 error",
    "rate_l2": "rate",
    "h1_relative": "relative H1 error",
    "h1_seminorm": "H1 error",
    "rate_h1": "rate",
    "error_estimate_relative": "estimated relative L2 error",
    "error_estimate": "estimated L2 error",
    "iterations": "iterations",
}
ESTIMATES = tuple(key for key in TITLES if key.startswith("error_estimate"))
EXACT_ERRORS = tuple(key for key in TITLES if key.startswith(("l2", "h1")))  # known with an exact solution


def capitalized(title: str) -> str:
    """Return the title with a capital letter first; the others stay."""
    return title[0].upper() + title[1:]


def number(key: str, value: float | None) -> str:
    """Return the number of that key as text, a dash where it is not known."""
    if value is None:
        return "–"
    if isinstance(value, int):
        return f"{value:,}"
    if key == "h":
        return f"{value:.4g}"
    return f"{value:.2f}" if key.startswith("rate") else f"{value:.3e}"
