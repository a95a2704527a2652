"""Divides the regions between curves into quadrangles: of all candidates those that fill them at the least cost.

Quadrangles fill a region exactly once where each line inside is a side of as many on its left as on its right, and each
curve around it is a side of one on the region's side, whole or in parts: an integer program.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from ...arrays import Array
from .candidates import Candidates, CurveCuts, beside, branches_of, candidates_of, cut, cut_places, opposite
from .coons import Quad, Sides, qualities, smoothed
from .planar_graph import PlanarGraph
from .plane_regions import PlaneRegion, outline
from .plane_warp import PlaneWarp
from .polygons import edges_of

_GAP = 0.02  # relative: a decomposition that costs so little more than the best one is taken
_NODES = 200  # of the search, at most


@dataclass(frozen=True, eq=False)
class Decomposition:
    """Quadrangles that fill regions.

    Attributes
    ----------
    points : (n, 2) array
    quads : tuple of four int each
        Counterclockwise.
    owners : tuple of int
        The region of each.
    sides : dict
        The curves that are sides, by their ends, in both directions; others are straight.
    inner : tuple of int
        The points that lie inside of regions.
    cost : float
        By which decompositions are compared.
    """

    points: Array
    quads: tuple[Quad, ...]
    owners: tuple[int, ...]
    sides: Sides
    inner: tuple[int, ...]
    cost: float

    @property
    def quality(self) -> float:
        """Return the quality of the worst quadrangle."""
        return float(qualities(self.points, self.quads, self.sides).min())

    def smoothed(self) -> "Decomposition":
        """Return the decomposition with its inner points moved."""
        return replace(self, points=smoothed(self.points, self.quads, self.sides, self.inner))

    def moved(self, field: PlaneWarp) -> "Decomposition":
        """Return the decomposition of the plane that a field has moved."""
        sides = {edge: curve.moved(field) for edge, curve in self.sides.items()}
        return replace(self, points=field(self.points), sides=sides)


def decomposition_of(
    network: PlanarGraph, regions: Sequence[PlaneRegion], most: int, *, facing: bool = False
) -> Decomposition | None:
    """Return the decomposition of regions into quadrangles that costs least; None where there is none.

    most: blocks, at most, one for each slab of each quadrangle. facing: whether straight sides have optional points
    opposite curved ones, too.
    """
    branches = [branches_of(network, region) for region in regions]
    nodes = list(network.nodes)
    at: dict[tuple[int, int], Array] = {}
    for region, own in zip(regions, branches, strict=True):
        near = np.concatenate([own, opposite(network, region)]) if facing else own
        for edge in (edge for loop in region.loops for edge in edges_of(loop)):
            key = (min(edge), max(edge))
            at[key] = np.concatenate([at.get(key, np.empty((0, 2))), near])
    cuts: dict[tuple[int, int], CurveCuts] = {}
    for curve in network.curves:
        if (key := (min(curve.ends), max(curve.ends))) in at:
            cuts[key] = cut(curve, cut_places(curve, at[key]), nodes)
    inner, rows = list[int](), list[Candidates]()
    sides = {edge: part for one in cuts.values() for edge, part in one.parts.items()}
    for region, own in zip(regions, branches, strict=True):
        rims = [[_ahead(cuts[min(edge), max(edge)], edge[0]) for edge in edges_of(loop)] for loop in region.loops]
        loops = [tuple(k for rim in row for k in rim.numbers[:-1]) for row in rims]
        outlines = [outline(network, loop) for loop in region.loops]
        points = [*own, *beside(np.array(nodes), loops, sides, outlines)]
        numbers = list(range(len(nodes), len(nodes) + len(points)))
        nodes += points
        inner += numbers
        rows.append(candidates_of(np.array(nodes), [rim for row in rims for rim in row], numbers, outlines))
    chosen = _chosen(rows, regions, list(cuts.values()), most)
    if chosen is None:
        return None
    picked = [
        (quad, owner) for owner, numbers in enumerate(chosen[0]) for quad in (rows[owner].quads[k] for k in numbers)
    ]
    return Decomposition(
        np.array(nodes), tuple(q for q, _ in picked), tuple(o for _, o in picked), sides, tuple(inner), chosen[1]
    )


def _ahead(cuts: CurveCuts, start: int) -> CurveCuts:
    """Return cuts whose numbers begin with a node."""
    return cuts if cuts.numbers[0] == start else replace(cuts, numbers=cuts.numbers[::-1])


def _chosen(
    rows: Sequence[Candidates], regions: Sequence[PlaneRegion], cuts: Sequence[CurveCuts], most: int
) -> tuple[list[list[int]], float] | None:
    """Return the candidates of each region that fill it, and what they cost; None where none do."""
    layers = [sum(region.solid) for region in regions]
    costs = [layer / row.qualities**2 for row, layer in zip(rows, layers, strict=True)]
    counts = [np.full(len(row.quads), layer) for row, layer in zip(rows, layers, strict=True)]
    equations: dict[object, dict[int, float]] = {}
    column = 0
    on_curve = {frozenset(edge) for one in cuts for edge in one.parts}
    for owner, row in enumerate(rows):
        for quad in row.quads:
            for a, b in edges_of(quad):
                key = (owner, a, b) if frozenset((a, b)) in on_curve else (owner, min(a, b), max(a, b))
                equations.setdefault(key, {})[column] = 1.0 if a == key[1] else -1.0
            column += 1
    first = column
    goals: dict[object, float] = {}
    around = [{edge for loop in region.loops for edge in edges_of(loop)} for region in regions]
    for one in cuts:
        ends = one.numbers[0], one.numbers[-1]
        sides = [(owner, way) for owner in range(len(rows)) for way in (1, -1) if ends[::way] in around[owner]]
        goals["path", ends, ends[0]] = 1.0
        for i, a in enumerate(one.numbers):
            for b in one.numbers[i + 1 :]:
                equations.setdefault(("path", ends, a), {})[column] = 1.0
                if b != ends[1]:
                    equations.setdefault(("path", ends, b), {})[column] = -1.0
                for owner, way in sides:
                    equations.setdefault((owner, *(a, b)[::way]), {})[column] = -1.0
                column += 1
    from scipy.optimize import Bounds, LinearConstraint, milp

    cost = np.concatenate([*costs, np.zeros(column - first)])
    keys = list(equations)
    data = [(i, j, v) for i, key in enumerate(keys) for j, v in equations[key].items()]
    i, j, v = np.array(data).T
    right = np.array([goals.get(key, 0.0) for key in keys])
    matrix = csr_array((v, (i, j)), shape=(len(keys), column))
    few = csr_array(np.concatenate([*counts, np.zeros(column - first)])[None])
    optimum = milp(
        cost,
        integrality=np.ones(column, dtype=np.int64),
        bounds=Bounds(0.0, 1.0),
        constraints=[LinearConstraint(matrix, right, right), LinearConstraint(few, 0.0, most)],
        options={"mip_rel_gap": _GAP, "node_limit": _NODES},
    )
    if optimum.x is None:
        return None
    chosen, start = list[list[int]](), 0
    for row in rows:
        chosen.append(np.flatnonzero(optimum.x[start : start + len(row.quads)] > 0.5).tolist())
        start += len(row.quads)
    return chosen, float(optimum.fun)
