"""Integrates the squares of errors over a plane of points in one compiled pass that stores nothing at the points.

Splines arrive contracted in u and v (`kernels.evaluate_lines`). The pass contracts them in w; one inner loop without
stores is what the compiler turns into vector instructions, with the geometry and the gradients in registers.
"""

from parameterize.arrays import Array

from .kernels import Table, compiled


@compiled
def error_squares(
    geometry: Array,
    weight: Array | None,
    of_map: Table,
    spline: Array,
    of_space: Table,
    weights: Array,
    values: Array,
    gradients: Array | None,
) -> tuple[float, float, float, float]:
    """Return the integrals of (u - u_h)^2, u^2, |grad u - grad u_h|^2 and |grad u|^2 for one component.

    geometry: (3, 3, n_w, q_v), the components of the map by `evaluate_lines`, or of a rational map those of its
    numerator. weight: (3, n_w, q_v), the denominator of a rational map. spline: (3, m_w, q_v), u_h. of_map, of_space:
    the tables of direction w for the map and for u_h. weights: (q_w, q_v), of the rule. values: (q_w, q_v), u.
    gradients: (3, q_w, q_v), grad u; where it is None, the last two integrals are zero.
    """
    first_x, basis_x, functions_x = of_map
    first_u, basis_u, functions_u = of_space
    error, size, slope_error, slope = 0.0, 0.0, 0.0, 0.0
    for q in range(weights.shape[0]):
        at_x, at_u = first_x[q], first_u[q]
        for m in range(weights.shape[1]):
            xu = xv = xw = yu = yv = yw = zu = zv = zw = 0.0
            for j in range(len(functions_x)):
                i, b, d = at_x + j, basis_x[0, q, j], basis_x[1, q, j]
                xu, xv, xw = xu + b * geometry[0, 1, i, m], xv + b * geometry[0, 2, i, m], xw + d * geometry[0, 0, i, m]
                yu, yv, yw = yu + b * geometry[1, 1, i, m], yv + b * geometry[1, 2, i, m], yw + d * geometry[1, 0, i, m]
                zu, zv, zw = zu + b * geometry[2, 1, i, m], zv + b * geometry[2, 2, i, m], zw + d * geometry[2, 0, i, m]
            if weight is not None:  # the derivative of x / h is (x_u - (x / h) h_u) / h
                x = y = z = h = hu = hv = hw = 0.0
                for j in range(len(functions_x)):
                    i, b, d = at_x + j, basis_x[0, q, j], basis_x[1, q, j]
                    x, y, z = x + b * geometry[0, 0, i, m], y + b * geometry[1, 0, i, m], z + b * geometry[2, 0, i, m]
                    h, hw = h + b * weight[0, i, m], hw + d * weight[0, i, m]
                    hu, hv = hu + b * weight[1, i, m], hv + b * weight[2, i, m]
                x, y, z = x / h, y / h, z / h
                xu, xv, xw = (xu - x * hu) / h, (xv - x * hv) / h, (xw - x * hw) / h
                yu, yv, yw = (yu - y * hu) / h, (yv - y * hv) / h, (yw - y * hw) / h
                zu, zv, zw = (zu - z * hu) / h, (zv - z * hv) / h, (zw - z * hw) / h
            u = du = dv = dw = 0.0
            for j in range(len(functions_u)):
                i, b, d = at_u + j, basis_u[0, q, j], basis_u[1, q, j]
                u, dw = u + b * spline[0, i, m], dw + d * spline[0, i, m]
                du, dv = du + b * spline[1, i, m], dv + b * spline[2, i, m]
            # rows of det J J^-1: the cross products of the tangents
            ax, ay, az = yv * zw - zv * yw, zv * xw - xv * zw, xv * yw - yv * xw
            bx, by, bz = yw * zu - zw * yu, zw * xu - xw * zu, xw * yu - yw * xu
            cx, cy, cz = yu * zv - zu * yv, zu * xv - xu * zv, xu * yv - yu * xv
            det = xu * ax + yu * ay + zu * az
            measure, lack = weights[q, m] * abs(det), values[q, m] - u
            error += measure * lack * lack
            size += measure * values[q, m] * values[q, m]
            if gradients is not None:
                gx, gy, gz = gradients[0, q, m], gradients[1, q, m], gradients[2, q, m]
                inverse = 1.0 / det
                ex = gx - inverse * (ax * du + bx * dv + cx * dw)
                ey = gy - inverse * (ay * du + by * dv + cy * dw)
                ez = gz - inverse * (az * du + bz * dv + cz * dw)
                slope_error += measure * (ex * ex + ey * ey + ez * ez)
                slope += measure * (gx * gx + gy * gy + gz * gz)
    return error, size, slope_error, slope
