"""Inserts knots where a map needs them and optimises further, until its boundary is close enough to the surface.

Each direction of each block has knots of its own, as far as interfaces allow: on both sides they are the same.
Knots that are inserted leave a map as it is, so each further spline stage starts from the map of the stage before.
What it finds is kept where no less is proved of it; else the map before is the result, and that is said.
"""

import logging
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any, Literal

import numpy as np

from .arrays import Array, IntArray, Knots
from .certificate.determinant import DeterminantForm
from .checkpoint import Checkpoints
from .config import RefinementConfig, SplineConfig
from .optimization.determinant_penalty import MIN_COEFFICIENT
from .optimization.distortion import ARAP_LIMIT
from .optimization.endings import CertifiedMap, Course
from .optimization.phases import FIRM_ROUNDS, Polish, Schedule, Separate, Unfold
from .optimization.rounds import optimize
from .optimization.spans import in_blocks
from .optimization.surface_distance import Correspondence
from .optimization.term import Weights
from .progress import History, ProgressCallback
from .quality.distances import two_sided
from .quality.distortion import arap_grid, own_boxes
from .spline.body import shared_numbers
from .spline.bspline import breakpoints, midpoints
from .spline.patch_groups import group_of
from .spline.spline_map import ControlNets, SplineMap, tied_spans
from .spline.volume import AXES
from .time_limit import OutOfTime, cut_short, seconds_to_spare

_log = logging.getLogger(__name__)
_CHECKPOINT = "knots"
SHARE = 0.7  # of all that is found lies on the spans that are halved together: fewer would take more refinements
GROWTH = 2.0  # factor of the number of control points in one refinement, at most: the next one knows better where
DISTORTION = 0.25  # the weight of distortion above its limit, where all squared distances together have weight 1
_NARROWEST = 0.2  # of the first spline's spans: none gets narrower than this share of their length
_CLOSER = 3.0  # factor of the surface's weight: the boundary counts more once the map is in shape
_GAIN = 3e-4  # in place of the spline stage's: the first steps on new knots gain little, the later ones more
ROUNDS = 8  # after a refinement, at most
POLISH = 3  # of these rounds, while the map is certified, at most

Stop = Literal["tolerance met", "limit reached", "no better map", "out of time"]


@dataclass(frozen=True)
class Level:
    """Describe a map: its control points, its distance from the surface, and the rounds on its knots.

    control_points: three numbers for one cube, one a direction; for several blocks one number, of the control points of
    all blocks, those on interfaces once. distance, largest: between surface and spline, both ways, over the diagonal of
    the surface's bounding box; root mean square, and the largest of all samples. unproved: the number of spans on which
    det J > 0 is not proved. rounds, seconds: the number of rounds and the wall seconds by phase, and their ending;
    empty for the map before the first refinement, whose rounds belong to an attempt.
    """

    control_points: tuple[int, int, int] | int
    distance: float
    largest: float
    unproved: int
    rounds: dict[str, int] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict, compare=False)
    ending: str = ""

    def __str__(self) -> str:
        found = self.control_points
        size = f"{found:,}" if isinstance(found, int) else " x ".join(map(str, found))
        return f"{size} control points: distance {self.distance:.3g}, largest {self.largest:.3g} of the diagonal"


@dataclass(frozen=True)
class Refinement:
    """Describe the refinements that led to the control points of a map.

    levels: the maps that were kept, the result last. dropped: the map with more control points that was not kept, as
    less is proved of it, or its boundary is no closer. stopped: the reason why no more knots were inserted.
    """

    tolerance: float
    max_control_points: int
    stopped: Stop
    levels: tuple[Level, ...]
    dropped: Level | None


