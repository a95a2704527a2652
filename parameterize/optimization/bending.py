"""Computes the fairness: the matrices of 1-D integrals, the integral of F's squared Hessians, and its energy term.

operators.py explains the layout of control points and the sum of pieces of work.
"""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numba
import numpy as np
from numpy.typing import DTypeLike

from ..arrays import Array, Floats, Knots
from ..spline.bspline import collocation, gauss_points
from ..spline.spline_map import ControlNets
from .operators import PiecewiseOperator
from .tensor_product import Band, apply_band, band
from .term import Blockwise, RoundWeights, side_by_side

Grams = list[tuple[Array, ...]]  # mass, stiffness and bending matrices (n, n), each for the three directions


def grams(knots: Knots, degrees: tuple[int, ...]) -> Grams:
    """Return the matrices of integrals of products: of basis functions, of their first and of their second derivatives.

    The integrals are computed by Gauss quadrature and are exact.
    """

    def of(row: Array, degree: int, derivative: int) -> Array:
        points, weights = gauss_points(row, degree + 1)
        table = collocation(row, degree, points.ravel(), derivative).toarray()
        return np.asarray(table.T @ (weights.ravel()[:, None] * table))

    return [tuple(of(row, p, d) for row, p in zip(knots, degrees, strict=True)) for d in range(3)]


def bending_operator(matrices: Grams, weight: float, dtype: DTypeLike = np.float64) -> PiecewiseOperator:
    """Return the operator x -> weight * H x, where x^T H x = int |Hessian F|^2 is exact.

    A piece of work is one component of F. H = h x m x m + m x h x m + m x m x h + 2 (k x k x m + k x m x k + m x k x
    k), with mass matrices m, stiffness matrices k and bending matrices h of the three directions.
    """
    bands = tuple(
        band(*((factor * matrix).astype(dtype) for matrix in (mass, math.sqrt(2.0) * slope, curve)))
        for factor, mass, slope, curve in zip((1.0, 1.0, weight), *matrices, strict=True)
    )

    def bend(component: int, control: Floats) -> Floats:
        return np.asarray(_bent(bands, control[component]))

    (m_u, k_u, h_u), (m_v, k_v, h_v), (m_w, k_w, h_w) = ([np.diag(part[d]) for part in matrices] for d in range(3))
    own = _outer(h_u, m_v, m_w) + _outer(m_u, h_v, m_w) + _outer(m_u, m_v, h_w)
    own += 2.0 * (_outer(k_u, k_v, m_w) + _outer(k_u, m_v, k_w) + _outer(m_u, k_v, k_w))
    blocks = np.zeros((6, *own.shape), dtype)
    blocks[[0, 2, 5]] = weight * own  # of the three components
    pieces: list[Callable[[Floats], Any]] = [partial(bend, component) for component in range(3)]
    return PiecewiseOperator(pieces, lambda parts, _: np.stack(parts), lambda _: blocks)


def _outer(u: Array, v: Array, w: Array) -> Array:
    """Return the products (n_u, n_v, n_w) of entries of three rows."""
    return u[:, None, None] * v[:, None] * w


class BlockFairness:
    """Compute the term weight * int |Hessian F|^2 over a block, which is quadratic in the control points.

    bend: the second derivative of the term, in double precision. mass: the three matrices (n, n) of the integrals of
    products of basis functions.
    """

    def __init__(self, knots: Knots, degree: int, weight: float) -> None:
        self._weight, matrices = weight, grams(knots, (degree,) * 3)
        self.mass, self._slope, self._curve = matrices
        self.bend, self._rough = (bending_operator(matrices, 2.0 * weight, dtype) for dtype in (np.float64, np.float32))

    def weight(self, weights: RoundWeights) -> float:
        """Return 1, because the operators already contain the weight."""
        return 1.0

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the term at control points (3, n_u, n_v, n_w), and its gradient of the same shape."""
        bent = self.bend(control)
        return 0.5 * float(np.vdot(bent, control)), bent

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the second derivative, which does not depend on `control`, as an operator in single precision."""
        return self._rough

    def with_stiffness(self) -> tuple[Array, ...]:
        """Return for each direction twice the stiffness matrix plus twice the weighted bending matrix, each (n, n)."""
        return tuple(2.0 * k + 2.0 * self._weight * h for k, h in zip(self._slope, self._curve, strict=True))


class Fairness(Blockwise[BlockFairness]):
    """Compute the fairness of all blocks; knots: of each block, in the units of the distortion.

    bend: the second derivative of the term, in double precision.
    """

    def __init__(self, nets: ControlNets, knots: tuple[Knots, ...], weight: float) -> None:
        super().__init__(nets, [BlockFairness(rows, nets.degree, weight) for rows in knots])
        self.bend = side_by_side(nets, [term.bend for term in self.terms])


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _bent(bands: tuple[Band, Band, Band], field: Array) -> Array:
    """Return H applied to one component (n_u, n_v, n_w); the bands of a direction are those of m, sqrt(2) k and h.

    Each step applies matrices along the first axis, which then becomes the last axis.
    """
    first_u, mass_u, slope_u, curve_u = bands[0]
    first_v, mass_v, slope_v, curve_v = bands[1]
    first_w, mass_w, slope_w, curve_w = bands[2]
    n_u, n_v, n_w = field.shape
    x = field.reshape(n_u, n_v * n_w)
    mass, slope, curve = np.zeros_like(x), np.zeros_like(x), np.zeros_like(x)
    apply_band(first_u, mass_u, x, mass)
    apply_band(first_u, slope_u, x, slope)
    apply_band(first_u, curve_u, x, curve)
    m, k, h = _turned(mass, n_v), _turned(slope, n_v), _turned(curve, n_v)
    for_mass, for_slope, for_curve = np.zeros_like(m), np.zeros_like(m), np.zeros_like(m)  # of w
    apply_band(first_v, mass_v, h, for_mass)
    apply_band(first_v, slope_v, k, for_mass)
    apply_band(first_v, curve_v, m, for_mass)
    apply_band(first_v, mass_v, k, for_slope)
    apply_band(first_v, slope_v, m, for_slope)
    apply_band(first_v, mass_v, m, for_curve)
    out = np.zeros((n_w, n_u * n_v), field.dtype)
    apply_band(first_w, mass_w, _turned(for_mass, n_w), out)
    apply_band(first_w, slope_w, _turned(for_slope, n_w), out)
    apply_band(first_w, curve_w, _turned(for_curve, n_w), out)
    return _turned(out, n_u).reshape(n_u, n_v, n_w)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _turned(field: Array, size: int) -> Array:
    """Return the field with its first axis last, in the shape (size, ...): its former second axis has length `size`."""
    return np.ascontiguousarray(field.T).reshape(size, field.size // size)
