"""The starts, one after the other, until a map has no faults: the network, a cube that grows, stiffer ones.

A body with handles, and one with limbs, starts from blocks along its skeleton, one that planes bound from exact blocks,
a stack of extrusions from columns.
"""

import logging
import math

from .checkpoint import Checkpoints
from .layouts.rods.along_skeleton import LayoutError
from .starts.blocks import BLOCKS
from .starts.body import BODY
from .starts.columns import COLUMNS
from .starts.growth import GROWTH, LAST, STIFF
from .starts.network import NETWORK
from .starts.planes import PLANES
from .starts.sharp import SHARP
from .starts.start import Start, Task
from .starts.tried import Tried

_log = logging.getLogger(__name__)

# Of 59 hard surfaces 15 needed the stiffer growth and one the last; a fit to an extended layout between served none.
STARTS: tuple[Start, ...] = (NETWORK, GROWTH, STIFF, LAST)


def starts_of(task: Task) -> tuple[Start, ...]:
    """Return the starts that suit the body and the options, in their order.

    Raises LayoutError for one cube on a body with handles, SkeletonError for such a body without a skeleton.
    """
    if task.surface.genus and task.config.blocks == 1:
        raise LayoutError(
            f"genus {task.surface.genus}: one cube is never mapped one-to-one onto a body with handles; allow more"
        )
    if task.choice.division == "planes":
        return (PLANES,)
    if task.choice.division == "columns":
        return (COLUMNS,)
    if task.choice.division == "cube":
        return (SHARP, *STARTS) if task.config.starts > 1 and task.ridges is not None else STARTS
    if task.choice.division == "body":
        return (BODY, BLOCKS)
    return (BLOCKS,) if task.surface.genus or task.config.blocks is not None else (BLOCKS, *STARTS)


def next_start(tried: tuple[Tried, ...], starts: tuple[Start, ...]) -> Start | None:
    """Return the start that follows those that were tried; None where a map has no faults or no start is left.

    A stiffer growth follows a growth that ends far from the surface, certified or not.
    """
    begun = [one.start for one in tried]
    left = [start for start in starts if start not in begun]
    grown = tried[begun.index(GROWTH)].attempt if GROWTH in begun else None
    if STIFF in left and grown is not None and grown.distance > GROWTH.far:
        return STIFF
    return None if not left or any(_serves(one) for one in tried) else left[0]


def _serves(one: Tried) -> bool:
    """Return whether a map has no faults, and, where it has blocks, is close to the surface: one cube may be closer.

    On a hand whose blocks span the slits between the fingers, 0.013 away back from the boundary, one cube is closer.
    Of a map with its edges on sharp edges it is also proved that the boundary does not meet itself.
    """
    if one.attempt is None or any(one.attempt.found.faults):
        return False
    if one.start is SHARP and one.attempt.found.injective is None:
        return False
    both_ways = math.hypot(one.attempt.distance, one.attempt.distance_back) / math.sqrt(2.0)
    return one.start is not BLOCKS or both_ways <= GROWTH.far


def attempts(task: Task, checkpoints: Checkpoints) -> tuple[Tried, ...]:
    """Make maps until one has no faults, at most as many as the options say; return all, with at least one map."""
    tried: tuple[Tried, ...] = ()
    starts = starts_of(task)
    most = task.most_starts + starts.count(BLOCKS) + starts.count(SHARP)
    while len(tried) < most and (start := next_start(tried, starts)) is not None:
        if tried:
            _tell(tried[-1], start)
        before = dict(task.seconds)
        attempt = start.make(task, checkpoints.of_part(len(tried)) if tried else checkpoints)
        spent = {step: seconds - before.get(step, 0.0) for step, seconds in task.seconds.items()}
        tried += (Tried(start, attempt, spent),)
    return tried


def _tell(last: Tried, start: Start) -> None:
    """Log the fault of the last start, and the start that follows it."""
    level = logging.INFO if last.attempt is None else logging.WARNING
    _log.log(level, "%s: %s; %s instead", last.start.name, last.fault, start.doing)
