"""Follows a run: the share of its work that is done, which never falls, and the seconds to its end."""

import time
from collections import deque
from collections.abc import Callable

WINDOW = 20.0  # seconds over which estimates are compared
SHORTEST = 8.0  # shortest span of estimates that suffices, in seconds
SLIPPING = 0.5  # seconds that the expected end may move in a second; an end that moves more is unknown
MOST = 0.9  # largest part of the remaining share that counts as done without a new estimate


class Course:
    """Hold the share of a run that is done, and the expected time of its end. clock: in seconds."""

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
        """Keep the share that is done, and forget the estimates, because nothing runs for a while."""
        self._done = self.share
        self._estimates.clear()

    @property
    def share(self) -> float:
        """Return the share of the run that is done: the rest is in proportion to the seconds to the end.

        The share rises linearly as long as the estimates expect the same end; a new end changes its slope only.
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
