"""Defines Block: a rod of straight pieces, whose faces have the names and the order of a patch's.

A face is an array of corners (2, 2, 3) across a block and (2, m, 3) along it, in the order u, v, w of its two
directions.
"""

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...spline.interface import face_layer
from ...spline.volume import BSplineVolume


@dataclass(frozen=True, eq=False)
class Block:
    """A rod of quadrilateral sections: bilinear across it, linear from each section to the next.

    Attributes
    ----------
    name : str
        What it is of the body, for messages and reports.
    sections : (m, 2, 2, 3) array
        The corners [u][v] of m >= 2 sections, evenly spaced in w from 0 to 1, at volume 1. (u, v, w) is right-handed.
    spans : three int
        The number of knot spans along u, v and w.
    """

    name: str
    sections: Array
    spans: tuple[int, int, int]

    def __post_init__(self) -> None:
        if len(self.sections) < 2 or self.sections.shape[1:] != (2, 2, 3):
            raise ValueError(f"block {self.name}: sections must be (m >= 2, 2, 2, 3), got {self.sections.shape}")
        if min(self.spans) < 1:
            raise ValueError(f"block {self.name}: each direction needs one span or more, got {self.spans}")

    def face(self, name: str) -> Array:
        """Return the corners of a face: (2, 2, 3) of w0 and w1, (2, m, 3) of the others."""
        return face_layer(np.moveaxis(self.sections, 0, 2), name)

    def points(self, places: Array) -> Array:
        """Return the points (..., 3) at parameters (..., 3) in the unit cube."""
        return np.asarray(self.spline(places.reshape(-1, 3)).reshape(places.shape))

    @property
    def spline(self) -> BSplineVolume:
        """Return the block as a spline of degree 1."""
        even = np.linspace(0.0, 1.0, len(self.sections))
        knots = np.array([0.0, 0.0, 1.0, 1.0])
        points = np.ascontiguousarray(np.moveaxis(self.sections, 0, 2))
        return BSplineVolume((1, 1, 1), (knots, knots, np.concatenate([[0.0], even, [1.0]])), points)
