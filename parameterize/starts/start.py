"""Defines a start, which makes the map of a surface for the rounds to optimise, and the task that all starts share."""

import logging
import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

import numpy as np

from ..arrays import Array, IntArray, in_brackets
from ..checkpoint import Checkpoints
from ..coarse import coarse_knots, optimize_coarse_first
from ..config import Config, SplineConfig
from ..cube.constrained import Constrained
from ..cube.cube_layout import CubeLayout
from ..cube.cutting import subdivide_finely
from ..cube.sphere import lay_on_sphere
from ..layouts.planes.exact_blocks import division_of, layout_of
from ..layouts.rods.along_skeleton import SPANS, BlockLayout, LayoutError, block_layout
from ..layouts.skeleton.choice import Choice, choose
from ..layouts.skeleton.graph import Skeleton, SkeletonError
from ..layouts.skeleton.solid import skeleton_of
from ..layouts.stacks.stacked_blocks import Columns, columns_of
from ..layouts.stubs.pieces import Handle, handles_of
from ..optimization.certified_map import CertifiedMap
from ..optimization.endings import Course
from ..optimization.phases import Schedule
from ..optimization.reassignment import boundary_samples
from ..optimization.sliding import SlidingParameters
from ..optimization.surface_distance import TANGENTIAL, Correspondence
from ..optimization.term import Weights
from ..progress import timed
from ..spline.control_nets import ControlNets
from ..spline.spline_map import SplineMap
from ..surface.features import features_of
from ..surface.geometry import normals_and_areas, vertex_quadrics, vertex_weights
from ..surface.ridges import Ridges
from ..surface.solid import Solid
from ..surface.surface import Surface
from ..threads import one_blas_thread
from .kept_blocks import kept_choice

_log = logging.getLogger(__name__)

FEWEST_SPANS = 4  # across a block: with fewer its section cannot become round
COMPACT = 4.0  # cubed area of the surface over 36 pi, at volume 1: bodies with less have no long limbs, and most have
# less, so that these need not wait for a skeleton
_A_SPAN = 4  # samples of the boundary, of which the distance back to the surface is taken
_CELL = 0.03  # of the lattice whose points tell the areas of sections, at volume 1
FEW_EDGES = 4.0  # length at volume 1 of sharp edges: less is an eye or a mouth; the rim of a half ball has 5, a cube 12
PIECE = 0.25  # length at volume 1: a coarse mesh of a smooth body has sharp edges in shorter pieces
ALL = 0.95  # of the length of all sharp edges, which the cube's edges have to carry: with .92 of it on them, a notched
# cube came out three times as far from its surface as with edges that follow none
Origin = Literal["network", "growth", "extension", "blocks", "planes", "columns"]
MOST_POINTS = (
    30_000  # added where long edges of the mesh are cut, else they are cut less finely: memory grows with them
)


