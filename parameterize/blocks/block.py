"""Defines Block: a rod of straight pieces, whose faces have the names and the order of a patch's.

A face is an array of corners (2, 2, 3) across a block and (2, m, 3) along it, in the order u, v, w of its two
directions.
"""

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..spline.interface import face_layer


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
        u, v, w = np.moveaxis(places, -1, 0)[..., None]
        last = len(self.sections) - 2
        below = np.clip((w[..., 0] * (last + 1)).astype(np.int64), 0, last)
        along = w * (last + 1) - below[..., None]
        corners = self.sections[below], self.sections[below + 1]
        low, high = (
            (1 - u) * ((1 - v) * c[..., 0, 0, :] + v * c[..., 0, 1, :])
            + u * ((1 - v) * c[..., 1, 0, :] + v * c[..., 1, 1, :])
            for c in corners
        )
        return np.asarray((1 - along) * low + along * high)
