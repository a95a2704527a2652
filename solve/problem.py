"""Poisson: the data of -Laplace u = f on the volume, u = g on its boundary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from parameterize.bspline import Array

from .expressions import Expression, ExpressionError

LARGEST = 1e100  # of data: their squares, summed over all points, must not overflow

Data = str | Callable[[Array, Array, Array], ArrayLike]


@dataclass(frozen=True)
class Poisson:
    """Poisson's problem with Dirichlet data on all faces, in the volume's own coordinates.

    Each entry is a formula in x, y, z or a function of three arrays of equal shape.
    exact: the solution, where it is known. As a formula it gives source and boundary data, and the report's errors;
        a function needs `source` beside it, and leaves the H1 seminorm out, for its derivatives are unknown.
    source: f; overrides the one that follows from `exact`.
    boundary: g; default: `exact`, or zero.

    Raises ExpressionError for a formula that is refused, ValueError where the source cannot be known.
    """

    exact: Data | None = None
    source: Data | None = None
    boundary: Data | None = None
    _parsed: dict[str, Expression | Data | None] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.source is None and self.exact is None:
            raise ValueError('the problem has no source: give exact="..." or source="..." (source="0" for Laplace)')
        parsed = {name: _parse(name, getattr(self, name)) for name in ("exact", "source", "boundary")}
        if self.source is None and not isinstance(parsed["exact"], Expression):
            raise ValueError(
                "exact is a function, whose Laplacian is unknown: give source=... too, or a formula as exact"
            )
        object.__setattr__(self, "_parsed", parsed)

    def source_at(self, x: Array, y: Array, z: Array) -> Array:
        """Source f at points given by arrays of equal shape. Raises ExpressionError where it is not finite."""
        source, exact = self._parsed["source"], self._parsed["exact"]
        if source is None and isinstance(exact, Expression):
            return _finite("source (-Laplacian of exact)", -exact.jet(x, y, z)[2], x, y, z)
        return _values("source", source, x, y, z)

    def boundary_at(self, x: Array, y: Array, z: Array) -> Array:
        """Boundary data g at points given by arrays of equal shape. Raises ExpressionError where it is not finite."""
        for name in ("boundary", "exact"):
            if self._parsed[name] is not None:
                return _values(name, self._parsed[name], x, y, z)
        return np.zeros(x.shape)

    def exact_at(self, x: Array, y: Array, z: Array) -> tuple[Array, Array | None]:
        """Exact u and its gradient (3, ...), None for a function. Raises ExpressionError where they are not finite."""
        exact = self._parsed["exact"]
        if isinstance(exact, Expression):
            value, gradient, _ = exact.jet(x, y, z)
            return _finite("exact", value, x, y, z), _finite("gradient of exact", gradient, x, y, z)
        return _values("exact", exact, x, y, z), None


def _parse(name: str, data: Data | None) -> Expression | Data | None:
    if data is None or callable(data):
        return data
    if not isinstance(data, str):
        raise ValueError(f"{name} must be a formula such as '1' or a function of x, y, z, got {data!r}")
    try:
        return Expression(data)
    except ExpressionError as error:
        raise ExpressionError(f"{name}: {error}") from None


def _values(name: str, data: Expression | Data | None, x: Array, y: Array, z: Array) -> Array:
    assert callable(data)
    values = np.asarray(data(x, y, z), dtype=np.float64)
    try:
        full = np.broadcast_to(values, x.shape)
    except ValueError:
        raise ValueError(f"{name} returned shape {values.shape} for points of shape {x.shape}") from None
    return _finite(name, full, x, y, z)


def _finite(name: str, values: Array, x: Array, y: Array, z: Array) -> Array:
    """Values unchanged; ExpressionError naming the first point where they are not finite, or beyond LARGEST."""
    bad = ~(np.abs(values) <= LARGEST)  # NaN included
    if bad.any():
        at = tuple(np.argwhere(bad)[0][-x.ndim :])
        where = f"x={x[at]:.6g}, y={y[at]:.6g}, z={z[at]:.6g}"
        if np.isfinite(values[bad].flat[0]):
            raise ExpressionError(f"{name} exceeds {LARGEST:.0e} at {where}, a point of the domain: scale the data")
        raise ExpressionError(f"{name} is not finite at {where}, a point of the domain")
    return values
