"""Collects the quadrangles from which the decomposition of a region is chosen, with their corners and sides.

Corners are nodes, optional points on curves, and optional points inside: beside smooth nodes, and where the medial axis
branches. Sides are parts of curves, and straight lines between points that see each other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay, cKDTree

from ...arrays import Array
from .coons import Quad, Sides, qualities
from .planar_graph import PlanarGraph
from .plane_curves import Curve
from .plane_regions import Loop, PlaneRegion, outline
from .polygons import cross, edges_of, inside_of

_THICK = 0.5  # of the shorter chord beside a node, and
_CLEAR = 0.35  # of the way across the region there: how far a point beside it lies
_SECTOR = (
    np.pi / 8.0
)  # radians: of the straight lines from a point in one sector the shortest to the rim, and to inside
_TOO_NEAR = 1e-4  # of the region's diagonal: what is nearer is the outline at the point itself
_NEAREST = 60  # points to which straight lines are looked for, from each
_SHARPEST = np.radians(10.0)  # an angle of a quadrangle, at least; at most 180 degrees less it
LEAST = 0.2  # quality of a quadrangle that is taken
_APART = 0.5  # of the radius of its circle: how far a branch of the medial axis lies from others, at least
_DENSE = 10  # points of a curve for the medial axis
_MOST_CUTS = 5  # optional points on a curve
_BETWEEN = 0.12  # of a curve's length between two optional points, at least


@dataclass(frozen=True, eq=False)
class CurveCuts:
    """A curve with optional points on it.

    numbers: of its first node, of the optional points in their order, and of its last node. parts: the curve between
    any two of them that may be a side, by their numbers.
    """

    numbers: tuple[int, ...]
    parts: dict[tuple[int, int], Curve]


@dataclass(frozen=True, eq=False)
class Candidates:
    """The quadrangles that may fill a region: `quads` of points, with their qualities (k,)."""

    quads: tuple[Quad, ...]
    qualities: Array


def branches_of(network: PlanarGraph, region: PlaneRegion) -> Array:
    """Return points (k, 2) where the medial axis of a region branches: three of its curves are equally near."""
    edges = [edge for loop in region.loops for edge in edges_of(loop)]
    even = np.linspace(0.0, 1.0, _DENSE + 1)[:-1] + 0.5 / _DENSE
    rows = np.concatenate([network.sides[edge].at(even) for edge in edges])
    owners = np.repeat(np.arange(len(edges)), _DENSE)
    corners = Delaunay(rows).simplices
    own = np.sort(owners[corners], axis=1)
    corners = corners[np.all(own[:, 1:] != own[:, :-1], axis=1)]
    a, b, c = (rows[corners[:, k]] for k in range(3))
    ab, ac = b - a, c - a
    det = 2.0 * cross(ab, ac)
    sides = np.stack([ac[:, 1], -ac[:, 0]], 1) * np.sum(ab**2, 1)[:, None]
    sides -= np.stack([ab[:, 1], -ab[:, 0]], 1) * np.sum(ac**2, 1)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        centers = a + sides / det[:, None]
    radii = np.linalg.norm(centers - a, axis=1)
    fine = np.isfinite(radii) & inside_of([outline(network, loop) for loop in region.loops], np.nan_to_num(centers))
    chosen = list[Array]()
    for k in sorted(
        np.flatnonzero(fine).tolist(), key=lambda k: (-round(float(radii[k]), 6), *np.round(centers[k], 6))
    ):
        if all(np.linalg.norm(centers[k] - other) > _APART * radii[k] for other in chosen):
            chosen.append(centers[k])
    return np.array(chosen).reshape(-1, 2)


def opposite(network: PlanarGraph, region: PlaneRegion) -> Array:
    """Return the points (k, 2) of a region's outline that lie opposite the middles of its curved sides."""
    rim = Rim.of([outline(network, loop) for loop in region.loops])
    points = []
    for side in (network.sides[edge] for loop in region.loops for edge in edges_of(loop)):
        if not side.is_straight:
            half = side.halves(-1)[1]
            point, (x, y) = half.points[0], half.tangents[0]
            way = np.array([-y, x])
            if np.isfinite(far := rim.across(point, way)):
                points.append(point + far * way)
    return np.array(points).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Rim:
    """The lines around a region, from `start` (n, 2) `along` (n, 2); what is nearer than `nearest` is a line's end."""

    start: Array
    along: Array
    nearest: float

    @classmethod
    def of(cls, outlines: Sequence[Array]) -> "Rim":
        """Return the lines of polygons (k, 2)."""
        start = np.concatenate(outlines)
        along = np.concatenate([np.roll(row, -1, axis=0) for row in outlines]) - start
        return cls(start, along, _TOO_NEAR * float(np.linalg.norm(np.ptp(start, axis=0))))

    def across(self, point: Array, way: Array) -> float:
        """Return how far the rim is from one of its points (2,) along a unit vector (2,); inf where it is not met."""
        gap, det = self.start - point, cross(way[None], self.along)
        with np.errstate(divide="ignore", invalid="ignore"):
            far, place = cross(gap, self.along) / det, cross(gap, way[None]) / det
        return float(far[(place >= 0.0) & (place <= 1.0) & (far > self.nearest)].min(initial=np.inf))


