"""Solves for displacement and pressure by conjugate gradients in the inner product of Bramble and Pasciak.

K u + B^T p = f, B u - C p = g. With an approximate inverse P of K, and one of the pressures' matrix B K^-1 B^T + C, the
block-triangular preconditioner makes the matrix its own adjoint in the form

    <x, y> = x_u . (K - share / P) y_u + x_p . S y_p

(Bramble, Pasciak, Math. Comp. 50 (1988)). Where the share is less than all eigenvalues of P K, the form is an inner
product. With a share of one the iteration takes half as many steps, nearly as few as conjugate gradients on K alone; it
is then a simplified Lanczos method (Freund, Nachtigal, 1995), whose residuals may grow for a while. Where they grow too
much, or the form vanishes, the iteration starts again at the best iterate with a smaller share.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array
from parameterize.conjugate_gradients import NO_PRODUCT, LinearResult

GROWTH = 1e4  # of a residual over the least so far, at which the iteration starts again
SMALLER = 0.25  # share after a start over the share before
MOST_STARTS = 12
TRUE = 2.0  # residual of the last iterate over the tolerance: rounding spoils the one that the iteration updates

Pair = tuple[Array, Array]  # of a displacement and a pressure, or of forces and volumes


@dataclass(frozen=True, eq=False)
class Saddle:
    """State the matrix and its preconditioner.

    stiffness: from u to K u and B u. coupling: from p to B^T p and - C p. inverse: P. schur: the approximate inverse of
    the pressures' matrix.
    """

    stiffness: Callable[[Array], Pair]
    coupling: Callable[[Array], Pair]
    inverse: Callable[[Array], Array]
    schur: Callable[[Array], Array]

    def product(self, x: Pair) -> Pair:
        """Return the matrix times u and p."""
        return _sum(self.stiffness(x[0]), self.coupling(x[1]))

    def size(self, right: Pair) -> "Callable[[Pair], float]":
        """Return the function that measures residuals, relative to a right-hand side.

        Volumes are compared with those that the forces change under the preconditioner.
        """
        f, g = right
        volumes = np.linalg.norm(self.stiffness(self.inverse(f))[1]) + np.linalg.norm(g)
        forces = np.linalg.norm(f) or np.linalg.norm(self.coupling(self.schur(g))[0])

        def measured(r: Pair) -> float:
            parts = [float(np.linalg.norm(own)) for own in r]
            return math.hypot(*(own / size for own, size in zip(parts, (forces, volumes), strict=True) if size > 0.0))

        return measured


def saddle_point(
    system: Saddle, right: Pair, tolerance: float, max_iterations: int, start: Pair | None = None
) -> LinearResult:
    """Return the solution as a pair, and the residuals of forces and volumes together, as `conjugate_gradients` does.

    The residuals are those of the iterates; the result is the best of them.
    """
    x = start or (np.zeros_like(right[0]), np.zeros_like(right[1]))
    if not any(part.any() for part in right):
        return LinearResult((0.0 * right[0], 0.0 * right[1]), (0.0,), True)
    size = system.size(right)
    rest = _less(right, system.product(x))
    residuals, share = [size(rest)], 1.0
    if not math.isfinite(residuals[0]):
        return LinearResult(x, tuple(residuals), False, NO_PRODUCT)
    least = residuals[0]
    for _ in range(MOST_STARTS):
        if least <= tolerance or len(residuals) > max_iterations:
            break
        for iterate, r in _steps(system, x, rest, share):
            residuals.append(size(r))
            if residuals[-1] < least:
                least, x = residuals[-1], iterate
            if least <= tolerance or len(residuals) > max_iterations or not residuals[-1] <= GROWTH * least:
                break
        rest = _less(right, system.product(x))
        least = size(rest)
        if least <= TRUE * tolerance:
            break
        share *= SMALLER
    return LinearResult(x, (*residuals[:-1], least), least <= TRUE * tolerance)


def _steps(system: Saddle, x: Pair, rest: Pair, share: float) -> Iterator[tuple[Pair, Pair]]:
    """Yield iterates and their residuals, until the iteration breaks down."""

    def inverse(r: Array) -> Array:
        return system.inverse(r) / share

    z_u = inverse(rest[0])
    direction = product = None
    before = 1.0
    while True:
        stiff = system.stiffness(z_u)
        z = z_u, system.schur(stiff[1] - rest[1])
        image = _sum(stiff, system.coupling(z[1]))
        form = _dot(z, _less(stiff, rest))
        if not math.isfinite(form) or form == 0.0:
            return
        direction = z if direction is None else _sum(z, direction, form / before)
        product = image if product is None else _sum(image, product, form / before)
        turned = inverse(product[0])
        curvature = float((turned - direction[0]).ravel() @ product[0].ravel()) - _dot1(direction[1], product[1])
        if not math.isfinite(curvature) or curvature == 0.0:
            return
        step, before = form / curvature, form
        x, rest, z_u = _sum(x, direction, step), _sum(rest, product, -step), z_u - step * turned
        yield x, rest


def _dot1(one: Array, other: Array) -> float:
    return float(one.ravel() @ other.ravel())


def _dot(one: Pair, other: Pair) -> float:
    return _dot1(one[0], other[0]) + _dot1(one[1], other[1])


def _sum(one: Pair, other: Pair, factor: float = 1.0) -> Pair:
    return one[0] + factor * other[0], one[1] + factor * other[1]


def _less(one: Pair, other: Pair) -> Pair:
    return _sum(one, other, -1.0)
