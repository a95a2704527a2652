"""What a long run reports: Progress to its caller, History of all steps, as history.npz holds them, and its seconds."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .arrays import Array


@dataclass(frozen=True)
class Progress:
    """State after one step.

    seconds_left: of the present and all later training stages, from the seconds of the steps that are done and the
    number of those that are planned; None for other stages, which end once they gain nothing more, and whose `steps`
    are the most that there may be.
    mapped: while the network is trained, computes where it maps the surface as it is now, (n, 3) with the cube at
    0..1; the first rows are the surface's own vertices. Costs one evaluation, changes nothing.
    """

    stage: str
    step: int
    steps: int
    loss: float
    folded: int
    seconds_left: float | None
    mapped: Callable[[], Array] | None = field(default=None, compare=False, repr=False)


ProgressCallback = Callable[[Progress], None]


def ignore(_: Progress) -> None:
    """Do nothing: the callback of a silent run."""


@dataclass
class History:
    """Loss, folded samples and unweighted terms of every step, over all stages."""

    rows: list[tuple[str, int, float, int, dict[str, float]]] = field(default_factory=list)

    def add(self, stage: str, step: int, loss: float, folded: int, terms: dict[str, float]) -> None:
        """Append a row."""
        self.rows.append((stage, step, loss, folded, terms))

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return columns of equal length, with NaN where a term is not used."""
        columns = {
            name: np.array([row[k] for row in self.rows]) for k, name in enumerate(("stage", "step", "loss", "folded"))
        }
        for name in sorted({name for row in self.rows for name in row[4]}):
            columns[name] = np.array([row[4].get(name, math.nan) for row in self.rows])
        return columns


@contextmanager
def timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    """Add the wall seconds of the block to seconds[name]."""
    start = time.perf_counter()
    yield
    seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - start
