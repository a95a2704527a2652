"""Describes the ways that were tried, and chooses the best of their maps."""

from collections.abc import Iterable
from dataclasses import dataclass

from .way import Attempt, Way


@dataclass(frozen=True)
class AttemptReport:
    """Describe the attempt of a way.

    Attributes
    ----------
    start : str
        The name of the way.
    origin : str
        The kind of way: "network", "growth", "sharp", "blocks", "planes" or "stacks".
    ending : str
        Why its rounds ended.
    rounds : dict of str to int
        The number of rounds by phase: approach, grow, shape, unfold, separate, polish. Those of a body with stubs
        begin with the rounds of the body alone.
    seconds : dict of str to float
        Wall seconds of train and fit, and by phase.
    unproved : int or None
        Spans on which det J > 0 is not proved; None without a map.
    meets_itself : bool or None
        Whether the boundary of a certified map was found to meet itself; None without a map.
    distance : float or None
        Root mean square distance of the surface's points from the map, at volume 1; None without a map.
    """

    start: str
    origin: str
    ending: str
    rounds: dict[str, int]
    seconds: dict[str, float]
    unproved: int | None = None
    meets_itself: bool | None = None
    distance: float | None = None


@dataclass(frozen=True)
class Tried:
    """Hold a way that was tried, its attempt (None if it did not suit the shape), and the wall seconds by step."""

    way: Way
    attempt: Attempt | None
    seconds: dict[str, float]

    @property
    def serves(self) -> bool:
        """Return whether there is a map, and it is good enough."""
        return self.attempt is not None and self.way.serves(self.attempt)

    @property
    def fault(self) -> str:
        """Return why another way follows, in words for the log and for report.json."""
        if self.attempt is None and self.way.origin == "blocks":
            return "no blocks fit"
        if self.attempt is None:
            return "hard for the network" if "train" in self.seconds else "not trained"
        found = self.attempt.found
        if not any(found.faults):
            return "far from the surface"
        return "the boundary meets itself" if found.meets_itself else "not certified"

    def report(self) -> AttemptReport:
        """Return the report of the way, for the result and for report.json."""
        seconds = {step: spent for step, spent in self.seconds.items() if step in ("train", "fit") and spent > 0.0}
        way = self.way.name, self.way.origin
        if self.attempt is None:
            return AttemptReport(*way, self.fault, {}, seconds)
        found, course = self.attempt.found, self.attempt.course
        rounds, seconds = dict(course.rounds), seconds | course.seconds
        return AttemptReport(*way, str(course.ending), rounds, seconds, *found.faults, self.attempt.distance)


def best_of(tried: Iterable[Tried]) -> tuple[Way, Attempt] | None:
    """Return the way and the attempt of the best map: fewest faults, then the least distance; None without a map."""
    maps = [(one.way, one.attempt) for one in tried if one.attempt is not None]
    return min(maps, key=lambda one: one[1].rank, default=None)
