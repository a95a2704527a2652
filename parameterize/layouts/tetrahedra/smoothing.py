"""Moves the inner nodes of curved tetrahedra so that det J becomes positive, with the nodes on the part left in place.

The energy is the mean distortion (|J|^2 / 3)^(3/2) / chi(det J) against regular tetrahedra, at points of each one;
chi, a smooth floor under det J, is lowered from sweep to sweep (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov,
ACM Trans. Graph. 40 (2021)).
"""

from dataclasses import dataclass
from functools import cache

import numba
import numpy as np

from ...arrays import Array, IntArray, Mask
from .determinant import indices
from .mesh import EDGES, ORDER, THIRDS

_POINTS = 4  # the points of a tetrahedron at which the energy is taken: the lattice of this degree
_STEPS = 60  # of a sweep, at most
_SIZE = 0.25  # the weight of (1 + det J^2) / chi, without which a tetrahedron would shrink to a point under the floor
_REGULAR = np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]]) / np.sqrt(8.0)  # with edges of length 1


@dataclass(frozen=True, eq=False)
class CubicDistortion:
    """The distortion of some cubic tetrahedra, of which some nodes are free.

    cells: (t, 20), the nodes of each. free: (m,), numbers of nodes. scales: (t,), one over the edges of the regular
    tetrahedra to which they are compared.
    """

    cells: IntArray
    free: IntArray
    scales: Array

    def value(self, nodes: Array, width: float) -> tuple[float, Array]:
        """Return the energy for nodes (k, 3), and its derivative (m, 3) by the free ones."""
        energy, slopes = _energy(nodes, self.cells, self.scales, _slopes(), width)
        return energy, slopes[self.free]

    def smoothed(self, nodes: Array, width: float) -> Array:
        """Return nodes (k, 3) of which the free ones have moved to less distortion, with a floor of this width."""
        from scipy.optimize import minimize

        def value(free: Array) -> tuple[float, Array]:
            moved = nodes.copy()
            moved[self.free] = free.reshape(-1, 3)
            energy, slope = self.value(moved, width)
            return energy, slope.ravel()

        found = nodes.copy()
        ended = minimize(value, nodes[self.free].ravel(), jac=True, method="L-BFGS-B", options={"maxiter": _STEPS})
        found[self.free] = ended.x.reshape(-1, 3)
        return found


@cache
def _slopes() -> Array:
    """Return the derivatives (points, 20, 3) of the shape functions in the coordinates of a regular tetrahedron."""
    points = indices(_POINTS) / _POINTS
    powers = np.linalg.inv(np.prod((THIRDS[:, None] / ORDER) ** indices(ORDER), axis=2))
    steps = np.eye(4, dtype=np.int64)
    by_weights = np.stack(
        [
            np.prod(points[:, None] ** np.maximum(indices(ORDER) - step, 0), axis=2) * (indices(ORDER) @ step)
            for step in steps
        ]
    )  # (4, points, 20), of the powers by the barycentric coordinates
    slopes = by_weights @ powers
    edges = np.linalg.inv((_REGULAR[1:] - _REGULAR[0]).T)  # of the coordinates: from places to weights 1 to 3
    return np.einsum("kqn,kx->qnx", slopes[1:] - slopes[0], edges)


def neighbourhood(cells: IntArray, chosen: Mask) -> Mask:
    """Return the chosen tetrahedra (t,), and those that have a vertex with them in common."""
    touched = np.zeros(int(cells.max()) + 1, dtype=bool)
    touched[cells[chosen, :4]] = True
    return np.asarray(touched[cells[:, :4]].any(axis=1))


def distortion_of(cells: IntArray, nodes: Array, near: Mask, fixed: Mask) -> CubicDistortion:
    """Return the distortion of the tetrahedra that are `near` (t,): nodes that others share, or are `fixed`, stay."""
    free = np.zeros(len(nodes), dtype=bool)
    free[cells[near]] = True
    free[cells[~near]] = False
    corners = nodes[cells[near, :4]]
    edges = np.linalg.norm(corners[:, EDGES[:, 0]] - corners[:, EDGES[:, 1]], axis=2)
    return CubicDistortion(cells[near], np.flatnonzero(free & ~fixed), 1.0 / np.sqrt((edges**2).mean(axis=1)))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _energy(nodes: Array, cells: IntArray, scales: Array, slopes: Array, width: float) -> tuple[float, Array]:
    """Return the energy of tetrahedra for nodes (k, 3), and its derivative (k, 3) by all of them."""
    energy, whole = 0.0, np.zeros_like(nodes)
    count = cells.shape[1]
    local, along = np.empty((count, 3)), np.empty((count, 3))
    jacobian, cofactors = np.empty((3, 3)), np.empty((3, 3))
    for t in range(len(cells)):
        for n in range(count):
            for x in range(3):
                local[n, x], along[n, x] = nodes[cells[t, n], x] * scales[t], 0.0
        for q in range(len(slopes)):
            jacobian[:] = 0.0
            for n in range(count):
                for x in range(3):
                    for j in range(3):
                        jacobian[x, j] += local[n, x] * slopes[q, n, j]
            norm, determinant = 0.0, 0.0
            for j in range(3):
                a, b = (j + 1) % 3, (j + 2) % 3
                for x in range(3):
                    y, z = (x + 1) % 3, (x + 2) % 3
                    cofactors[x, j] = jacobian[y, a] * jacobian[z, b] - jacobian[z, a] * jacobian[y, b]
                    norm += jacobian[x, j] * jacobian[x, j] / 3.0
            for x in range(3):
                determinant += jacobian[x, 0] * cofactors[x, 0]
            root = np.sqrt(determinant * determinant + width * width)
            chi = 0.5 * (determinant + root)
            value = (norm * np.sqrt(norm) + _SIZE * (1.0 + determinant * determinant)) / chi
            energy += value
            first = np.sqrt(norm) / chi
            second = 0.5 * value / chi * (1.0 + determinant / root) - 2.0 * _SIZE * determinant / chi
            for x in range(3):
                for j in range(3):
                    jacobian[x, j] = (first * jacobian[x, j] - second * cofactors[x, j]) * scales[t]
            for n in range(count):
                for x in range(3):
                    for j in range(3):
                        along[n, x] += jacobian[x, j] * slopes[q, n, j]
        for n in range(count):
            for x in range(3):
                whole[cells[t, n], x] += along[n, x]
    return energy, whole
