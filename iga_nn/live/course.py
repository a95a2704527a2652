"""Follows a run: the share of its work that is done, which never falls, and the seconds that are left."""

import time
from collections import deque
from collections.abc import Callable

WINDOW = 20.0  # seconds over which estimates are compared
SHORTEST = 8.0  # shortest span of estimates that suffices, in seconds
SLIPPING = 0.5  # seconds by which the expected end moves in each second, from which on it is not known
MOST = 0.9  # largest part of the share left that is taken without a new estimate


class Course:
    """Hold the share of a run that is done, and when its end is expected. clock: in seconds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._done = 0.0  # share at the last estimate
        self._estimates: deque[tuple[float, float]] = deque()  # times of estimates, and the ends that they expect

    def tell(self, left: float) -> None:
        """Take an estimate of the seconds that are left."""
        self._done, now = self.share, self._clock()
        self._estimates.append((now, now + max(left, 1e-3)))
        while self._estimates[0][0] < now - WINDOW:
            self._estimates.popleft()

    def pause(self) -> None:
        """Keep the share that is done, and forget the estimates: time goes by in which nothing runs."""
        self._done = self.share
        self._estimates.clear()

    @property
    def share(self) -> float:
        """Return the share of the run that is done: what is left of it shrinks as the seconds that are left do.

        It rises linearly as long as the estimates expect the same end, and goes on from where it is where they change.
        """
        if not self._estimates:
            return self._done
        at, end = self._estimates[-1]
        passed = min((self._clock() - at) / (end - at), MOST)
        return self._done + (1.0 - self._done) * passed

    @property
    def left(self) -> float | None:
        """Return the seconds that are left; None without an estimate, or while the expected end moves away."""
        if not self._estimates:
            return None
        (first, before), (last, end) = self._estimates[0], self._estimates[-1]
        slips = last - first >= SHORTEST and end - before > SLIPPING * (last - first)
        left = end - self._clock()
        return None if slips or left <= 0.0 else left
