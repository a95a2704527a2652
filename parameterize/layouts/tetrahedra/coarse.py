"""Coarse triangles on the smooth faces of a mesh, by splits, collapses and flips of edges that keep its curves.

As in Botsch and Kobbelt ("A remeshing approach to multiresolution modeling", SGP 2004), but many edges at a time:
those whose surroundings do not touch, the most urgent first.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from ...arrays import Array, IntArray, Mask
from .curves import Curves
from .smooth_faces import SmoothFaces

LONG, SHORT = 4.0 / 3.0, 0.8  # of the wanted length: longer edges are split, shorter ones collapsed
_POOR = 0.25  # quality of triangles that a collapse may make of better ones
_GAIN = 0.05  # of quality, for which an edge is flipped
_GOOD = 0.3  # of triangles that a move may make worse
_LONGER = 1.1  # times the longest edge at a vertex, those after its collapse, where all are long
_POOREST = 0.003  # of those that a collapse may make
_SIDES = np.array([[0, 1], [1, 2], [2, 0]])


@dataclass(eq=False)
class Coarse:
    """Triangles on smooth faces, that change.

    points: (n, 3). triangles: (m, 3). faces: (m,), the smooth face of each. up: (m, 3), its normal at the middle of the
    triangle. arcs: (k, 2), edges on curves. curves: (k,). spans: (k, 2), the arc lengths at their ends, ascending.
    fixed: (n,), corners.
    """

    surface: SmoothFaces
    lines: Curves
    points: Array
    triangles: IntArray
    faces: IntArray
    up: Array
    arcs: IntArray
    curves: IntArray
    spans: Array
    fixed: Mask

    def qualities(self, triangles: IntArray, up: Array) -> Array:
        """Return the quality of triangles (k, 3): 1 where regular, 0 where flat, negative where turned over."""
        return qualities_of(self.points[triangles], up)

    def normals_at(self, triangles: IntArray, faces: IntArray) -> Array:
        """Return the normals (k, 3) of the smooth faces (k,) at the middles of triangles (k, 3)."""
        return self.surface.normals(*self.surface.nearest(self.points[triangles].mean(axis=1), faces))

    def edges(self) -> "Edges":
        """Return the edges of the triangles."""
        pairs = np.sort(self.triangles[:, _SIDES].reshape(-1, 2), axis=1)
        base = len(self.points)
        keys, first, own, counts = np.unique(
            pairs[:, 0] * base + pairs[:, 1], return_index=True, return_inverse=True, return_counts=True
        )
        arcs = np.sort(self.arcs, axis=1)
        of_arc = np.full(len(keys), -1)
        of_arc[np.searchsorted(keys, arcs[:, 0] * base + arcs[:, 1])] = np.arange(len(arcs))
        return Edges(pairs[first], own.reshape(-1, 3), counts, of_arc, keys, base)

    def middles(self, edges: "Edges", chosen: IntArray) -> Array:
        """Return the points (k, 3) in the middle of chosen edges, on their curve or face."""
        ends = self.points[edges.ends[chosen]]
        arcs = edges.arcs[chosen]
        found = ends.mean(axis=1)
        on = arcs >= 0
        found[on] = self.lines.at(self.curves[arcs[on]], self.spans[arcs[on]].mean(axis=1))
        face = np.zeros(len(edges.ends), dtype=np.int64)
        face[edges.of_triangles] = self.faces[:, None]
        found[~on] = self.surface.onto(found[~on], face[chosen[~on]])
        return found

    def split(self, edges: "Edges", urgency: Array) -> bool:
        """Split edges of positive urgency (e,), of each triangle at most one; return whether any was."""
        ranks = np.zeros(len(urgency), dtype=np.int64)
        wanted = np.flatnonzero(urgency > 0.0)
        ranks[wanted[np.argsort(urgency[wanted], kind="stable")]] = np.arange(1, len(wanted) + 1)
        most = ranks[edges.of_triangles].max(axis=1)
        first = most[:, None] == ranks[edges.of_triangles]
        agreed = np.bincount(edges.of_triangles[first & (most > 0)[:, None]], minlength=len(ranks)) == edges.counts
        chosen = np.flatnonzero((ranks > 0) & agreed)
        if not len(chosen):
            return False
        number = np.full(len(ranks), -1)
        number[chosen] = len(self.points) + np.arange(len(chosen))
        self.points = np.concatenate([self.points, self.middles(edges, chosen)])
        self.fixed = np.concatenate([self.fixed, np.zeros(len(chosen), dtype=bool)])
        self._divide_triangles(number[edges.of_triangles])
        self._divide_arcs(edges, number, chosen)
        return True

    def _divide_triangles(self, middles: IntArray) -> None:
        """Divide triangles at the new vertices of their sides (m, 3), of which each has one at most, -1 for none."""
        at, side = np.nonzero(middles >= 0)
        middle, old = middles[at, side], self.triangles[at]
        rows = np.arange(len(at))
        a, b, c = (old[rows, (side + k) % 3] for k in range(3))
        self.triangles[at] = np.stack([a, middle, c], axis=1)
        self.triangles = np.concatenate([self.triangles, np.stack([middle, b, c], axis=1)])
        self.faces = np.concatenate([self.faces, self.faces[at]])
        new = np.concatenate([at, len(self.triangles) - len(at) + rows])
        self.up = np.concatenate([self.up, self.up[at]])
        self.up[new] = self.normals_at(self.triangles[new], self.faces[new])

    def _divide_arcs(self, edges: "Edges", number: IntArray, chosen: IntArray) -> None:
        """Divide the arcs among the chosen edges at their new vertices."""
        on = chosen[edges.arcs[chosen] >= 0]
        arc, middle = edges.arcs[on], number[on]
        half = self.spans[arc].mean(axis=1)
        self.arcs = np.concatenate([self.arcs, np.stack([middle, self.arcs[arc, 1]], axis=1)])
        self.spans = np.concatenate([self.spans, np.stack([half, self.spans[arc, 1]], axis=1)])
        self.curves = np.concatenate([self.curves, self.curves[arc]])
        self.arcs[arc, 1], self.spans[arc, 1] = middle, half

    def collapse(self, edges: "Edges", lengths: Array, longest: Array) -> bool:
        """Collapse edges shorter than `SHORT`, lengths (e,) over the wanted ones; return whether any was.

        longest: (n,), of the edges that may end at each vertex.
        """
        away, onto, urgency = self._collapsible(edges, lengths)
        kept = np.flatnonzero(self._may_collapse(edges, away, onto, longest))
        away, onto, urgency = away[kept], onto[kept], urgency[kept]
        chosen = _apart(len(self.points), edges.ends, np.stack([away, onto], axis=1), urgency)
        away, onto = away[chosen], onto[chosen]
        if not len(away):
            return False
        target = np.arange(len(self.points))
        target[away] = onto
        touched = np.isin(self.triangles, away).any(axis=1)
        self.triangles = target[self.triangles]
        gone = (self.triangles == np.roll(self.triangles, 1, axis=1)).any(axis=1)
        self._merge_arcs(target, away)
        changed = np.flatnonzero(touched & ~gone)
        self.up[changed] = self.normals_at(self.triangles[changed], self.faces[changed])
        self.triangles, self.faces, self.up = self.triangles[~gone], self.faces[~gone], self.up[~gone]
        return True

    def _collapsible(self, edges: "Edges", lengths: Array) -> tuple[IntArray, IntArray, Array]:
        """Return the vertices (k,) that may go, those onto which they would, and how urgent that is."""
        on_curve = np.zeros(len(self.points), dtype=bool)
        on_curve[self.arcs] = True
        short = np.flatnonzero(lengths < SHORT)
        away = np.concatenate([edges.ends[short, 0], edges.ends[short, 1]])
        onto = np.concatenate([edges.ends[short, 1], edges.ends[short, 0]])
        along = np.tile(edges.arcs[short] >= 0, 2)
        free = ~self.fixed[away] & (~on_curve[away] | along)
        return away[free], onto[free], (SHORT - np.tile(lengths[short], 2) + 1e-9)[free]

    def _may_collapse(self, edges: "Edges", away: IntArray, onto: IntArray, longest: Array) -> Mask:
        """Return which collapses leave a surface, with triangles that are neither turned over nor too large."""
        count = len(self.points)
        both = np.concatenate([edges.ends, edges.ends[:, ::-1]])
        near = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(count, count))
        common: Array = np.asarray(near[away].multiply(near[onto]).sum(axis=1)).ravel()
        possible = (common == edges.counts[edges.find(away, onto)]) & ~self._lengthens_arcs(away, onto, longest)
        owners, triangles = expanded(self.triangles, count, away)
        rows = self.triangles[triangles]
        stays = (rows != onto[owners][:, None]).all(axis=1)
        owners, triangles, rows = owners[stays], triangles[stays], rows[stays]
        new = np.where(rows == away[owners][:, None], onto[owners][:, None], rows)
        up = self.up[triangles]
        before, after = self.qualities(rows, up), self.qualities(new, up)
        sides = np.linalg.norm(self.points[new] - self.points[onto[owners]][:, None], axis=2)
        former = np.linalg.norm(self.points[rows] - self.points[away[owners]][:, None], axis=2).max(axis=1)
        longest_there = np.zeros(len(away))
        np.maximum.at(longest_there, owners, _LONGER * former)
        limit = 0.5 * (longest[new] + longest[onto[owners]][:, None])
        poor = (after < np.minimum(_POOR, 0.9 * before)) | (after < _POOREST)
        large = (sides > np.maximum(limit, longest_there[owners][:, None])).any(axis=1)
        return possible & (np.bincount(owners, poor | large, minlength=len(away)) == 0)

    def _lengthens_arcs(self, away: IntArray, onto: IntArray, longest: Array) -> Mask:
        """Return which collapses along curves leave an arc that is too long."""
        into, out = self._arcs_at()[away].T
        before, after = self.arcs[into, 0], self.arcs[out, 1]
        other = np.where(before == onto, after, before)
        length = np.linalg.norm(self.points[other] - self.points[onto], axis=1)
        return (into >= 0) & (length > 0.5 * (longest[other] + longest[onto]))

    def _merge_arcs(self, target: IntArray, away: IntArray) -> None:
        """Join the two arcs at each vertex that goes away along its curve."""
        ends = self._arcs_at()
        joined = away[ends[away, 0] >= 0]
        into, out = ends[joined].T
        backwards = self.arcs[into, 0] == target[joined]  # onto the vertex before
        gone, left = np.where(backwards, into, out), np.where(backwards, out, into)
        length = np.diff(self.spans[gone])[:, 0]
        self.spans[left, np.where(backwards, 0, 1)] += np.where(backwards, -length, length)
        self.arcs = np.delete(target[self.arcs], gone, axis=0)
        self.curves, self.spans = np.delete(self.curves, gone), np.delete(self.spans, gone, axis=0)

    def _arcs_at(self) -> IntArray:
        """Return the arcs (n, 2) that end and that begin at each vertex inside a curve, -1 for none."""
        ends = np.full((len(self.points), 2), -1)
        ends[self.arcs[:, 1], 0] = np.arange(len(self.arcs))
        ends[self.arcs[:, 0], 1] = np.arange(len(self.arcs))
        ends[self.fixed] = -1
        return ends

    def flip(self, edges: "Edges") -> bool:
        """Flip edges between triangles of one face where the poorer of both triangles gains; return whether any was."""
        inner = np.flatnonzero((edges.arcs < 0) & (edges.counts == 2))
        order = np.argsort(edges.of_triangles.ravel(), kind="stable")
        last = np.cumsum(edges.counts)[inner]
        (one, at), (two, beside) = (np.divmod(order[last - back], 3) for back in (2, 1))
        a, b, c = (self.triangles[one, (at + k) % 3] for k in range(3))
        d = self.triangles[two, (beside + 2) % 3]
        new = (np.stack([c, a, d], axis=1), np.stack([d, b, c], axis=1))
        up = 0.5 * (self.up[one] + self.up[two])
        before = [self.qualities(self.triangles[own], self.up[own]) for own in (one, two)]
        gain = np.min([self.qualities(rows, up) for rows in new], axis=0) - np.min(before, axis=0)
        wanted = np.flatnonzero((gain > _GAIN) & ~edges.has(c, d))
        quads = np.stack([a, b, c, d], axis=1)[wanted]
        chosen = wanted[_apart(len(self.points), quads[:0, :2], quads, gain[wanted])]
        for own, rows in zip((one, two), new, strict=True):
            self.triangles[own[chosen]] = rows[chosen]
            self.up[own[chosen]] = self.normals_at(rows[chosen], self.faces[own[chosen]])
        return len(chosen) > 0

    def relax(self, edges: "Edges", wanted: Array) -> None:
        """Move vertices inside faces to the middle of their neighbours, those on curves to even steps."""
        self.points = self._unspoilt(self._relaxed_inside(edges, wanted))
        self._relax_arcs(wanted)
        self.up = self.normals_at(self.triangles, self.faces)

    def _relaxed_inside(self, edges: "Edges", wanted: Array) -> Array:
        """Return the points (n, 3) after a step of the vertices inside faces."""
        still = self.fixed.copy()
        still[self.arcs] = True
        both = np.concatenate([edges.ends, edges.ends[:, ::-1]])
        weight = 1.0 / (wanted[both[:, 0]] + wanted[both[:, 1]])
        total = np.bincount(both[:, 0], weight, minlength=len(self.points))
        sums = np.zeros((len(self.points), 3))
        np.add.at(sums, both[:, 0], weight[:, None] * self.points[both[:, 1]])
        free = np.flatnonzero(~still & (total > 0.0))
        face = np.zeros(len(self.points), dtype=np.int64)
        face[self.triangles] = self.faces[:, None]
        moved = self.points.copy()
        target = sums[free] / total[free][:, None]
        moved[free] = self.surface.onto(0.3 * self.points[free] + 0.7 * target, face[free])
        return moved

    def _unspoilt(self, moved: Array) -> Array:
        """Return moved points (n, 3), but those left where they are by whose moves triangles become poor."""
        before = qualities_of(self.points[self.triangles], self.up)
        found = moved.copy()
        while True:
            after = qualities_of(found[self.triangles], self.up)
            bad = self.triangles[(after < _GOOD) & (after < before)]
            if (found[bad] == self.points[bad]).all():
                return found
            found[bad] = self.points[bad]

    def _relax_arcs(self, wanted: Array) -> None:
        """Move the vertices on curves, but corners, to where the steps to both sides are even."""
        ends = self._arcs_at()
        inner = np.flatnonzero(ends[:, 0] >= 0)
        into, out = ends[inner].T
        left, right = self.arcs[into, 0], self.arcs[out, 1]
        before, after = np.diff(self.spans[into])[:, 0], np.diff(self.spans[out])[:, 0]
        a, b = wanted[inner] + wanted[left], wanted[inner] + wanted[right]
        step = 0.3 * ((before + after) * a / (a + b) - before)
        moved = self.points.copy()
        moved[inner] = self.lines.at(self.curves[into], self.spans[into, 1] + step)
        trial = self._unspoilt(moved)
        step = np.where((trial[inner] == moved[inner]).all(axis=1), step, 0.0)
        self.points = trial
        self.spans[into, 1] += step
        self.spans[out, 0] += step

    def compact(self) -> None:
        """Drop the vertices that no triangle has."""
        used = np.unique(self.triangles)
        number = np.full(len(self.points), -1)
        number[used] = np.arange(len(used))
        self.points, self.fixed = self.points[used], self.fixed[used]
        self.triangles, self.arcs = number[self.triangles], number[self.arcs]


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of triangles: ends (e, 2), ascending; those of each triangle (m, 3); how many triangles have each (e,).

    arcs: (e,), the number of the arc, or -1. keys: (e,), base * (first end) + (second end), ascending.
    """

    ends: IntArray
    of_triangles: IntArray
    counts: IntArray
    arcs: IntArray
    keys: IntArray
    base: int

    def find(self, a: IntArray, b: IntArray) -> IntArray:
        """Return the numbers of the edges between vertices."""
        return np.searchsorted(self.keys, np.minimum(a, b) * self.base + np.maximum(a, b))

    def has(self, a: IntArray, b: IntArray) -> Mask:
        """Return whether there are edges between vertices."""
        return np.isin(np.minimum(a, b) * self.base + np.maximum(a, b), self.keys)


