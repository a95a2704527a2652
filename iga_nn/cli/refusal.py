"""Words the refusal of a command line: the fault and its remedy, in one line."""

import re
from dataclasses import fields
from itertools import pairwise
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

from cyclopts import CoercionError, CycloptsError, UnusedCliTokensError

from ..errors import one_line
from ..options import PROBLEMS

_KINDS = {int: "a whole number", float: "a number"}
# A suggestion that begins with another letter than the unknown option: --force, for --source, replaces results.
_FAR_HINT = re.compile(r"(Unknown option: \W*(\w).*?) Did you mean --(?!\2).*")


def refusal(error: Exception, argv: list[str]) -> str:
    """Return the fault of a command line and its remedy, in one line."""
    if isinstance(error, UnusedCliTokensError):
        return f"unknown arguments: {' '.join(error.unused_tokens or ())}; --help lists the arguments"
    if isinstance(error, CoercionError) and error.token and (expected := _in_words(error.target_type)):
        return f"{error.token.keyword}: must be {expected}, got {error.token.value}"
    if isinstance(error, CycloptsError):
        return _FAR_HINT.sub(r"\1 --help lists the options.", one_line(error)) + _minus_hint(argv)
    return one_line(error)


def _in_words(kind: Any) -> str:
    """Return the values of a type of numbers, or of numbers and words, as a text; "" for other types."""
    kinds = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
    words = [word for one in kinds if get_origin(one) is Literal for word in get_args(one)]
    numbers = [_KINDS[one] for one in kinds if one in _KINDS]
    known = len(numbers) + sum(get_origin(one) is Literal for one in kinds) + (NoneType in kinds) == len(kinds)
    return " or ".join([*numbers, *words]) if numbers and known else ""


def _minus_hint(argv: list[str]) -> str:
    """Return the remedy where a formula was read as an option; options of the type `Formula` take formulas."""
    formulas = {field.name for kind in PROBLEMS.values() for field in fields(kind) if "Formula" in str(field.type)}
    for option, value in pairwise(argv):
        if option.removeprefix("--").replace("-", "_") in formulas and value.startswith("-"):
            return f" A formula that starts with a minus is written {option}={value}"
    return ""
