"""Defines the loads of bodies that are forces per area."""

from __future__ import annotations

from typing import Any, ClassVar, Self

from parameterize.arrays import Array

from .condition import Exact
from .constants import Vector, at_point, in_words, vector
from .general_conditions import Flux
from .region import Region


class Load(Flux):
    """Load a body by a force per area on a region: sigma n = g.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> pulled = iga_nn.Elasticity(conditions=[iga_nn.Fix("u0"), iga_nn.Load("u1", (0, 0, 1))])
    >>> iga_nn.solve(benchmark_volume(2), pulled).report.balance.imbalance < 1e-8
    True
    """


class Pressure(Flux):
    """Load a body by a force per area against the outward normal: sigma n = -p n on a region.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Pressure("nz > 0.9", "10-z").role
    "pressure 'nz > 0.9'"
    """

    entries: ClassVar[int | None] = 1
    is_along_normal: ClassVar[bool] = True

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return -p n (3, ...)."""
        return super().flux_at(exact, x, normal) if self.datum is None else -self.datum(x)[0] * normal


class Hydrostatic(Pressure):
    """Load a body by the pressure of a fluid at rest, which grows with the depth below its surface; zero above.

    Parameters
    ----------
    region : Region or str
        The wetted region; what lies above the surface has no pressure.
    weight : three numbers
        The fluid's weight per volume, density times gravity, a vector that points down.
    point : three numbers
        A point on the surface of the fluid.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Hydrostatic("x < 1", (0, 0, -9.81e-6), (0, 0, 50)).text
    '0;0;-9.81e-06 at (0, 0, 50)'
    """

    has_point: ClassVar[bool] = True
    weight: Vector
    point: Vector

    def __init__(self, region: Region | str, weight: Any, point: Any, *, name: str = "") -> None:
        super().__init__(region, name=name)
        down, at = vector(self.role, weight), vector(f"{self.role}: the point", point)
        depth = "+".join(f"({one!r})*({axis}-({own!r}))" for axis, one, own in zip("xyz", down, at, strict=True))
        self._keep(weight=down, point=at, data=f"max(0, {depth})")

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the pair of a keyword: weight and point."""
        return cls(region, *at_point(name or cls.role_on(region), data), name=name)

    @property
    def text(self) -> str:
        """Return weight and point for a report."""
        return in_words(self.weight, self.point)
