"""Defines conditions that couple two regions: cyclic symmetry, where one sector of a body stands for all of it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array

from .condition import Condition, Exact
from .region import Region

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
FORM = "'REGION, REGION about z' or 'REGION, REGION about (0, 0, 1) through (1, 2, 3)'"

_ABOUT = re.compile(r"^(?P<regions>.*)\sabout\s+(?P<axis>.+?)(?:\s+through\s+(?P<point>.+))?\s*$", re.DOTALL)


@dataclass(frozen=True)
class Axis:
    """Hold an axis of rotation: a unit vector (3,) and a point (3,)."""

    direction: tuple[float, ...]
    point: tuple[float, ...]

    @classmethod
    def of(cls, direction: str | Sequence[float], point: Sequence[float], role: str) -> Axis:
        """Return the axis along "x", "y", "z" or a vector. Raises ValueError for anything else."""
        try:
            along = np.array(AXES[direction] if isinstance(direction, str) else direction, dtype=np.float64)
            through = np.array(point, dtype=np.float64)
        except (KeyError, TypeError, ValueError):
            along = through = np.full(0, np.nan)
        size = float(np.linalg.norm(along))
        if along.shape != (3,) or through.shape != (3,) or not (np.isfinite(through).all() and 0.0 < size < np.inf):
            raise ValueError(f"{role}: the axis is x, y, z or a vector through a point of three numbers: {FORM}")
        return cls(tuple((along / size).tolist()), tuple(through.tolist()))

    @property
    def text(self) -> str:
        """Return the axis as a user writes it."""
        name = next((name for name, unit in AXES.items() if np.allclose(unit, self.direction)), _row(self.direction))
        return f"about {name}" + (f" through {_row(self.point)}" if any(self.point) else "")

    def rotation(self, angle: float) -> Array:
        """Return the matrix (3, 3) of a turn about the axis (Rodrigues' formula)."""
        x, y, z = self.direction
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross

    def turned(self, rotation: Array, x: Array) -> Array:
        """Return points (3, m) after a rotation (3, 3) about the axis."""
        middle = np.array(self.point)[:, None]
        return np.asarray(middle + rotation @ (np.asarray(x) - middle))


class Cyclic(Condition):
    """Couple two regions of a sector: u on the second is u on the first, turned about an axis.

    The angle follows from the regions, and must be a whole part of 360 degrees. A scalar is equal on both. The meshes
    on the regions need not match.

    Parameters
    ----------
    region : Region or str
        One cut of the sector.
    other : Region or str
        The other cut.
    axis : str or three float
        "x", "y", "z", or a vector along the axis.
    point : three float
        A point on the axis.

    Raises
    ------
    ValueError
        For an axis of another form.

    Examples
    --------
    >>> import iga_nn
    >>> print(iga_nn.Cyclic("u0", "u1", "z").role)
    cyclic 'u0, u1 about z'
    """

    is_coupled: ClassVar[bool] = True
    entries: ClassVar[int | None] = 0

    def __init__(
        self,
        region: Region | str,
        other: Region | str,
        axis: str | Sequence[float] = "z",
        point: Sequence[float] = (0.0, 0.0, 0.0),
        *,
        name: str = "",
    ) -> None:
        super().__init__(region, None, name=name)
        self._keep(other=other if isinstance(other, Region) else Region(other))
        self._keep(axis=Axis.of(axis, point, f"cyclic {str(region)!r}"))

    other: Region
    axis: Axis

    @classmethod
    def of(cls, region: Region | str, data: Any = None, name: str = "") -> Self:
        """Return the condition of a text "REGION, REGION about AXIS through POINT". Raises ValueError for others."""
        found = _ABOUT.match(str(region))
        parts = _split(found["regions"]) if found else []
        if found is None or len(parts) != 2 or data is not None:
            raise ValueError(f"cyclic {str(region)!r:.80}: give two regions and an axis, {FORM}")
        axis: Any = found["axis"] if found["axis"] in AXES else _numbers(found["axis"])
        point = (0.0, 0.0, 0.0) if found["point"] is None else _numbers(found["point"])
        return cls(parts[0], parts[1], axis, point, name=name)

    @property
    def role(self) -> str:
        """Return the name of the condition in messages."""
        return self.name or f"cyclic '{self.region}, {self.other} {self.axis.text}'"

    @property
    def text(self) -> str:
        """Return the other region and the axis for a report."""
        return f"turned to {self.other} {self.axis.text}"

    @property
    def parts(self) -> tuple[Condition, ...]:
        """Return the condition on the first region, and the one that marks the second."""
        return self, Image(self)

    def stated(self, components: int, *, has_exact: bool, of_coordinates: bool) -> Self:
        """Return the condition, which has no data. Raises ValueError for u of two, or of more than three components."""
        if components not in (1, 3):
            raise ValueError(f"{self.role}: u must have one component, or three, not {components}")
        return self

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return zero: the flux is that of the other region."""
        return np.zeros((1, *x.shape[1:]))


class Image(Condition):
    """Mark the second region of a cyclic symmetry."""

    is_coupled: ClassVar[bool] = True
    of_first: Cyclic

    def __init__(self, first: Cyclic) -> None:
        super().__init__(first.other, None)
        self._keep(of_first=first)

    @property
    def role(self) -> str:
        """Return the name of the region in messages."""
        return f"other side of {self.of_first.role}"

    @property
    def parts(self) -> tuple[Condition, ...]:
        """Return nothing: the condition on the first region makes this one."""
        return ()

    @property
    def text(self) -> str:
        """Return the first region for a report."""
        return f"turned from {self.of_first.region} {self.of_first.axis.text}"

    def stated(self, components: int, *, has_exact: bool, of_coordinates: bool) -> Self:
        """Return the condition, which has no data."""
        return self

    def flux_at(self, exact: Exact, x: Array, normal: Array) -> Array:
        """Return zero: the flux is that of the first region."""
        return np.zeros((1, *x.shape[1:]))


def demand_uncoupled(problem: Any, why: str) -> None:
    """Raise ValueError for a problem with a condition that couples regions. why: what does not work, in a line."""
    for condition in problem.conditions:
        if isinstance(condition, Cyclic):
            raise ValueError(f"{condition.role}: {why}")


def _split(text: str) -> list[str]:
    """Return the parts of a text between commas that stand in no brackets and in no quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if letter == "," and not depth and not quote:
            parts.append("")
            continue
        parts[-1] += letter
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "'\"":
            quote = letter
        else:
            depth += (letter in "([") - (letter in ")]")
    return [part.strip() for part in parts]


def _numbers(text: str) -> list[float]:
    """Return the numbers of a row "(1, 2, 3)"; an empty list for any other text."""
    try:
        return [float(part) for part in text.strip().removeprefix("(").removesuffix(")").split(",")]
    except ValueError:
        return []


def _row(values: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in values) + ")"
