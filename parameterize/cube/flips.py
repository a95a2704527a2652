"""Finds, prevents and turns back flipped triangles of a surface laid out on the cube."""

import math

import numba
import numpy as np

from ..arrays import Array, IntArray, Mask
from .cube import snap

_ROUNDING = 8.0 * float(np.finfo(np.float64).eps)
_FLAT = 1e-13  # orientation of a triangle that counts as flipped
_SWEEPS = 600  # of `untangle`, at most
_PATIENCE = 60  # sweeps of `untangle` after which one more ring of neighbours may move
_PUSHES = 100  # sweeps of `unflip`, at most
_PUSHED_VOLUME = 1e-2  # of a triangle that `unflip` has turned outwards, as a share of the median triangle's
_HOLDING_ROUNDS = 20  # of `new_flips`, at most: each holds more points


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def orientation(places: Array, faces: IntArray) -> tuple[Array, Array]:
    """Return (p0 - c) . ((p1 - p0) x (p2 - p0)) of triangles (m, 3), c the cube's centre, and its rounding error: (m,).

    The product is positive where a triangle faces outwards, seen from the centre. On a common face of the cube two of
    the three components of the cross product vanish exactly.
    """
    triple, noise = np.empty(len(faces)), np.empty(len(faces))
    for t in range(len(faces)):
        triple[t], noise[t] = _orientation(places, faces, t)
    return triple, noise


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _orientation(places: Array, faces: IntArray, t: int) -> tuple[float, float]:
    """Return `orientation` of the t-th triangle."""
    p0, p1, p2 = faces[t, 0], faces[t, 1], faces[t, 2]
    triple, noise = 0.0, 0.0
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        ahead = (places[p1, d] - places[p0, d]) * (places[p2, e] - places[p0, e])
        behind = (places[p1, e] - places[p0, e]) * (places[p2, d] - places[p0, d])
        triple += (places[p0, c] - 0.5) * (ahead - behind)
        noise += _ROUNDING * abs(places[p0, c] - 0.5) * (abs(ahead) + abs(behind))
    return triple, noise


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def flipped(places: Array, faces: IntArray) -> Mask:
    """Return the mask (m,) of triangles (m, 3) that do not face outwards, with a margin for later rounding errors."""
    found = np.empty(len(faces), np.bool_)
    for t in range(len(faces)):
        found[t] = _orientation(places, faces, t)[0] <= _FLAT
    return found


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def new_flips(after: Array, before: Array, faces: IntArray, allowed: Mask, moved: Mask) -> Mask:
    """Return the mask (n,) of points that must stay, so that no other triangle flips when the rest moves to `after`.

    allowed: the mask (m,) of the triangles that may be flipped. moved: the mask (n,) of points; triangles of other
    points alone are known not to flip.
    """
    stay, places, touched = np.zeros(len(before), np.bool_), after.copy(), moved.copy()
    for _ in range(_HOLDING_ROUNDS):
        is_done, held = True, np.zeros(len(before), np.bool_)
        for t in range(len(faces)):
            is_near = touched[faces[t, 0]] or touched[faces[t, 1]] or touched[faces[t, 2]]
            if is_near and not allowed[t] and _orientation(places, faces, t)[0] <= _FLAT:
                is_done = False
                for k in range(3):
                    held[faces[t, k]] = True
        if is_done:
            return stay
        for n in range(len(before)):
            touched[n] = held[n] and not stay[n]
            if touched[n]:
                stay[n] = True
                for c in range(3):
                    places[n, c] = before[n, c]
    stay[:] = True
    return stay


