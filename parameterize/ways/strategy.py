"""Takes the ways to a map in their order, until a map is good enough. docs/ways.md is made from this table.

| way | suits | the map |
| --- | --- | --- |
| planes | bodies whose plane faces divide them into blocks | exact blocks, left as they are laid |
| stacks | stacks of extrusions, also with leaning sides | blocks over their profiles, left as they are laid |
| hexahedra | all other parts with sharp edges, cavities or several solids | hexahedra of curved tetrahedra, as laid |
| body with stubs | fat bodies with thin handles, such as a mug | one cube, cut into blocks, and rods on its faces |
| blocks | all others with handles, and bodies of long limbs that meet | rods and junctions, drawn to the surface |
| sharp edges | bodies without handles whose sharp edges one cube's can carry | one cube, laid along them |
| network | all others without handles | one cube, trained, fitted and optimised |
| growth | shapes that are hard for the network | one cube that grows into the solid |
| stiff growth | maps not certified, or that meet themselves or end far away | the same, stiffer, turned otherwise |
| last growth | bodies on which all of these failed | the same, turned again; it may end farther away |
| last hexahedra | bodies with sharp edges of which these make no good map | hexahedra of curved tetrahedra, as laid |
"""

import logging
from collections.abc import Iterable

from ..checkpoint import CheckpointError, Checkpoints
from ..layouts.rods.along_skeleton import LayoutError
from ..layouts.skeleton.graph import SkeletonError
from ..progress import timed
from ..threads import one_blas_thread
from ..time_limit import OutOfTime, check_time, cut_short, seconds_left
from .blocks import BLOCKS
from .cost import Cost
from .growth import GROWTH, LAST, STIFF
from .hexahedra import HEXAHEDRA, LAST_HEXAHEDRA
from .mapping_task import MappingTask
from .network import NETWORK
from .planes import PLANES
from .sharp import SHARP
from .stacks import STACKS
from .stubs import STUBS
from .tried import Tried
from .way import Suits, Way

_log = logging.getLogger(__name__)

WAYS: tuple[Way, ...] = (PLANES, STACKS, HEXAHEDRA, STUBS, BLOCKS, SHARP, NETWORK, GROWTH, STIFF, LAST, LAST_HEXAHEDRA)
_CHECKPOINT = "choice"


def ways_of(asked: Iterable[Way | str] | Way | str) -> tuple[Way, ...]:
    """Return ways in the order in which they are asked for, each once, by themselves or by their names.

    A single one needs no list. Raises ValueError for an unknown name, TypeError for what is no way and no name.
    """
    if isinstance(asked, str | bytes | Way) or not isinstance(asked, Iterable):
        return (_way_of(asked),)
    return tuple(dict.fromkeys(map(_way_of, asked)))


def _way_of(asked: object) -> Way:
    """Return a way, or the one of a name, which may have `-` for spaces. Raises as `ways_of`."""
    if isinstance(asked, Way):
        return asked
    if not isinstance(asked, str):
        raise TypeError(f"ways must be names of ways, such as ('planes', 'stacks'), got {asked!r:.80}")
    for way in WAYS:
        if way.name == asked.replace("-", " "):
            return way
    raise ValueError(f"unknown way {asked!r:.80}: choose from {names_of(WAYS)}")


def first_way(task: MappingTask, ways: tuple[Way, ...]) -> tuple[Way, Suits]:
    """Return the first way that suits a body, and why: its own words, or else those of the last way that does not.

    That of the checkpoint is taken if there is one: to find it may take minutes. Raises LayoutError if none suits, and
    for one cube on a body with handles; SkeletonError for such a body without a skeleton.
    """
    if (kept := task.checkpoints.load(_CHECKPOINT)) is not None:
        _, state = kept
        return next(way for way in ways if way.name == state["way"]), Suits(True, state["why"])
    if task.surface.genus and task.config.blocks == 1:
        raise LayoutError(
            f"genus {task.surface.genus}: one cube is never mapped one-to-one onto a body with handles; allow more"
        )
    words = Suits(False)
    for way in ways:
        suits = _suits(way, task)
        words = suits if suits.why else words
        if suits.applies:
            return way, words
    raise LayoutError(f"none of the ways asked for suits this body ({names_of(ways)}): allow others")


def _suits(way: Way, task: MappingTask) -> Suits:
    """Return whether a way suits a body; if not, its reason is kept for the report."""
    suits = way.suits(task)
    if not suits.applies and suits.why:
        task.refused[way.name] = suits.why
    return suits


def cost_of_first(task: MappingTask, ways: tuple[Way, ...]) -> tuple[str, Cost | None]:
    """Return the name and the cost of the first way that suits a body; "" and None if the run will refuse it.

    The cost is None, too, if the way turns out to have no blocks for the body.
    """
    with one_blas_thread():
        try:
            way, _ = first_way(task, ways)
        except (LayoutError, SkeletonError, CheckpointError):
            return "", None
        try:
            return way.name, way.cost(task)
        except (LayoutError, SkeletonError):
            return way.name, None


def attempts(task: MappingTask, ways: tuple[Way, ...], checkpoints: Checkpoints) -> tuple[tuple[Tried, ...], str]:
    """Make maps until one is good enough, at most as many as the options say.

    Return all that was tried, with at least one map, and why the first way suits the body. Raises LayoutError if no
    way makes a map.
    """
    with timed(task.seconds, "fit"), one_blas_thread():
        first, suits = first_way(task, ways)
    check_time()  # a fast way would end before the clock is looked at
    if suits.why:
        _log.log(suits.level, "%s", suits.why)
    task.checkpoints.save(_CHECKPOINT, {}, {"way": first.name, "why": suits.why})
    tried: tuple[Tried, ...] = ()
    for way in ways[ways.index(first) :]:
        if not _is_next(way, tried, task):
            continue
        if tried:
            _tell(tried[-1], way)
        before, has_map = dict(task.seconds), any(one.attempt is not None for one in tried)
        if has_map and seconds_left() <= 0.0:
            cut_short(f"the ways to a map, before {way.name}")
            break
        try:
            attempt = way.make(task, checkpoints.of_part(len(tried)) if tried else checkpoints)
        except OutOfTime:
            if not has_map:
                raise
            cut_short(f"the ways to a map, in {way.name}")
            break
        spent = {step: seconds - before.get(step, 0.0) for step, seconds in task.seconds.items()}
        tried += (Tried(way, attempt, spent),)
    if all(one.attempt is None for one in tried):
        raise LayoutError(f"none of the ways asked for makes a map of this body ({names_of(ways)}): allow others")
    return tried, suits.why


def names_of(ways: Iterable[Way]) -> str:
    """Return the names of ways, as a message lists them and the command line takes them."""
    return ", ".join(way.name.replace(" ", "-") for way in ways)


def _is_next(way: Way, tried: tuple[Tried, ...], task: MappingTask) -> bool:
    """Return whether a way is taken after those that were tried; of those that count there is a limit."""
    if way.counted and sum(one.way.counted for one in tried) >= task.most_starts:
        return False
    return not tried or (way.follows(tried) and _suits(way, task).applies)


def _tell(last: Tried, way: Way) -> None:
    """Log the fault of the last way, and the way that follows it."""
    level = logging.INFO if last.attempt is None else logging.WARNING
    _log.log(level, "%s: %s; %s instead", last.way.name, last.fault, way.doing)