def cut_places(curve: Curve, near: Array) -> list[float]:
    """Return the places of optional points on a curve: its middle, and of a straight one the feet of near points."""
    if not curve.is_straight:
        return [float(curve.halves(0)[0].length / curve.length)]
    along = curve.points[1] - curve.points[0]
    feet = (near - curve.points[0]) @ along / (along @ along)
    far = np.linalg.norm(near - curve.points[0] - feet[:, None] * along, axis=1)
    places = [0.5]
    for place in feet[np.argsort(np.round(far, 6), kind="stable")]:
        others = np.array([0.0, 1.0, *places])
        if len(places) < _MOST_CUTS and np.abs(others - place).min() > _BETWEEN and 0.0 < place < 1.0:
            places.append(float(place))
    return sorted(places)


def cut(curve: Curve, places: Sequence[float], nodes: list[Array]) -> CurveCuts:
    """Return a curve with optional points, which are added to the nodes, and its parts."""
    numbers, whole, at = [curve.ends[0]], curve, [0]
    for place in places:
        whole, index = whole.with_point(place)
        if index <= at[-1]:  # a point that is already there
            continue
        at.append(index)
        numbers.append(len(nodes))
        nodes.append(whole.points[index])
    numbers.append(curve.ends[1])
    at.append(len(whole.points) - 1)
    parts = {}
    for i in range(len(at)):
        for j in range(i + 1, len(at)):
            part = whole.part(at[i], at[j], (numbers[i], numbers[j]))
            parts[part.ends] = part
            parts[part.ends[::-1]] = part.reversed
    return CurveCuts(tuple(numbers), parts)


def beside(points: Array, loops: Sequence[Loop], sides: Sides, outlines: Sequence[Array]) -> list[Array]:
    """Return a point inside of a region beside each of the points of its loops at which the outline hardly turns.

    sides: the curves between points that follow each other. outlines: the polygons of the loops.
    """
    rim, inside = Rim.of(outlines), []
    for loop in loops:
        for k, node in enumerate(loop):
            before, after = sides[loop[k - 1], node], sides[node, loop[(k + 1) % len(loop)]]
            into, out = before.tangents[-1], after.tangents[0]
            if into @ out < np.cos(np.pi / 4.0) or (before.is_straight and after.is_straight):
                continue
            way = np.array([-(into + out)[1], (into + out)[0]])
            way /= np.linalg.norm(way)
            chord = min(float(np.linalg.norm(c.points[-1] - c.points[0])) for c in (before, after))
            inside.append(points[node] + min(_THICK * chord, _CLEAR * rim.across(points[node], way)) * way)
    return inside


