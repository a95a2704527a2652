"""Moves the plane smoothly, so that polygons come to other places: straight lines of them stay straight."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array

_APART = 1.0 / 30.0  # of the largest width: points of long lines at which the smooth field is given
_MOST = 3000  # of such points: a dense system of equations has them
_BESIDE = 1e-4  # of the largest width: how far from a point the smooth field is taken to move a direction


@dataclass(frozen=True, eq=False)
class PlaneWarp:
    """A motion of the plane.

    Attributes
    ----------
    lines : (n, 2, 2) array
        From the first point of each line to its last one.
    places : (n, 2, 2) array
        Where these points are moved.
    near : float
        Points nearer to each other are one.
    """

    lines: Array
    places: Array
    near: float

    @classmethod
    def of(cls, loops: Sequence[tuple[Array, Array]], near: float) -> "PlaneWarp | None":
        """Return the motion of the corners (k, 2) of loops to places (k, 2); None where one point has two places."""
        points, places = (np.concatenate(rows) for rows in zip(*loops, strict=True))
        pairs = cKDTree(points).query_pairs(4.0 * near, output_type="ndarray")
        if len(pairs) and np.abs(places[pairs[:, 0]] - places[pairs[:, 1]]).max() > 8.0 * near:
            return None
        lines, moved = (
            np.concatenate([np.stack([loop, np.roll(loop, -1, axis=0)], axis=1) for loop in rows])
            for rows in zip(*loops, strict=True)
        )
        return cls(lines, moved, near)

    @cached_property
    def _is_still(self) -> bool:
        return bool(np.abs(self.places - self.lines).max() <= 8.0 * self.near)

    @cached_property
    def _smooth(self) -> Any:
        """Return the displacement as a thin plate spline through points of all lines."""
        from scipy.interpolate import RBFInterpolator

        apart = max(_APART * float(np.ptp(self.lines, axis=(0, 1)).max()), self._total / _MOST)
        points, away = [], []
        for line, place in zip(self.lines, self.places, strict=True):
            count = int(np.ceil(np.linalg.norm(line[1] - line[0]) / apart))
            share = (np.arange(count) / count)[:, None]
            points.append((1.0 - share) * line[0] + share * line[1])
            away.append((1.0 - share) * place[0] + share * place[1] - points[-1])
        rows, values = np.concatenate(points), np.concatenate(away)
        twice = cKDTree(rows).query_pairs(0.01 * apart, output_type="ndarray")
        kept = np.setdiff1d(np.arange(len(rows)), twice[:, 1])
        return RBFInterpolator(rows[kept], values[kept], kernel="thin_plate_spline", degree=1)

    @property
    def _total(self) -> float:
        return float(np.linalg.norm(self.lines[:, 1] - self.lines[:, 0], axis=1).sum())

    def __call__(self, points: Array) -> Array:
        """Return points (n, 2), moved: those on a line in proportion, others smoothly."""
        if self._is_still:
            return points
        moved = points + self._smooth(points)
        start, along = self.lines[:, 0], self.lines[:, 1] - self.lines[:, 0]
        for k, point in enumerate(points):
            share = np.clip(np.sum((point - start) * along, axis=1) / np.sum(along**2, axis=1), 0.0, 1.0)[:, None]
            far = np.linalg.norm(start + share * along - point, axis=1)
            line = int(far.argmin())
            if far[line] <= 4.0 * self.near:
                moved[k] = (1.0 - share[line]) * self.places[line, 0] + share[line] * self.places[line, 1]
        return np.asarray(moved)

    def directions(self, points: Array, tangents: Array) -> Array:
        """Return unit vectors (n, 2) at points (n, 2), moved."""
        if self._is_still:
            return tangents
        step = _BESIDE * float(np.ptp(self.lines, axis=(0, 1)).max())
        ahead, behind = (self._smooth(points + way * tangents) for way in (step, -step))
        moved = tangents + (ahead - behind) / (2.0 * step)
        return np.asarray(moved / np.linalg.norm(moved, axis=1)[:, None])
