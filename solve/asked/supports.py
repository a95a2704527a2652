"""Finds the supports of a problem that lie in a region, whose reactions are known from the residual."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from parameterize.spline.body import Body

from ..ask import Ask
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.region import Region
from ..integrals import surface_rules_on

ALL = 0.999  # share of a support's area that counts as all of it
NONE = 0.001  # and as nothing


@dataclass(frozen=True)
class SupportsOfRegion:
    """Hold supports by their names in a balance. faces: such as "u0", whose reactions have the names of faces."""

    roles: tuple[str, ...]
    faces: tuple[str, ...]
    said: str


@dataclass(frozen=True)
class _Support:
    name: str  # of a condition on a region its role, of a whole face its name
    region: Region
    is_face: bool


def supports_in(ask: Ask, problem: BoundaryValueProblem, body: Body) -> SupportsOfRegion | None:
    """Return the supports in an ask's region; None for a flow through a region that is not made of supports.

    problem: placed in the body. Raises ValueError for a reaction of a region without a support, or with a part of one.
    """
    assert ask.region is not None
    every = list(_all_supports(problem))
    own = [one for one in every if str(one.region) == str(ask.region)] or [
        one for one in every if one.is_face and one.name in ask.region.faces
    ]
    is_whole = bool(own)
    if not own:
        own, is_whole = _within(ask, every, body)
    if ask.kind == "flow" and not (own and is_whole):
        return None
    if not own:
        known = ", ".join(repr(str(one.region)) for one in every) or "there are none"
        raise ValueError(f"no support lies in {str(ask.region)!r}; the supports are on {known}")
    roles, faces = (tuple(one.name for one in own if one.is_face == on) for on in (False, True))
    return SupportsOfRegion(roles, faces, f"of {', '.join(one.name for one in own)}")


def _all_supports(problem: BoundaryValueProblem) -> Iterator[_Support]:
    """Yield the supports: conditions on regions, and whole faces with data of their own."""
    for condition in problem.conditions:
        if condition.is_support:
            yield _Support(condition.role, condition.region, is_face=False)
    for condition in problem.faces:
        if condition.is_support:
            yield from (_Support(face, Region(face), is_face=True) for face in condition.faces)


def _within(ask: Ask, every: list[_Support], body: Body) -> tuple[list[_Support], bool]:
    """Return the supports whose areas lie in a region, and whether they are all of it."""
    assert ask.region is not None
    own, covered = [], 0.0
    for one in every:
        whole = _area(one.region, body)
        inside = _area(one.region & ask.region, body) if whole else 0.0
        if whole and inside >= ALL * whole:
            own.append(one)
            covered += inside
        elif whole and inside > NONE * whole and ask.kind == "reaction":
            raise ValueError(
                f"{inside / whole:.1%} of {one.name} lies in {str(ask.region)!r}: ask for the reaction of all of "
                f"{str(one.region)!r}"
            )
    if ask.kind == "reaction":
        return own, True
    return own, bool(own) and covered >= ALL * _area(ask.region, body)


def _area(region: Region, body: Body) -> float:
    """Return the area of a region; 0 where it is empty."""
    try:
        return float(sum(np.sum(rule.weights) for _, rule in surface_rules_on(body.patches, body, [region])))
    except ValueError:
        return 0.0
