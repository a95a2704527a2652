"""States the forces of a body's mass as a force per volume: gravity, acceleration, and rotation about an axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .constants import at_point, constant, vector
from .data import PerPatch
from .parser import ExpressionError

LISTED = (list, tuple, np.ndarray)


def with_inertia(
    body_force: PerPatch | None,
    density: Any = None,
    gravity: Any = None,
    acceleration: Any = None,
    spin: Any = None,
    *,
    has_exact: bool = False,
) -> PerPatch | None:
    """Return the force per volume f + rho (g - a - w x (w x (x - p))), as formulas where a mass acts.

    body_force: f, three formulas or numbers, or one for each patch or solid; without a mass it may be anything.
    density: rho, or a number for each patch or solid. gravity: g. acceleration: a, that of the body. spin: the angular
    velocity w, in radians per time, and a point p on the axis. has_exact: whether f follows from an exact solution.
    Raises ExpressionError for data of another kind, ValueError where they do not fit together.
    """
    given = {"gravity": gravity, "acceleration": acceleration, "spin": spin}
    said = ", ".join(name for name, own in given.items() if own is not None)
    if not said:
        return body_force
    if density is None:
        raise ValueError(f"{said}: give the density of the body, too (--density), such as 7.85e-9 t/mm³ of steel")
    if has_exact and body_force is None:
        raise ValueError(f"{said}: the force per volume follows from the exact solution; leave one of them out")
    fields = _accelerations(gravity, acceleration, spin)
    each = [own for own in (density, body_force) if isinstance(own, Mapping)]
    if not each:
        return _summed(body_force, density, fields)
    if set(each[0]) != set(each[-1]):
        raise ValueError("density and body_force: give both for the same patches, or for the same solids")
    own_force, own_density = (
        own if isinstance(own, Mapping) else dict.fromkeys(each[0], own) for own in (body_force, density)
    )
    return {owner: _summed(own_force[owner], own_density[owner], fields) for owner in each[0]}


def _accelerations(gravity: Any, acceleration: Any, spin: Any) -> list[str]:
    """Return g - a - w x (w x (x - p)) as three formulas."""
    constant_part, turning, point = np.zeros(3), np.zeros((3, 3)), np.zeros(3)
    if gravity is not None:
        constant_part += vector("gravity", gravity)
    if acceleration is not None:
        constant_part -= vector("acceleration", acceleration)
    if spin is not None:
        given, at = at_point("spin", spin)
        w, point = np.array(vector("spin", given)), np.array(vector("spin: the point", at))
        turning = (w @ w) * np.eye(3) - np.outer(w, w)
    found = []
    for own, row in zip(constant_part.tolist(), turning.tolist(), strict=True):
        pairs = zip("xyz", row, point.tolist(), strict=True)
        found.append("+".join([f"({own!r})", *(f"({one!r})*({axis}-({at!r}))" for axis, one, at in pairs if one)]))
    return found


def _summed(force: Any, density: Any, accelerations: Sequence[str]) -> list[Any]:
    """Return a force per volume plus a density times accelerations, as three formulas."""
    given = ["0"] * 3 if force is None else list(force) if isinstance(force, LISTED) else [force]
    if len(given) != 3 or not all(isinstance(entry, str | int | float) for entry in given):
        raise ValueError("body_force: write three formulas or numbers where gravity, acceleration or a spin act, too")
    mass = constant("density", density)
    if mass < 0.0:
        raise ExpressionError(f"density must not be negative, got {mass:g}")
    return [f"({own})+({mass!r})*({one})" for own, one in zip(given, accelerations, strict=True)]
