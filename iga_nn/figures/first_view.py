"""Chooses the side from which a body is shown: one that shows its shape, where it is loaded, and where it is held.

Cells of the boundary are drawn as dots into a small picture, of which each pixel knows its nearest cell.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import BodyLike
from solve.field import FieldOnBody
from solve.forms.conditions import Condition

from .fields import outer_faces, points_of, remembered
from .outline import outward
from .region_numbers import numbers_of
from .render import TILT, View, longest_first, widest_view

PIXELS = 64  # along the diagonal of the body's box
MOST_CELLS = 60_000
OF_REGIONS = 2.0  # weight of what is seen of loads and supports; the outline and the shape have 1 each
OF_SUPPORT = 0.5  # of a support in comparison with a load
SEEN = 0.2  # of a region: with less, the rest of the body is drawn as glass
UPRIGHT, TALL = 0.99, 2.0  # cosine of an axis that is z; sides of a cloud that is laid down
BETTER = 1.02  # times the first view: another one is worth it
PLANES = 4.0, 30.0  # steps of the normals, and of the distances over the diagonal, by which planes are told apart


@dataclass(frozen=True, eq=False)
class Cells:
    """Hold cells of the boundary: middles and outward unit normals (k, 3), and the region of each, -1 for none."""

    middles: Array
    normals: Array
    regions: IntArray

    @classmethod
    def of(cls, body: BodyLike, conditions: Sequence[Condition]) -> "Cells":
        """Return the cells between the samples on the outer faces of a body."""
        points = points_of(body).on(outer_faces(body))
        middles = 0.25 * (points[:, 1:, 1:] + points[:, :-1, :-1] + points[:, 1:, :-1] + points[:, :-1, 1:])
        numbers = numbers_of(body, conditions)[:, :-1, :-1].reshape(-1)
        every = -(-len(numbers) // MOST_CELLS)
        normals = outward(body, points).reshape(-1, 3)
        return cls(middles.reshape(-1, 3)[::every], normals[::every], numbers[::every])

    @property
    def planes(self) -> IntArray:
        """Return a number (k,) of the plane in which each cell lies, roughly."""
        size = float(np.linalg.norm(np.ptp(self.middles, axis=0))) or 1.0
        heights = ((self.middles - self.middles.mean(axis=0)) * self.normals).sum(axis=1) / size
        rows = np.column_stack([PLANES[0] * self.normals, PLANES[1] * heights])
        return np.unique(np.rint(rows).astype(np.int64), axis=0, return_inverse=True)[1].reshape(-1)

    def seen(self, view: View) -> IntArray:
        """Return the number of the nearest cell of each pixel that the body covers."""
        size = float(np.linalg.norm(np.ptp(self.middles, axis=0))) or 1.0
        turned = self.middles @ np.stack([view.right, view.up, view.towards], axis=1)
        columns, rows = np.floor(PIXELS / size * (turned[:, :2] - turned[:, :2].min(axis=0))).astype(np.int64).T
        order = np.argsort(turned[:, 2])  # the nearest last
        picture = np.full((2 * PIXELS) ** 2, -1)
        picture[(rows * 2 * PIXELS + columns)[order]] = order
        shown = picture[picture >= 0]
        return shown[self.normals[shown] @ view.towards > 0.0]  # what lies behind is seen through gaps


def views_of(points: Array) -> list[View]:
    """Return 24 views of a cloud of points (k, 3): along each of its axes, moved to each side; the widest first.

    z points up, unless one looks along it, or the cloud is a tall one.
    """
    axes = longest_first(points)
    axes = axes * np.sign(axes[range(3), np.abs(axes).argmax(axis=1)])[:, None]
    sides = np.ptp(points @ axes.T, axis=0)
    found = []
    for main in (2, 1, 0):
        first, second = (k for k in range(3) if k != main)  # the second is the shorter one
        if abs(axes[first][2]) > UPRIGHT and sides[first] < TALL * sides[second]:
            first, second = second, first
        right, up = axes[first], axes[second]
        for front, above, aside in product((1.0, -1.0), (1.0, -1.0), (1.0, -1.0)):
            tilted = np.cos(TILT) * front * axes[main] + np.sin(TILT) * (0.8 * above * up + 0.6 * aside * right)
            across = np.cross(up, tilted)
            across /= np.linalg.norm(across)
            found.append(View(across, np.cross(tilted, across), tilted))
    return found


def shown_from(body: BodyLike, solution: FieldOnBody | None = None) -> View:
    """Return the view that shows a body, and of a solution where it is loaded and held.

    Without regions of data it is the widest view.
    """
    conditions = conditions_of(solution)
    return _best(body, conditions) if conditions else widest_view(_outside(body), TILT)


def conditions_of(solution: Any) -> tuple[Condition, ...]:
    """Return the conditions on regions of a solution, none where its problem is not known."""
    problem = getattr(solution, "problem", None)
    return () if problem is None else problem.conditions


def _outside(body: BodyLike) -> Array:
    return points_of(body).on(outer_faces(body)).reshape(-1, 3)


@remembered
def _best(body: BodyLike, conditions: tuple[Condition, ...]) -> View:
    cells, views = Cells.of(body, conditions), views_of(_outside(body))
    shown, planes = [cells.seen(view) for view in views], cells.planes
    outline = np.array([float(len(each)) for each in shown])
    shape = np.array([_entropy(planes[each]) for each in shown])
    scores = outline / outline.max() + shape / max(shape.max(), 1e-9)
    counts = np.array([np.bincount(cells.regions[each] + 1, minlength=len(conditions) + 1)[1:] for each in shown])
    weights = np.array([OF_SUPPORT if one.is_support else 1.0 for one in conditions]) * (counts.max(axis=0) > 0)
    if weights.sum() > 0.0:
        scores += OF_REGIONS * (counts / np.maximum(counts.max(axis=0), 1)) @ weights / weights.sum()
    best = int(scores.argmax())
    return views[best if scores[best] > BETTER * scores[0] else 0]


def _entropy(planes: IntArray) -> float:
    """Return the viewpoint entropy of the planes that are seen, in bits (Vázquez et al. 2001)."""
    shares = np.bincount(planes) / max(len(planes), 1)
    shares = shares[shares > 0.0]
    return float(-(shares * np.log2(shares)).sum())


def best_sides(body: BodyLike, conditions: Sequence[Condition]) -> list[tuple[View, bool]]:
    """Return for each condition the view that shows most of its region, and whether a fair part of it is seen there."""
    cells, views = Cells.of(body, tuple(conditions)), views_of(_outside(body))
    shown = [np.bincount(cells.regions[cells.seen(view)] + 1, minlength=len(conditions) + 1)[1:] for view in views]
    counts, found = np.array(shown), []
    size = float(np.linalg.norm(np.ptp(cells.middles, axis=0))) or 1.0
    for number in range(len(conditions)):
        best = int(counts[:, number].argmax())
        own = cells.normals[cells.regions == number]
        facing = np.maximum(own @ views[best].towards, 0.0).sum() if len(own) else 0.0
        dots = facing * _area(body, cells) * (PIXELS / size) ** 2  # pixels that nothing before the region would leave
        found.append((views[best], bool(counts[best, number] >= SEEN * min(dots, 1e9))))
    return found


def _area(body: BodyLike, cells: Cells) -> float:
    """Return the mean area of a cell of the boundary."""
    points = points_of(body).on(outer_faces(body))
    diagonals = points[:, 1:, 1:] - points[:, :-1, :-1], points[:, :-1, 1:] - points[:, 1:, :-1]
    return 0.5 * float(np.linalg.norm(np.cross(*diagonals), axis=-1).sum()) / len(cells.middles)
