"""Turns the cube within a layout on the sphere, so that its edges do not lie in hollows.

det J > 0 needs the faces of the solid to meet at less than 180 degrees along the cube's edges, measured inside. So an
edge in a hollow cannot lie on the surface; an edge along a ridge suits best.
"""

import numba
import numpy as np
from scipy.spatial.transform import Rotation

from ..arrays import Array
from ..surface.geometry import edge_triangles, normals_and_areas
from ..threads import in_parallel
from .cube import CubeLayout

_TURNS = 200  # rotations of the cube that are drawn at random
_FINALISTS = 5  # the best of these, which are turned further
_EVALUATIONS = 60  # of the cost while one rotation is turned further, at most
_FIRST_TURN = 0.1  # radians: edges of the first simplex
_OTHER_TURN = 0.3  # radians by which a turn differs from every better one to count as another
_EDGE_WIDTH = 0.15  # from the cube's edges, within which the surface should not be hollow
_PIECES = 24  # of each cube edge: a piece in a hollow is not made up for by ridges beside it
_HOLLOW = 1.0  # extra weight of a piece in a hollow


def best_turn(layout: CubeLayout, generator: np.random.Generator, number: int = 0) -> Array:
    """Return the rotation (3, 3) of a layout on the sphere with the least concavity along the cube's edges.

    number: 0 for the best rotation, 1 for the next best, and so on. The best of some random rotations are improved by
    the simplex method of Nelder and Mead; results that nearly agree count as one. Where fewer than `number` + 1 results
    are left, the list continues with the best random rotations that differ from all results.
    """
    from scipy.optimize import fmin

    middles, along, bends = _bends(layout)
    simplex = _FIRST_TURN * np.vstack([np.zeros(3), np.eye(3)])

    def cost(rotation: Rotation) -> float:
        turn = rotation.as_matrix().T
        return _concavity(middles @ turn, along @ turn, bends)

    def turned_further(rotation: Rotation) -> tuple[float, Rotation]:
        def cost_after(vector: Array) -> float:
            return cost(Rotation.from_rotvec(vector) * rotation)

        least = fmin(cost_after, simplex[0], initial_simplex=simplex, maxfun=_EVALUATIONS, disp=False)
        return cost_after(least), Rotation.from_rotvec(least) * rotation

    rotations = list(Rotation.random(_TURNS, rng=generator))
    order = np.argsort(in_parallel(cost, rotations))
    found = in_parallel(turned_further, [rotations[i] for i in order[:_FINALISTS]])
    turns = list[Rotation]()
    for _, rotation in sorted(found, key=lambda pair: pair[0]):
        if _is_other(rotation, turns):
            turns.append(rotation)
    for i in order[_FINALISTS:]:
        if number < len(turns):
            break
        if _is_other(rotations[i], turns):
            _, rotation = turned_further(rotations[i])
            if _is_other(rotation, turns):
                turns.append(rotation)
    return np.asarray(turns[min(number, len(turns) - 1)].as_matrix())


def concavity(layout: CubeLayout) -> float:
    """Return the concavity of a layout along the cube's edges, which `best_turn` minimises; ridges are negative."""
    return _concavity(*_bends(layout))


def _is_other(rotation: Rotation, turns: list[Rotation]) -> bool:
    return all(_angle_between(rotation, turn) > _OTHER_TURN for turn in turns)


def _angle_between(first: Rotation, second: Rotation) -> float:
    """Return the angle between two turns of the cube, in radians, the least over the 24 symmetries of the cube."""
    return float((first * second.inv()).reduce(left=Rotation.create_group("O")).magnitude())


def _bends(layout: CubeLayout) -> tuple[Array, Array, Array]:
    """Return the midpoints and directions on the sphere of the mesh edges, (e, 3) each, and the surface's bends (e,).

    A bend is the angle between the two triangles, positive in a hollow, times the edge's length on the sphere.
    """
    points, faces, places = layout.points, layout.faces, layout.places
    edges, owners = edge_triangles(faces)
    here, there = owners.T
    normals, _ = normals_and_areas(points, faces)
    angle = np.arccos(np.clip((normals[here] * normals[there]).sum(axis=1), -1.0, 1.0))
    middle_there = points[faces[there]].mean(axis=1) - points[edges[:, 0]]
    hollow = np.where((middle_there * normals[here]).sum(axis=1) > 0.0, angle, -angle)
    step = places[edges[:, 1]] - places[edges[:, 0]]
    length = np.linalg.norm(step, axis=1)
    middles = places[edges].mean(axis=1)
    return middles, step / np.maximum(length, 1e-300)[:, None], length * hollow


def _concavity(middles: Array, along: Array, bends: Array) -> float:
    """Return the sum of the bends (e,) near the cube's edges, weighted by nearness and direction.

    The bends are summed over pieces of each cube edge; a positive sum, a hollow, has a larger weight.
    """
    pieces = _bends_of_pieces(middles, along, bends, _EDGE_WIDTH, _PIECES)
    return float(pieces.sum() + _HOLLOW * np.maximum(pieces, 0.0).sum())


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bends_of_pieces(middles: Array, along: Array, bends: Array, width: float, count: int) -> Array:
    """Return weighted sums of bends (3, 2, 2, count): by the cube edge's axis, its two sides, and the piece.

    The two sides, 0 or 1, are those of the two other axes.
    """
    sums = np.zeros((3, 2, 2, count))
    for n in range(len(bends)):
        axis = 0  # of the nearest edge of the cube
        for other in range(1, 3):
            if abs(middles[n, other]) < abs(middles[n, axis]):
                axis = other
        first, second = middles[n, (axis + 1) % 3], middles[n, (axis + 2) % 3]
        size = 2.0 * max(abs(first), abs(second))  # projects radially onto the cube
        away = 0.5 - min(abs(first), abs(second)) / size
        weight = np.exp(-0.5 * (away / width) ** 2) * along[n, axis] ** 2
        piece = min(int(count * (0.5 + middles[n, axis] / size)), count - 1)
        sums[axis, int(first > 0.0), int(second > 0.0), piece] += weight * bends[n]
    return sums