def refine(
    found: CertifiedMap,
    fit: Correspondence,
    config: SplineConfig,
    refinement: RefinementConfig,
    weights: Weights,
    *,
    history: History,
    progress: ProgressCallback,
    checkpoints: Checkpoints,
) -> tuple[CertifiedMap, Correspondence, Refinement]:
    """Return the last map of which no less is proved than of `found`, its surface data, and how it was found.

    Each refinement has checkpoints of its own: the chosen knots, and those of its spline stage.
    """
    report: dict[str, Any] = {"history": history, "progress": progress}
    spots, narrowest = _Spots.of(found, fit), _NARROWEST / np.array(found.spline.nets.spans)
    levels, dropped = [spots.level], None
    stopped: Stop = "tolerance met"
    for number in count(1):
        _log.info("%s", levels[-1])
        if not any(found.faults) and levels[-1].distance <= refinement.tolerance:
            break
        if seconds_to_spare() <= 0.0:
            stopped = "out of time"
            break
        kept = checkpoints.of_part(f"refined{number}")
        finer = _chosen_knots(spots, refinement.max_control_points, narrowest, kept)
        if ControlNets(config.degree, finer).shapes == found.spline.nets.shapes:
            stopped = "limit reached"
            break
        try:
            other, surface, course = _optimized_on(finer, found.spline, fit, config, weights, kept, report)
        except OutOfTime:
            stopped = "out of time"
            break
        spots = _Spots.of(other, surface, course)
        if (other.faults, spots.level.distance) >= (found.faults, levels[-1].distance):
            stopped, dropped = "no better map", spots.level
            _log.warning("no better map with %s, %d spans unproved: the one before is kept", dropped, dropped.unproved)
            break
        found, fit = other, surface
        levels.append(spots.level)
    if stopped == "out of time":
        cut_short("the refinement of the spline")
    told = Refinement(refinement.tolerance, refinement.max_control_points, stopped, tuple(levels), dropped)
    return found, fit, told


@dataclass(frozen=True, eq=False)
class _Spots:
    """A map at volume 1, with its distances and unproved spans, and their places.

    places (n, 3), patches (n,), squares (n,): the parameters of samples on the surface and the spline, their blocks,
    and their squared distances times the areas they stand for. unproved: (k, 4).
    """

    spline: SplineMap
    places: Array
    patches: IntArray
    squares: Array
    unproved: IntArray
    level: Level

    @classmethod
    def of(cls, found: CertifiedMap, fit: Correspondence, course: Course | None = None) -> "_Spots":
        """Measure a map as the report does; course: of the rounds on its knots."""
        spline, nets = found.spline, found.spline.nets
        gaps = two_sided(spline.body, fit.points, fit.sliding.triangles)
        distance = gaps.summary().scaled(1.0 / float(np.linalg.norm(np.ptp(fit.points, axis=0))))
        size = nets.shapes[0] if nets.is_single else shared_numbers(nets.shapes, nets.interfaces)[1]
        level = Level(size, distance.rms, distance.max, len(found.unproved))
        if course is not None:
            level = replace(level, rounds=dict(course.rounds), seconds=course.seconds, ending=str(course.ending))
        ways = (gaps.mesh_to_spline, gaps.spline_to_mesh)
        places, patches = (np.concatenate([getattr(way, name) for way in ways]) for name in ("parameters", "patches"))
        squares = np.concatenate([way.shares * way.distances**2 for way in ways])
        return cls(spline, places, patches, squares, found.unproved, level)

    def amounts(self, distortion_share: float) -> list[Array]:
        """Return for each direction of each block, block after block, the amounts on each of its spans.

        Unproved spans, where there are any; else squared distances, and distortion above the limit with a share.
        """
        nets = self.spline.nets
        if len(self.unproved):
            return [
                np.bincount(self.unproved[self.unproved[:, 0] == block, 1 + axis], minlength=count).astype(float)
                for block, counts in enumerate(nets.spans)
                for axis, count in enumerate(counts)
            ]
        shares, boundary, stretched = self.squares / self.squares.sum(), list[Array](), list[Array]()
        grids, excesses = zip(*map(self._excess, range(len(nets.knots)), _boxes(self.spline)), strict=True)
        total = max(sum(float(excess.sum()) for excess in excesses), 1e-300)
        for block, (knots, grid, excess) in enumerate(zip(nets.knots, grids, excesses, strict=True)):
            own = self.patches == block
            boundary += totals_along(self.places[own], shares[own], knots)
            stretched += totals_along(grid, distortion_share * excess.ravel() / total, knots)
        return [a + b for a, b in zip(boundary, stretched, strict=True)]

    def _excess(self, block: int, box: Array) -> tuple[Array, Array]:
        """Return parameters (m, 3) in a block, and there the integrand of the squared distortion above the limit."""
        points, (density,), weights = arap_grid(self.spline.patch(block), n_gauss=2, box=box)
        limit = ARAP_LIMIT * (1.0 + float(np.sum(weights * density)))
        excess = np.prod(box) * weights * np.maximum(density - limit, 0.0) ** 2
        return np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 3), excess


def _boxes(spline: SplineMap) -> Array:
    """Return the sides (blocks, 3) of the boxes against which distortion is measured: one cube, or each block's own."""
    return np.ones((1, 3)) if spline.nets.is_single else own_boxes(spline.body)


