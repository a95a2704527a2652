"""Computes the distortion of a spline map, with a penalty on det J at the quadrature points."""

import math
from collections.abc import Callable

import numba
import numpy as np

from ..arrays import Array, Floats, Knots
from ..quality.rotations import closest_rotations, cofactors_and_determinants, least_eigenvalues, squared_norms
from ..spline.spline_map import ControlNets
from ..threads import in_parallel
from .operators import PiecewiseOperator, no_blocks
from .tensor_product import SYMMETRIC, GaussGrid
from .term import Blockwise, RoundWeights

ARAP_LIMIT = 6.0  # times 1 + the mean distortion: larger distortion costs more, else a few elements are crushed
_STIFFENING = 3.0  # weight of the squared excess above that limit
_MIN_DET = 0.15  # det J below this is penalised at the Gauss points; mean det J is 1
_GAUSS = 3, 1  # Gauss points a span and direction: on the first and last span, where F bends most, and on the others
_LEAST_DET = 0.03  # in the metric of the damping: below, it would hold F still


class BlockDistortion:
    """Compute int a + s (a - l)_+^2 + w (alpha - det J)_+^2 over a block, with a = |J - R|^2, R the closest rotation.

    The first term, a, is the ARAP energy of F; the second keeps the maximum of a small; the third prevents folds, as
    the paper's bijectivity term does. The integral is computed by Gauss quadrature. Where alpha is lowered by a share,
    w grows by the inverse of the squared share.

    limit: l. penalty: w. folded: the number of quadrature points with det J <= 0 at the last evaluation of the energy.
    damping: the damping of Newton's step, a factor of the squared change of J relative to J, because det J has the
    largest curvature where it is small.
    """

    def __init__(self, knots: Knots, degree: int, gauss: tuple[int, int] = _GAUSS) -> None:
        self._grid = GaussGrid(knots, (degree,) * 3, gauss[0], inner=gauss[1])
        self.limit, self.penalty, self.damping, self.folded = ARAP_LIMIT, 0.0, 0.0, 0
        self._floors = np.full_like(self._grid.weights, _MIN_DET)  # alpha at the points
        self._short_weights = self._grid.weights  # of the squared shortfalls
        self._size = math.prod(float(row[-1] - row[0]) for row in knots)

    def start_round(self, control: Array, penalty: float) -> None:
        """Set the weight of the penalty, and set the limit l in proportion to 1 + the mean distortion at `control`."""
        self.penalty = penalty

        def part(planes: slice) -> float:
            jacobian = self._grid.jacobian(control, planes)
            return float(self._weights(planes) @ squared_norms(jacobian - closest_rotations(jacobian)))

        self.limit = ARAP_LIMIT * (1.0 + sum(in_parallel(part, self._grid.planes())) / self._size)

    def lower_floors(self, control: Array, least: float) -> Array:
        """Lower alpha where det J is small all around at `control`; return the shares (n_u, n_v, n_w) of the spans.

        least: the smallest of these shares.

        In a part that is far thinner than the rest, such as a stalk, det J is small everywhere. A penalty with the
        usual alpha would inflate such a part, against the surface's data. There alpha is half the mean of det J in a
        neighbourhood, which is a ninth of the cube wide.
        """
        from scipy.ndimage import uniform_filter

        def part(planes: slice) -> Array:
            return np.asarray(cofactors_and_determinants(self._grid.jacobian(control, planes))[1])

        weights = self._grid.weights
        det = self._grid.by_planes(in_parallel(part, self._grid.planes()))
        mass, volume = (self._grid.sum_on_spans(values) for values in (det * weights, weights))
        around = [2 * (count // 18) + 1 for count in mass.shape]
        mean = uniform_filter(mass, around, mode="nearest") / uniform_filter(volume, around, mode="nearest")
        shares = np.clip(0.5 * mean / _MIN_DET, least, 1.0)
        at_points = self._grid.at_points(shares)
        self._floors, self._short_weights = _MIN_DET * at_points, weights / at_points**2
        return np.asarray(shares)

    def weight(self, weights: RoundWeights) -> float:
        """Return 1, because other weights are relative to the distortion; `start_round` sets the penalty's weight."""
        return 1.0

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the energy and its gradient (3, n_u, n_v, n_w), and count the folded quadrature points in `folded`."""

        def part(planes: slice) -> tuple[float, int, tuple[int, Floats]]:
            jacobian, weights = self._grid.jacobian(control, planes), self._weights(planes)
            cofactors, det = cofactors_and_determinants(jacobian)
            short = np.maximum(self._grid.flat(self._floors, planes) - det, 0.0)
            shortfall = self._grid.flat(self._short_weights, planes) * short
            gap = jacobian - closest_rotations(jacobian)
            density = squared_norms(gap)
            excess = np.maximum(density - self.limit, 0.0)
            energy = weights @ (density + _STIFFENING * excess**2)
            energy += self.penalty * (shortfall @ short)
            dual = 2.0 * weights * (1.0 + 2.0 * _STIFFENING * excess) * gap
            dual -= 2.0 * self.penalty * shortfall * cofactors
            return float(energy), int((det <= 0.0).sum()), self._grid.adjoint(dual, planes)

        energies, folded, pulled = zip(*in_parallel(part, self._grid.planes()), strict=True)
        self.folded = sum(folded)
        return sum(energies), self._grid.collect(list(pulled), control)

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return a positive semidefinite second derivative at `control`, damped, as an operator in single precision.

        With S = R^T J, R turns by R [omega] when J changes by d, where (tr(S) I - S) omega = -sum_k R_k x d_k over the
        rows k, so the Hessian of a is 2 (d - R [omega]). It is positive where all sums of two singular values, the
        eigenvalues of tr(S) I - S, are at least 2; smaller eigenvalues are raised to 2. The penalty's part is the
        Gauss-Newton matrix.
        """
        rough = control.astype(np.float32)

        def piece(planes: slice) -> tuple[Callable[[Floats], tuple[int, Floats]], tuple[int, Floats]]:
            jacobian, weights = self._grid.jacobian(rough, planes), self._weights(planes).astype(np.float32)
            rotation = closest_rotations(jacobian)
            cofactors, det = cofactors_and_determinants(jacobian)
            short_weights = self._grid.flat(self._short_weights, planes).astype(np.float32)
            push = (
                np.sqrt(2.0 * self.penalty * short_weights * (det < self._grid.flat(self._floors, planes))) * cofactors
            )
            gap = jacobian - rotation
            excess = np.maximum(squared_norms(gap) - self.limit, 0.0)
            pull = np.sqrt(8.0 * _STIFFENING * weights * (excess > 0.0)) * gap
            scale = 2.0 * weights * (1.0 + 2.0 * _STIFFENING * excess)
            # |J^-1|^2 / 3: 1 for the identity, and bounded where det J vanishes
            inverse = squared_norms(cofactors) / (3.0 * np.maximum(det, _LEAST_DET) ** 2)
            held = 2.0 * self.damping * weights * np.clip(inverse, 1.0, 1.0 / _LEAST_DET**2)
            parts = rotation, _turning(rotation, jacobian), pull.reshape(9, -1), push.reshape(9, -1), scale, held
            matrices = _matrices(*parts)
            return self._grid.squared(matrices, planes), self._grid.diagonal(matrices, planes)

        products, diagonals = zip(*in_parallel(piece, self._grid.planes()), strict=True)
        blocks = self._grid.collect(list(diagonals), no_blocks(rough))
        return PiecewiseOperator(list(products), self._grid.collect, lambda _: blocks)

    def _weights(self, planes: slice) -> Array:
        return self._grid.flat(self._grid.weights, planes)


class DistortionTerm(Blockwise[BlockDistortion]):
    """Compute the distortion of all blocks; knots: of each block, in units in which the mean of det J is near 1."""

    def __init__(self, nets: ControlNets, knots: tuple[Knots, ...]) -> None:
        super().__init__(nets, [BlockDistortion(rows, nets.degree) for rows in knots])

    @property
    def folded(self) -> int:
        """Return the number of quadrature points with det J <= 0 at the last evaluation of the energy."""
        return sum(term.folded for term in self.terms)

    def start_round(self, control: Array, penalty: float) -> None:
        """Set the weight of the penalty and the limits of the distortion for control points (3, n)."""
        for block, term in enumerate(self.terms):
            term.start_round(self.nets.of_block(control, block), penalty)

    def lower_floors(self, control: Array, least: float) -> Array:
        """Lower the floors of det J where it is small all around at `control`; return the shares (m,) of all spans."""
        parts = enumerate(self.terms)
        return np.concatenate([term.lower_floors(self.nets.of_block(control, k), least).ravel() for k, term in parts])

    def damp(self, damping: float) -> None:
        """Set the damping of Newton's step."""
        for term in self.terms:
            term.damping = damping


def _turning(rotation: Floats, jacobian: Floats) -> Floats:
    """Return (tr(S) I - S)^-1 with S = R^T J, (3, 3, m); eigenvalues of tr(S) I - S below 2 are raised to 2."""
    sums = -_stretches(rotation, jacobian)
    trace = sums[0, 0] + sums[1, 1] + sums[2, 2]
    for i in range(3):
        sums[i, i] -= trace
    lift = np.maximum(2.0 - least_eigenvalues(sums), 0.0)
    for i in range(3):
        sums[i, i] += lift
    cofactors, det = cofactors_and_determinants(sums)  # of a symmetric matrix
    return np.asarray(cofactors / det)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _stretches(rotation: Floats, jacobian: Floats) -> Floats:
    """Return the symmetric matrices R^T J, (3, 3, m)."""
    out = np.zeros_like(jacobian)
    for a in range(3):
        for b in range(3):
            for c in range(3):
                for i in range(out.shape[2]):
                    out[a, b, i] += rotation[c, a, i] * jacobian[c, b, i]
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _matrices(rotation: Floats, softness: Floats, pull: Floats, push: Floats, scale: Floats, held: Floats) -> Floats:
    """Return the symmetric matrices (45, m) of the second derivative in the nine entries of J, as in SYMMETRIC.

    They are scale (I - B softness B^T) + pull pull^T + push push^T + held I; B^T d is the sum of R_k x d_k over the
    rows k.
    """
    m = scale.size
    turn, soft = np.zeros((9, 3, m), scale.dtype), np.zeros((9, 3, m), scale.dtype)
    out = np.empty((45, m), scale.dtype)
    for a in range(9):
        k, j = a // 3, a % 3
        before, behind = (j + 1) % 3, (j + 2) % 3
        for i in range(m):
            turn[a, before, i] = rotation[k, behind, i]
            turn[a, behind, i] = -rotation[k, before, i]
        for s in range(3):
            for i in range(m):
                soft[a, s, i] = softness[s, before, i] * turn[a, before, i]
                soft[a, s, i] += softness[s, behind, i] * turn[a, behind, i]
        for b in range(a + 1):
            row = out[SYMMETRIC[a, b]]
            for i in range(m):
                turned = soft[a, 0, i] * turn[b, 0, i] + soft[a, 1, i] * turn[b, 1, i] + soft[a, 2, i] * turn[b, 2, i]
                row[i] = scale[i] * ((a == b) - turned) + pull[a, i] * pull[b, i] + push[a, i] * push[b, i]
                row[i] += (a == b) * held[i]
    return out
