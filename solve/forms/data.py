"""Data of a problem: formulas in x, y, z and X, Y, Z or functions of three arrays, checked at every point."""

from __future__ import annotations

from collections.abc import Callable, Collection
from copy import copy
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from .formula import Expression, ExpressionError
from .frame import UnitFrame

LARGEST = 1e100  # of data: their squares, summed over all points, must not overflow
USUAL_SIZE = 5.0  # of coordinates in which formulas are written

Data = str | Callable[[Array, Array, Array], ArrayLike]
Parsed = Expression | Callable[[Array, Array, Array], ArrayLike]


class ProblemData:
    """The parsed data of a problem by name, several entries for a vector or a tensor, and the meaning of X, Y, Z."""

    _parsed: dict[str, tuple[Parsed, ...]]

    @property
    def formulas(self) -> list[tuple[str, Expression]]:
        """The names of the data that are formulas, and these; a vector's name comes with each of its formulas."""
        named = [(name, entry) for name, entries in self._parsed.items() for entry in entries]
        return [(name, entry) for name, entry in named if isinstance(entry, Expression)]

    @property
    def is_scaled(self) -> bool:
        """Whether X, Y or Z occurs in a formula."""
        return any(formula.is_scaled for _, formula in self.formulas)

    def on(self, volume: BSplineVolume) -> Self:
        """The same problem with X, Y, Z measured in a volume: its size is 1 in them, the middle of its box 0."""
        return self.placed(UnitFrame.of(volume)) if self.is_scaled else self

    def placed(self, frame: UnitFrame) -> Self:
        """The same problem with X, Y, Z measured in a frame."""
        other = copy(self)
        parsed = {name: tuple(_placed(entry, frame) for entry in entries) for name, entries in self._parsed.items()}
        object.__setattr__(other, "_parsed", parsed)
        return other


def _placed(data: Parsed, frame: UnitFrame) -> Parsed:
    return data.placed(frame) if isinstance(data, Expression) else data


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
    return finite(name, full, x, y, z, data)


def finite(name: str, found: Array, x: Array, y: Array, z: Array, data: Parsed | None = None) -> Array:
    """Values unchanged; ExpressionError naming the first point where they are not finite, or beyond LARGEST.

    data: what the values come from, for the remedy.
    """
    bad = ~(np.abs(found) <= LARGEST)  # NaN included
    if bad.any():
        fault = f"exceeds {LARGEST:.0e}" if np.isfinite(found[bad].flat[0]) else "is not finite"
        good = found[~bad]
        elsewhere = f"; elsewhere it runs from {good.min():.3g} to {good.max():.3g}" if good.size else ""
        where = _first(bad, x, y, z)
        raise ExpressionError(f"{name} {fault} at {where}, a point of the domain{elsewhere}{in_scaled(data, x, y, z)}")
    return found


def in_scaled(data: Parsed | None, x: Array, y: Array, z: Array) -> str:
    """The remedy for a formula in x, y, z on a domain far from size 1 or from the origin: the same in X, Y, Z.

    x, y, z: points of the domain, arrays of equal shape.
    """
    if not isinstance(data, Expression) or data.scaled_text is None:
        return ""
    size, away = max(float(np.ptp(c)) for c in (x, y, z)), max(float(np.abs(c).max()) for c in (x, y, z))
    if away < USUAL_SIZE and size > 1.0 / USUAL_SIZE:
        return ""
    return f"; X, Y, Z are x, y, z scaled to volume 1 about the middle of the domain: try {data.scaled_text!r}"


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
