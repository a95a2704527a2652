"""Defines Grid: nodes on all patches of a body, some of which make up the next coarser grid.

Directions that interfaces tie have the same nodes. The nodes go that lie closest, wherever they are along a direction:
point smoothers are quick only along strong couplings (semicoarsening; Trottenberg, Oosterlee, Schueller, Multigrid,
2001, section 5.1). On graded knots the finest grading goes first, and iterations do not depend on its depth.
"""

from collections import defaultdict
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array, kron

from parameterize.arrays import Array, Mask
from parameterize.spline.body import Body
from parameterize.spline.bspline import collocation
from parameterize.spline.sheets import Sheets

from ..discretization.space import TrialSpace, of_each
from ..discretization.unknowns import Glued
from .nodal import linear, nodes

EVEN = 1.6  # ratio of distances that count as equal
FAR = 4.0  # such a ratio in other patches of a sheet: graded hexahedra take 34 iterations, with 8 they take 43


@dataclass(frozen=True, eq=False)
class Grid:
    """Hold nodes on the patches of a body: the unknowns are those of trilinear functions.

    lengths: (patches, 3), the mean length of each patch along its directions. sheets: the directions that are tied.
    """

    body: Body
    unknowns: Glued
    lengths: Array
    sheets: Sheets

    @classmethod
    def of(cls, body: Body, unknowns: Glued) -> "Grid":
        """Return the grid of the Greville points of a body's unknowns."""
        return cls(body, on_nodes(unknowns), _lengths(body), Sheets.of(body))

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
        """Return the grid without the nodes that lie closest; None where no direction has inner nodes."""
        kept = list(map(_kept, self.distances, self.near, self.sheets.mirrored.tolist()))
        if all(own.all() for own in kept):
            return None
        ways = [own[::-1] for own in kept], kept  # of directions that run against their sheets, and of others
        made: dict[Any, TrialSpace] = {}
        spaces = []
        for number, space in enumerate(self.unknowns.spaces):
            places = zip(self.sheets.numbers[number].tolist(), self.sheets.flipped[number].tolist(), strict=True)
            masks = [ways[not is_flipped][sheet] for sheet, is_flipped in places]
            key = id(space), *(mask.tobytes() for mask in masks)
            if key not in made:
                made[key] = linear(space, [self._row(number, axis)[mask] for axis, mask in enumerate(masks)])
            spaces.append(made[key])
        return Grid(self.body, Glued.of(spaces, self.body.interfaces), self.lengths, self.sheets)

    @property
    def near(self) -> list[Mask]:
        """Return which distances (n - 1,) of neighbouring nodes of each sheet are short.

        They are near the least distance in some patch of the sheet, and not far from it in any. Where there are no
        such distances the ones count that are least far.
        """
        steps = self.distances
        shortest = np.array([own.min() if len(own) > 1 else np.inf for own in steps])
        least = (self.lengths * shortest[self.sheets.numbers]).min(axis=1, keepdims=True)  # of each patch
        ratios = np.where(np.isfinite(least), self.lengths / least, 1.0)  # of patches without inner nodes any number
        lowest, highest = np.full(len(steps), np.inf), np.zeros(len(steps))
        np.minimum.at(lowest, self.sheets.numbers, ratios)
        np.maximum.at(highest, self.sheets.numbers, ratios)
        is_near = shortest * lowest <= EVEN
        far = max(FAR, EVEN * float((shortest * highest)[is_near].min(initial=np.inf)))
        limits = np.minimum(EVEN / lowest, far / highest).tolist()
        return [own <= limit for own, limit in zip(steps, limits, strict=True)]

    @property
    def distances(self) -> list[Array]:
        """Return the distances (n - 1,) of neighbouring nodes of each sheet, as parameters."""
        return [np.diff(self._row(*divmod(first, 3))) for first in self.sheets.first.tolist()]

    def _row(self, patch: int, axis: int) -> Array:
        """Return the nodes (n,) of a direction of a patch."""
        return self.unknowns.spaces[patch].knots[axis][1:-1]

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


def _kept(distances: Array, is_near: Mask, is_mirrored: bool) -> Mask:
    """Return which nodes (n,) of a row stay: of two neighbours at least one, and all that are near to no other.

    distances: (n - 1,), of neighbours. is_near: (n - 1,), whether they are short. Nodes go in the order of the gaps
    that they leave, and of a row that is tied to itself in reverse together with those that mirror them.
    """
    last = len(distances)
    before, after = distances[:-1], distances[1:]
    near = 1 + np.flatnonzero(is_near[:-1] | is_near[1:])
    kept = np.ones(last + 1, dtype=bool)
    for node in near[np.argsort((before + after)[near - 1], kind="stable")].tolist():
        pair = [node, last - node] if is_mirrored else [node]
        beside = [neighbour for own in pair for neighbour in (own - 1, own + 1)]
        if kept[beside].all() and pair[0] not in beside:
            kept[pair] = False
    return kept


def _lengths(body: Body) -> Array:
    """Return the mean length (patches, 3) of the lines of control points along each direction."""
    found = np.empty((len(body), 3))
    for group in body.groups:
        for axis in range(3):
            steps = np.linalg.norm(np.diff(group.control_points, axis=1 + axis), axis=-1)
            found[group.numbers, axis] = steps.sum(axis=1 + axis).mean(axis=(1, 2))
    return found
