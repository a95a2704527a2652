"""Progress: what a long run reports to its caller after each step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from .arrays import Array


@dataclass(frozen=True)
class Progress:
    """State after one step; `seconds_left` counts the present stage and all later training stages.

    mapped: while the network is trained, computes where it maps the surface as it is now, (n, 3) with the cube at
    0..1; the first rows are the surface's own vertices. Costs one evaluation, changes nothing.
    """

    stage: str
    step: int
    steps: int
    loss: float
    folded: int
    seconds_left: float
    mapped: Callable[[], Array] | None = field(default=None, compare=False, repr=False)


ProgressCallback = Callable[[Progress], None]


def ignore(_: Progress) -> None:
    """Do nothing: the callback of a silent run."""
