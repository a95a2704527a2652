"""Defines the conditions that every law takes: values, fluxes, and exchanges with the outside."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array

from .condition import Condition, Exact
from .region import Region


class Value(Condition):
    """u = g on a region of the boundary, by default zero, or that of the exact solution.

    An entry of g that is None leaves that component free.

    Parameters
    ----------
    region : Region or str
        Where the condition holds.
    data : datum, optional
        g.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> warm = [iga_nn.Value("u0", "20"), iga_nn.Exchange("nz > 0.9", 25, 30)]
    >>> iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(conditions=warm)).report.converged
    True
    """

    is_essential: ClassVar[bool] = True

    @property
    def free(self) -> tuple[bool, ...]:
        """Return for each component whether it is left free; () if none is."""
        entries = self.data if isinstance(self.data, list | tuple) else ()
        return tuple(entry is None for entry in entries) if None in entries else ()

    @property
    def is_strong(self) -> bool:
        """Return whether the trial space can hold the condition: all components of u on whole faces of the cube."""
        return self.entries is None and bool(self.faces) and not self.free

    def _full(self, data: Any) -> Any:
        if self.free and all(self.free):
            raise ValueError(f"{self.role}: gives no component; leave it out")
        return [0.0 if entry is None else entry for entry in data] if self.free else data

    def directions(self, components: int, normal: Array) -> list[Array]:
        """Return the unit directions (c, m) along which values are given, for normals (3, m)."""
        units = np.eye(components)[:, :, None] * np.ones(normal.shape[1])
        return [unit for unit, is_free in zip(units, self.free or (False,) * components, strict=True) if not is_free]

    def values_at(self, exact: Exact, x: Array) -> Array:
        """Return the values (c, ...), or (1, ...) of the component along the one direction, at points (3, ...)."""
        return exact.exact_values(x) if self.datum is None else self.datum(x)

    def values_along(self, direction: Array, exact: Exact, x: Array) -> Array:
        """Return the values (m,) along a direction (c, m) at points (3, m)."""
        found = self.values_at(exact, x)
        return found[0] if len(found) != len(direction) else np.asarray((found * direction).sum(axis=0))


class Flux(Condition):
    """flux . n = g on a region, the flux into the body; None for that of the exact solution.

    Parameters
    ----------
    region : Region or str
        Where the condition holds.
    data : datum or None
        g.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> heated = [iga_nn.Value("u0", 20), iga_nn.Flux("u1", "x")]
    >>> iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(conditions=heated)).report.converged
    True
    """

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return g (c, ...)."""
        return exact.exact_flux(self.role, x, normal) if self.datum is None else self.datum(x)


class Exchange(Condition):
    """flux . n = alpha (outside - u) on a region, as of heat that passes to the air.

    Parameters
    ----------
    region : Region or str
        Where the condition holds.
    alpha : entry
        The factor, not negative.
    outside : datum or None
        The value outside; None for the one with which the exact solution fits.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Exchange("nz > 0.9", 25, "20+x").text
    '25, outside 20+x'
    """

    def __init__(self, region: Region | str, alpha: Any, outside: Any = None, *, name: str = "") -> None:
        super().__init__(region, outside, name=name)
        if alpha is None:
            raise ValueError(f"{self.role}: the {self.factor_name} must be a number, a formula or a function, got None")
        object.__setattr__(self, "factor", alpha)

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the pair of a keyword. Raises ValueError for anything else."""
        if not isinstance(data, tuple | list) or len(data) != 2 or data[0] is None:
            role = name or cls.role_on(region)
            words = "alpha, g" if name else "factor, value outside"
            raise ValueError(f"{role}: give two entries ({words}), got {data!r:.80}")
        return cls(region, *data, name=name)

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return the flux (c, ...) into a body with u = 0."""
        if self.datum is not None:
            return np.asarray(self.factor_at(x) * self.datum(x))
        return exact.exact_flux(self.role, x, normal) + self.factor_at(x) * exact.exact_values(x)


class Robin(Exchange):
    """flux . n + alpha u = g on a region, g in the place of `outside`; None for the g of the exact solution.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Robin("u1", 2, 6).kind
    'robin'
    """

    factor_name: ClassVar[str] = "alpha"

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return g (c, ...)."""
        return super().flux_at(exact, x, normal) if self.datum is None else self.datum(x)
