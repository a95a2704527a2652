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
from ..cube.cube import axis_and_side, damped_fit, face_number, nearest_faces, tangent_axes
from ..cube.flips import new_flips, unflip, untangle, untangle_whole
from ..spline.bspline import breakpoints, fill_basis
from ..threads import in_parallel
from .determinant_penalty import with_neighbours
from .operators import ControlRows, pieces

_DAMPING = 1e-6  # against parallel tangents
_HALVINGS = 3
_NO_TRIANGLES = np.zeros((0, 3), dtype=np.int64)


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
        values, ta, tb = self.window.derivatives(control)
        residual = values - points
        step = -np.stack(damped_fit(ta, tb, residual, _DAMPING), axis=1)
        step *= np.minimum(1.0, max_step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-300))
        a, b = tangent_axes(axis_and_side(self.cube_faces)[0])
        moved = self.parameters.copy()
        rows = np.arange(len(moved))
        moved[rows, a] += step[:, 0]
        moved[rows, b] += step[:, 1]
        before = self.parameters, self.cube_faces
        self.place(*fold_over_edges(moved, self.cube_faces))
        squares = (residual**2).sum(axis=1)
        stay = (((self.values(control) - points) ** 2).sum(axis=1) > squares) | (squares > reach**2)
        self._keep(*before, stay)
        if keep_layout:
            self._hold_back(*before, moved)

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
        knots = tuple(self.knots)
        found = in_parallel(
            lambda piece: _face_windows(knots, self.degree, parameters[piece], faces[piece]), pieces(len(faces))
        )
        return FaceWindow(*(np.concatenate(parts) for parts in zip(*found, strict=True)))

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
        value, along_a, along_b = np.concatenate(found, axis=1)
        return value, along_a, along_b

    def with_points(self, chosen: Mask, other: "FaceWindow") -> "FaceWindow":
        """Return this window with the chosen points (N,) replaced by those of another one."""
        replaced = FaceWindow(self.indices.copy(), self.in_a.copy(), self.in_b.copy())
        replaced.indices[chosen], replaced.in_a[chosen], replaced.in_b[chosen] = other.indices, other.in_a, other.in_b
        return replaced


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _face_windows(knots: Knots, degree: int, parameters: Array, cube_faces: IntArray) -> tuple[IntArray, Array, Array]:
    """Return what a FaceWindow holds, for points (N, 3) on cube faces (N,)."""
    count, width = len(parameters), degree + 1
    sizes, stride = np.empty(3, np.int64), np.ones(3, np.int64)
    for d in range(3):
        sizes[d] = len(knots[d]) - degree - 1
    stride[1], stride[0] = sizes[2], sizes[1] * sizes[2]
    indices = np.empty((count, width * width), np.int64)
    in_a, in_b = np.empty((count, 2, 1, width)), np.empty((count, 2, 1, width))
    first, span = np.empty(2, np.int64), np.empty(1, np.int64)
    for n in range(count):
        axis, side = cube_faces[n] // 2, cube_faces[n] % 2
        for d in range(2):
            along = (axis + 1 + d) % 3
            row, x = knots[along], parameters[n, along : along + 1]
            span[0] = min(max(np.searchsorted(row, x[0], side="right") - 1, degree), len(row) - degree - 2)
            fill_basis(row, degree, x, span, in_b[n] if d else in_a[n])
            first[d] = span[0] - degree
        base = side * (sizes[axis] - 1) * stride[axis]
        step_a, step_b = stride[(axis + 1) % 3], stride[(axis + 2) % 3]
        for i in range(width):
            for j in range(width):
                indices[n, i * width + j] = base + (first[0] + i) * step_a + (first[1] + j) * step_b
    return indices, in_a[:, :, 0], in_b[:, :, 0]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _tangents(indices: IntArray, in_a: Array, in_b: Array, control: Array) -> Array:
    """Return F, t_a and t_b of control points (3, n) at the points of a FaceWindow: (3, N, 3)."""
    width = in_a.shape[2]
    out = np.zeros((3, len(indices), 3))
    for n in range(len(indices)):
        for i in range(width):
            for j in range(width):
                column = indices[n, i * width + j]
                for c in range(3):
                    point = control[c, column]
                    out[0, n, c] += in_a[n, 0, i] * in_b[n, 0, j] * point
                    out[1, n, c] += in_a[n, 1, i] * in_b[n, 0, j] * point
                    out[2, n, c] += in_a[n, 0, i] * in_b[n, 1, j] * point
    return out


def fold_over_edges(parameters: Array, cube_faces: IntArray) -> tuple[Array, IntArray]:
    """Continue steps that left their face on the neighbouring one: what overshot goes inwards there."""
    parameters, cube_faces = parameters.copy(), cube_faces.copy()
    rows = np.arange(len(parameters))
    outside = np.maximum(-parameters, parameters - 1.0)  # (N, 3), positive beyond a side
    constant, side = axis_and_side(cube_faces)
    outside[rows, constant] = -1.0
    axis = outside.argmax(axis=1)
    overshoot = outside[rows, axis]
    crossed = rows[overshoot > 0.0]
    inwards = np.where(side[crossed] == 1, 1.0 - overshoot[crossed], overshoot[crossed])
    parameters[crossed, constant[crossed]] = inwards
    cube_faces[crossed] = face_number(axis[crossed], parameters[crossed, axis[crossed]] > 0.5)
    return np.clip(parameters, 0.0, 1.0), cube_faces
