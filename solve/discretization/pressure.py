"""Defines the pressures of a nearly incompressible body: splines on pairs of spans of the trial space.

Displacements of degree p and smoothness p - 1 do not control pressures of degree p - 1 on the same spans: one that
alternates from span to span does no work on any of them. They control pressures of degree p on pairs of spans
("subgrid": Bressan, Sangalli, Numer. Math. 124 (2013)), and of degree p - 1 on a single span (Taylor, Hood). Both are
splines of the trial space, so the same kernels evaluate them: their coefficients there are E times their own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, kron

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import shared_numbers
from parameterize.spline.bspline import collocation, greville
from parameterize.spline.interface import Interface

from .groups import CoefficientLayout
from .space import TrialSpace

LEAST_DEGREE = 2  # of displacements that have pressures
ROUNDING = 1e-12  # of an entry of E

Extraction = tuple[Array, Array, Array]  # E of the three directions, (n, k) each


@dataclass(frozen=True, eq=False)
class Pressures:
    """Number the pressures of a body, those of glued faces once.

    of_patches: E of each patch. numbers: for each patch the number (k_u, k_v, k_w) of each of its pressures. matrix:
    (total, count), from the pressures to the coefficients in the trial spaces of all patches, as an array of groups
    with one component has them. transposed: its transpose.
    """

    of_patches: Sequence[Extraction]
    numbers: Sequence[IntArray]
    matrix: csr_array
    transposed: csr_array

    @classmethod
    def of(
        cls, layout: CoefficientLayout, spaces: Sequence[TrialSpace], interfaces: Sequence[Interface]
    ) -> "Pressures":
        """Return the pressures of patches with the given trial spaces, continuous across the given interfaces."""
        known: dict[bytes, Array] = {}

        def along(knots: Array, degree: int) -> Array:
            key = bytes([degree]) + knots.tobytes()
            return known[key] if key in known else known.setdefault(key, extraction(knots, degree))

        each = [tuple(map(along, space.knots, space.degrees)) for space in spaces]
        numbers, count = shared_numbers([tuple(part.shape[1] for part in own) for own in each], interfaces)
        matrix = _joined(layout, each, numbers, count)  # type: ignore[arg-type]  # three directions
        return cls(each, numbers, matrix, csr_array(matrix.T))  # type: ignore[arg-type]

    @property
    def count(self) -> int:
        """Return the number of pressures of the body."""
        return int(self.matrix.shape[1])


def _joined(
    layout: CoefficientLayout, each: Sequence[Extraction], numbers: Sequence[IntArray], count: int
) -> csr_array:
    """Return the matrix of `Pressures`."""
    patterns: dict[tuple[int, ...], csr_array] = {}
    parts = []
    for patch in (number for group in layout.groups for number in group):
        u, v, w = each[patch]
        key = id(u), id(v), id(w)
        if key not in patterns:
            patterns[key] = csr_array(kron(csr_array(u), kron(csr_array(v), csr_array(w))))
        parts.append((patterns[key], numbers[patch].ravel()))
    entries = np.concatenate([own.data for own, _ in parts])
    columns = np.concatenate([places[own.indices] for own, places in parts])
    lengths = np.concatenate([np.diff(own.indptr) for own, _ in parts])
    return csr_array((entries, columns, np.concatenate([[0], np.cumsum(lengths)])), shape=(len(lengths), count))


def extraction(knots: Array, degree: int) -> Array:
    """Return E (n, k) of one direction: the coefficients in the trial space of k pressures.

    knots, degree: those of the trial space, at least LEAST_DEGREE. Knots where splines are only continuous divide the
    direction into parts, with pressures of their own that are equal where the parts meet.
    """
    values, counts = np.unique(knots, return_counts=True)
    repeats = counts.astype(np.int64)
    cuts = np.flatnonzero(repeats >= degree)
    parts = [
        _of_smooth(values[a : b + 1], repeats[a + 1 : b], degree) for a, b in zip(cuts[:-1], cuts[1:], strict=True)
    ]
    rows, columns = (np.cumsum([0, *(part.shape[axis] - 1 for part in parts)]) for axis in (0, 1))
    whole = np.zeros((rows[-1] + 1, columns[-1] + 1))
    for part, i, j in zip(parts, rows, columns, strict=False):
        whole[i : i + part.shape[0], j : j + part.shape[1]] = part
    return whole


def _of_smooth(breaks: Array, repeats: IntArray, degree: int) -> Array:
    """Return E of spans between which splines are smooth. repeats: the multiplicity of each inner knot."""
    count = len(breaks) - 1
    pairs = np.arange(2, count // 2 + 1, 2)
    kept = np.union1d(pairs, count - pairs)  # the same from both ends: a glued face may run either way
    own = degree if count > 1 else degree - 1
    fine = _open(breaks, degree, np.repeat(breaks[1:-1], repeats))
    coarse = _open(breaks, own, np.repeat(breaks[kept], repeats[kept - 1]))
    nodes = greville(fine, degree)
    found = np.linalg.solve(collocation(fine, degree, nodes).toarray(), collocation(coarse, own, nodes).toarray())
    return np.where(np.abs(found) > ROUNDING, found, 0.0)


def _open(breaks: Array, degree: int, inner: Array) -> Array:
    """Return an open knot vector with the given inner knots."""
    return np.concatenate([[breaks[0]] * (degree + 1), inner, [breaks[-1]] * (degree + 1)])
