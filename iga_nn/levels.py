"""The numbers of a level, one solve on one mesh: their keys in report.json and study.csv, and what they are called."""

TITLES = {  # in the order they are shown
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
