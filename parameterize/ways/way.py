"""Defines a way, which makes the map of a surface, and the attempt that comes of it."""

import logging
import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..checkpoint import Checkpoints
from ..optimization.endings import CertifiedMap, Course
from ..optimization.phases import Schedule
from ..optimization.reassignment import boundary_samples
from ..optimization.rounds import optimize_coarse_first
from ..optimization.surface_distance import Correspondence
from ..optimization.term import Weights
from ..progress import timed
from ..spline.spline_map import SplineMap
from ..surface.solid import Solid
from .cost import Cost
from .mapping_task import MappingTask

if TYPE_CHECKING:
    from .tried import Tried

_log = logging.getLogger(__name__)

_A_SPAN = 4  # samples of the boundary, of which the distance back to the surface is taken


@dataclass(frozen=True, eq=False)
class Attempt:
    """Hold a map, the course of its rounds, its surface data, and the weights of the energy for its refinement."""

    found: CertifiedMap
    course: Course
    fit: Correspondence
    weights: Weights

    @cached_property
    def distance(self) -> float:
        """Return the root mean square distance of the surface's points from the map, at volume 1."""
        return math.sqrt(self.fit.mean_square(self.found.spline.control))

    @cached_property
    def distance_back(self) -> float:
        """Return the root mean square distance of the map's boundary from the surface, at volume 1.

        It is large where the map spans a hollow of the surface, whose points are not far from it.
        """
        samples = boundary_samples(self.found.spline, _A_SPAN)
        squares = Solid(self.fit.points, self.fit.sliding.triangles).squared_depths(samples.points)
        return math.sqrt(np.average(squares, weights=samples.areas))

    @property
    def rank(self) -> tuple[int, bool, bool, float]:
        """Return the faults of the map, then its distance: of two attempts the one with the lower rank is better."""
        return *self.found.rank, self.distance


@dataclass(frozen=True)
class Suits:
    """Say whether a way suits a body, and why, in words with the figures that decide; "" where the options say it.

    level: of the line in the log.
    """

    applies: bool
    why: str = ""
    level: int = logging.INFO


@dataclass(frozen=True)
class Way(ABC):
    """Describe a way to a map; docs/ways.md says which body takes which.

    name: the name in report.json, and, with "-" for spaces, on the command line. doing: the way in words, as the log
    shows it. origin: the kind of way. comes_from: the kind in words for report.html, the map's source and how it is
    made.
    """

    name: str
    doing: str
    origin: ClassVar[str]
    comes_from: ClassVar[tuple[str, str]]
    counted: ClassVar[bool] = False  # among the tries that `Config.starts` limits

    @abstractmethod
    def suits(self, task: MappingTask) -> Suits:
        """Return whether the way suits the body and the options, and why.

        Raises SkeletonError for a body with handles without a skeleton.
        """

    @abstractmethod
    def make(self, task: MappingTask, checkpoints: Checkpoints) -> Attempt | None:
        """Return an attempt with its map; None if the way turns out not to suit the shape."""

    def serves(self, attempt: Attempt) -> bool:
        """Return whether a map that this way has made is good enough, so that no other way follows."""
        return not any(attempt.found.faults)

    def follows(self, tried: "Sequence[Tried]") -> bool:
        """Return whether this way comes after others that were tried: if none of their maps is good enough."""
        return not any(one.serves for one in tried)

    def cost(self, task: MappingTask) -> Cost | None:
        """Return the work and the memory of this way for a body that it suits; None if the work is not known."""
        return None


def optimized(
    first: SplineMap,
    fit: Correspondence,
    schedule: Schedule,
    task: MappingTask,
    checkpoints: Checkpoints,
    weights: Weights = Weights(),
) -> Attempt:
    """Return the attempt that the rounds make of a first map, on the knots of `fit`."""
    spline = task.config.spline
    with timed(task.seconds, "optimize"):
        made = optimize_coarse_first(first, fit, spline, schedule, weights, checkpoints=checkpoints, **task.report)
    attempt = Attempt(*made, weights)
    _log.info("the rounds end: %s; %s", attempt.course.ending, attempt.course.ending.sentence)
    return attempt
