"""Defines Grid: nodes on all patches of a body, every second of which make up the next coarser grid.

Directions that interfaces tie have the same nodes. Those are coarsened together whose nodes lie closest: point
smoothers are quick only along strong couplings (semicoarsening; Trottenberg, Oosterlee, Schueller, Multigrid, 2001,
section 5.1).
"""

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array, kron

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.body import Body, numbers_of_classes
from parameterize.spline.bspline import collocation
from parameterize.spline.interface_rows import kinds

from ..discretization.space import TrialSpace, of_each
from ..discretization.unknowns import Glued
from .nodal import linear, nodes

EVEN = 1.6  # ratio of distances that count as equal


@dataclass(frozen=True, eq=False)
class Grid:
    """Hold nodes on the patches of a body: the unknowns are those of trilinear functions.

    lengths: (patches, 3), the mean length of each patch along its directions. classes: (patches, 3), the number of the
    tied directions to which each direction belongs.
    """

    body: Body
    unknowns: Glued
    lengths: Array
    classes: IntArray

    @classmethod
    def of(cls, body: Body, unknowns: Glued) -> "Grid":
        """Return the grid of the Greville points of a body's unknowns."""
        return cls(body, on_nodes(unknowns), _lengths(body), _tied(body))

    @property
    def count(self) -> int:
        """Return the number of free nodes."""
        return self.unknowns.shape[0]

    @cached_property
    def points(self) -> Array:
        """Return the points (count, 3) of the free nodes."""
        found, places, spaces = np.zeros((self.count + 1, 3)), self.unknowns.places, self.unknowns.spaces
        for group in self.body.groups:
            alike = defaultdict(list)
            for place, number in enumerate(group.numbers):
                alike[spaces[number].key].append(place)
            for chosen in alike.values():
                numbers = group.numbers[chosen]
                u, v, w = spaces[numbers[0]].knots
                points = group.rows(np.array(chosen)).grid(u[1:-1], v[1:-1], w[1:-1])
                found[np.stack([places[number] for number in numbers])] = points
        return found[:-1]

    def coarser(self) -> "Grid | None":
        """Return the grid without every second node of some directions; None where no direction has inner nodes."""
        cells = np.array([space.shape for space in self.unknowns.spaces]) - 1
        distances = np.where(cells > 1, self.lengths / cells, np.inf)
        chosen = _closest(distances, self.classes)
        if not chosen.any():
            return None
        made: dict[Any, TrialSpace] = {}
        spaces = []
        for space, thin in zip(self.unknowns.spaces, map(tuple, chosen.tolist()), strict=True):
            if (id(space), thin) not in made:
                rows = zip(space.knots, thin, strict=True)
                inner = [_thinned(knots[1:-1]) if is_thinned else knots[1:-1] for knots, is_thinned in rows]
                made[id(space), thin] = linear(space, inner)
            spaces.append(made[id(space), thin])
        return Grid(self.body, Glued.of(spaces, self.body.interfaces), self.lengths, self.classes)

    def interpolation(self, coarser: "Grid") -> csr_array:
        """Return the matrix (count, coarser.count) from values of trilinear functions on the coarser grid."""
        fine, coarse = self.unknowns, coarser.unknowns
        alike = defaultdict(list)
        for number, (own, other) in enumerate(zip(fine.spaces, coarse.spaces, strict=True)):
            alike[own.key, other.key].append(number)
        rows, columns, values = [], [], []
        for patches in alike.values():
            matrix = _between(fine.spaces[patches[0]], coarse.spaces[patches[0]])
            here, there = (np.stack([places[i].ravel() for i in patches]) for places in (fine.places, coarse.places))
            rows.append(here[:, matrix.row].ravel())
            columns.append(there[:, matrix.col].ravel())
            values.append(np.tile(matrix.data, len(patches)))
        row, column, value = map(np.concatenate, (rows, columns, values))
        copies = fine.collect(fine.spread(np.ones((1, self.count))))[0]
        free = (row < self.count) & (column < coarser.count)
        row, column = row[free], column[free]
        entries = value[free] / copies[row], (row, column)
        return coo_array(entries, shape=(self.count, coarser.count)).tocsr()


def on_nodes(unknowns: Glued) -> Glued:
    """Return the unknowns of trilinear functions on the Greville points of the patches."""
    spaces = of_each(
        lambda space: linear(space, [nodes(*row) for row in zip(space.knots, space.degrees, strict=True)]),
        unknowns.spaces,
    )
    return Glued(tuple(spaces), unknowns.numbers, unknowns.count, unknowns.fixed)


def _between(fine: TrialSpace, coarse: TrialSpace) -> coo_array:
    """Return the matrix from the nodes of a patch on a coarser grid to those on a finer one."""
    u, v, w = (collocation(b, 1, a[1:-1]) for a, b in zip(fine.knots, coarse.knots, strict=True))
    found = kron(kron(u, v), w, format="coo")
    found.eliminate_zeros()
    return found


def _thinned(row: Array) -> Array:
    """Return every second node, counted from both ends: the same ones whichever way a direction runs."""
    last = len(row) - 1
    kept = np.arange(0, last // 2 + last % 2, 2)
    return row[np.union1d(kept, last - kept)]


def _closest(distances: Array, classes: IntArray) -> Mask:
    """Return which directions (patches, 3) are coarsened: with their class, where nodes are closest in some patch."""
    least = distances.min(axis=1, keepdims=True)
    ratios = np.divide(distances, least, out=np.full_like(distances, np.inf), where=np.isfinite(distances))
    lowest = np.full(classes.max() + 1, np.inf)
    np.minimum.at(lowest, classes, ratios)
    return np.asarray(lowest[classes] <= EVEN)


def _lengths(body: Body) -> Array:
    """Return the mean length (patches, 3) of the lines of control points along each direction."""
    found = np.empty((len(body), 3))
    for group in body.groups:
        for axis in range(3):
            steps = np.linalg.norm(np.diff(group.control_points, axis=1 + axis), axis=-1)
            found[group.numbers, axis] = steps.sum(axis=1 + axis).mean(axis=(1, 2))
    return found


def _tied(body: Body) -> IntArray:
    """Return the number (patches, 3) of the class of each direction; interfaces tie the directions along them."""
    rows, pairs = body.interface_rows, [np.empty((2, 0), dtype=np.int64)]
    for kind, members in kinds(rows, np.zeros(len(body), dtype=np.int64)):
        for own, other, _ in kind.directions:
            pairs.append(3 * rows[members][:, [0, 2]].T + np.array([[own], [other]]))
    return numbers_of_classes(3 * len(body), np.concatenate(pairs, axis=1)).reshape(-1, 3)
