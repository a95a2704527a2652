"""Solution: the spline that a solve returns, with its map and report."""

from __future__ import annotations

from dataclasses import dataclass

from parameterize.spline.volume import BSplineVolume

from .field import SplineField
from .report import SolveReport


@dataclass(frozen=True, eq=False)
class Solution(SplineField):
    """The discrete solution: a spline of the parameters, the map it lives on, and the report."""

    geometry: BSplineVolume
    report: SolveReport

    @property
    def field(self) -> SplineField:
        """The spline alone: a datum for another problem on the same volume."""
        return SplineField(self.degrees, self.knots, self.coefficients)
