"""Chooses the cube's corners on the sharp edges of a surface, and says which of its points the cube's edges carry.

The corners take corners of sharp edges, or points on ridges; paths between them (edge_paths.py) run along ridges that
lead the same way. The points of ridges on these paths are carried: they slide along the cube's edge alone.
"""

from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..surface.geometry import edge_table
from ..surface.ridges import Ridges
from .cube import CORNERS, EDGES, CubeLayout, axis_and_side, face_number, nearest_faces

OFF_RIDGES = (0.85, 1.5)  # by which a corner off all ridges counts as farther away on the cube: the usual, and for rims
# that are far from the corners, such as the small one of a cone
_OFF_CORNER = 0.25  # by which one on a ridge does
_TRIED = 6  # corners of sharp edges near each corner of the cube
_MOVE = 1.0  # length of ridges, at volume 1, that is worth a corner's squared distance 1 on the cube


def choose_sharp_corners(layout: CubeLayout, ridges: Ridges, off_ridge: float = OFF_RIDGES[0]) -> IntArray:
    """Return eight different vertices (8,) for the cube's corners: near these on the cube, on corners of sharp edges.

    A vertex elsewhere on a ridge, and more so one off all ridges, by `off_ridge`, has to be nearer. Then corners move
    to others of sharp edges, one by one or two at a time, where edges of the cube follow more ridges.
    """
    from scipy.optimize import linear_sum_assignment

    gaps = np.linalg.norm(layout.places[:, None] - CORNERS, axis=2)  # (n, 8)
    on = np.flatnonzero(ridges.hold(layout.points))
    ends = np.array([np.linalg.norm(layout.points - corner, axis=1).argmin() for corner in ridges.corners], dtype=int)
    extra = np.full(len(gaps), off_ridge)
    extra[on] = _OFF_CORNER
    extra[ends] = 0.0
    cost = gaps + extra[:, None]
    candidates = np.unique(np.argsort(cost, axis=0)[:8])
    rows, columns = linear_sum_assignment(cost[candidates])
    chosen = np.asarray(candidates[rows[np.argsort(columns)]])
    length = np.zeros((len(ends) + 1,) * 2)
    a, b = ridges.links.T
    length[a, b] = length[b, a] = ridges.lengths
    return _improved(chosen, ends, length, gaps)


def _improved(chosen: IntArray, ends: IntArray, length: Array, gaps: Array) -> IntArray:
    """Return the corners (8,) after moves to others of `ends` (c,) that raise the length of the ridges followed.

    length: (c + 1, c + 1), of the ridge between two corners of sharp edges; the last row is that of other vertices.
    gaps: (n, 8), the distances of vertices from the cube's corners on the cube.
    """
    number = {int(vertex): k for k, vertex in enumerate(ends)}
    near = [ends[np.argsort(gaps[ends, k])[:_TRIED]] for k in range(8)]

    def score(corners: IntArray) -> float:
        at = [number.get(int(vertex), len(ends)) for vertex in corners]
        followed = sum(length[at[i], at[j]] for i, j in EDGES)
        return float(followed - _MOVE * np.square(gaps[corners, range(8)]).sum())

    best, value, moved = chosen, score(chosen), True
    while moved:
        moved = False
        for i, j in combinations(range(8), 2):
            for first, second in product([best[i], *near[i]], [best[j], *near[j]]):
                other = best.copy()
                other[[i, j]] = first, second
                if len(set(other.tolist())) == 8 and (found := score(other)) > value + 1e-9:
                    best, value, moved = other, found, True
    return best


@dataclass(frozen=True, eq=False)
class Constrained:
    """Say which points of a layout on the cube slide along the cube's edges alone.

    fixed: (n, 3), the parameters that points keep. faces: (n,), the face of the cube on which they slide. length: of
    the cube's edges on ridges.
    """

    fixed: Mask
    faces: IntArray
    length: float


def constrained(layout: CubeLayout, ridges: Ridges) -> Constrained:
    """Return which points of ridges lie on the cube's edges, and stay there.

    A ridge that runs around a whole face of the cube without a corner of its own passes the cube's corners: its points
    keep the parameter that is constant on the face, and slide from one edge of the cube to the next.
    """
    places = layout.places
    edges = edge_table(layout.faces)[0]
    at_side = (places == 0.0) | (places == 1.0)
    same = (places[edges[:, 0]] == places[edges[:, 1]]) & at_side[edges].all(axis=1)
    edges = edges[same.sum(axis=1) == 2]
    lengths = np.linalg.norm(layout.points[edges[:, 1]] - layout.points[edges[:, 0]], axis=1)
    on = ridges.along(layout.points, edges)
    fixed, faces = np.zeros(places.shape, dtype=bool), nearest_faces(places)
    fixed[edges[on].ravel()] = at_side[edges[on].ravel()]
    for face in range(6):
        axis, side = axis_and_side(face)
        rim = (places[edges, axis] == side).all(axis=1)
        own = np.unique(edges[rim])
        if on[rim].all() and not ridges.end_at(layout.points[own]).any():
            fixed[own] = np.arange(3) == axis
            others = np.where(at_side[own] & (np.arange(3) != axis), np.arange(3), -1).max(axis=1)
            faces[own] = face_number(others, places[own, others].astype(np.int64))
    return Constrained(fixed, faces, float(lengths[on].sum()))
