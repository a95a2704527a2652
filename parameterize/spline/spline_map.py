"""SplineMap: a map of blocks as the optimization holds it, component by component."""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, Knots
from .body import Body
from .bspline import greville, interpolate_grid
from .control_nets import ControlNets
from .volume import BSplineVolume


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
        return Body(tuple(self.patch(k) for k in range(len(self.nets.knots))), self.nets.interfaces)

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
