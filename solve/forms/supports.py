"""Defines the supports of bodies: displacements that are given, and springs."""

from __future__ import annotations

from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array

from .condition import joined
from .constants import Vector, at_point, constant, in_words, vector
from .general_conditions import Exchange, Value
from .region import Region
from .total_loads import Integral


class Fix(Value):
    """Hold a body: u = g on a region, zero by default; an entry of g that is None leaves that component free.

    Examples
    --------
    >>> import iga_nn
    >>> print(iga_nn.Fix("x < 1", (0, None, "y")).text)
    0;free;y
    """


class Roller(Value):
    """Hold a body along the outward normal alone: u . n = g on a region, zero by default.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Roller("w0").role
    "roller 'w0'"
    """

    entries: ClassVar[int | None] = 1
    is_along_normal: ClassVar[bool] = True

    def directions(self, components: int, normal: Array) -> list[Array]:
        """Return the normal."""
        return [normal]


class Symmetry(Roller):
    """Hold a body where a plane of symmetry cuts it: u . n = 0 on a region, as on a roller.

    Examples
    --------
    >>> import iga_nn
    >>> issubclass(iga_nn.Symmetry, iga_nn.Roller)
    True
    """


class Turn(Fix):
    """Turn a region about an axis by a small angle: u = angle x (x - point).

    Parameters
    ----------
    region : Region or str
        The region that is turned as a rigid body.
    angle : three numbers
        The angle in radians along the axis.
    point : three numbers
        A point on the axis.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Turn("u1", (0, 0, "pi/1800"), (0, 0, 5)).text
    '0;0;0.00174532925199 at (0, 0, 5)'
    """

    has_point: ClassVar[bool] = True
    angle: Vector
    point: Vector

    def __init__(self, region: Region | str, angle: Any, point: Any, *, name: str = "") -> None:
        super().__init__(region, name=name)
        turn, at = vector(self.role, angle), vector(f"{self.role}: the point", point)
        x, y, z = (f"({axis}-({own!r}))" for axis, own in zip("xyz", at, strict=True))
        (a, b, c) = (f"({own!r})" for own in turn)
        formulas = [f"{b}*{z}-{c}*{y}", f"{c}*{x}-{a}*{z}", f"{a}*{y}-{b}*{x}"]
        self._keep(angle=turn, point=at, data=formulas)

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the pair of a keyword: angle and point."""
        return cls(region, *at_point(name or cls.role_on(region), data), name=name)

    @property
    def text(self) -> str:
        """Return angle and point for a report."""
        return in_words(self.angle, self.point)


class Spring(Exchange):
    """Hold a body by springs: sigma n = alpha (outside - u), a force per area.

    The value outside is zero by default; other data as of `Exchange`.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Spring("nz < -0.9", 50).text, iga_nn.Spring("nz < -0.9", 50, (0, 0, 1)).text
    ('50', '50, outside 0;0;1')
    """

    def __init__(self, region: Region | str, alpha: Any, outside: Any = 0.0, *, name: str = "") -> None:
        super().__init__(region, alpha, outside, name=name)

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the factor of a keyword, or from its pair."""
        return super().of(region, data if isinstance(data, tuple | list) else (data, 0.0), name)

    @property
    def text(self) -> str:
        """Return the factor for a report, and the value outside if it is not zero."""
        is_zero = isinstance(self.data, list | float) and not np.any(self.data)
        return joined(self.factor) if is_zero else super().text


class TotalSpring(Spring):
    """Hold a body by a spring whose stiffness in total, force per displacement, is shared out over a region's area.

    The spring acts along all directions, and alike all over the region: it resists turns, too.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.TotalSpring("u0", 1000).text
    '1000'
    """

    area: float | None = None  # of the region; None until a solve has found it

    def __init__(self, region: Region | str, alpha: Any, outside: Any = 0.0, *, name: str = "") -> None:
        super().__init__(region, alpha, outside, name=name)
        self._keep(factor=constant(self.role, alpha))

    def nominal(self) -> Self:
        """Return the spring for a region of area 1."""
        return self._with(area=1.0)

    def shared_out(self, integral: Integral) -> Self:
        """Return the spring with its area; `integral` is that over the region."""
        return self._with(area=float(integral(lambda x, normal: np.ones(x.shape[1]))))

    def sharing(self, other: Any) -> Self:
        """Return the spring with the area of another one, that of all patches."""
        return self._with(area=other.area)

    def factor_at(self, x: Array) -> Array:
        """Return the stiffness per area (...)."""
        assert self.area is not None, f"{self.role} has not been shared out"
        return super().factor_at(x) / self.area


class Foundation(Exchange):
    """Hold a body on an elastic foundation, along its normal alone: sigma n = -alpha (u . n) n.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Foundation("nz < -0.9", 0.1).text
    '0.1'
    """

    is_along_normal: ClassVar[bool] = True

    def __init__(self, region: Region | str, alpha: Any, *, name: str = "") -> None:
        super().__init__(region, alpha, 0.0, name=name)

    @classmethod
    def of(cls, region: Region | str, data: Any, name: str = "") -> Self:
        """Return the condition from the factor of a keyword."""
        return cls(region, data, name=name)

    @property
    def text(self) -> str:
        """Return the factor for a report."""
        return joined(self.factor)

    def factors_at(self, components: int, x: Array, normal: Array) -> Array:
        """Return the factor (3, 3, m) of u: along the normal alone."""
        return normal[:, None] * normal * self.factor_at(x)
