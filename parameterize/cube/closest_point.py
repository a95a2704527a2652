"""The small linear system in every Gauss-Newton step towards a closest point."""

from __future__ import annotations

import numpy as np

from ..arrays import Array


def damped_fit(first: Array, second: Array, right: Array, damping: float) -> tuple[Array, Array]:
    """Return the coefficients a, b (k,) that minimise |a first + b second - right|, for vectors (k, 3).

    The diagonal of the normal equations grows by `damping` times its sum: the two directions may be parallel. The
    vectors are first scaled by a power of two, exactly, so that nothing overflows whatever their unit.
    """
    exponent = -int(np.frexp(max(np.abs(first).max(initial=0.0), np.abs(second).max(initial=0.0)))[1])
    first, second, right = (np.ldexp(vectors, exponent) for vectors in (first, second, right))
    aa, bb, ab = (first * first).sum(1), (second * second).sum(1), (first * second).sum(1)
    ra, rb = (first * right).sum(1), (second * right).sum(1)
    lift = damping * (aa + bb) + 1e-150  # no more than keeps the determinant of two zero vectors positive
    aa, bb = aa + lift, bb + lift
    determinant = aa * bb - ab * ab
    return (bb * ra - ab * rb) / determinant, (aa * rb - ab * ra) / determinant
