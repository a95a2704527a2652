"""Compiled kernels of linear elasticity, one plane of quadrature points at a time; conventions as in `kernels`."""

from __future__ import annotations

import numpy as np

from parameterize.arrays import Array, IntArray

from .kernels import compiled


@compiled
def plane_stress(fields: Array, factors: Array, lam: float, mu: float) -> None:
    """Turn gradients into fluxes, in place: fields (3, 4, q_w, q_v) = components x (value, d/du, d/dv, d/dw).

    factors: (3, 3, q_w, q_v), F of `elastic_operator`: row of the parametric direction, column of the physical one.
    """
    gradient, stress = np.empty((3, 3)), np.empty((3, 3))
    for q in range(fields.shape[2]):
        for m in range(fields.shape[3]):
            for c in range(3):
                a, b, d = fields[c, 1, q, m], fields[c, 2, q, m], fields[c, 3, q, m]
                for i in range(3):
                    gradient[c, i] = factors[0, i, q, m] * a + factors[1, i, q, m] * b + factors[2, i, q, m] * d
            pressure = lam * (gradient[0, 0] + gradient[1, 1] + gradient[2, 2])
            for c in range(3):
                for i in range(3):
                    stress[c, i] = mu * (gradient[c, i] + gradient[i, c])
                stress[c, c] += pressure
            for c in range(3):
                for a in range(3):
                    flux = factors[a, 0, q, m] * stress[c, 0] + factors[a, 1, q, m] * stress[c, 1]
                    fields[c, a + 1, q, m] = flux + factors[a, 2, q, m] * stress[c, 2]


@compiled
def spread_plane(
    field: Array, first_u: int, u: Array, first_v: IntArray, v: Array, first_w: IntArray, w: Array, result: Array
) -> None:
    """Transpose of `kernels.evaluate_plane` for the gradient: adds field (4, q_w, q_v), its first entry left out.

    result: (n_u, n_v, n_w).
    """
    _, n_v, n_w = result.shape
    lines = np.zeros((3, n_w, v.shape[1]))
    for q in range(w.shape[1]):
        row_u, row_v, row_w = field[1, q], field[2, q], field[3, q]
        for k in range(w.shape[2]):
            value, slope, at = w[0, q, k], w[1, q, k], first_w[q] + k
            line, line_u, line_v = lines[0, at], lines[1, at], lines[2, at]
            for m in range(row_u.size):
                line[m] += slope * row_w[m]
                line_u[m] += value * row_u[m]
                line_v[m] += value * row_v[m]
    planes = np.zeros((2, n_v, n_w))
    for q in range(v.shape[1]):
        for j in range(v.shape[2]):
            value, slope = v[0, q, j], v[1, q, j]
            plane, plane_u = planes[0, first_v[q] + j], planes[1, first_v[q] + j]
            for k in range(n_w):
                plane[k] += value * lines[0, k, q] + slope * lines[2, k, q]
                plane_u[k] += value * lines[1, k, q]
    for i in range(u.shape[1]):
        value, slope = u[0, i], u[1, i]
        for j in range(n_v):
            target, plane, plane_u = result[first_u + i, j], planes[0, j], planes[1, j]
            for k in range(n_w):
                target[k] += value * plane[k] + slope * plane_u[k]
