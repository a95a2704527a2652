"""Data of a problem: formulas in x, y, z or functions of three arrays, read once and checked at every point."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np
from numpy.typing import ArrayLike, NDArray

from parameterize.arrays import Array
from parameterize.volume import FACE_NAMES

from .expressions import Expression, ExpressionError

LARGEST = 1e100  # of data: their squares, summed over all points, must not overflow

Data = str | Callable[[Array, Array, Array], ArrayLike]
Parsed = Expression | Callable[[Array, Array, Array], ArrayLike]


def parse(name: str, data: Data) -> Parsed:
    """A formula translated, a function as it is. Raises ExpressionError or ValueError that names the entry."""
    if callable(data):
        return data
    if not isinstance(data, str):
        raise ValueError(f"{name} must be a formula such as '1' or a function of x, y, z, got {data!r}")
    try:
        return Expression(data)
    except ExpressionError as error:
        raise ExpressionError(f"{name}: {error}") from None


def values(name: str, data: Parsed, x: Array, y: Array, z: Array) -> Array:
    """Values at points given by arrays of equal shape. Raises ExpressionError where they are not finite."""
    found = np.asarray(data(x, y, z), dtype=np.float64)
    try:
        full = np.broadcast_to(found, x.shape)
    except ValueError:
        raise ValueError(f"{name} returned shape {found.shape} for points of shape {x.shape}") from None
    return finite(name, full, x, y, z)


def finite(name: str, found: Array, x: Array, y: Array, z: Array) -> Array:
    """Values unchanged; ExpressionError naming the first point where they are not finite, or beyond LARGEST."""
    bad = ~(np.abs(found) <= LARGEST)  # NaN included
    if bad.any():
        where = _first(bad, x, y, z)
        if np.isfinite(found[bad].flat[0]):
            raise ExpressionError(f"{name} exceeds {LARGEST:.0e} at {where}, a point of the domain: scale the data")
        raise ExpressionError(f"{name} is not finite at {where}, a point of the domain")
    return found


def demand(good: NDArray[np.bool_], name: str, must: str, x: Array, y: Array, z: Array) -> None:
    """Raise ExpressionError naming the first point where a condition on the data does not hold."""
    if not good.all():
        raise ExpressionError(f"{name} must be {must}, and is not at {_first(~good, x, y, z)}, a point of the domain")


def check_faces(name: str, faces: Collection[str]) -> None:
    """Raise ValueError for a name that is no face of the cube."""
    for face in faces:
        if face not in FACE_NAMES:
            raise ValueError(f"{name}: {face!r} is no face of the cube; the faces are {', '.join(FACE_NAMES)}")


def _first(bad: NDArray[np.bool_], x: Array, y: Array, z: Array) -> str:
    at = tuple(np.argwhere(bad)[0][-x.ndim :]) if x.ndim else ()
    return f"x={x[at]:.6g}, y={y[at]:.6g}, z={z[at]:.6g}"