def qualities_of(corners: Array, up: Array) -> Array:
    """Return the quality (k,) of triangles, corners (k, 3, 3): 1 where regular, negative where turned against `up`."""
    sides = np.roll(corners, -1, axis=1) - corners
    doubled = np.einsum("kx,kx->k", np.cross(sides[:, 0], sides[:, 1]), up)
    return np.asarray(2.0 * np.sqrt(3.0) * doubled / np.maximum(np.einsum("kex,kex->k", sides, sides), 1e-300))


def expanded(triangles: IntArray, count: int, vertices: IntArray) -> tuple[IntArray, IntArray]:
    """Return all pairs of a vertex, as its place in `vertices` (k,), and a triangle that has it."""
    order = np.argsort(triangles.ravel(), kind="stable")
    many = np.bincount(triangles.ravel(), minlength=count)
    start = np.cumsum(many) - many
    sizes = many[vertices]
    owners = np.repeat(np.arange(len(vertices)), sizes)
    within = np.arange(len(owners)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    return owners, order[start[vertices][owners] + within] // 3


def _apart(count: int, edges: IntArray, groups: IntArray, urgency: Array) -> IntArray:
    """Return groups of vertices that share none and are not joined by edges (e, 2): the most urgent around."""
    rank = np.zeros(len(groups), dtype=np.int64)
    rank[np.argsort(urgency, kind="stable")] = np.arange(1, len(groups) + 1)
    best = np.zeros(count, dtype=np.int64)
    np.maximum.at(best, groups, rank[:, None])
    around = best.copy()
    np.maximum.at(around, edges, best[edges[:, ::-1]])
    return np.flatnonzero((around[groups] == rank[:, None]).all(axis=1))
