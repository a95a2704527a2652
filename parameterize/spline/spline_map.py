"""Defines ControlNets, the control nets of blocks in one array, and SplineMap, the map that these give.

A block is a cube that a spline maps into space. The optimization holds all blocks of a body together: control points
(3, n), component first, block after block, each net in the order u, v, w. One cube is a body of one block.

A span of a direction is the slab of a block between two neighbouring knots. An interface makes the slabs on both of its
sides continue each other, so that a knot inserted into the one must be inserted into the other. A slab that comes back
to its block through a loop of others, turned, is one with a slab of another direction there, or with its mirror image.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from ..arrays import Array, Floats, IntArray, Knots, Mask
from .body import Body, numbers_of_classes, shared_numbers
from .bspline import breakpoints, greville, interpolate_grid
from .interface import Interface, axis_side
from .solids import PatchSolids
from .volume import BSplineVolume


@dataclass(frozen=True, eq=False)
class ControlNets:
    """Describe the control nets of blocks: degree in all directions, knots of each block, interfaces, and solids.

    A cube's face has the number 2 * axis + side; a face of a body has the number 6 * block + face.
    """

    degree: int
    knots: tuple[Knots, ...]
    interfaces: tuple[Interface, ...] = ()
    solids: PatchSolids = field(default_factory=PatchSolids)

    @property
    def is_single(self) -> bool:
        """Return whether the body is one block that is not glued to itself: the image of a cube."""
        return len(self.knots) == 1 and not self.interfaces

    @cached_property
    def shapes(self) -> tuple[tuple[int, int, int], ...]:
        """Return the numbers of control points (n_u, n_v, n_w) of each block."""
        return tuple(tuple(len(row) - self.degree - 1 for row in knots) for knots in self.knots)  # type: ignore[misc]

    @cached_property
    def spans(self) -> tuple[tuple[int, int, int], ...]:
        """Return the numbers of spans of each block in its three directions."""
        return tuple(tuple(len(breakpoints(row)) - 1 for row in knots) for knots in self.knots)  # type: ignore[misc]

    @cached_property
    def starts(self) -> IntArray:
        """Return the number of each block's first control point, and of control points in all, (blocks + 1,)."""
        return np.cumsum([0, *(int(np.prod(shape)) for shape in self.shapes)])

    @cached_property
    def first_spans(self) -> IntArray:
        """Return the number of each block's first span, and the number of all spans: (blocks + 1,)."""
        return np.cumsum([0, *(int(np.prod(spans)) for spans in self.spans)])

    def of_block(self, control: Floats, block: int) -> Floats:
        """Return the control points (..., n_u, n_v, n_w) of a block, contiguous, from those of all blocks (..., n)."""
        part = control[..., self.starts[block] : self.starts[block + 1]]
        return np.ascontiguousarray(part).reshape(*control.shape[:-1], *self.shapes[block])

    def joined(self, parts: list[Floats]) -> Floats:
        """Return the control points (3, n) of all blocks from those of each block, (3, n_u, n_v, n_w).

        Those of a single block are not copied.
        """
        flat = [part.reshape(3, -1) for part in parts]
        return flat[0] if len(flat) == 1 else np.concatenate(flat, axis=1)

    @cached_property
    def _shared(self) -> tuple[IntArray, IntArray, Array]:
        """Return the control points that interfaces make one with others, the group of each, and the groups' sizes."""
        labels = np.concatenate([row.ravel() for row in shared_numbers(self.shapes, self.interfaces)[0]])
        sizes = np.bincount(labels)
        places = np.flatnonzero(sizes[labels] > 1)
        _, groups = np.unique(labels[places], return_inverse=True)
        return places, groups, np.bincount(groups).astype(np.float64)

    def merged(self, control: Floats) -> Floats:
        """Return values (..., n) of all control points, with their mean at control points that interfaces make one.

        This is the orthogonal projection onto the values of continuous maps. The means of a group are equal bit by bit.
        """
        if not self.interfaces:
            return control
        places, groups, sizes = self._shared
        merged = control.copy()
        for row in merged.reshape(-1, control.shape[-1]):
            row[places] = (np.bincount(groups, row[places]) / sizes)[groups]
        return merged

    def merged_mask(self, chosen: Mask) -> Mask:
        """Return a mask (n,) of control points, with all those that interfaces make one with a chosen one."""
        return np.asarray(self.merged(chosen.astype(np.float64)) > 0.0)

    @cached_property
    def exposed(self) -> Mask:
        """Return whether each face of each block belongs to the body's boundary, (6 blocks,)."""
        exposed = np.ones(6 * len(self.knots), dtype=bool)
        for interface in self.interfaces:
            for block, face in (interface.first, interface.second):
                axis, side = axis_side(face)
                exposed[6 * block + 2 * axis + side] = False
        return exposed


