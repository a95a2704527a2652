"""Layout of a closed surface on the boundary of the cube: places (n, 3) of its points, orientation of its triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from ..arrays import Array, IntArray
from .cube import snap

_FLAT = 1e-13  # orientation of a triangle that counts as flipped
_SWEEPS = 600
_PATIENCE = 60
_UNDO_ROUNDS = 20


def flipped(places: Array, faces: IntArray) -> NDArray[np.bool_]:
    """Which triangles (m, 3) do not face outwards, seen from the cube's centre: (m,)."""
    a, b, c = np.moveaxis((places - 0.5)[faces], 1, 0)
    return np.asarray(np.einsum("mi,mi->m", a, np.cross(b, c)) <= _FLAT)


def new_flips(before: Array, after: Array, faces: IntArray) -> NDArray[np.bool_]:
    """Which points (n,) must stay so that no further triangle flips when the others go from `before` to `after`."""
    stay, allowed = np.zeros(len(before), dtype=bool), flipped(before, faces)
    for _ in range(_UNDO_ROUNDS):
        bad = flipped(np.where(stay[:, None], before, after), faces) & ~allowed
        if not bad.any():
            return stay
        stay[faces[bad].ravel()] = True
    return np.ones(len(before), dtype=bool)


def untangle(parameters: Array, faces: IntArray, sweeps: int = _SWEEPS) -> Array:
    """Relax the vertices around flipped triangles until none is left, moving as few and as little as possible.

    A relaxed vertex goes half way to the mean of its neighbours, seen from the centre. Only vertices of triangles that
    are flipped at the time move; where they stay so, rings of neighbours join, one after every _PATIENCE sweeps. After
    `sweeps` some may be left.
    """
    n = len(parameters)
    i, j = faces.ravel(), faces[:, [1, 2, 0]].ravel()  # closed surface: both directions appear
    adjacency = csr_array((np.ones(len(i)), (i, j)), shape=(n, n))
    direction = parameters - 0.5
    direction = direction / np.linalg.norm(direction, axis=1, keepdims=True)
    for sweep in range(sweeps):
        bad = flipped(0.5 + direction, faces)
        if not bad.any():
            break
        free = np.zeros(n, dtype=bool)
        free[faces[bad].ravel()] = True
        for _ in range(sweep // _PATIENCE):
            free |= (adjacency @ free.astype(float)) > 0.0
        mean = adjacency[free] @ direction
        moved = direction[free] + mean / np.linalg.norm(mean, axis=1, keepdims=True)
        direction[free] = moved / np.linalg.norm(moved, axis=1, keepdims=True)
    return snap(0.5 + direction)
