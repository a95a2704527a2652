"""Computes the forces of a law that is not linear, and their derivative, a matrix stored at the quadrature points."""

from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.volume import BSplineVolume

from ..forms.form import ROUNDING, Form, reaction
from ..forms.jets import PAIRS
from ..forms.tangent import derivative
from . import kernels
from .operator import FormOperator, MatrixFree, Operator
from .quadrature import geometry_planes


@dataclass(frozen=True, eq=False)
class Forces(MatrixFree):
    """Compute the integrals of flux : grad v + react . v of any law, with Robin's term; `apply` takes coefficients."""

    volume: BSplineVolume
    form: Form

    @classmethod
    def of(cls, operator: Operator | FormOperator, volume: BSplineVolume, form: Form) -> "Forces":
        """Return the forces of a law with the quadrature rule and the terms on faces of an operator."""
        return cls(operator.space, operator.rule, operator.threads, volume, form, faces=operator.faces)

    def _multiply(self, points: IntArray, coefficients: Array, result: Array) -> None:
        for q, rows, measure, x in geometry_planes(self.volume, self.rule, points):
            size = np.abs(measure)
            scale = np.sqrt(size)
            fields, gradient = self._plane(q, rows, scale, coefficients)
            with np.errstate(all="ignore"):  # a step may go too far: whoever makes it looks at the result
                flux = np.asarray(self.form.flux(fields[:, 0], gradient, x), dtype=np.float64) * scale
                fields[:, 0] = reaction(self.form, fields[:, 0], gradient, x) * size
            kernels.turn(rows, np.ascontiguousarray(flux), fields[:, 1:], True)
            for plane, total in zip(fields, result, strict=True):
                kernels.spread_plane(plane, q, self.tables, self.form.has_reaction, total)

    def _plane(self, q: int, rows: Array, scale: Array, coefficients: Array) -> tuple[Array, Array]:
        """Return values and parametric derivatives (c, 4, q_w, q_v) of a plane, and gradients (c, 3, q_w, q_v)."""
        fields = np.empty((len(coefficients), 4, *self.rule.plane_shape))
        for component, plane in zip(coefficients, fields, strict=True):
            kernels.evaluate_plane(component, q, self.tables, plane)
        gradient = np.empty((len(coefficients), 3, *self.rule.plane_shape))
        kernels.turn(rows, fields[:, 1:], gradient, False)
        return fields, gradient / scale

    def derivative(self, coefficients: Array) -> "Tangent":
        """Return the derivative at coefficients (c, n_u, n_v, n_w). Raises ValueError as `tangent.derivative` does."""
        c, (q_u, *plane) = len(coefficients), (self.rule.shape[0], *self.rule.plane_shape)
        factors, source = np.empty((q_u, c, 4, c, 4, *plane)), np.ascontiguousarray(coefficients)

        def fill(points: IntArray) -> None:
            for q, rows, measure, x in geometry_planes(self.volume, self.rule, points):
                scale = np.sqrt(np.abs(measure))
                fields, gradient = self._plane(q, rows, scale, source)
                pull = np.zeros((4, 4, *plane))  # from u and its parametric derivatives to u and its gradient
                pull[0, 0], pull[1:, 1:] = scale, rows
                law = derivative(self.form, fields[:, 0], gradient, np.asarray(x))
                half = np.einsum("cidjwv,bjwv->cidbwv", law, pull)
                factors[q] = np.einsum("aiwv,cidbwv->cadbwv", pull, half)

        self.on_planes(fill)
        return Tangent(self.space, self.rule, self.threads, factors, self.form.has_reaction, faces=self.faces)


@dataclass(frozen=True, eq=False)
class Tangent(MatrixFree):
    """Apply the derivative of forces.

    factors: (q_u, c, 4, c, 4, q_w, q_v), the derivatives with respect to u and its parametric derivatives, with
    weights. has_reaction: whether the first of the four entries is used.
    """

    factors: Array
    has_reaction: bool

    @property
    def is_symmetric(self) -> bool:
        """Return whether the matrix is its own transpose, tested on the plane in the middle."""
        middle = self.factors[len(self.factors) // 2]
        return bool(np.abs(middle - middle.transpose(2, 3, 0, 1, 4, 5)).max() <= ROUNDING * np.abs(middle).max())

    def _multiply(self, points: IntArray, coefficients: Array, result: Array) -> None:
        fields = np.empty((len(coefficients), 4, *self.rule.plane_shape))
        for q in points:
            for component, plane in zip(coefficients, fields, strict=True):
                kernels.evaluate_plane(component, q, self.tables, plane)
            found = np.einsum("cadbwv,dbwv->cawv", self.factors[q], fields)
            for plane, total in zip(found, result, strict=True):
                kernels.spread_plane(plane, q, self.tables, self.has_reaction, total)

    def block(self, component: int) -> Operator:
        """Return the symmetric part of a component's diagonal block, for its own gradient and value."""
        own = self.factors[:, component, :, component]
        entries = [0.5 * (own[:, 1 + i, 1 + j] + own[:, 1 + j, 1 + i]) for i, j in PAIRS]
        entries += [np.maximum(own[:, 0, 0], 0.0)] if self.has_reaction else []
        whole = Operator(self.space, self.rule, self.threads, np.ascontiguousarray(np.stack(entries, axis=1)))
        return replace(whole, faces=self.faces)
