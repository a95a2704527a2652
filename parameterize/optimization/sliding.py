"""Where points lie on the boundary of the cube, and how they slide there.

Between optimisation steps every parameter moves to the closest point of F's boundary, over the cube's edges where it
must: the paper keeps them fixed (section 4.3.2), which freezes the network's correspondence; letting them slide lowers
boundary error and distortion together.
"""

from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np
from torch import Tensor

from ..arrays import Array, IntArray, Knots, Mask
from ..config import LAYOUT, LayoutConfig
from ..cube.cube import damped_solution, nearest_faces
from ..cube.flips import new_flips, unflip, untangle, untangle_whole
from ..spline.bspline import basis_derivatives, breakpoints
from ..threads import in_parallel
from .determinant_penalty import with_neighbours
from .operators import ControlRows, pieces

_DAMPING = 1e-6  # against parallel tangents
_HALVINGS = 3
_NO_TRIANGLES = np.zeros((0, 3), dtype=np.int64)


Polynomials = tuple[IntArray, Array, IntArray, Array]


def _polynomials(knots: Knots, degree: int) -> Polynomials:
    """Return the functions that are not zero on a span as polynomials: nothing evaluates them faster.

    That is, for the spans of all directions one after the other, where those of each direction begin (4,), where a
    span begins (s,), its first function (s,), and the Taylor coefficients there, power by power (s, p + 1, p + 1).
    """
    begins = [breakpoints(row)[:-1] for row in knots]
    found = [basis_derivatives(row, degree, begin, degree) for row, begin in zip(knots, begins, strict=True)]
    factorials = np.cumprod(np.maximum(np.arange(degree + 1), 1))
    coefficients = np.concatenate([derivatives.swapaxes(0, 1) for _, derivatives in found]) / factorials[:, None]
    starts = np.cumsum([0, *(len(begin) for begin in begins)])
    return starts, np.concatenate(begins), np.concatenate([first for first, _ in found]), coefficients


