"""Chooses, from its skeleton, how a body is divided: blocks along the skeleton, one block with stubs, or one cube."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from .graph import Branch, Skeleton

Division = Literal["blocks", "body", "cube", "planes", "columns"]

# Share of the volume in the balls around the curves. A square rod has .79, and a rod twice as wide as thick .39:
TUBE_OF_LIMBS = 0.7  # without handles one cube is possible, and is left for a body that is nearly all limbs: bodies
# of round limbs have .75 to .97, and one with a fat trunk that the curves do not fill (a bunny) .65 and less
TUBE_OF_HANDLES = 0.4  # with it blocks along all branches serve: square rods become sections twice as wide as thick
LONG = 10.0  # median radii of the longest limb, to the middle of its junction: five diameters


@dataclass(frozen=True)
class Choice:
    """How a body is divided, and why.

    Attributes
    ----------
    division : str
        "blocks" for blocks along all branches, "body" for one block with stubs on its faces where loops begin and end,
        "cube" for one block, that is a body without handles as it is mapped without a skeleton, "planes" for exact
        blocks of a body that planes bound, "columns" for blocks of a stack of extrusions; the skeleton of these is not
        looked for.
    reason : str
        In words, with the figures that decide.
    """

    division: Division
    reason: str


def choose(skeleton: Skeleton, *, stubs: bool) -> Choice:
    """Return how the body of a skeleton is divided.

    stubs: whether all its handles are tubes that leave a body and come back to it.
    """
    return _with_handles(skeleton, stubs) if skeleton.handles else _without_handles(skeleton)


def _without_handles(skeleton: Skeleton) -> Choice:
    """Return blocks for bodies of long limbs, else one cube."""
    if max(skeleton.degrees) < 3:
        return Choice("cube", "no handles, and no place where limbs meet: one cube")
    slender = max(_slenderness(branch) for branch in skeleton.branches if _is_limb(branch, skeleton))
    figures = f"{skeleton.tube:.2f} of the volume around its curves, longest limb {slender:.1f} radii"
    if skeleton.tube < TUBE_OF_LIMBS:
        return Choice("cube", f"no handles, and a fat trunk: {figures}: one cube")
    if slender < LONG:
        return Choice("cube", f"no handles, and short limbs: {figures}: one cube")
    return Choice("blocks", f"{np.sum(np.equal(skeleton.degrees, 1))} limbs: {figures}: blocks along them")


def _with_handles(skeleton: Skeleton, stubs: bool) -> Choice:
    """Return blocks along all branches, or one block with the handles on its faces."""
    handles = "1 handle" if skeleton.handles == 1 else f"{skeleton.handles} handles"
    figures = f"{skeleton.tube:.2f} of the volume around its curves"
    if skeleton.tube >= TUBE_OF_HANDLES:
        return Choice("blocks", f"{handles}, thick branches: {figures}: blocks along them")
    if stubs:
        return Choice(
            "body", f"{handles}, thin ones on a fat body: {figures}: one block, with the handles on its faces"
        )
    return Choice("blocks", f"{handles}, flat branches: {figures}: blocks as wide as the body along them")


def _is_limb(branch: Branch, skeleton: Skeleton) -> bool:
    """Return whether a branch ends in a tip."""
    return min(skeleton.degrees[end] for end in branch.ends) == 1


def _slenderness(branch: Branch) -> float:
    """Return the length of a branch over its median radius."""
    return branch.length / float(np.median(branch.radii))