def tied_spans(nets: ControlNets) -> list[IntArray]:
    """Return for each direction of each block, in the order u, v, w of block after block, the classes of its spans.

    Spans that interfaces make one have the same class. Classes have the numbers from 0 on, in the order in which their
    first spans come; without interfaces each span has its own.
    """
    starts = np.cumsum([0, *(count for counts in nets.spans for count in counts)])
    rows = [np.arange(first, last) for first, last in pairwise(starts)]
    pairs = [np.empty((2, 0), dtype=np.int64)]
    for interface in nets.interfaces:
        for a, b, flip in interface.directions:
            row = rows[3 * interface.second[0] + b]
            pairs.append(np.stack([rows[3 * interface.first[0] + a], row[::-1] if flip else row]))
    classes = numbers_of_classes(int(starts[-1]), np.concatenate(pairs, axis=1))
    return [classes[row] for row in rows]


@dataclass(frozen=True, eq=False)
class SplineMap:
    """A map F of one degree in all directions; control: (3, n), the control points of all blocks, see ControlNets."""

    nets: ControlNets
    control: Array

    @classmethod
    def on_cube(cls, degree: int, knots: Knots, control: Array) -> "SplineMap":
        """Return the map of one cube with control points (3, n_u, n_v, n_w)."""
        return cls(ControlNets(degree, (knots,)), control.reshape(3, -1))

    @classmethod
    def of(cls, volume: BSplineVolume) -> "SplineMap":
        """Return the map of a polynomial volume whose degree is the same in all directions."""
        assert volume.weights is None, "the optimization moves control points, and knows no weights"
        control = np.ascontiguousarray(np.moveaxis(volume.control_points, -1, 0))
        return cls.on_cube(volume.degrees[0], volume.knots, control)

    @classmethod
    def interpolating(cls, values: Array, knots: Knots, degree: int) -> "SplineMap":
        """Return the map of one cube with these values (n_u, n_v, n_w, 3) at the Greville points of the knots."""
        control = np.moveaxis(interpolate_grid(knots, degree, values), -1, 0)
        return cls.on_cube(degree, knots, np.ascontiguousarray(control))

    @property
    def knots(self) -> Knots:
        """Return the knots of one cube."""
        (knots,) = self.nets.knots
        return knots

    def patch(self, block: int) -> BSplineVolume:
        """Return the map of a block as a volume."""
        points = np.moveaxis(self.nets.of_block(self.control, block), 0, -1)
        return BSplineVolume((self.nets.degree,) * 3, self.nets.knots[block], points)

    @property
    def volume(self) -> BSplineVolume:
        """Return the same map of one cube as a volume."""
        assert self.nets.is_single
        return self.patch(0)

    @property
    def body(self) -> Body:
        """Return the same map as a body, a patch for each block."""
        patches = tuple(self.patch(k) for k in range(len(self.nets.knots)))
        return Body(patches, self.nets.interfaces, self.nets.solids)

    def with_control(self, control: Array) -> "SplineMap":
        """Return the map on the same knots with other control points (3, n)."""
        return replace(self, control=control)

    def on_knots(self, knots: tuple[Knots, ...]) -> "SplineMap":
        """Return the same map on finer knots of each block (knot insertion), equal at interfaces bit by bit."""
        nets = replace(self.nets, knots=knots)
        finer = (self.patch(block).on_knots(rows).control_points for block, rows in enumerate(knots))
        return SplineMap(nets, nets.merged(nets.joined([np.moveaxis(points, -1, 0) for points in finer])))

    def interpolated(self, knots: Knots) -> "SplineMap":
        """Return the map of one cube on other knots that agrees with this one at their Greville points."""
        u, v, w = (greville(row, self.nets.degree) for row in knots)
        values = self.volume.grid(u, v, w)
        return SplineMap.interpolating(values, knots, self.nets.degree)
