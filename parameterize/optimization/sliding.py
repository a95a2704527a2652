"""Places points on the boundary of the cube, and lets them slide there.

Between optimisation steps every parameter moves to the closest point of F's boundary, across the cube's edges where
necessary. The paper keeps the parameters fixed (section 4.3.2), which keeps the network's correspondence; slides lower
the boundary error and the distortion together.
"""

from copy import copy
from functools import cached_property

import numba
import numpy as np

from ..arrays import Array, IntArray, Knots, Mask
from ..cube.cube import damped_solution, nearest_faces
from ..cube.flips import new_flips, unflip, untangle, untangle_whole
from ..spline.bspline import breakpoints
from ..threads import in_parallel
from .face_window import FaceWindow, Polynomials, fill_tangents, fill_window, polynomials_of
from .operators import ControlRows, pieces
from .spans import with_neighbours

_DAMPING = 1e-6  # against parallel tangents
_HALVINGS = 3
_NO_TRIANGLES = np.zeros((0, 3), dtype=np.int64)


class SlidingParameters:
    """Hold parameters (N, 3) on cube faces (N,), and the rows that yield F there.

    The points to which parameters slide are not part of this class, because the samples of contact.py have none.
    SurfaceFit, a term of the energy, adds the points, their metrics and their weights.

    triangles: (m, 3), between the points; with them `relax` and `slide` keep the layout on the cube one-to-one.
    """

    def __init__(self, knots: Knots, degree: int, parameters: Array, triangles: IntArray = _NO_TRIANGLES) -> None:
        self.knots, self.degree = knots, degree
        self.triangles = triangles
        self.place(parameters, nearest_faces(parameters))

    def place(self, parameters: Array, cube_faces: IntArray) -> None:
        """Set the parameters (N, 3) and their cube faces (N,)."""
        self.parameters, self.cube_faces = parameters, cube_faces
        for known in ("window", "rows"):
            self.__dict__.pop(known, None)

    def on_knots(self, knots: Knots) -> "SlidingParameters":
        """Return the same parameters for a spline with other knots."""
        other = SlidingParameters(knots, self.degree, self.parameters, self.triangles)
        other.place(self.parameters, self.cube_faces)
        return other

    def values(self, control: Array) -> Array:
        """Return F at the parameters, (N, 3)."""
        return self.window.derivatives(control)[0]

    def spans(self) -> IntArray:
        """Return the span of each parameter, (N, 3)."""
        breaks = [breakpoints(k) for k in self.knots]
        found = [np.searchsorted(b[1:-1], x, "right") for b, x in zip(breaks, self.parameters.T, strict=True)]
        return np.stack(found, axis=1)

    def near_spans(self, spans: IntArray) -> Mask:
        """Return the mask (N,) of the points with parameters in one of the spans (k, 3) or next to it."""
        shape = tuple(len(breakpoints(k)) - 1 for k in self.knots)
        return with_neighbours(spans, shape)[tuple(self.spans().T)]

    def slide(
        self, control: Array, points: Array, max_step: float, *, keep_layout: bool = False, reach: float = np.inf
    ) -> None:
        """Move every parameter by one Gauss-Newton step to the place where F's boundary is closest to its point (N, 3).

        A step across an edge of the cube continues on the next face; `max_step` is the longest step in the parameters.
        Points whose distance would grow, and points farther away than `reach`, keep their parameters. With
        `keep_layout`, steps that would flip a triangle are shortened.
        """
        window, field = self.window, control.reshape(3, -1)
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
            blocked = new_flips(parameters, self.parameters, self.triangles)
            if not blocked.any():
                break
            share[blocked] *= 0.5
            self.place(*fold_over_edges(parameters + share[:, None] * (goal - parameters), cube_faces))
        self._keep(parameters, cube_faces, new_flips(parameters, self.parameters, self.triangles))

    def at_closest_points(self, control: Array, points: Array, slides: int, sweeps: int) -> "SlidingParameters":
        """Return the parameters where F's boundary is closest to the points (N, 3), as far as no triangle flips.

        The parameters slide `slides` times; flipped triangles are relaxed in at most `sweeps` sweeps; then the
        parameters slide `slides` times again.
        """
        other, longest = copy(self), 0.5 / max(control.shape[1:])
        for _ in range(slides):
            other.slide(control, points, longest)
        other.unflip()
        other._move(untangle_whole(other.parameters, self.triangles, sweeps))
        for _ in range(slides):
            other.slide(control, points, longest, keep_layout=True)
        return other

    def relax(self, sweeps: int) -> None:
        """Untangle flipped triangles in a few sweeps, so that flips of several slides do not accumulate."""
        self._move(untangle(self.parameters, self.triangles, sweeps))

    def unflip(self) -> None:
        """Turn flipped triangles outwards by small moves of their own points; all other points stay."""
        self._move(unflip(self.parameters, self.triangles))

    def _move(self, places: Array) -> None:
        moved = np.abs(places - self.parameters).max(axis=1) > 1e-9
        self._keep(places, nearest_faces(places), moved)

    def _keep(self, parameters: Array, cube_faces: IntArray, chosen: Mask) -> None:
        """Set these parameters for the chosen points; the basis functions of the others are not computed again."""
        known = self.window
        self.place(
            np.where(chosen[:, None], parameters, self.parameters), np.where(chosen, cube_faces, self.cube_faces)
        )
        self.window = known.with_points(
            chosen, FaceWindow.at(self._polynomials, parameters[chosen], cube_faces[chosen])
        )

    @cached_property
    def window(self) -> FaceWindow:
        """Return the basis functions that are not zero at the points."""
        return FaceWindow.at(self._polynomials, self.parameters, self.cube_faces)

    @cached_property
    def _polynomials(self) -> Polynomials:
        return polynomials_of(self.knots, self.degree)

    @cached_property
    def rows(self) -> ControlRows:
        """Return the rows that yield F at the points."""
        return ControlRows(self.window.indices, self.window.weights(0, 0))


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
    """Compute the step of `SlidingParameters.slide` at points (N, 3) with a given FaceWindow.

    Returns the ends of the steps in the planes of the faces (N, 3), the new parameters, their cube faces and their
    FaceWindow.
    """
    goal, parameters, cube_faces = parameters.copy(), parameters.copy(), cube_faces.copy()
    old, before = (indices, in_a, in_b), parameters.copy()
    indices, in_a, in_b = indices.copy(), in_a.copy(), in_b.copy()
    found = np.empty((len(points), 3, 3))
    for n in range(len(points)):
        fill_tangents(indices, in_a, in_b, control, n, found)
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
        fill_window(polynomials, parameters, cube_faces, n, indices, in_a, in_b)
        fill_tangents(indices, in_a, in_b, control, n, found)
        after = 0.0
        for c in range(3):
            after += (found[n, 0, c] - points[n, c]) ** 2
        if after > square:
            parameters[n], cube_faces[n] = before[n], face
            indices[n], in_a[n], in_b[n] = old[0][n], old[1][n], old[2][n]
    return goal, parameters, cube_faces, indices, in_a, in_b


def fold_over_edges(parameters: Array, cube_faces: IntArray) -> tuple[Array, IntArray]:
    """Return parameters and cube faces after steps that left a face continue on the neighbouring face.

    The part of a step beyond the edge points inwards on the neighbouring face.
    """
    parameters, cube_faces = parameters.copy(), cube_faces.copy()
    _fold_all(parameters, cube_faces)
    return parameters, cube_faces


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fold_all(parameters: Array, cube_faces: IntArray) -> None:
    for n in range(len(parameters)):
        _fold(parameters, cube_faces, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fold(parameters: Array, cube_faces: IntArray, n: int) -> None:
    """Continue the step of point n on the neighbouring face, in place."""
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
