"""Holds what all ways share: the surface, the options, and facts on the body that are found once."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

from ..arrays import Array, IntArray, in_brackets
from ..checkpoint import Checkpoints
from ..config import Config, SplineConfig
from ..cube.cutting import subdivide_finely
from ..layouts.rods.along_skeleton import SPANS
from ..layouts.skeleton.curve_skeleton import skeleton_of
from ..layouts.skeleton.graph import Skeleton, SkeletonError
from ..optimization.sliding import SlidingParameters
from ..optimization.surface_distance import TANGENTIAL, Correspondence
from ..surface.geometry import vertex_quadrics, vertex_weights
from ..surface.surface import Surface

FEWEST_SPANS = 4  # across a block: with fewer its section cannot become round
MOST_POINTS = (
    30_000  # added where long edges of the mesh are cut, else they are cut less finely: memory grows with them
)
Fact = TypeVar("Fact")
_facts: WeakKeyDictionary[Surface, dict[object, Any]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class MappingTask:
    """Hold the surface that is mapped, the options, the device, and where seconds, steps and checkpoints go."""

    surface: Surface
    config: Config
    seed: int
    device: str  # where the network is trained, "cpu" or "cuda"
    dtype: str  # its precision, "float32" or "float64"
    given_corners: IntArray | None
    seconds: dict[str, float]  # by step, of the run so far
    report: dict[str, Any]  # history and progress, as Trainer and optimize take them
    checkpoints: Checkpoints = field(default_factory=Checkpoints.none)  # of what all ways share
    refused: dict[str, str] = field(default_factory=dict)  # why ways do not suit the body, by their names

    @property
    def own(self) -> int:
        """Return the number of the surface's own vertices, which stay the first vertices where edges are cut."""
        return len(self.surface.vertices)

    @property
    def most_starts(self) -> int:
        """Return the largest number of tries: one if the user gives corners, as only the first way holds them."""
        return self.config.starts if self.given_corners is None else 1

    @cached_property
    def mesh(self) -> tuple[Array, IntArray]:
        """Return the vertices (n, 3) and the faces (m, 3) of the surface at volume 1, with long edges cut."""
        longest = self.config.spline.longest_edge
        return subdivide_finely(self.surface.unit_vertices, self.surface.faces, longest, self.own + MOST_POINTS)

    @property
    def spans_across(self) -> int:
        """Return the spans across a block, in proportion to the control points a direction that one cube would have."""
        return max(FEWEST_SPANS, round(SPANS * self.config.spline.control_points / SplineConfig.control_points))

    @property
    def skeleton(self) -> Skeleton:
        """Return the skeleton of the solid at volume 1. Raises SkeletonError if it has none."""
        found = self.fact("skeleton", self._skeleton)
        if isinstance(found, str):
            raise SkeletonError(found)
        return found

    def _skeleton(self) -> Skeleton | str:
        """Return the skeleton, or why there is none."""
        surface = self.surface
        try:
            return skeleton_of(surface.unit_vertices, surface.faces, surface.genus, self.in_users_units)
        except SkeletonError as error:
            return str(error)

    def in_users_units(self, point: Array) -> str:
        """Return a point (3,) at volume 1 in words, in the user's units."""
        return in_brackets(self.surface.from_unit(point))

    def correspondence(self, parameters: SlidingParameters, points: Array) -> Correspondence:
        """Return surface points (n, 3) with their parameters; the surface's own vertices are first."""
        return Correspondence(
            parameters,
            points,
            vertex_quadrics(points, parameters.triangles, TANGENTIAL),
            vertex_weights(points, parameters.triangles, self.own),
            given_corners=None if self.given_corners is None else self.mesh[0][self.given_corners],
        )

    def fact(self, key: object, find: Callable[[], Fact]) -> Fact:
        """Return what `find` finds on the surface, once for a key: the forecast of a run asks before the run does."""
        known = _facts.setdefault(self.surface, {})
        if key not in known:
            known[key] = find()
        found: Fact = known[key]
        return found
