"""Compiled loops over the triangles on a sphere, for the derivatives of their symmetric Dirichlet energy."""

import numba
import numpy as np

from ..arrays import Array, IntArray


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def derivatives(
    directions: Array, tangents: Array, faces: IntArray, stiffness: Array, area: Array
) -> tuple[Array, Array]:
    """Return the gradient (m, 6) and the second derivative (m, 6, 6) of triangles (m, 3) in steps along tangents.

    directions (n, 3) and their tangents (n, 3, 2); stiffness (m, 3, 3) and area (m,) of each triangle on the surface.
    The energy is D (1 + (A / a)^2), with the Dirichlet energy D, the areas a on the sphere and A on the surface.
    """
    gradients, hessians = np.empty((len(faces), 6)), np.empty((len(faces), 6, 6))
    towards, wider, first, second, inwards = np.empty(3), np.empty(3), np.empty(6), np.empty(6), np.empty(3)
    for t in range(len(faces)):
        x, y, z = directions[faces[t, 0]], directions[faces[t, 1]], directions[faces[t, 2]]
        own = 0.5 * _volume(x, y, z)
        dirichlet = _dirichlet(x, y, z, stiffness[t])
        square = area[t] ** 2
        factor, slope, bend = 1.0 + square / own**2, -2.0 * square / own**3, 6.0 * square / own**4
        for i in range(3):
            corner, after, before = directions[faces[t, i]], directions[faces[t, i - 2]], directions[faces[t, i - 1]]
            for d in range(3):
                e, f = (d + 1) % 3, (d + 2) % 3
                towards[d] = 2.0 * (stiffness[t, i, 1] * (y[d] - x[d]) + stiffness[t, i, 2] * (z[d] - x[d]))
                wider[d] = 0.5 * (after[e] * before[f] - after[f] * before[e])
            inwards[i] = 0.0  # the sphere is curved
            for d in range(3):
                inwards[i] += (factor * towards[d] + slope * dirichlet * wider[d]) * corner[d]
            frame = tangents[faces[t, i]]
            for a in range(2):
                first[2 * i + a] = towards[0] * frame[0, a] + towards[1] * frame[1, a] + towards[2] * frame[2, a]
                second[2 * i + a] = wider[0] * frame[0, a] + wider[1] * frame[1, a] + wider[2] * frame[2, a]
        for p in range(6):
            gradients[t, p] = factor * first[p] + slope * dirichlet * second[p]
            for q in range(p + 1):
                bound = 2.0 * factor * stiffness[t, p // 2, q // 2]
                value = _block(directions, tangents, faces[t], p, q, bound, slope * dirichlet)
                value += (
                    slope * (first[p] * second[q] + second[p] * first[q]) + bend * dirichlet * second[p] * second[q]
                )
                hessians[t, p, q] = hessians[t, q, p] = value - inwards[p // 2] * (p == q)
    return gradients, hessians


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _block(directions: Array, tangents: Array, face: IntArray, p: int, q: int, bound: float, pressure: float) -> float:
    """Return how the forces along p and q of a triangle change: `bound` binds its corners, `pressure` widens it."""
    i, j = p // 2, q // 2
    u, v = tangents[face[i], :, p % 2], tangents[face[j], :, q % 2]
    value = bound * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])
    if i == j:
        return value
    turned = 0.5 * pressure * _volume(directions[face[3 - i - j]], u, v)
    return value + (turned if (i + 1) % 3 == j else -turned)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _volume(x: Array, y: Array, z: Array) -> float:
    """Return the determinant of three rows, from differences: they may be close to each other."""
    u, v = (y[0] - x[0], y[1] - x[1], y[2] - x[2]), (z[0] - x[0], z[1] - x[1], z[2] - x[2])
    across = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    return x[0] * across[0] + x[1] * across[1] + x[2] * across[2]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _dirichlet(x: Array, y: Array, z: Array, stiffness: Array) -> float:
    """Return the Dirichlet energy of a triangle, from its sides."""
    energy = 0.0
    for d in range(3):
        u, v = y[d] - x[d], z[d] - x[d]
        energy += stiffness[1, 1] * u * u + 2.0 * stiffness[1, 2] * u * v + stiffness[2, 2] * v * v
    return energy


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def lift(hessians: Array, values: Array, vectors: Array) -> None:
    """Make symmetric matrices (m, 6, 6), with eigenvalues (m, 6) and vectors (m, 6, 6), positive: negative ones go."""
    for t in range(len(values)):
        for k in range(6):
            if values[t, k] < 0.0:
                for p in range(6):
                    for q in range(6):
                        hessians[t, p, q] -= values[t, k] * vectors[t, p, k] * vectors[t, q, k]