def totals_along(places: Array, amounts: Array, knots: Knots) -> list[Array]:
    """Return for each direction the amounts (m,) at places (m, 3) of a block, summed over each of its spans."""
    return [np.histogram(places[:, axis], breakpoints(row), weights=amounts)[0] for axis, row in enumerate(knots)]


def _chosen_knots(spots: _Spots, most: int, narrowest: Array, checkpoints: Checkpoints) -> tuple[Knots, ...]:
    """Return finer knots of each block, those of the checkpoint where there is one, and keep them in a checkpoint.

    most: control points a direction. narrowest: (blocks, 3).
    """
    nets = spots.spline.nets
    names = [[f"{axis}{block}" for axis in AXES] for block in range(len(nets.knots))]
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        return tuple((saved[0][u], saved[0][v], saved[0][w]) for u, v, w in names)
    finer = halved_where_most(nets, spots.amounts(DISTORTION), most, narrowest)
    rows = {name: row for own, knots in zip(names, finer, strict=True) for name, row in zip(own, knots, strict=True)}
    checkpoints.save(_CHECKPOINT, rows, {})
    return finer


def halved_where_most(nets: ControlNets, amounts: list[Array], most: int, narrowest: Array) -> tuple[Knots, ...]:
    """Return the knots with those spans halved on which most is found, the largest amounts of all directions first.

    Spans that interfaces make one count together, and are halved together. amounts: of each span, a direction, block
    after block. most: control points a direction. narrowest: (blocks, 3). No span is halved any more once `SHARE` of
    all amounts is on those that are, or the control points are `GROWTH` times as many; none into halves below
    `narrowest`.
    """
    rows = [row for knots in nets.knots for row in knots]
    owners = np.repeat(np.arange(len(rows)), [len(row) for row in amounts])
    halves = np.concatenate([np.diff(breakpoints(row)) / 2.0 for row in rows])
    is_wide = halves >= narrowest.ravel()[owners]
    classes = np.concatenate(tied_spans(nets))
    values = np.bincount(classes, np.concatenate(amounts))
    counts = np.ravel(nets.shapes)
    reached, wanted, total = 0.0, SHARE * values.sum(), _control_points(counts)
    chosen = np.zeros(len(classes), dtype=bool)
    for number in np.argsort(-values, kind="stable"):
        members = classes == number
        grown = counts + np.bincount(owners[members], minlength=len(counts))
        if reached >= wanted or _control_points(grown) > GROWTH * total:
            break
        if grown[owners[members]].max() <= most and is_wide[members].all():
            chosen, counts = chosen | members, grown
        reached += values[number]
    finer = [np.sort(np.append(row, midpoints(row)[chosen[owners == d]])) for d, row in enumerate(rows)]
    return tuple((finer[d], finer[d + 1], finer[d + 2]) for d in range(0, len(finer), 3))


def _control_points(counts: IntArray) -> int:
    """Return the number of control points of blocks, of which each direction has so many (3 blocks,)."""
    return int(counts.reshape(-1, 3).prod(axis=1).sum())


def _optimized_on(
    finer: tuple[Knots, ...],
    spline: SplineMap,
    fit: Correspondence,
    config: SplineConfig,
    weights: Weights,
    checkpoints: Checkpoints,
    report: dict[str, Any],
) -> tuple[CertifiedMap, Correspondence, Course]:
    """Insert the knots and continue with the rounds that follow those of a certified map; return their course, too."""
    phases = (Unfold(), Separate(), Polish(rounds=POLISH))
    schedule = Schedule(phases, FIRM_ROUNDS + ROUNDS, gain=_GAIN)
    first = spline.on_knots(finer)
    surface = fit.on_nets(first.nets)
    found, course = optimize(
        first,
        surface,
        config,
        schedule,
        replace(weights, surface=_CLOSER * weights.surface),
        checkpoints=checkpoints,
        begun=FIRM_ROUNDS,
        watched=_nearly_folded(first),
        **report,
    )
    _log.info("the rounds end: %s; %s", course.ending, course.ending.sentence)
    return found, surface, course


def _nearly_folded(spline: SplineMap) -> IntArray:
    """Return the spans (k, 4) with a Bernstein coefficient of det J that the penalty would raise."""
    found = []
    for block, box in enumerate(_boxes(spline)):
        form = DeterminantForm(group_of(spline.patch(block)))
        low = np.ldexp(form.survey()[0][0, 0], form.exponents) < MIN_COEFFICIENT * np.prod(box)
        found.append(form.numbers(np.flatnonzero(low))[:, 1:])
    return in_blocks(found)
