"""Reads data of a condition that are constants: numbers, or formulas without coordinates, and the point they act at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .parser import Expression, ExpressionError

Vector = tuple[float, float, float]


def constant(name: str, given: Any) -> float:
    """Return the number of a number or of a formula without coordinates, such as "2*pi/180".

    name: that of the datum, for messages. Raises ExpressionError for anything else.
    """
    try:
        found = Expression(given) if isinstance(given, str) else None
        value = float(given if found is None else float("nan") if found.variables else found(*np.zeros((3, 1)))[0])
    except (TypeError, ValueError) as error:
        raise ExpressionError(f"{name}: {error}") from None
    if not np.isfinite(value):
        raise ExpressionError(f"{name} must be a finite number, the same at all points, got {given!r:.80}")
    return value


def vector(name: str, given: Any) -> Vector:
    """Return three numbers from three entries as of `constant`. Raises ExpressionError for anything else."""
    given = given.tolist() if isinstance(given, np.ndarray) else given
    if isinstance(given, str) or not isinstance(given, Sequence) or len(given) != 3:
        raise ExpressionError(f"{name} must have three entries, such as (0, 0, -500), got {given!r:.80}")
    x, y, z = (constant(name, entry) for entry in given)
    return x, y, z


def at_point(name: str, given: Any) -> tuple[Any, Any]:
    """Return the vector and the point of a pair of both. Raises ExpressionError for anything else."""
    is_pair = isinstance(given, tuple | list) and len(given) == 2
    if not is_pair or any(isinstance(part, str | int | float) or part is None for part in given):
        raise ExpressionError(f"{name}: give a vector and a point, ((0, 0, -500), (10, 0, 50)), got {given!r:.80}")
    return given[0], given[1]


def in_words(given: Vector, point: Vector | None = None) -> str:
    """Return a vector, and the point it acts at, as on the command line: "0;0;-500 at (10, 0, 50)"."""
    said = ";".join(f"{entry:.12g}" for entry in given)
    return said if point is None else f"{said} at ({', '.join(f'{entry:.12g}' for entry in point)})"
