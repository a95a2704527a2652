"""The way to one block for a fat body, with stubs for its thin handles on the faces.

The handles are cut off, the body without them is mapped as one cube, and rods are laid along the handles from face to
face. The body is cut into blocks there, so that a rod is glued to a whole face. Without this way a mug stays folded.
"""

import logging
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Array, IntArray
from ..checkpoint import Checkpoints
from ..layouts.complex import Complex, control_points
from ..layouts.rods.along_skeleton import LayoutError
from ..layouts.rods.clearance import Clearance
from ..layouts.stubs.handles import Handle, handles_of, without_handles
from ..layouts.stubs.stub_blocks import Footprint, footprint, stub_blocks
from ..optimization.endings import Course
from ..optimization.reassignment import boundary_samples
from ..progress import timed
from ..spline.bspline import greville
from ..spline.interface import face_layer
from ..spline.spline_map import SplineMap
from ..spline.volume import BSplineVolume
from ..surface.errors import MeshError
from ..surface.solid import Solid
from ..surface.surface import surface_from_arrays
from ..threads import one_blas_thread
from .blocks import BLOCKS, STIFF_WEIGHTS, TUBE_OF_HANDLES, schedule, softened, surface_fit
from .cost import Cost
from .growth import GROWTH
from .laid import in_words
from .mapping_task import MOST_POINTS, MappingTask
from .way import Attempt, Suits, Way, optimized

_log = logging.getLogger(__name__)

_CONTROL_POINTS = 18  # a direction of the body's first map: it is optimised again with its handles
_FACE_SHARES = (0.1,)  # as those of blocks along the skeleton: the body is there, only its handles have some way to go
_POINT_SHARES = (0.1,)
_CELL = 0.03  # of the lattice whose points tell the areas of sections, at volume 1
_A_SPAN = 4  # samples of the body's faces among which rims find their places


class WithStubs(Way):
    """Make a map of a body as one cube, cut into blocks, and of its handles as rods on their faces."""

    origin, comes_from = BLOCKS.origin, BLOCKS.comes_from

    def suits(self, task: MappingTask) -> Suits:
        """Return whether the body is fat, and all its handles are thin tubes that leave it and come back to it."""
        surface = task.surface
        if not surface.is_plain or not surface.genus or task.skeleton.tube >= TUBE_OF_HANDLES or not _handles(task):
            return Suits(False)
        figures = f"{task.skeleton.tube:.2f} of the volume around its curves"
        handles = f"{in_words(task.skeleton.handles, 'handle')}, thin ones on a fat body"
        return Suits(True, f"{handles}: {figures}: one block, with the handles on its faces")

    def make(self, task: MappingTask, checkpoints: Checkpoints) -> Attempt | None:
        """Map the body without its handles, lay rods for these, and return the attempt with all blocks.

        None is returned if they do not leave one body without handles, no rods fit, or more blocks would be needed
        than the options allow.
        """
        surface = task.surface
        with timed(task.seconds, "fit"), one_blas_thread():
            most = task.own + MOST_POINTS
            trunk = without_handles(surface.unit_vertices, surface.faces, task.skeleton, _handles(task), most)
        if trunk is None:
            return None
        vertices, faces, rims = trunk
        try:
            body, earlier = _of_body(task, vertices, faces, checkpoints)
            with timed(task.seconds, "fit"), one_blas_thread():
                first = _with_stubs(task, body, rims)
                fit = surface_fit(task, first)
        except (MeshError, LayoutError) as error:
            _log.warning("%s", error)
            return None
        rounds = schedule(task.config, _FACE_SHARES, _POINT_SHARES)
        made = softened(optimized(first, fit, rounds, task, checkpoints, STIFF_WEIGHTS), task, checkpoints)
        return replace(made, course=made.course.after(earlier))

    def cost(self, task: MappingTask) -> Cost:
        """Return the cost of the rounds of the body alone, and of those with its rods."""
        points, blocks = float(_CONTROL_POINTS**3), 20 * max(task.surface.genus, 1)
        return Cost.of_blocks(points, blocks, is_sharp=True)