class SlidingParameters:
    """Parameters (N, 3) on cube faces (N,), and the rows that yield F there.

    triangles (m, 3) between the points: `relax` and `slide` keep the layout on the cube one-to-one.
    """

    def __init__(
        self,
        knots: Knots,
        degree: int,
        parameters: Array,
        triangles: IntArray = _NO_TRIANGLES,
        layout: LayoutConfig = LAYOUT,
    ) -> None:
        self.knots, self.degree = knots, degree
        self.triangles, self.layout = triangles, layout
        self.place(parameters, nearest_faces(parameters))

    def place(self, parameters: Array, cube_faces: IntArray) -> None:
        """Take these parameters (N, 3) on these cube faces (N,)."""
        self.parameters, self.cube_faces = parameters, cube_faces
        for known in ("window", "rows"):
            self.__dict__.pop(known, None)

    def on_knots(self, knots: Knots) -> "SlidingParameters":
        """Return the same parameters for a spline with other knots."""
        other = SlidingParameters(knots, self.degree, self.parameters, self.triangles, self.layout)
        other.place(self.parameters, self.cube_faces)
        return other

    def values(self, control: Tensor) -> Array:
        """Return F at the parameters: (N, 3)."""
        return self.window.derivatives(control)[0]

    def spans(self) -> IntArray:
        """Return in which span each parameter lies: (N, 3)."""
        breaks = [breakpoints(k) for k in self.knots]
        found = [np.searchsorted(b[1:-1], x, "right") for b, x in zip(breaks, self.parameters.T, strict=True)]
        return np.stack(found, axis=1)

    def near_spans(self, spans: IntArray) -> Mask:
        """Return which points have their parameter in one of the spans (k, 3) or next to it: (N,)."""
        shape = tuple(len(breakpoints(k)) - 1 for k in self.knots)
        return with_neighbours(spans, shape)[tuple(self.spans().T)]

    def slide(
        self, control: Tensor, points: Array, max_step: float, *, keep_layout: bool = False, reach: float = np.inf
    ) -> None:
        """Take one Gauss-Newton step of every parameter towards where F's boundary is closest to its point (N, 3).

        A step over an edge of the cube continues on the next face; `max_step` limits a step in the parameters. Points
        that would end up farther away, and those farther away than `reach`, stay where they are; with `keep_layout`
        steps that would flip a triangle are shortened.
        """
        window, field = self.window, control.reshape(3, -1).numpy()
        polynomials, before = self._polynomials, (self.parameters, self.cube_faces)

        def part(rows: slice) -> tuple[Array, ...]:
            known = (window.indices[rows], window.in_a[rows], window.in_b[rows])
            at = (self.parameters[rows], self.cube_faces[rows])
            return _slid(polynomials, *at, *known, field, points[rows], max_step, reach)

        found = in_parallel(part, pieces(len(points)))
        goal, parameters, cube_faces, *arrays = (np.concatenate(parts) for parts in zip(*found, strict=True))
        self.place(parameters, cube_faces)
        self.window = FaceWindow(*arrays)
        if keep_layout:
            self._hold_back(*before, goal)

    def _hold_back(self, parameters: Array, cube_faces: IntArray, goal: Array) -> None:
        """Shorten steps from `parameters` towards `goal` until no further triangle flips."""
        share = np.where((self.parameters == parameters).all(axis=1), 0.0, 1.0)
        for _ in range(_HALVINGS):
            blocked = new_flips(parameters, self.parameters, self.triangles, self.layout)
            if not blocked.any():
                break
            share[blocked] *= 0.5
            self.place(*fold_over_edges(parameters + share[:, None] * (goal - parameters), cube_faces))
        self._keep(parameters, cube_faces, new_flips(parameters, self.parameters, self.triangles, self.layout))

    def settled(self, control: Tensor, points: Array, slides: int, sweeps: int) -> "SlidingParameters":
        """Return the parameters where F's boundary is closest to their points (N, 3), as far as no triangle flips.

        They slide `slides` times; triangles that this flips are relaxed in at most so many sweeps; then they slide as
        often again.
        """
        other, longest = copy(self), 0.5 / max(control.shape[1:])
        for _ in range(slides):
            other.slide(control, points, longest)
        other.unflip()
        other._move(untangle_whole(other.parameters, self.triangles, replace(self.layout, sweeps=sweeps)))
        for _ in range(slides):
            other.slide(control, points, longest, keep_layout=True)
        return other

    def relax(self, sweeps: int) -> None:
        """Untangle flipped triangles in a few sweeps, so that what sliding tangles does not pile up."""
        self._move(untangle(self.parameters, self.triangles, replace(self.layout, sweeps=sweeps)))

    def unflip(self) -> None:
        """Turn flipped triangles outwards by moving their own points alone, and those by little."""
        self._move(unflip(self.parameters, self.triangles, self.layout))

    def _move(self, places: Array) -> None:
        moved = np.abs(places - self.parameters).max(axis=1) > 1e-9
        self._keep(places, nearest_faces(places), moved)

    def _keep(self, parameters: Array, cube_faces: IntArray, chosen: Mask) -> None:
        """Take these parameters for the chosen points; the basis functions of the others need not be found again."""
        known = self.window
        self.place(
            np.where(chosen[:, None], parameters, self.parameters), np.where(chosen, cube_faces, self.cube_faces)
        )
        self.window = known.with_points(chosen, self._window(parameters[chosen], cube_faces[chosen]))

    @cached_property
    def window(self) -> "FaceWindow":
        """The basis functions that are not zero at the points."""
        return self._window(self.parameters, self.cube_faces)

    def _window(self, parameters: Array, faces: IntArray) -> "FaceWindow":
        polynomials = self._polynomials
        found = in_parallel(
            lambda piece: _face_windows(polynomials, parameters[piece], faces[piece]), pieces(len(faces))
        )
        return FaceWindow(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

    @cached_property
    def _polynomials(self) -> Polynomials:
        return _polynomials(self.knots, self.degree)

    @cached_property
    def rows(self) -> ControlRows:
        """The rows that yield F at the points."""
        return ControlRows(self.window.indices, self.window.weights(0, 0))


@dataclass(frozen=True, eq=False)
class FaceWindow:
    """indices (N, k) of control points; in_a, in_b (N, 2, p + 1): values and derivatives in the face's directions."""

    indices: IntArray
    in_a: Array
    in_b: Array

    def weights(self, a: int, b: int) -> Array:
        """Return the control points' weights in the derivative of order a and b: (N, k)."""
        return (self.in_a[:, a, :, None] * self.in_b[:, b, None, :]).reshape(self.indices.shape)

    def derivatives(self, control: Tensor) -> tuple[Array, Array, Array]:
        """Return F and its tangents t_a and t_b at the points: (N, 3) each."""
        flat, windows = control.reshape(3, -1).numpy(), (self.indices, self.in_a, self.in_b)
        found = in_parallel(lambda piece: _tangents(*(w[piece] for w in windows), flat), pieces(len(self.indices)))
        value, along_a, along_b = np.concatenate(found).swapaxes(0, 1)
        return value, along_a, along_b

    def with_points(self, chosen: Mask, other: "FaceWindow") -> "FaceWindow":
        """Return this window with the chosen points (N,) replaced by those of another one."""
        replaced = FaceWindow(self.indices.copy(), self.in_a.copy(), self.in_b.copy())
        replaced.indices[chosen], replaced.in_a[chosen], replaced.in_b[chosen] = other.indices, other.in_a, other.in_b
        return replaced


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _face_windows(polynomials: Polynomials, parameters: Array, cube_faces: IntArray) -> tuple[IntArray, Array, Array]:
    """Return what a FaceWindow holds, for points (N, 3) on cube faces (N,)."""
    count, width = len(parameters), polynomials[3].shape[1]
    indices = np.empty((count, width * width), np.int64)
    in_a, in_b = np.empty((count, 2, width)), np.empty((count, 2, width))
    for n in range(count):
        _fill_window(polynomials, parameters, cube_faces, n, indices, in_a, in_b)
    return indices, in_a, in_b


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_window(
    polynomials: Polynomials,
    parameters: Array,
    cube_faces: IntArray,
    n: int,
    indices: IntArray,
    in_a: Array,
    in_b: Array,
) -> None:
    """Write row n of what a FaceWindow holds."""
    starts, _, first, _ = polynomials
    axis, width = cube_faces[n] // 2, in_a.shape[2]
    a, b = (axis + 1) % 3, (axis + 2) % 3
    size_v, size_w = first[starts[2] - 1] + width, first[starts[3] - 1] + width
    strides = (size_v * size_w, size_w, 1)
    first_a = _fill_values(polynomials, a, parameters[n, a], n, in_a)
    first_b = _fill_values(polynomials, b, parameters[n, b], n, in_b)
    base = (first[starts[axis + 1] - 1] + width - 1) * strides[axis] if cube_faces[n] % 2 else 0
    for i in range(width):
        for j in range(width):
            indices[n, i * width + j] = base + (first_a + i) * strides[a] + (first_b + j) * strides[b]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_values(polynomials: Polynomials, direction: int, x: float, n: int, out: Array) -> int:
    """Write row n of values and derivatives (N, 2, p + 1); return the index of the first function that is not zero."""
    starts, begins, first, coefficients = polynomials
    low, high = starts[direction], starts[direction + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if begins[middle] <= x:
            low = middle
        else:
            high = middle
    step, width = x - begins[low], out.shape[2]
    for i in range(width):
        value, slope = coefficients[low, width - 1, i], 0.0
        for power in range(width - 2, -1, -1):
            slope = slope * step + value
            value = value * step + coefficients[low, power, i]
        out[n, 0, i], out[n, 1, i] = value, slope
    return first[low]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _slid(
    polynomials: Polynomials,
    parameters: Array,
    cube_faces: IntArray,
    indices: IntArray,
    in_a: Array,
    in_b: Array,
    control: Array,
    points: Array,
    max_step: float,
    reach: float,
) -> tuple[Array, Array, IntArray, IntArray, Array, Array]:
    """Take the step of `SlidingParameters.slide` at points (N, 3), whose FaceWindow is given.

    Returns where the steps lead within the faces' planes (N, 3), the parameters, their cube faces and their FaceWindow.
    """
    goal, parameters, cube_faces = parameters.copy(), parameters.copy(), cube_faces.copy()
    old, before = (indices, in_a, in_b), parameters.copy()
    indices, in_a, in_b = indices.copy(), in_a.copy(), in_b.copy()
    found = np.empty((len(points), 3, 3))
    for n in range(len(points)):
        _fill_tangents(indices, in_a, in_b, control, n, found)
        square = aa = bb = ab = ra = rb = 0.0
        for c in range(3):
            off, along_a, along_b = found[n, 0, c] - points[n, c], found[n, 1, c], found[n, 2, c]
            square += off * off
            aa, bb, ab = aa + along_a * along_a, bb + along_b * along_b, ab + along_a * along_b
            ra, rb = ra + along_a * off, rb + along_b * off
        step_a, step_b = damped_solution(aa, bb, ab, ra, rb, _DAMPING)
        share = min(1.0, max_step / max(np.sqrt(step_a**2 + step_b**2), 1e-300))
        face = cube_faces[n]
        goal[n, (face // 2 + 1) % 3] -= share * step_a
        goal[n, (face // 2 + 2) % 3] -= share * step_b
        if square > reach**2:
            continue
        for c in range(3):
            parameters[n, c] = goal[n, c]
        _fold(parameters, cube_faces, n)
        _fill_window(polynomials, parameters, cube_faces, n, indices, in_a, in_b)
        _fill_tangents(indices, in_a, in_b, control, n, found)
        after = 0.0
        for c in range(3):
            after += (found[n, 0, c] - points[n, c]) ** 2
        if after > square:
            parameters[n], cube_faces[n] = before[n], face
            indices[n], in_a[n], in_b[n] = old[0][n], old[1][n], old[2][n]
    return goal, parameters, cube_faces, indices, in_a, in_b


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _tangents(indices: IntArray, in_a: Array, in_b: Array, control: Array) -> Array:
    """Return F, t_a and t_b of control points (3, n) at the points of a FaceWindow: (N, 3, 3)."""
    out = np.empty((len(indices), 3, 3))
    for n in range(len(indices)):
        _fill_tangents(indices, in_a, in_b, control, n, out)
    return out


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fill_tangents(indices: IntArray, in_a: Array, in_b: Array, control: Array, n: int, out: Array) -> None:
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


def fold_over_edges(parameters: Array, cube_faces: IntArray) -> tuple[Array, IntArray]:
    """Continue steps that left their face on the neighbouring one: what overshot goes inwards there."""
    parameters, cube_faces = parameters.copy(), cube_faces.copy()
    _fold_all(parameters, cube_faces)
    return parameters, cube_faces


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fold_all(parameters: Array, cube_faces: IntArray) -> None:
    for n in range(len(parameters)):
        _fold(parameters, cube_faces, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fold(parameters: Array, cube_faces: IntArray, n: int) -> None:
    """Continue the step of one point, in place."""
    constant, side = cube_faces[n] // 2, cube_faces[n] % 2
    axis, overshoot = constant, 0.0
    for d in range(3):
        outside = max(-parameters[n, d], parameters[n, d] - 1.0)
        if d != constant and outside > overshoot:
            axis, overshoot = d, outside
    if overshoot > 0.0:
        parameters[n, constant] = 1.0 - overshoot if side == 1 else overshoot
        cube_faces[n] = 2 * axis + int(parameters[n, axis] > 0.5)
    for d in range(3):
        parameters[n, d] = min(max(parameters[n, d], 0.0), 1.0)