def unflip(parameters: Array, faces: IntArray, still: Mask | None = None) -> Array:
    """Turn flipped triangles outwards by the least moves of their corners, sweep by sweep; some may stay flipped.

    This suits a few flips in a layout whose points should stay: `untangle` flattens whole neighbourhoods, and with it
    alone the closest points of Homer's surface are 1.4 times as far. Seen from the centre, the volume under a triangle
    is linear in each corner, so each triangle gives one Newton step, and every corner takes the mean of the steps of
    its triangles. still: (n,), the points that must not move.
    """
    direction = _directions(parameters)
    volumes = np.abs(np.linalg.det(direction[faces]))
    goal = _PUSHED_VOLUME * float(np.median(volumes))
    for _ in range(_PUSHES):
        bad = flipped(0.5 + direction, faces)
        if not bad.any():
            break
        used = faces[bad]
        corners = direction[used]  # (k, 3, 3)
        slopes = np.cross(corners[:, [1, 2, 0]], corners[:, [2, 0, 1]])
        volume = np.sum(corners[:, 0] * slopes[:, 0], axis=1)
        slopes -= np.sum(slopes * corners, axis=2, keepdims=True) * corners  # along the sphere
        size = (goal - volume) / np.maximum(np.sum(slopes**2, axis=(1, 2)), _FLAT)
        count = np.bincount(used.ravel(), minlength=len(direction))[:, None]
        pushed = size[:, None, None] * slopes
        total = [np.bincount(used.ravel(), pushed[:, :, c].ravel(), len(direction)) for c in range(3)]
        step = np.stack(total, axis=1) / np.maximum(count, 1)
        if still is not None:
            step[still] = 0.0
        direction = direction + step
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return snap(0.5 + direction)


def untangle(parameters: Array, faces: IntArray, sweeps: int = _SWEEPS, still: Mask | None = None) -> Array:
    """Return the parameters (n, 3) after relaxation of the vertices around flipped triangles, until none is left.

    A relaxed vertex moves half way to the mean of its neighbours, seen from the centre. Only vertices of triangles that
    are flipped at the time move; where triangles stay flipped, one more ring of neighbours joins after every _PATIENCE
    sweeps. After all `sweeps` some flips may be left. still: (n,), points that must not move.
    """
    held = np.zeros(len(parameters), dtype=bool) if still is None else still
    return snap(0.5 + _relaxed(_directions(parameters), np.ascontiguousarray(faces), sweeps, held))


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _relaxed(direction: Array, faces: IntArray, sweeps: int, still: Mask) -> Array:
    """Return the unit vectors (n, 3) of `untangle` after its sweeps; the given ones are overwritten."""
    for sweep in range(sweeps):
        bad = flipped(0.5 + direction, faces)
        free = np.zeros(len(direction), np.bool_)
        for t in range(len(faces)):
            for corner in faces[t]:
                free[corner] |= bad[t]
        if not free.any():
            break
        for _ in range(sweep // _PATIENCE):
            inner = free.copy()
            for t in range(len(faces)):
                for k in range(3):  # closed surface: both directions of an edge appear
                    free[faces[t, k]] |= inner[faces[t, (k + 1) % 3]]
        total = np.zeros_like(direction)
        for t in range(len(faces)):
            for k in range(3):
                point, other = faces[t, k], faces[t, (k + 1) % 3]
                if free[point]:
                    for c in range(3):
                        total[point, c] += direction[other, c]
        for point in range(len(direction)):
            if free[point] and not still[point]:
                _turn(direction[point], total[point])
    return direction


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _turn(direction: Array, towards: Array) -> None:
    """Turn a unit vector half way to another vector, in place."""
    length = math.sqrt(towards[0] ** 2 + towards[1] ** 2 + towards[2] ** 2)
    for c in range(3):
        direction[c] += towards[c] / length
    length = math.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
    for c in range(3):
        direction[c] /= length


def untangle_whole(parameters: Array, faces: IntArray, sweeps: int = _SWEEPS, still: Mask | None = None) -> Array:
    """Return the untangled parameters (n, 3), or the given parameters where flips would be left.

    Neighbours join ring after ring, so a flip that cannot be removed would disturb a whole limb of the surface.
    """
    untangled = untangle(parameters, faces, sweeps, still)
    return parameters if flipped(untangled, faces).any() else untangled


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _directions(parameters: Array) -> Array:
    """Return unit vectors from the cube's centre to its points (n, 3)."""
    found = np.empty_like(parameters)
    for n in range(len(parameters)):
        x, y, z = parameters[n, 0] - 0.5, parameters[n, 1] - 0.5, parameters[n, 2] - 0.5
        length = math.sqrt(x * x + y * y + z * z)
        found[n, 0], found[n, 1], found[n, 2] = x / length, y / length, z / length
    return found
