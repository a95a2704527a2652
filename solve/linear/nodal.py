"""Changes between coefficients of splines and their values at the Greville points of all patches.

On a patch the values are N times the coefficients, with N a tensor product of three small matrices. Its inverse serves
the whole body: on a face values depend on the coefficients of the face alone, because knot vectors are open.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import collocation, greville

from ..discretization.groups import OnPatches
from ..discretization.space import TrialSpace
from ..discretization.unknowns import Glued

Factors = tuple[Array, Array, Array]  # a direction each: (patches, n, n), or (1, n, n) where all patches have one


@dataclass(frozen=True, eq=False)
class NodalBasis:
    """Apply N^-1 and its transpose to vectors (c, m) of the free unknowns of a body.

    matrices, inverses: N and N^-1 of each group of patches. copies: (m,), the number of coefficients of patches that
    are one unknown.
    """

    unknowns: Glued
    matrices: Sequence[Factors]
    inverses: Sequence[Factors]
    copies: Array

    @classmethod
    def of(cls, unknowns: Glued) -> "NodalBasis":
        """Return the basis of the values at the Greville points."""
        groups = [[unknowns.spaces[patch] for patch in group] for group in unknowns.layout.groups]
        ones = unknowns.spread(np.ones((1, *unknowns.shape)))
        matrices = list(map(_values_of, groups))
        return cls(unknowns, matrices, list(map(_inverses, matrices)), unknowns.collect(ones)[0])

    def values(self, coefficients: OnPatches) -> OnPatches:
        """Return N times all coefficients of the patches, fixed ones included."""
        parts = replace(coefficients, flat=coefficients.flat.copy())
        for (u, v, w), part in zip(self.matrices, parts.in_groups, strict=True):
            part[:] = _applied(u, v, w, part)
        return parts

    def coefficients(self, values: Array) -> Array:
        """Return N^-1 times values (c, m)."""
        parts = self.unknowns.spread(values)
        for (u, v, w), part in zip(self.inverses, parts.in_groups, strict=True):
            part[:] = _applied(u, v, w, part)
        return self.unknowns.chosen(parts)

    def integrals(self, residual: Array) -> Array:
        """Return N^-T times a residual (c, m): its entries for the functions that are one at one Greville point."""
        parts = self.unknowns.spread(residual / self.copies)
        for (u, v, w), part in zip(self.inverses, parts.in_groups, strict=True):
            part[:] = _applied(u.swapaxes(1, 2), v.swapaxes(1, 2), w.swapaxes(1, 2), part)
        return self.unknowns.collect(parts)


def _applied(u: Array, v: Array, w: Array, x: Array) -> Array:
    """Return three matrices applied along the last three axes of x (patches, c, n_u, n_v, n_w)."""
    count, c, n_u, n_v, n_w = x.shape
    x = x.reshape(count, c * n_u * n_v, n_w) @ w.swapaxes(1, 2)
    x = v[:, None] @ x.reshape(count, c * n_u, n_v, n_w)
    return (u[:, None] @ x.reshape(count, c, n_u, n_v * n_w)).reshape(count, c, n_u, n_v, n_w)


def _values_of(spaces: Sequence[TrialSpace]) -> Factors:
    """Return N of a group of patches; those of equal knots are one."""
    u, v, w = (_stacked([(space.knots[axis], space.degrees[axis]) for space in spaces]) for axis in range(3))
    return u, v, w


def _inverses(matrices: Factors) -> Factors:
    u, v, w = (np.asarray(np.linalg.inv(own), dtype=np.float64) for own in matrices)
    return u, v, w


def _stacked(rows: Sequence[tuple[Array, int]]) -> Array:
    kinds: dict[bytes, int] = {}
    numbers = [kinds.setdefault(knots.tobytes(), len(kinds)) for knots, _ in rows]
    firsts = np.unique(numbers, return_index=True)[1]
    different = np.stack([_values(*rows[i]) for i in firsts])
    return different if len(different) == 1 else different[numbers]


def _values(knots: Array, degree: int) -> Array:
    """Return the values (n, n) of the functions of a direction, in columns, at its Greville points."""
    return np.asarray(collocation(knots, degree, nodes(knots, degree)).toarray())


def nodes(knots: Array, degree: int) -> Array:
    """Return the Greville points (n,), with the ends of the knot vector exactly."""
    return _nodes(knots.tobytes(), degree)


@lru_cache(maxsize=1024)
def _nodes(knots: bytes, degree: int) -> Array:
    row = np.frombuffer(knots)
    return np.asarray(np.clip(greville(row, degree), row[0], row[-1]))


def linear(space: TrialSpace, rows: Sequence[Array]) -> TrialSpace:
    """Return the space of trilinear functions on nodes, with the faces of another space. rows: (n,) each direction."""
    u, v, w = (np.concatenate([row[:1], row, row[-1:]]) for row in rows)
    return replace(space, degrees=(1, 1, 1), knots=(u, v, w))