STUBS = WithStubs("body with stubs", "mapping the body without its handles, and laying rods for these,")


def _handles(task: MappingTask) -> tuple[Handle, ...]:
    """Return the thin handles of a fat body, as many as it has in all; () if they are thick, or there are none.

    Raises SkeletonError for a body without a skeleton.
    """

    def find() -> tuple[Handle, ...]:
        solid = Solid(task.surface.unit_vertices, task.surface.faces)
        return handles_of(task.skeleton, solid.lattice(_CELL))

    return task.fact("handles", find)


def _of_body(task: MappingTask, vertices: Array, faces: IntArray, checkpoints: Checkpoints) -> tuple[SplineMap, Course]:
    """Return the map of the body without its handles, at the place of the whole body at volume 1, and its rounds.

    Raises MeshError where the surface without handles is none that can be mapped.
    """
    surface = surface_from_arrays(vertices, faces, f"{task.surface.name} without handles")
    config = replace(task.config, blocks=1, refinement=None).with_control_points(_CONTROL_POINTS)
    kept = checkpoints.of_part("body")
    own = replace(task, surface=surface, config=config, given_corners=None, checkpoints=kept)
    grown = GROWTH.make(own, kept)
    spline = grown.found.spline
    return spline.with_control(surface.from_unit(spline.control.T).T), grown.course


def _with_stubs(task: MappingTask, body: SplineMap, rims: list[tuple[Array, Array]]) -> SplineMap:
    """Return the first map of all blocks: the body's, cut where its handles begin and end, and rods between these.

    Raises LayoutError where no rods fit, or more blocks are needed than the options allow.
    """
    surface, most = task.surface, task.config.blocks
    ends = [(_footprint(body, first), _footprint(body, last)) for first, last in rims]
    room = Clearance(task.skeleton, Solid(surface.unit_vertices, surface.faces))
    blocks, parts = stub_blocks(body.volume, ends, _handles(task), room)
    if most is not None and len(blocks) > most:
        raise LayoutError(f"a body with stubs needs {len(blocks)} blocks, and at most {most} are allowed: allow more")
    return _first(blocks, parts, task.config.spline.degree)


def _footprint(body: SplineMap, rim: Array) -> Footprint:
    """Return the footprint on the body's cube for a rim (k, 3) that a handle leaves."""
    samples = boundary_samples(body, _A_SPAN)
    nearest = np.asarray(cKDTree(samples.points).query(rim)[1])
    return footprint(samples.parameters[nearest], samples.faces[nearest], body.nets.spans[0][0])


def _first(blocks: Complex, parts: tuple[BSplineVolume, ...], degree: int) -> SplineMap:
    """Return the map of all blocks: rods whose ends lie on the body, and the parts of the body's map."""
    nets = blocks.nets(degree)
    points = [_on_body(number, blocks, parts, degree) for number in range(len(blocks) - len(parts))]
    points += [part.control_points for part in parts]
    return SplineMap(nets, nets.merged(nets.joined([np.moveaxis(net, -1, 0) for net in points])))


def _on_body(number: int, blocks: Complex, parts: tuple[BSplineVolume, ...], degree: int) -> Array:
    """Return the control points (n_u, n_v, n_w, 3) of a rod whose ends are the faces of the body's blocks below."""
    points = control_points(blocks, number, degree)
    along = greville(blocks.nets(degree).knots[number][2], degree)
    for interface in blocks.interfaces:
        (own, face), (other, below) = interface.first, interface.second
        if own == number:
            body = parts[other - len(blocks) + len(parts)].control_points
            away = interface.turned(face_layer(body, below)) - face_layer(points, face)
            share = np.maximum(0.0, 1.0 - 2.0 * (along if face == "w0" else 1.0 - along))
            points = points + share[:, None] * away[:, :, None]
    return points
