"""Accelerates an iteration by Anderson's method: several steps give a guess at the limit.

Anderson, J. ACM 12 (1965); Walker, Ni, SIAM J. Numer. Anal. 49 (2011), in the form without constraints.
"""

import numpy as np

from ..arrays import Array

_DAMPING = 1e-8  # of the least squares, against steps that are nearly alike


class Acceleration:
    """Hold the last steps of an iteration x -> g(x), at most `memory` + 1 steps."""

    def __init__(self, memory: int) -> None:
        self._memory = memory
        self._starts: list[Array] = []
        self._ends: list[Array] = []

    def add(self, start: Array, end: Array) -> None:
        """Add the step from x, `start`, to g(x), `end`."""
        self._starts = [*self._starts[-self._memory :], start]
        self._ends = [*self._ends[-self._memory :], end]

    def forget(self, keep: int = 0) -> None:
        """Forget all but the last `keep` steps, because older steps no longer show the limit of the iteration."""
        self._starts = self._starts[len(self._starts) - keep :]
        self._ends = self._ends[len(self._ends) - keep :]

    def guess(self) -> Array | None:
        """Return the combination of the ends, with factors of sum 1, whose steps cancel best; None before two steps."""
        if len(self._ends) < 2:
            return None
        starts, ends = (np.stack([x.ravel() for x in kept]) for kept in (self._starts, self._ends))
        steps = ends - starts
        changes = np.diff(steps, axis=0)
        gram = changes @ changes.T
        gram += _DAMPING * np.trace(gram) * np.eye(len(gram))
        factors = np.linalg.solve(gram, changes @ steps[-1])
        guess: Array = (ends[-1] - factors @ np.diff(ends, axis=0)).reshape(self._ends[-1].shape)
        return guess