def candidates_of(
    points: Array, rims: Sequence[CurveCuts], inner: Sequence[int], outlines: Sequence[Array]
) -> Candidates:
    """Return the quadrangles of points (n, 2) that may fill a region.

    rims: the curves around it, with the region on their left. inner: the numbers of the points inside. outlines: the
    polygons of its loops.
    """
    sides: Sides = {}
    for rim in rims:
        numbers = rim.numbers
        sides |= {
            (a, b): rim.parts[a, b] for i, a in enumerate(numbers) for b in numbers[i + 1 :] if (a, b) in rim.parts
        }
    members = sorted({k for rim in rims for k in rim.numbers} | set(inner))
    straight = [set(rim.numbers) for rim in rims if next(iter(rim.parts.values())).is_straight]
    lines = _lines(points, members, sides, straight, outlines)
    tangents = {edge: (curve.tangents[0], curve.tangents[-1]) for edge, curve in sides.items()}
    for a, b in lines:
        way = (points[b] - points[a]) / np.linalg.norm(points[b] - points[a])
        tangents[a, b], tangents[b, a] = (way, way), (-way, -way)
    quads = tuple(_cycles(tangents))
    good = qualities(points, quads, {edge: curve for rim in rims for edge, curve in rim.parts.items()})
    kept = np.flatnonzero(good >= LEAST)
    return Candidates(tuple(quads[k] for k in kept), good[kept])


def _lines(
    points: Array, members: Sequence[int], sides: Sides, straight: Sequence[set[int]], outlines: Sequence[Array]
) -> set[tuple[int, int]]:
    """Return the shortest straight lines from each point to others that it sees, the lower number first."""
    numbers = np.array(members)
    rows = points[numbers]
    _, near = cKDTree(rows).query(rows, k=min(len(rows), _NEAREST))
    pairs = np.unique(
        np.sort(np.stack([np.repeat(np.arange(len(rows)), near.shape[1]), near.ravel()], 1), axis=1), axis=0
    )
    pairs = numbers[pairs[pairs[:, 0] != pairs[:, 1]]]
    known = {frozenset(edge) for edge in sides}
    free = [k for k, (a, b) in enumerate(pairs.tolist()) if frozenset((a, b)) not in known]
    free = [k for k in free if not any({int(i) for i in pairs[k]} <= own for own in straight)]
    pairs = pairs[free]
    a, along = points[pairs[:, 0]], points[pairs[:, 1]] - points[pairs[:, 0]]
    start = np.concatenate(outlines)
    step = np.concatenate([np.roll(row, -1, axis=0) for row in outlines]) - start
    det = cross(along[:, None], step[None])
    gap = start[None] - a[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = cross(gap, step[None]) / det, cross(gap, along[:, None]) / det
    met = np.any((s > 1e-6) & (s < 1.0 - 1e-6) & (t > -1e-6) & (t < 1.0 + 1e-6), axis=1)
    pairs = pairs[~met]
    pairs = pairs[inside_of(outlines, points[pairs].mean(axis=1))]
    lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    shortest, outer = set[tuple[int, int]](), {k for edge in sides for k in edge}
    for k in members:
        own = np.flatnonzero(np.any(pairs == k, axis=1))
        ways = points[pairs[own].sum(axis=1) - k] - points[k]
        sectors = np.round(np.arctan2(ways[:, 1], ways[:, 0]) / _SECTOR + 1e-6).astype(int) % round(
            2.0 * np.pi / _SECTOR
        )
        seen = set[tuple[int, bool]]()
        for j in np.argsort(np.round(lengths[own], 9), kind="stable").tolist():
            a, b = pairs[own[j]].tolist()
            kind = int(sectors[j]), a + b - k in outer
            if kind not in seen:
                seen.add(kind)
                shortest.add((a, b))
    return shortest


def _cycles(tangents: dict[tuple[int, int], tuple[Array, Array]]) -> Iterator[Quad]:
    """Yield the closed paths of four sides, the lowest number first, that turn to the left at all corners."""
    out: dict[int, list[int]] = {}
    for a, b in tangents:
        out.setdefault(a, []).append(b)
    angles = {edge: tuple(float(np.arctan2(t[1], t[0])) for t in pair) for edge, pair in tangents.items()}

    def turns(a: int, b: int, c: int) -> bool:
        turn = (angles[b, c][0] - angles[a, b][1]) % (2.0 * np.pi)
        return _SHARPEST < turn < np.pi - _SHARPEST

    after = {(a, b): [c for c in out.get(b, ()) if c != a and turns(a, b, c)] for a, b in tangents}
    for a, b in tangents:
        for c in after[a, b] if b > a else ():
            for d in after[b, c] if c > a else ():
                if d > a and a in after[c, d] and b in after.get((d, a), ()):
                    yield a, b, c, d
