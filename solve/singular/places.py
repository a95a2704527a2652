"""Defines SingularPlaces: curves on which the gradient of a solution is infinite, and which points are near to them."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from parameterize.arrays import Array, Mask

SPANS = 2.0  # around a singular place in which a gradient is no result
GAP = 0.5  # largest distance of two neighbouring points of a curve, as a share of the shortest radius
_FLAT = 0.5  # of the shortest span: the least radius of an ellipsoid, for spans that lie in one plane
_NEAREST = 16  # points of curves whose ellipsoids are looked at


@dataclass(frozen=True, eq=False)
class SingularPlace:
    """Hold curves on which the gradient of the solution is infinite, for one reason.

    Attributes
    ----------
    kind : str
        "rim" of a held region, "edge" that is re-entrant, or "materials" that meet.
    text : str
        Where it is, as in "the rim of fix 'x < 1'".
    points : (m, 3) array
        Points on the curves, no farther apart than half the radius there.
    spans : (m, 3, 3) array
        Three sides of a span at each point, as columns.
    exponent : float
        The gradient grows as r^(exponent - 1), r the distance from the curve; the least one of all points.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> heated = iga_nn.Poisson(value="nz > 0.99 and x < 0.5", exchange={"nx > 0.9": (1, 20)})
    >>> (place,) = iga_nn.solve(benchmark_volume(2), heated).singular
    >>> place.kind, round(place.exponent, 2)
    ('rim', 0.5)
    """

    kind: str
    text: str
    points: Array
    spans: Array
    exponent: float

    @property
    def radius(self) -> float:
        """Return the largest distance at which a gradient is no result."""
        return SPANS * float(np.linalg.norm(self.spans, axis=1).max())

    def as_dict(self) -> dict[str, Any]:
        """Return the place for report.json, with one of its points."""
        at = self.points[len(self.points) // 2].tolist()
        return {"kind": self.kind, "text": self.text, "at": at, "radius": self.radius, "exponent": self.exponent}


@dataclass(frozen=True, eq=False)
class SingularPlaces:
    """Hold all singular places of a problem on a mesh.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> shelf = iga_nn.Elasticity(fix="u0", load={"u1": (0, 0, 1)})
    >>> found = iga_nn.solve(benchmark_volume(2), shelf).singular
    >>> [place.text for place in found], found.is_near([[0.0, 0.0, 0.5], [1.5, 0.5, 0.5]]).tolist()
    (["the rim of fix 'u0'"], [True, False])
    """

    places: tuple[SingularPlace, ...] = ()

    def __iter__(self) -> Iterator[SingularPlace]:
        return iter(self.places)

    def __len__(self) -> int:
        return len(self.places)

    def is_near(self, points: ArrayLike, spans: float = SPANS) -> Mask:
        """Return whether each of the points (m, 3) lies within so many spans of a singular place.

        These are ellipsoids around its points, with as many spans in each direction: spans may be longer than wide.
        """
        where = np.asarray(points, dtype=np.float64)
        if not self.places:
            return np.zeros(len(where), dtype=bool)
        farthest, found = spans * self._longest, np.zeros(len(where), dtype=bool)
        low, high = self._box
        left = np.flatnonzero(((where > low - farthest) & (where < high + farthest)).all(axis=1))
        count = min(_NEAREST, self._tree.n)
        rank = np.arange(1, count + 1)
        distances, nearest = map(np.asarray, self._tree.query(where[left], rank, distance_upper_bound=farthest))
        for column in range(count):
            own = np.flatnonzero(np.isfinite(distances[:, column]) & ~found[left])
            at = nearest[own, column]
            arms = np.einsum("mab,mb->ma", self._inverse[at], where[left[own]] - self._tree.data[at])
            found[left[own]] = (arms**2).sum(axis=1) < spans**2
        return found

    @cached_property
    def _box(self) -> tuple[Array, Array]:
        points: Array = self._tree.data
        return points.min(axis=0), points.max(axis=0)

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(np.concatenate([place.points for place in self.places]))

    @cached_property
    def _longest(self) -> float:
        return max(place.radius for place in self.places) / SPANS

    @cached_property
    def _inverse(self) -> Array:
        """Return the matrices (m, 3, 3) from arms in space to arms in spans."""
        spans = np.concatenate([place.spans for place in self.places])
        left, sizes, right = np.linalg.svd(spans)
        sizes = np.maximum(sizes, _FLAT * np.linalg.norm(spans, axis=1).min(axis=1, keepdims=True))
        return np.asarray(np.swapaxes(right, 1, 2) / sizes[:, None] @ np.swapaxes(left, 1, 2))
