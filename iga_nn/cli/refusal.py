"""Words the refusal of a command line: the fault and its remedy, in one line."""

import re
from dataclasses import fields
from itertools import pairwise

from cyclopts import CycloptsError, UnusedCliTokensError

from ..errors import one_line
from ..options import PROBLEMS

# A suggestion that begins with another letter than the unknown option: --force, for --source, replaces results.
_FAR_HINT = re.compile(r"(Unknown option: \W*(\w).*?) Did you mean --(?!\2).*")


def refusal(error: Exception, argv: list[str]) -> str:
    """Return the fault of a command line and its remedy, in one line."""
    if isinstance(error, UnusedCliTokensError):
        return f"unknown arguments: {' '.join(error.unused_tokens or ())}; --help lists the arguments"
    if isinstance(error, CycloptsError):
        return _FAR_HINT.sub(r"\1 --help lists the options.", one_line(error)) + _minus_hint(argv)
    return one_line(error)


def _minus_hint(argv: list[str]) -> str:
    """Return the remedy where a formula was read as an option; options of the type `Formula` take formulas."""
    formulas = {field.name for kind in PROBLEMS.values() for field in fields(kind) if "Formula" in str(field.type)}
    for option, value in pairwise(argv):
        if option.removeprefix("--").replace("-", "_") in formulas and value.startswith("-"):
            return f" A formula that starts with a minus is written {option}={value}"
    return ""
