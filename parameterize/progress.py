"""What a long run tells its caller after each step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """State after one step; `seconds_left` counts the present stage and all later training stages."""

    stage: str
    step: int
    steps: int
    loss: float
    folded: int
    seconds_left: float


ProgressCallback = Callable[[Progress], None]


def ignore(_: Progress) -> None:
    """The callback of a silent run."""
