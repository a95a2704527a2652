"""Rational splines, F = A / W: A = sum w_i P_i N_i and W = sum w_i N_i are splines, the homogeneous components.

(Piegl and Tiller, *The NURBS Book*, 2nd ed., section 1.4 and chapter 4.)
"""

from collections.abc import Callable, Sequence
from functools import cache
from itertools import product
from math import comb, prod

import numpy as np

from ..arrays import Array

Orders = tuple[int, int, int]  # of a partial derivative, a direction each


def homogeneous(points: Array, weights: Array) -> Array:
    """Return the coefficients (.., 4) of A and W from control points (.., 3) and weights (..)."""
    return np.concatenate([points * weights[..., None], weights[..., None]], axis=-1)


def projected(components: Array) -> tuple[Array, Array]:
    """Return the control points (.., 3) and weights (..) of homogeneous coefficients (.., 4)."""
    return components[..., :3] / components[..., 3:], components[..., 3]


def quotients(derivative: Callable[[Orders], Array], orders: Sequence[Orders]) -> list[Array]:
    """Return partial derivatives (.., 3) of F = A / W.

    derivative: returns that of A and W, (.., 4), for an order. By Leibniz' rule on A = W F (The NURBS Book, eq. 4.20).
    """
    parts = cache(derivative)

    @cache
    def quotient(order: Orders) -> Array:
        found = parts(order)[..., :3]
        for taken in product(*(range(n + 1) for n in order)):
            if any(taken):
                times = prod(map(comb, order, taken))
                rest = quotient(tuple(n - k for n, k in zip(order, taken, strict=True)))
                found = found - times * parts(taken)[..., 3:] * rest
        return found / parts((0, 0, 0))[..., 3:]

    return [quotient(order) for order in orders]