@dataclass(frozen=True, eq=False)
class Task:
    """Hold the data that all starts share: the surface, the options, the device, and results that are computed once."""

    surface: Surface
    config: Config
    seed: int
    device: str  # where the network is trained, "cpu" or "cuda"
    dtype: str  # its precision, "float32" or "float64"
    given_corners: IntArray | None
    seconds: dict[str, float]  # by step, of the run so far
    report: dict[str, Any]  # history and progress, as Trainer and optimize take them
    checkpoints: Checkpoints = field(default_factory=Checkpoints.none)  # of what all starts share

    @property
    def own(self) -> int:
        """Return the number of the surface's own vertices, which stay the first vertices where edges are cut."""
        return len(self.surface.vertices)

    @property
    def most_starts(self) -> int:
        """Return the largest number of starts: one where the user gives corners, as only the first start holds them."""
        return self.config.starts if self.given_corners is None else 1

    @cached_property
    def mesh(self) -> tuple[Array, IntArray]:
        """Return the vertices (n, 3) and the faces (m, 3) of the surface at volume 1, with long edges cut."""
        longest = self.config.spline.longest_edge
        return subdivide_finely(self.surface.unit_vertices, self.surface.faces, longest, self.own + MOST_POINTS)

    @cached_property
    def skeleton(self) -> Skeleton:
        """Return the skeleton of the solid at volume 1. Raises SkeletonError where it has none."""
        surface = self.surface
        return skeleton_of(surface.unit_vertices, surface.faces, surface.genus, self._where)

    def _where(self, point: Array) -> str:
        """Return a place (3,) at volume 1 in words, in the user's units."""
        return in_brackets(self.surface.from_unit(point))

    @cached_property
    def choice(self) -> Choice:
        """Return whether one cube or several blocks suit the body, and why; the reason is "" where the options say it.

        A body that planes bound gets exact blocks, where there are some, a stack of extrusions columns; another one
        with handles gets blocks. The skeleton of one without handles is looked for only where its surface is much
        larger than a ball's.

        That of the checkpoint is taken where its blocks are kept. Raises SkeletonError for a body with handles that has
        no skeleton.
        """
        if (kept := kept_choice(self.checkpoints)) is not None:
            _log.info("%s", kept.reason)
            return kept
        surface, most = self.surface, self.config.blocks
        if self.exact is not None:
            count = len(self.exact)
            found = Choice("planes", f"bounded by planes: {count} exact block{'s' * (count > 1)}")
            _log.info("%s", found.reason)
            return found
        if self.columns is not None:
            count, off = len(self.columns), self.columns.off
            blocks = f"{count} block{'s' * (count > 1)}"
            found = Choice(
                "columns", f"a stack of extrusions: {blocks}, within {off:.1e} of its outlines (over diagonal)"
            )
            _log.info("%s", found.reason)
            return found
        if surface.genus == 0:
            if most is not None or self.given_corners is not None:
                return Choice("blocks" if (most or 1) > 1 else "cube", "")
            if self.compactness < COMPACT:
                figure = f"{self.compactness:.1f} for a ball's 1"
                return Choice("cube", f"no handles, and a compact body: {figure}: one cube")
        with timed(self.seconds, "fit"), one_blas_thread():
            found = self._by_skeleton()
        _log.info("%s", found.reason)
        return found

    def _by_skeleton(self) -> Choice:
        """Return the choice by the body's skeleton. Raises SkeletonError for a body with handles that has none."""
        try:
            return choose(self.skeleton, stubs=bool(self.surface.genus and self.handles))
        except SkeletonError as error:
            if self.surface.genus:
                raise
            return Choice("cube", f"no handles, and no skeleton ({error}): one cube")

    @cached_property
    def compactness(self) -> float:
        """Return the cubed area of the surface at volume 1, over that of a ball."""
        area = float(normals_and_areas(self.surface.unit_vertices, self.surface.faces)[1].sum())
        return area**3 / (36.0 * math.pi)

    @cached_property
    def handles(self) -> tuple[Handle, ...]:
        """Return the thin handles of a fat body, as many as it has in all; () where they are thick, or there are none.

        Raises SkeletonError for a body without a skeleton.
        """
        surface = self.surface
        solid = Solid(surface.unit_vertices, surface.faces)
        return handles_of(self.skeleton, solid.lattice(_CELL))

    @cached_property
    def exact(self) -> BlockLayout | None:
        """Return exact blocks of a body that planes bound, at volume 1; None for others, and for given corners."""
        spline = self.config.spline
        if self.given_corners is not None:
            return None
        with timed(self.seconds, "fit"), one_blas_thread():
            division = division_of(self.surface, self.config.blocks)
            if division is None:
                return None
            found = layout_of(division, spans_across(spline.control_points))
        if len(found) > 1:
            return found
        spans = spline.control_points - spline.degree
        return BlockLayout((replace(found.blocks[0], spans=(spans, spans, spans)),), ())

    @cached_property
    def columns(self) -> Columns | None:
        """Return blocks of a stack of extrusions, at volume 1; None for other bodies, and for given corners."""
        surface, spline, most = self.surface, self.config.spline, self.config.blocks
        if self.given_corners is not None or len(surface.crossings):
            return None
        with timed(self.seconds, "fit"), one_blas_thread():
            points = surface.to_unit(surface.vertices)
            across = spans_across(spline.control_points)
            return columns_of(points, surface.faces, across, spline.degree, most, surface.sharp)

    @cached_property
    def layout(self) -> BlockLayout:
        """Return thin blocks along the skeleton. Raises SkeletonError and LayoutError where there are none."""
        surface, most = self.surface, self.config.blocks
        across = spans_across(self.config.spline.control_points)
        found = block_layout(self.skeleton, surface.unit_vertices, surface.faces, across, self._where)
        if most is not None and len(found) > most:
            raise LayoutError(f"the skeleton needs {len(found)} blocks, and at most {most} are allowed: allow more")
        return found

    @cached_property
    def ridges(self) -> Ridges | None:
        """Return the ridges of the surface, at volume 1; None where sharp edges are few or short, or not all ridges."""
        vertices, faces = self.surface.unit_vertices, self.surface.faces
        found = features_of(vertices, faces, self.surface.sharp)
        if found.lengths[found.lengths > PIECE].sum() < FEW_EDGES:
            return None
        ridges = Ridges.of(found, vertices, faces)
        return ridges if ridges.length >= ALL * ridges.total else None

    @cached_property
    def sphere(self) -> CubeLayout:
        """Return the layout of the surface, at volume 1, on the sphere."""
        surface = self.surface
        return lay_on_sphere(surface.unit_vertices, surface.faces, self.report["progress"], self.checkpoints)

    def fit(self, layout: CubeLayout, coarse: float, kept: Constrained | None = None) -> Correspondence:
        """Return the surface's points with their first parameters on the boundary of the cube (section 4.3.2, step 1).

        coarse: the number of spans a direction in the first rounds, as a share of that in the last rounds. kept:
        the points that slide along the cube's edges alone.
        """
        spline = self.config.spline
        nets = ControlNets(spline.degree, (coarse_knots(spline, coarse),))
        faces, fixed = (None, None) if kept is None else (kept.faces, kept.fixed)
        return Correspondence(
            SlidingParameters(nets, layout.places, faces, layout.faces, fixed),
            layout.points,
            vertex_quadrics(layout.points, layout.faces, TANGENTIAL),
            vertex_weights(layout.points, layout.faces, layout.n_own),
            given_corners=None if self.given_corners is None else self.mesh[0][self.given_corners],
        )


def spans_across(control_points: int) -> int:
    """Return the spans across a block, in proportion to the control points a direction that one cube would have."""
    return max(FEWEST_SPANS, round(SPANS * control_points / SplineConfig.control_points))


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
        squares = Solid(self.fit.points, self.fit.places.triangles).squared_depths(samples.points)
        return math.sqrt(np.average(squares, weights=samples.areas))

    @property
    def rank(self) -> tuple[int, bool, bool, float]:
        """Return the faults of the map, then its distance: of two attempts the one with the lower rank is better."""
        return *self.found.rank, self.distance


@dataclass(frozen=True)
class Start(ABC):
    """Describe a way to a first map.

    name: the name in report.json. origin: the kind of start. doing: the start in words, as the log shows it.
    """

    name: str
    origin: Origin
    doing: str

    @abstractmethod
    def make(self, task: Task, checkpoints: Checkpoints) -> Attempt | None:
        """Return an attempt with an optimised map; None where the start does not suit the shape."""


def optimized(
    first: SplineMap,
    fit: Correspondence,
    schedule: Schedule,
    task: Task,
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
