"""Checks the values of a dataclass against its annotations, for calls from Python; the command line converts texts."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cache
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from .errors import InputError

_KINDS: dict[Any, tuple[tuple[type, ...], str]] = {
    int: ((Integral,), "a whole number"),
    float: ((Real,), "a number"),
    bool: ((bool,), "True or False"),
    str: ((str,), "a string"),
    Path: ((str, Path), "a path"),
    Callable: ((Callable,), "a function"),  # type: ignore[dict-item]
    NoneType: ((NoneType,), "None"),
}


@dataclass(frozen=True)
class Checked:
    """Provide a base of dataclasses that refuse, with an InputError, a value of another type than its annotation."""

    def __post_init__(self) -> None:
        """Refuse the first field whose value has another type."""
        hints = hints_of(type(self))  # type: ignore[arg-type]  # classes have hashes
        for field in fields(self):
            check_type(field.name.replace("_", " "), getattr(self, field.name), hints[field.name])


@cache
def hints_of(kind: Any) -> dict[str, Any]:
    """Return the annotations of a class's fields, evaluated once: that takes a millisecond."""
    return get_type_hints(kind)


def check_type(name: str, value: Any, hint: Any) -> None:
    """Raise InputError for a value of another type than the annotation `hint`."""
    if not _fits(value, hint):
        raise InputError(f"{name}: must be {_in_words(hint)}, got {value!r:.80}")


def _fits(value: Any, hint: Any) -> bool:
    if get_origin(hint) in (Union, UnionType):
        return any(_fits(value, kind) for kind in get_args(hint))
    if get_origin(hint) is Literal:
        return isinstance(value, str) and value in get_args(hint)
    if get_origin(hint) is tuple:
        return isinstance(value, tuple | list) and all(_fits(item, get_args(hint)[0]) for item in value)
    kinds, _ = _known(hint)
    return isinstance(value, kinds) and (hint is bool or not isinstance(value, bool))


def _in_words(hint: Any) -> str:
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(map(_in_words, get_args(hint)))
    if get_origin(hint) is Literal:
        return " or ".join(map(repr, get_args(hint)))
    if get_origin(hint) is tuple:
        return f"a tuple or a list, each entry {_in_words(get_args(hint)[0])}"
    return _known(hint)[1]


def _known(hint: Any) -> tuple[tuple[type, ...], str]:
    """Return the classes that an annotation allows, and their name in messages."""
    return _KINDS.get(hint) or ((hint,), f"{hint.__name__}(...)")
