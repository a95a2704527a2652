"""Defines the rigid region: a part of the boundary that moves as a rigid body under the loads on it."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from parameterize.arrays import Array, in_brackets

from .condition import Exact
from .constants import Vector, constant
from .region import Region
from .supports import Fix

UNKNOWN = "only iga_nn.solve, of a linear law and without adaptive meshes, finds the motion of a rigid region"


@dataclass(frozen=True)
class RigidMotion:
    """Hold the motion that a solve found for a rigid region: u = shift + turn x (x - centre).

    Attributes
    ----------
    region : str
        The name of the condition.
    centre : three float
        The centre of the region's area.
    shift : three float
        The displacement of the centre.
    turn : three float
        The small turn about the centre, in radians.
    residual : float
        The part of the loads on the region, forces and moments, that the motion leaves unbalanced.
    """

    region: str
    centre: Vector
    shift: Vector
    turn: Vector
    residual: float

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of report.json."""
        return asdict(self)

    def __str__(self) -> str:
        said = f"shift {in_brackets(self.shift)} of {in_brackets(self.centre)}, turn {in_brackets(self.turn)}"
        return f"{self.region}: {said} (loads balanced to {self.residual:.0e})"


class Rigid(Fix):
    """Make a region move as a rigid body, by a motion that the solve finds from the loads on it.

    Loads on the same region may be a total force, a moment and a remote force; without loads the region stays rigid.

    Parameters
    ----------
    region : Region or str
        The region.
    data : three numbers, optional
        The displacement of all of the region, which then does not turn; an entry that is None stays free.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> twisted = iga_nn.Elasticity(fix="u0", rigid="u1", moment={"u1": (1, 0, 0)})
    >>> (motion,) = iga_nn.solve(benchmark_volume(2), twisted).report.rigid
    >>> motion.turn[0] > 0.0, motion.residual < 1e-8
    (True, True)
    """

    asked: tuple[float | None, ...] | None
    motion: Array | None = None  # (6,), shift of the centre and turn; None until a solve has found it

    def __init__(self, region: Region | str, data: Any = None, *, name: str = "") -> None:
        super().__init__(region, ["0", "0", "0"], name=name)
        rows = None if data is None else tuple(None if one is None else constant(self.role, one) for one in data)
        if rows is not None and len(rows) != 3:
            raise ValueError(f"{self.role}: give the displacement as three numbers, or nothing, got {data!r:.80}")
        self._keep(asked=rows)

    @property
    def is_strong(self) -> bool:
        """Return False: the motion is given at points."""
        return False

    @property
    def free(self) -> tuple[bool, ...]:
        """Return nothing: a motion has all components."""
        return ()

    @property
    def unknown(self) -> Array:
        """Return the mask (6,) of the numbers of the motion that a solve finds."""
        if self.asked is None:
            return np.ones(6, dtype=bool)
        return np.array([one is None for one in self.asked] + [False] * 3)

    @property
    def given(self) -> Array:
        """Return the motion (6,) with zero for what a solve finds."""
        rows = self.asked or (None,) * 3
        return np.array([one or 0.0 for one in rows] + [0.0] * 3)

    @property
    def text(self) -> str:
        """Return the given displacement for a report."""
        return (
            "free" if self.asked is None else ";".join("free" if one is None else f"{one:.12g}" for one in self.asked)
        )

    def moved(self, motion: Array, centre: Array, placed: Self) -> Self:
        """Return the condition of one patch with a motion (6,) about a centre (3,)."""
        d, t = motion[:3].tolist(), motion[3:].tolist()
        x, y, z = (f"({axis}-({own!r}))" for axis, own in zip("xyz", centre.tolist(), strict=True))
        a, b, c = (f"({own!r})" for own in t)
        turned = [f"{b}*{z}-{c}*{y}", f"{c}*{x}-{a}*{z}", f"{a}*{y}-{b}*{x}"]
        formulas = [f"({own!r})+{part}" for own, part in zip(d, turned, strict=True)]
        new = self._with(data=formulas).stated(3, has_exact=False, of_coordinates=False)
        return placed._with(data=formulas, parsed=new.parsed, motion=motion)

    def values_at(self, exact: Exact, x: Array) -> Array:
        """Return the displacement (3, ...). Raises ValueError before a solve has found the motion."""
        if self.motion is None:
            raise ValueError(f"{self.role}: {UNKNOWN}")
        return super().values_at(exact, x)


def demand_known_motions(problem: Any) -> None:
    """Raise ValueError for a problem with a rigid region whose motion no solve has found."""
    for one in problem.conditions:
        if isinstance(one, Rigid) and one.motion is None:
            raise ValueError(f"{one.role}: {UNKNOWN}")
