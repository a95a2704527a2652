"""Inserts knots where a map needs them and optimises further, until its boundary is close enough to the surface.

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
from .optimization.endings import Course
from .optimization.newton import LEAST_STEPS
from .optimization.optimized import Optimized
from .optimization.phases import FIRM_ROUNDS, Polish, Schedule, Separate, Unfold
from .optimization.rounds import optimize
from .optimization.spans import in_blocks
from .optimization.surface_distance import SurfaceFit
from .optimization.term import Weights
from .progress import History, ProgressCallback
from .quality.distortion import arap_grid
from .quality.two_sided import two_sided
from .spline.bspline import breakpoints, midpoints
from .spline.spline_map import SplineMap
from .spline.volume import BSplineVolume

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

Stop = Literal["tolerance met", "limit reached", "no better map"]


@dataclass(frozen=True)
class Level:
    """Describe a map: its control points a direction, its distance from the surface, and the rounds on its knots.

    distance, largest: between surface and spline, both ways, over the diagonal of the surface's bounding box; root mean
    square, and the largest of all samples. unproved: the number of spans on which det J > 0 is not proved. rounds,
    seconds: the number of rounds and the wall seconds by phase, and their ending; empty for the map before the first
    refinement, whose rounds belong to an attempt.
    """

    control_points: tuple[int, int, int]
    distance: float
    largest: float
    unproved: int
    rounds: dict[str, int] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict, compare=False)
    ending: str = ""

    def __str__(self) -> str:
        size = " x ".join(map(str, self.control_points))
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
    found: Optimized,
    fit: SurfaceFit,
    config: SplineConfig,
    refinement: RefinementConfig,
    weights: Weights,
    *,
    history: History,
    progress: ProgressCallback,
    checkpoints: Checkpoints,
) -> tuple[Optimized, SurfaceFit, Refinement]:
    """Return the last map of which no less is proved than of `found`, its surface data, and how it was found.

    Each refinement has checkpoints of its own: the chosen knots, and those of its spline stage.
    """
    report: dict[str, Any] = {"history": history, "progress": progress}
    spots = _Spots.of(found, fit)
    levels, dropped = [spots.level], None
    stopped: Stop = "tolerance met"
    for number in count(1):
        _log.info("%s", levels[-1])
        if not any(found.faults) and levels[-1].distance <= refinement.tolerance:
            break
        kept = checkpoints.of_part(f"refined{number}")
        finer = _chosen_knots(spots, config, refinement.max_control_points, kept)
        if tuple(len(row) - config.degree - 1 for row in finer) == levels[-1].control_points:
            stopped = "limit reached"
            break
        other, surface, course = _optimized_on(finer, spots.volume, fit, config, weights, kept, report)
        spots = _Spots.of(other, surface, course)
        if (other.faults, spots.level.distance) >= (found.faults, levels[-1].distance):
            stopped, dropped = "no better map", spots.level
            _log.warning("no better map with %s, %d spans unproved: the one before is kept", dropped, dropped.unproved)
            break
        found, fit = other, surface
        levels.append(spots.level)
    told = Refinement(refinement.tolerance, refinement.max_control_points, stopped, tuple(levels), dropped)
    return found, fit, told


@dataclass(frozen=True, eq=False)
class _Spots:
    """A map at volume 1, with its distances and unproved spans, and their places.

    places (n, 3), squares (n,): the parameters of samples on the surface and the spline, and their squared distances
    times the areas they stand for.
    """

    volume: BSplineVolume
    places: Array
    squares: Array
    unproved: IntArray
    level: Level

    @classmethod
    def of(cls, found: Optimized, fit: SurfaceFit, course: Course | None = None) -> "_Spots":
        """Measure a map as the report does; course: of the rounds on its knots."""
        volume = found.spline.volume
        gaps = two_sided(volume, fit.points, fit.places.triangles)
        distance = gaps.summary().scaled(1.0 / float(np.linalg.norm(np.ptp(fit.points, axis=0))))
        unproved = found.unproved[:, 1:]
        level = Level(volume.shape, distance.rms, distance.max, len(unproved))
        if course is not None:
            level = replace(level, rounds=dict(course.rounds), seconds=course.seconds, ending=str(course.ending))
        ways = (gaps.mesh_to_spline, gaps.spline_to_mesh)
        places = np.concatenate([way.parameters for way in ways])
        squares = np.concatenate([way.shares * way.distances**2 for way in ways])
        return cls(volume, places, squares, unproved, level)

    def amounts(self, distortion_share: float) -> list[Array]:
        """Return for each direction the amounts on each of its spans.

        Unproved spans, where there are any; else squared distances, and distortion above the limit with a share.
        """
        knots = self.volume.knots
        if len(self.unproved):
            n_spans = [len(np.unique(row)) - 1 for row in knots]
            return [np.bincount(self.unproved[:, d], minlength=n).astype(float) for d, n in enumerate(n_spans)]
        boundary = totals_along(self.places, self.squares / self.squares.sum(), knots)
        points, (density,), weights = arap_grid(self.volume, n_gauss=2)
        limit = ARAP_LIMIT * (1.0 + float(np.sum(weights * density)))
        excess = weights * np.maximum(density - limit, 0.0) ** 2
        grid = np.stack(np.meshgrid(*points, indexing="ij"), axis=-1).reshape(-1, 3)
        stretched = totals_along(grid, distortion_share * excess.ravel() / max(float(excess.sum()), 1e-300), knots)
        return [a + b for a, b in zip(boundary, stretched, strict=True)]


def totals_along(places: Array, amounts: Array, knots: Knots) -> list[Array]:
    """Return for each direction the amounts (m,) at places (m, 3) of the cube, summed over each of its spans."""
    return [np.histogram(places[:, axis], breakpoints(row), weights=amounts)[0] for axis, row in enumerate(knots)]


def _chosen_knots(spots: _Spots, config: SplineConfig, most: int, checkpoints: Checkpoints) -> Knots:
    """Return finer knots, those of the checkpoint where there is one, and keep them in a checkpoint.

    most: control points a direction.
    """
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        u, v, w = (saved[0][axis] for axis in "uvw")
        return u, v, w
    narrowest = _NARROWEST / (config.control_points - config.degree)
    amounts = spots.amounts(DISTORTION)
    finer = halved_where_most(spots.volume.knots, amounts, np.array(spots.volume.shape), most, narrowest)
    checkpoints.save(_CHECKPOINT, dict(zip("uvw", finer, strict=True)), {})
    return finer


def halved_where_most(knots: Knots, amounts: list[Array], counts: IntArray, most: int, narrowest: float) -> Knots:
    """Return the knots with those spans halved on which most is found, the largest amounts of all directions first.

    amounts: of each span, a direction. counts (3,): control points a direction, `most` at most. No span is halved any
    more once `SHARE` of all amounts is on those that are, or the control points are `GROWTH` times as many; none into
    halves below `narrowest`.
    """
    counts, total = counts.copy(), np.prod(counts)
    halves = np.concatenate([np.diff(breakpoints(row)) / 2.0 for row in knots])
    ranked = np.concatenate([np.stack([np.full(len(a), d), np.arange(len(a))], axis=1) for d, a in enumerate(amounts)])
    values = np.concatenate(amounts)
    chosen: tuple[list[int], ...] = ([], [], [])
    reached, wanted = 0.0, SHARE * values.sum()
    for place in np.argsort(-values, kind="stable"):
        axis, span = ranked[place]
        if reached >= wanted or np.prod(counts + (np.arange(3) == axis)) > GROWTH * total:
            break
        if counts[axis] < most and halves[place] >= narrowest:
            chosen[axis].append(span)
            counts[axis] += 1
        reached += values[place]
    u, v, w = (np.sort(np.concatenate([row, midpoints(row)[spans]])) for row, spans in zip(knots, chosen, strict=True))
    return u, v, w


def _optimized_on(
    finer: Knots,
    volume: BSplineVolume,
    fit: SurfaceFit,
    config: SplineConfig,
    weights: Weights,
    checkpoints: Checkpoints,
    report: dict[str, Any],
) -> tuple[Optimized, SurfaceFit, Course]:
    """Insert the knots and continue with the rounds that follow those of a certified map; return their course, too."""
    phases = (Unfold(), Separate(), Polish(rounds=POLISH))
    schedule = Schedule(phases, FIRM_ROUNDS + ROUNDS, (LEAST_STEPS,) * (FIRM_ROUNDS + 2), gain=_GAIN)
    start = volume.on_knots(finer)
    first = SplineMap.of(start)
    surface = fit.on_nets(first.nets)
    form = DeterminantForm(start)
    nearly = np.flatnonzero(np.ldexp(form.survey()[0], form.exponent) < MIN_COEFFICIENT)
    found, course = optimize(
        first,
        surface,
        config,
        schedule,
        replace(weights, surface=_CLOSER * weights.surface),
        checkpoints=checkpoints,
        begun=FIRM_ROUNDS,
        watched=in_blocks([form.numbers(nearly)]),
        **report,
    )
    _log.info("the rounds end: %s; %s", course.ending, course.ending.sentence)
    return found, surface, course
