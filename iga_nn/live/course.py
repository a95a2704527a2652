"""Follows a run: the share of it that is done, which never falls, and how long it still takes."""

import time
from collections import deque
from collections.abc import Callable

WINDOW = 20.0  # seconds over which estimates are compared
SHORTEST = 8.0  # seconds of them that suffice
SLIPPING = 0.5  # seconds by which the expected end moves in each second, from which on it is not known
MOST = 0.9  # of the share left, how much is taken while nothing new is told


class Course:
    """Hold the share of a run that is done, and when its end is expected. clock: in seconds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._done = 0.0  # share, when an estimate was told last
        self._told: deque[tuple[float, float]] = deque()  # when estimates were told, and the ends they expect

    def tell(self, left: float) -> None:
        """Take an estimate of the seconds that are left."""
        self._done, now = self.share, self._clock()
        self._told.append((now, now + max(left, 1e-3)))
        while self._told[0][0] < now - WINDOW:
            self._told.popleft()

    def pause(self) -> None:
        """Keep the share that is done, and forget the estimates: time goes by in which nothing runs."""
        self._done = self.share
        self._told.clear()

    @property
    def share(self) -> float:
        """Return the share of the run that is done: what is left of it shrinks as the seconds that are left do.

        It rises linearly as long as the estimates expect the same end, and goes on from where it is where they change.
        """
        if not self._told:
            return self._done
        told, end = self._told[-1]
        passed = min((self._clock() - told) / (end - told), MOST)
        return self._done + (1.0 - self._done) * passed

    @property
    def left(self) -> float | None:
        """Return the seconds that are left; None where that is not known: nothing was told, or the end moves away."""
        if not self._told:
            return None
        (first, before), (last, end) = self._told[0], self._told[-1]
        slips = last - first >= SHORTEST and end - before > SLIPPING * (last - first)
        left = end - self._clock()
        return None if slips or left <= 0.0 else left
