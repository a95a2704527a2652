"""Evaluates the basis functions that are not zero at points on faces of blocks, and F with its tangents there."""

from dataclasses import dataclass

import numba
import numpy as np

from ..arrays import Array, IntArray, Mask
from ..spline.bspline import basis_derivatives, breakpoints
from ..spline.spline_map import ControlNets
from ..threads import in_parallel
from .operators import pieces

Polynomials = tuple[IntArray, Array, IntArray, Array, IntArray]


def polynomials_of(nets: ControlNets) -> Polynomials:
    """Return the basis functions that are not zero on a span as polynomials, which are cheap to evaluate.

    The arrays hold the spans of all directions of all blocks one after the other: the first span of each direction
    (3 blocks + 1,), the first parameter of each span (s,), its first basis function (s,), the Taylor coefficients there
    (s, p + 1, p + 1), power by power, and the number of each block's first control point (blocks + 1,).
    """
    knots, degree = [row for rows in nets.knots for row in rows], nets.degree
    begins = [breakpoints(row)[:-1] for row in knots]
    found = [basis_derivatives(row, degree, begin, degree) for row, begin in zip(knots, begins, strict=True)]
    factorials = np.cumprod(np.maximum(np.arange(degree + 1), 1))
    taylor = np.concatenate([derivatives.swapaxes(0, 1) for _, derivatives in found]) / factorials[:, None]
    coefficients = np.ascontiguousarray(taylor)
    starts = np.cumsum([0, *(len(begin) for begin in begins)])
    return starts, np.concatenate(begins), np.concatenate([first for first, _ in found]), coefficients, nets.starts


@dataclass(frozen=True, eq=False)
class FaceWindow:
    """Hold the numbers (N, k) of control points, and the values and derivatives in_a, in_b (N, 2, p + 1) of functions.

    in_a and in_b belong to the two directions of the point's face.
    """

    indices: IntArray
    in_a: Array
    in_b: Array

    @classmethod
    def at(cls, polynomials: Polynomials, parameters: Array, cube_faces: IntArray) -> "FaceWindow":
        """Return the window of the basis functions at points (N, 3) on faces (N,)."""
        found = in_parallel(
            lambda rows: _face_windows(polynomials, parameters[rows], cube_faces[rows]), pieces(len(cube_faces))
        )
        return cls(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

    def weights(self, a: int, b: int) -> Array:
        """Return the weights (N, k) of the control points in the derivative of orders a and b."""
        return (self.in_a[:, a, :, None] * self.in_b[:, b, None, :]).reshape(self.indices.shape)

    def derivatives(self, control: Array) -> tuple[Array, Array, Array]:
        """Return F and its tangents t_a and t_b at the points, (N, 3) each."""
        flat, windows = np.ascontiguousarray(control.reshape(3, -1)), (self.indices, self.in_a, self.in_b)
        found = in_parallel(lambda piece: _tangents(*(w[piece] for w in windows), flat), pieces(len(self.indices)))
        value, along_a, along_b = np.concatenate(found).swapaxes(0, 1)
        return value, along_a, along_b

    def with_points(self, chosen: Mask, other: "FaceWindow") -> "FaceWindow":
        """Return this window with the rows of the chosen points (N,) replaced by the rows of another window."""
        replaced = FaceWindow(self.indices.copy(), self.in_a.copy(), self.in_b.copy())
        replaced.indices[chosen], replaced.in_a[chosen], replaced.in_b[chosen] = other.indices, other.in_a, other.in_b
        return replaced


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _face_windows(polynomials: Polynomials, parameters: Array, cube_faces: IntArray) -> tuple[IntArray, Array, Array]:
    """Return the three arrays of a FaceWindow for points (N, 3) on faces (N,)."""
    count, width = len(parameters), polynomials[3].shape[1]
    indices = np.empty((count, width * width), np.int64)
    in_a, in_b = np.empty((count, 2, width)), np.empty((count, 2, width))
    for n in range(count):
        fill_window(polynomials, parameters, cube_faces, n, indices, in_a, in_b)
    return indices, in_a, in_b


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fill_window(
    polynomials: Polynomials,
    parameters: Array,
    cube_faces: IntArray,
    n: int,
    indices: IntArray,
    in_a: Array,
    in_b: Array,
) -> None:
    """Write row n of the three arrays of a FaceWindow."""
    starts, _, first, _, offsets = polynomials
    block, axis, width = cube_faces[n] // 6, cube_faces[n] % 6 // 2, in_a.shape[2]
    a, b, own = (axis + 1) % 3, (axis + 2) % 3, 3 * block  # own: the block's first direction
    size_v, size_w = first[starts[own + 2] - 1] + width, first[starts[own + 3] - 1] + width
    strides = (size_v * size_w, size_w, 1)
    first_a = _fill_values(polynomials, own + a, parameters[n, a], n, in_a)
    first_b = _fill_values(polynomials, own + b, parameters[n, b], n, in_b)
    last = (first[starts[own + axis + 1] - 1] + width - 1) * strides[axis]
    base = offsets[block] + (last if cube_faces[n] % 2 else 0)
    for i in range(width):
        for j in range(width):
            indices[n, i * width + j] = base + (first_a + i) * strides[a] + (first_b + j) * strides[b]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_values(polynomials: Polynomials, direction: int, x: float, n: int, out: Array) -> int:
    """Write row n of values and derivatives (N, 2, p + 1); return the number of the first function that is not zero."""
    starts, begins, first, coefficients, _ = polynomials
    own = begins[starts[direction] : starts[direction + 1]]
    low = starts[direction] + max(np.searchsorted(own, x, side="right") - 1, 0)
    step, width = x - begins[low], out.shape[2]
    for i in range(width):
        value, slope = coefficients[low, width - 1, i], 0.0
        for power in range(width - 2, -1, -1):
            slope = slope * step + value
            value = value * step + coefficients[low, power, i]
        out[n, 0, i], out[n, 1, i] = value, slope
    return first[low]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _tangents(indices: IntArray, in_a: Array, in_b: Array, control: Array) -> Array:
    """Return F, t_a and t_b, (N, 3, 3), of control points (3, n) at the points of a FaceWindow."""
    out = np.empty((len(indices), 3, 3))
    for n in range(len(indices)):
        fill_tangents(indices, in_a, in_b, control, n, out)
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fill_tangents(indices: IntArray, in_a: Array, in_b: Array, control: Array, n: int, out: Array) -> None:
    """Write row n of F, t_a and t_b (N, 3, 3)."""
    width = in_a.shape[2]
    out[n] = 0.0
    for i in range(width):
        for j in range(width):
            column = indices[n, i * width + j]
            plain = in_a[n, 0, i] * in_b[n, 0, j]
            along_a, along_b = in_a[n, 1, i] * in_b[n, 0, j], in_a[n, 0, i] * in_b[n, 1, j]
            for c in range(3):
                point = control[c, column]
                out[n, 0, c] += plain * point
                out[n, 1, c] += along_a * point
                out[n, 2, c] += along_b * point
