"""Reads and writes spline volumes in the file formats of other programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from parameterize.spline.volume import BSplineVolume
    from solve.field import SplineField

    from ..figures.evaluate import Problem


@dataclass(frozen=True)
class Content:
    """What is exported: a volume, a solution on it, and the problem whose exact solution is known."""

    volume: BSplineVolume
    field: SplineField | None = None
    problem: Problem | None = None
