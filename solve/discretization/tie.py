"""Ties the coefficients on two cuts of a sector, where the meshes on both are the same: u is then exactly u turned.

The splines that fulfil the condition are a subspace of all, and the equations are those projected to it: Q A Q x = Q b.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import size_of
from parameterize.spline.bspline import greville

from .coupling import Coupling, values_at
from .images import Located
from .on_regions import Stated
from .unknowns import Glued

NEAR = 1e-9  # share of a body's size by which the points of two coefficients may differ, once one is turned
EQUAL = 1e-9  # of coefficients of size 1, by which the values on the cuts may differ


@dataclass(frozen=True, eq=False)
class Tie:
    """Project vectors (c, m) of the free unknowns to those that are tied.

    first, second: (k,), the places of pairs of coefficients. rotation: (c, c), from the first to the second. own: the
    places of coefficients on the axis. kept: (c, c), the projector on what a turn of these leaves as it is.
    """

    first: IntArray
    second: IntArray
    rotation: Array
    own: IntArray
    kept: Array

    def __call__(self, x: Array) -> Array:
        """Return the tied vector (c, ...) that is nearest to a vector."""
        found = x.reshape(len(x), -1).copy()
        mean = 0.5 * (found[:, self.first] + self.rotation.T @ found[:, self.second])
        found[:, self.first], found[:, self.second] = mean, self.rotation @ mean
        found[:, self.own] = self.kept @ found[:, self.own]
        return found.reshape(x.shape)


def tie_of(coupling: Coupling, unknowns: Glued) -> Tie | None:
    """Return the tie of a coupling; None where the meshes on the two cuts are not the same."""
    patches, layout = coupling.patches, unknowns.layout
    numbers = layout.numbers(unknowns.numbers, 1, 0)
    points = np.full((unknowns.count, 3), np.nan)
    sides = []
    for located in (coupling.first, coupling.second):
        places = np.flatnonzero(_sizes(coupling, located) > 0.0)
        sides.append(np.unique(numbers[places]))
    for number in np.unique(np.concatenate([coupling.first.patches, coupling.second.patches])).tolist():
        space = patches[number].space
        rows = (greville(knots, degree) for knots, degree in zip(space.knots, space.degrees, strict=True))
        points[unknowns.numbers[number]] = patches[number].volume.grid(*rows)
    first, second = sides
    turned = coupling.condition.axis.turned(coupling.turn, points[first].T).T
    distance, nearest = map(np.asarray, cKDTree(points[second]).query(turned))
    is_near = float(distance.max()) <= NEAR * size_of([patch.volume for patch in patches])
    if len(first) != len(second) or not is_near or len(np.unique(nearest)) < len(second):
        return None
    second = second[nearest]
    is_own = first == second
    if np.isin(first[~is_own], second).any() or (unknowns.fixed[first] != unknowns.fixed[second]).any():
        return None
    place = np.full(unknowns.count, -1)
    place[unknowns.free] = np.arange(len(unknowns.free))
    pairs = ~is_own & ~unknowns.fixed[first]
    axis = np.array(coupling.condition.axis.direction)
    kept = np.outer(axis, axis) if len(coupling.rotation) == 3 else np.eye(len(coupling.rotation))
    own = place[first[is_own & ~unknowns.fixed[first]]]
    found = Tie(place[first[pairs]], place[second[pairs]], coupling.rotation, own, kept)
    x = found(np.random.default_rng(0).uniform(-1.0, 1.0, (len(kept), len(unknowns.free))))
    missing = coupling.jump @ layout.joined(unknowns.spread(x)).flat
    return found if np.abs(missing).max(initial=0.0) <= EQUAL else None


def _sizes(coupling: Coupling, located: Located) -> Array:
    """Return the largest value (size,) of each function of the patches at points."""
    spaces: Sequence[Stated] = coupling.patches
    table = values_at([patch.space for patch in spaces], coupling.layout, located, 1)[0]
    return np.asarray(abs(table).max(axis=0).toarray()).ravel()
