"""Divides a plane polygon, perhaps with holes, into convex quadrangles with whole edges in common.

The polygon is cut into Delaunay triangles, which are matched in pairs, as many as form good quadrangles. Where some are
left, points in the middle of edges of the polygon are tried, which add triangles; and at last each quadrangle is cut
into four and each triangle left into three, from its middle.

This integer program is a matching: it maximises the number of pairs. That of decomposition.py covers regions exactly
once, at the least cost, with quadrangles of many more points, whose sides may be curved: it takes seconds, not
milliseconds, and adds points beside straight edges, too, so neither gives the blocks of the other.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np

from ...arrays import Array, IntArray
from ...surface.triangulation import triangulate
from .polygons import cross, edges_of

LEAST = 0.15  # the sine of the sharpest and of the bluntest angle of a quadrangle that is taken, about nine degrees
RECTANGLE = 1.0 + 1e-9  # the cost of a rectangle, below which there is none
_MOST_TRIED = 40  # sets of points on edges
_MOST_ADDED = 2  # points on edges

Loop = tuple[int, ...]
Triangle = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Quadrangles:
    """Quadrangles that fill a polygon.

    Attributes
    ----------
    points : (n, 2) array
        Those of the polygon first.
    corners : tuple of four int each
        Counterclockwise.
    parents : tuple of tuples of int
        Of each point the points of the polygon whose mean it is: itself, or the two ends of an edge; () inside.
    """

    points: Array
    corners: tuple[tuple[int, ...], ...]
    parents: tuple[tuple[int, ...], ...]

    @property
    def cost(self) -> float:
        """Return the number of quadrangles over the square of the smallest sine of an angle."""
        return len(self.corners) / max(min(_sine(self.points[list(one)]) for one in self.corners), 1e-300) ** 2


def quadrangles_of(points: Array, loops: Sequence[Loop]) -> Quadrangles | None:
    """Return the decomposition of a polygon, points (n, 2), that costs least; None if none is good enough.

    loops: the outer polygon counterclockwise, those around holes clockwise.
    """
    best, least = None, np.inf
    for one in _decompositions(points, loops):
        if (cost := one.cost) < least:
            best, least = one, cost
        if least <= RECTANGLE:
            break
    return best if best is not None and least * LEAST**2 <= len(best.corners) else None


def _decompositions(points: Array, loops: Sequence[Loop]) -> Iterator[Quadrangles]:
    """Yield decompositions without points on edges, then with one or two, of long edges first, and one all divided."""
    edges = [edge for loop in loops for edge in edges_of(loop)]
    long = sorted(edges, key=lambda edge: -float(np.linalg.norm(points[edge[0]] - points[edge[1]])))
    parity = sum(map(len, loops)) % 2  # of the number of triangles, and so of the points that have to be added
    sets = (chosen for count in range(parity, _MOST_ADDED + 1, 2) for chosen in combinations(long, count))
    for chosen in islice(sets, _MOST_TRIED):
        rows, paths, parents = _with_middles(points, loops, chosen)
        pairs, left = _matched(rows, _triangles(rows, paths))
        if not left:
            yield Quadrangles(rows, tuple(pairs), parents)
    pairs, left = _matched(points, _triangles(points, loops))
    yield _all_divided(points, [*pairs, *left], set(edges))


def _with_middles(
    points: Array, loops: Sequence[Loop], chosen: Sequence[tuple[int, int]]
) -> tuple[Array, list[Loop], tuple[tuple[int, ...], ...]]:
    """Return points, polygons and parents after the middles of some edges have become points."""
    number = {edge: len(points) + k for k, edge in enumerate(chosen)}
    rows = np.concatenate([points, *(points[list(edge)].mean(axis=0)[None] for edge in chosen)])
    paths = [tuple(i for a, b in edges_of(loop) for i in (a, number.get((a, b), -1)) if i >= 0) for loop in loops]
    return rows, paths, (*((k,) for k in range(len(points))), *chosen)


def _triangles(points: Array, loops: Sequence[Loop]) -> list[Triangle]:
    """Return the triangles of a polygon, flipped until none has a better neighbour across an edge."""
    path = list(loops[0])
    fixed = {frozenset(edge) for loop in loops for edge in edges_of(loop)}
    for hole in sorted(loops[1:], key=lambda loop: -float(points[list(loop), 0].max())):
        path = _bridged(points, path, hole, loops)
    space = np.column_stack([points, np.zeros(len(points))])
    triangles = [(int(a), int(b), int(c)) for a, b, c in triangulate(space, [path])]
    for _ in range(len(triangles) ** 2):
        sides = _sides(triangles)
        for edge, (one, other) in sides.items():
            if edge in fixed:
                continue
            a, b, c, d = _quadrangle(triangles[one], triangles[other], edge)
            if _sine(points[[a, b, c, d]]) > 0.0 and _opposite(points, a, b, c, d) < -1e-9:
                triangles[one], triangles[other] = (a, b, c), (a, c, d)
                break
        else:
            return triangles
    return triangles


def _bridged(points: Array, path: list[int], hole: Loop, loops: Sequence[Loop]) -> list[int]:
    """Return a polygon with a hole joined to it by the shortest line that meets no edge.

    Where rounding makes all lines meet one, the shortest is taken; what does not fill the body then is refused later.
    """
    edges = [edge for loop in loops for edge in edges_of(loop)]
    lines = sorted(
        (float(np.linalg.norm(points[a] - points[b])), i, k) for i, a in enumerate(path) for k, b in enumerate(hole)
    )
    free = (
        (i, k)
        for _, i, k in lines
        if not any(_meet(points, path[i], hole[k], c, d) for c, d in edges if not {path[i], hole[k]} & {c, d})
    )
    i, k = next(free, lines[0][1:])
    return [*path[: i + 1], *hole[k:], *hole[: k + 1], *path[i:]]


def _meet(points: Array, a: int, b: int, c: int, d: int) -> bool:
    """Return whether two lines between points meet."""
    turns = [
        cross(points[j] - points[i], points[k] - points[i]) for i, j, k in ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    ]
    return bool(turns[0] * turns[1] <= 0.0 and turns[2] * turns[3] <= 0.0)


def _sides(triangles: Sequence[Triangle]) -> dict[frozenset[int], tuple[int, int]]:
    """Return the edges between two triangles with these."""
    owners: dict[frozenset[int], list[int]] = {}
    for number, (a, b, c) in enumerate(triangles):
        for edge in edges_of((a, b, c)):
            owners.setdefault(frozenset(edge), []).append(number)
    return {edge: (rows[0], rows[1]) for edge, rows in owners.items() if len(rows) == 2}


def _quadrangle(one: Triangle, other: Triangle, edge: frozenset[int]) -> tuple[int, int, int, int]:
    """Return the four corners of two triangles, counterclockwise: the one of the first beside the edge comes first."""
    (a,), (c,) = set(one) - edge, set(other) - edge
    k = one.index(a)
    return a, one[(k + 1) % 3], c, one[(k + 2) % 3]


def _opposite(points: Array, a: int, b: int, c: int, d: int) -> float:
    """Return the sine of the sum of two opposite angles, at the first and the third corner.

    Below 0 the other diagonal is that of Delaunay.
    """
    angles = []
    for corner in (a, c):
        to_b, to_d = points[b] - points[corner], points[d] - points[corner]
        angles.append(np.arctan2(abs(cross(to_b, to_d)), to_b @ to_d))
    return float(np.sin(sum(angles)))


def _sine(corners: Array) -> float:
    """Return the smallest sine of an angle of a polygon (k, 2), 0 and below where it is not strictly convex."""
    ahead, behind = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
    lengths = np.linalg.norm(ahead, axis=1) * np.linalg.norm(behind, axis=1)
    return float((cross(ahead, behind) / np.maximum(lengths, 1e-300)).min())


def _matched(points: Array, triangles: list[Triangle]) -> tuple[list[tuple[int, ...]], list[Triangle]]:
    """Return as many quadrangles of two triangles as there are, the best ones, and the triangles that are left."""
    pairs = [
        (one, other, corners, sine)
        for edge, (one, other) in _sides(triangles).items()
        if (sine := _sine(points[list(corners := _quadrangle(triangles[one], triangles[other], edge))])) >= LEAST
    ]
    if not pairs:
        return [], triangles
    uses = np.zeros((len(triangles), len(pairs)))
    for k, (one, other, _, _) in enumerate(pairs):
        uses[[one, other], k] = 1.0
    gains = np.array([len(triangles) + sine for *_, sine in pairs])
    taken = _best_pairs(uses, gains) if uses.sum(axis=1).max() > 1.0 else np.arange(len(pairs))
    left = np.flatnonzero(uses[:, taken].sum(axis=1) < 0.5)
    return [pairs[k][2] for k in taken], [triangles[k] for k in left]


def _best_pairs(uses: Array, gains: Array) -> IntArray:
    """Return the numbers of the pairs with the largest sum of gains (k,), uses (triangles, k), each triangle in one."""
    from scipy.optimize import Bounds, LinearConstraint, milp  # which takes longer to load than a box needs for all

    once, whole = LinearConstraint(uses, ub=1.0), np.ones(len(gains), dtype=np.int64)
    chosen = milp(-gains, integrality=whole, bounds=Bounds(0.0, 1.0), constraints=once).x
    assert chosen is not None  # no pair at all is allowed, too
    return np.flatnonzero(chosen > 0.5)


def _all_divided(points: Array, pieces: list[tuple[int, ...]], border: set[tuple[int, int]]) -> Quadrangles:
    """Return the pieces of a polygon, each cut from its middle to the middles of its edges."""
    rows, parents, numbers = list(points), [(k,) for k in range(len(points))], dict[frozenset[int], int]()

    def middle(*corners: int) -> int:
        key = frozenset(corners)
        if key not in numbers:
            numbers[key] = len(rows)
            rows.append(points[list(corners)].mean(axis=0))
            parents.append(corners if {corners, corners[::-1]} & border else ())  # type: ignore[arg-type]
        return numbers[key]

    quadrangles = [
        (b, middle(b, c), middle(*piece), middle(a, b))
        for piece in pieces
        for a, b, c in zip(piece[-1:] + piece[:-1], piece, piece[1:] + piece[:1], strict=True)
    ]
    return Quadrangles(np.array(rows), tuple(quadrangles), tuple(parents))
