"""Evaluates the basis functions that are not zero at points on faces of blocks, and F with its tangents there."""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import DTypeLike

from ..arrays import Array, Floats, IntArray, Mask
from ..spline.bspline import basis_derivatives, breakpoints
from ..spline.spline_map import ControlNets
from ..threads import in_parallel
from .operators import ControlRows, pieces

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
    """Hold the control points that act on N points, and the values and derivatives of the basis functions there.

    places: (N, 3), the number of the first control point, and the steps of the numbers along the two directions of the
    point's face. in_a, in_b: (N, 2, p + 1), of the functions in these directions.
    """

    places: IntArray
    in_a: Array
    in_b: Array

    @classmethod
    def empty(cls, count: int, degree: int) -> "FaceWindow":
        """Return a window whose arrays are still to be filled."""
        values = count, 2, degree + 1
        return cls(np.empty((count, 3), np.int64), np.empty(values), np.empty(values))

    @classmethod
    def at(cls, polynomials: Polynomials, parameters: Array, cube_faces: IntArray) -> "FaceWindow":
        """Return the window of the basis functions at points (N, 3) on faces (N,)."""
        window = cls.empty(len(cube_faces), polynomials[3].shape[1] - 1)

        def part(rows: slice) -> None:
            _fill_windows(polynomials, parameters[rows], cube_faces[rows], *window.some(rows).arrays)

        in_parallel(part, pieces(len(cube_faces)))
        return window

    @property
    def arrays(self) -> tuple[IntArray, Array, Array]:
        """Return the three arrays."""
        return self.places, self.in_a, self.in_b

    def some(self, rows: slice | IntArray) -> "FaceWindow":
        """Return the window of some of the points."""
        return FaceWindow(self.places[rows], self.in_a[rows], self.in_b[rows])

    def rows(self, a: int, b: int, dtype: DTypeLike = np.float64) -> ControlRows:
        """Return the rows that yield the derivatives of F of orders a and b."""
        shape = len(self.places), self.in_a.shape[2] ** 2
        columns, values = np.empty(shape, np.int64), np.empty(shape, dtype)
        in_parallel(
            lambda rows: _fill_rows(*self.some(rows).arrays, a, b, columns[rows], values[rows]), pieces(shape[0])
        )
        return ControlRows(columns, values)

    def derivatives(self, control: Array) -> tuple[Array, Array, Array]:
        """Return F and its tangents t_a and t_b at the points, (N, 3) each."""
        flat, found = np.ascontiguousarray(control.reshape(3, -1)), np.empty((len(self.places), 3, 3))
        in_parallel(lambda rows: _fill_all(*self.some(rows).arrays, flat, found[rows]), pieces(len(found)))
        value, along_a, along_b = found.swapaxes(0, 1)
        return value, along_a, along_b

    def with_points(self, chosen: Mask, other: "FaceWindow") -> "FaceWindow":
        """Return this window with the rows of the chosen points (N,) replaced by the rows of another window."""
        replaced = FaceWindow(self.places.copy(), self.in_a.copy(), self.in_b.copy())
        replaced.places[chosen], replaced.in_a[chosen], replaced.in_b[chosen] = other.arrays
        return replaced


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_windows(
    polynomials: Polynomials, parameters: Array, cube_faces: IntArray, places: IntArray, in_a: Array, in_b: Array
) -> None:
    """Write the three arrays of a FaceWindow for points (N, 3) on faces (N,)."""
    for n in range(len(parameters)):
        fill_window(polynomials, parameters, cube_faces, n, places, in_a, in_b)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fill_window(
    polynomials: Polynomials,
    parameters: Array,
    cube_faces: IntArray,
    n: int,
    places: IntArray,
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
    places[n, 0] = base + first_a * strides[a] + first_b * strides[b]
    places[n, 1], places[n, 2] = strides[a], strides[b]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_values(polynomials: Polynomials, direction: int, x: float, n: int, out: Array) -> int:
    """Write row n of values and derivatives (N, 2, p + 1); return the number of the first function that is not zero."""
    starts, begins, first, coefficients, _ = polynomials
    begin, end = starts[direction], starts[direction + 1]
    low = begin + min(max(int(x * (end - begin)), 0), end - begin - 1)  # the span, where all are equally long
    while low > begin and begins[low] > x:
        low -= 1
    while low < end - 1 and begins[low + 1] <= x:
        low += 1
    step, width = x - begins[low], out.shape[2]
    for i in range(width):
        value, slope = coefficients[low, width - 1, i], 0.0
        for power in range(width - 2, -1, -1):
            slope = slope * step + value
            value = value * step + coefficients[low, power, i]
        out[n, 0, i], out[n, 1, i] = value, slope
    return first[low]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_rows(places: IntArray, in_a: Array, in_b: Array, a: int, b: int, columns: IntArray, values: Floats) -> None:
    """Write columns and values (N, k) of the rows of `FaceWindow.rows`."""
    width = in_a.shape[2]
    for n in range(len(places)):
        for i in range(width):
            for j in range(width):
                columns[n, i * width + j] = places[n, 0] + i * places[n, 1] + j * places[n, 2]
                values[n, i * width + j] = in_a[n, a, i] * in_b[n, b, j]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_all(places: IntArray, in_a: Array, in_b: Array, control: Array, found: Array) -> None:
    """Write F, t_a and t_b (N, 3, 3) at the points of a FaceWindow; control points: (3, n)."""
    for n in range(len(places)):
        fill_tangents(places, in_a, in_b, control, n, found, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fill_tangents(places: IntArray, in_a: Array, in_b: Array, control: Array, n: int, found: Array, row: int) -> None:
    """Write F, t_a and t_b at the n-th point into a row of `found` (m, 3, 3)."""
    width = in_a.shape[2]
    for c in range(3):
        value, along_a, along_b = 0.0, 0.0, 0.0
        for i in range(width):
            plain, steep = 0.0, 0.0  # along b
            column = places[n, 0] + i * places[n, 1]
            for j in range(width):
                plain += in_b[n, 0, j] * control[c, column]
                steep += in_b[n, 1, j] * control[c, column]
                column += places[n, 2]
            value += in_a[n, 0, i] * plain
            along_a += in_a[n, 1, i] * plain
            along_b += in_a[n, 0, i] * steep
        found[row, 0, c], found[row, 1, c], found[row, 2, c] = value, along_a, along_b


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def agreement(found: Array, row: int, normals: Array, n: int, face: int) -> float:
    """Return (t_a x t_b) . n with the tangents of F in a row of `found`, and the outward normal of the n-th point."""
    size = (found[row, 1, 1] * found[row, 2, 2] - found[row, 1, 2] * found[row, 2, 1]) * normals[n, 0]
    size += (found[row, 1, 2] * found[row, 2, 0] - found[row, 1, 0] * found[row, 2, 2]) * normals[n, 1]
    size += (found[row, 1, 0] * found[row, 2, 1] - found[row, 1, 1] * found[row, 2, 0]) * normals[n, 2]
    return size if face % 2 == 1 else -size
