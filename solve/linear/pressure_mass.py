"""Inverts the pressures' matrix roughly: each patch's as a tensor product, averaged where patches meet.

The matrix B K^-1 B^T + C is nearly int (1 / (2 mu) + 1 / lambda) p r. On a patch this mass matrix is nearly D (M_u (x)
M_v (x) M_w) D, M of the parameters and D a diagonal (Loli, Sangalli, Tani, Comput. Math. Appl. 125 (2022)).
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import collocation

from ..discretization.grouped import Law
from ..discretization.pressure import Extraction, Pressures

STRENGTH = 2.0  # of the mass over that of the law: 1 and 4 take up to a tenth more iterations


@dataclass(frozen=True, eq=False)
class _Group:
    """Hold the patches with equal numbers of pressures: places (k, m_u, m_v, m_w), weights of that shape, inverses."""

    places: IntArray
    weights: Array
    inverses: Sequence[Array]  # of M, (k, m, m) of each direction

    def __call__(self, residual: Array) -> Array:
        u, v, w = self.inverses
        x = self.weights * residual[self.places]
        x = np.matmul(u, x.reshape(*x.shape[:2], -1)).reshape(x.shape)
        x = np.matmul(v[:, None], x)
        return self.weights * np.matmul(x, w[:, None])  # M is symmetric


@dataclass(frozen=True, eq=False)
class PressureMass:
    """Apply the rough inverse to pressures (count,)."""

    groups: Sequence[_Group]
    count: int

    @classmethod
    def of(cls, pressures: Pressures, laws: Sequence[Law], sums: Sequence[Array]) -> "PressureMass":
        """Return the inverse for patches with the quadrature rules of the given laws.

        sums: for each patch the integral (m_u, m_v, m_w) of 1 / (2 mu) + 1 / lambda times each pressure.
        """
        numbers = pressures.numbers
        total = np.bincount(
            np.concatenate([own.ravel() for own in numbers]), np.concatenate([own.ravel() for own in sums])
        )
        members: dict[tuple[int, ...], list[int]] = defaultdict(list)
        for patch, own in enumerate(numbers):
            members[own.shape].append(patch)
        known: dict[tuple[int, int, int], tuple[Array, Array]] = {}
        groups = []
        for patches in members.values():
            each = [_directions(pressures.of_patches[i], laws[i], known) for i in patches]
            u, v, w = (np.stack([own[axis][1] for own in each]) for axis in range(3))
            own = np.stack([sums[i] for i in patches])
            places = np.stack([numbers[i] for i in patches])
            plain = np.stack([np.einsum("i,j,k->ijk", *(one[axis][0] for axis in range(3))) for one in each])
            weights = own / total[places] * np.sqrt(plain / (STRENGTH * own))
            groups.append(_Group(places, weights, (u, v, w)))
        return cls(groups, pressures.count)

    def __call__(self, residual: Array) -> Array:
        """Return the inverse times volumes (count,)."""
        found = np.zeros(self.count)
        for group in self.groups:
            found += np.bincount(group.places.ravel(), group(residual).ravel(), self.count)
        return found


def _directions(
    parts: Extraction, law: Law, known: dict[tuple[int, int, int], tuple[Array, Array]]
) -> list[tuple[Array, Array]]:
    """Return for each direction the integrals (m,) of the pressures over the parameter, and the inverse of M (m, m)."""
    found = []
    for axis, part in enumerate(parts):
        key = id(part), id(law.rule), axis
        if key not in known:
            points, weights = law.rule.points[axis], law.rule.weights[axis]
            basis = collocation(law.space.knots[axis], law.space.degrees[axis], points).toarray() @ part
            known[key] = weights @ basis, np.linalg.inv(basis.T @ (weights[:, None] * basis))
        found.append(known[key])
    return found
