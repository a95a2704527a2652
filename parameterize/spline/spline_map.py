"""SplineMap: a map of the unit cube as the optimization holds it, component by component."""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, Knots
from .bspline import greville, interpolate_grid
from .volume import BSplineVolume


@dataclass(frozen=True, eq=False)
class SplineMap:
    """A map F of one degree in all directions; control (3, n_u, n_v, n_w) in C order, which kernels run along."""

    degree: int
    knots: Knots
    control: Array

    @classmethod
    def of(cls, volume: BSplineVolume) -> "SplineMap":
        """Return the map of a polynomial volume whose degree is the same in all directions."""
        assert volume.weights is None, "the optimization moves control points, and knows no weights"
        return cls(volume.degrees[0], volume.knots, np.ascontiguousarray(np.moveaxis(volume.control_points, -1, 0)))

    @classmethod
    def interpolating(cls, values: Array, knots: Knots, degree: int) -> "SplineMap":
        """Return the map with these values (n_u, n_v, n_w, 3) at the Greville points of the knots."""
        control = np.moveaxis(interpolate_grid(knots, degree, values), -1, 0)
        return cls(degree, knots, np.ascontiguousarray(control))

    @property
    def volume(self) -> BSplineVolume:
        """The same map as a volume."""
        return BSplineVolume((self.degree,) * 3, self.knots, np.moveaxis(self.control, 0, -1))

    def with_control(self, control: Array) -> "SplineMap":
        """Return the map on the same knots with other control points (3, n_u, n_v, n_w)."""
        return replace(self, control=control)

    def interpolated(self, knots: Knots) -> "SplineMap":
        """Return the map on other knots that agrees with this one at their Greville points."""
        u, v, w = (greville(row, self.degree) for row in knots)
        values = self.volume.grid(u, v, w)
        return SplineMap.interpolating(values, knots, self.degree)
