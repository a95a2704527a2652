"""Places points on the faces of blocks that form the boundary, and lets them slide there.

Between optimisation steps every parameter moves to the closest point of F's boundary, across edges of faces where
necessary. The paper keeps the parameters fixed (section 4.3.2), which keeps the network's correspondence; slides lower
the boundary error and the distortion together.
"""

from copy import copy
from functools import cached_property

import numba
import numpy as np

from ..array_copies import write
from ..arrays import Array, IntArray, Knots, Mask
from ..cube.cube import axis_and_side, damped_solution, nearest_faces, tangent_axes
from ..cube.flips import new_flips, unflip, untangle, untangle_whole
from ..spline.bspline import breakpoints
from ..spline.spline_map import ControlNets
from ..threads import in_parallel
from .adjacent_faces import Edges, next_faces
from .face_window import FaceWindow, Polynomials, fill_tangents, fill_window, polynomials_of
from .operators import ControlRows, pieces
from .spans import numbers, with_neighbours

_DAMPING = 1e-6  # against parallel tangents
_HALVINGS = 3
_NO_TRIANGLES = np.zeros((0, 3), dtype=np.int64)


class SlidingParameters:
    """Hold parameters (N, 3) on faces (N,) of a block, and the rows that yield F there.

    The points to which parameters slide are not part of this class, because the samples of contact.py have none.
    Correspondence, a term of the energy, adds the points, their metrics and their weights.

    cube_faces: the faces, 6 * block + face; by default the nearest ones of one cube. triangles: (m, 3), between the
    points; on one cube, `relax` and `slide` keep the layout of these one-to-one. On a body of several
    blocks parameters are assigned anew before each round (reassignment.py), and there is no layout to keep.
    fixed: (N, 3), the parameters of each point that stay as they are: those of a point of a sharp edge that is carried
    by an edge of the cube, along which it slides.
    """

    def __init__(
        self,
        nets: ControlNets,
        parameters: Array,
        cube_faces: IntArray | None = None,
        triangles: IntArray = _NO_TRIANGLES,
        fixed: Mask | None = None,
    ) -> None:
        self.nets, self.triangles = nets, triangles
        self.fixed = np.zeros(parameters.shape, dtype=bool) if fixed is None else fixed
        self.measure_in(np.ones((len(nets.knots), 3)))
        self.place(parameters, nearest_faces(parameters) if cube_faces is None else cube_faces)

    @property
    def knots(self) -> Knots:
        """Return the knots of one cube."""
        (knots,) = self.nets.knots
        return knots

    def measure_in(self, boxes: Array) -> None:
        """Set the side lengths (blocks, 3) of the blocks, in which steps across their edges are measured."""
        self.boxes = boxes

    @property
    def lengths(self) -> tuple[Array, Array]:
        """Return the side lengths of the blocks along the two directions of each parameter's face, (N,) each."""
        a, b = tangent_axes(axis_and_side(self.cube_faces)[0])
        return self.boxes[self.blocks, a], self.boxes[self.blocks, b]

    def place(self, parameters: Array, cube_faces: IntArray) -> None:
        """Set the parameters (N, 3) and their faces (N,)."""
        self.parameters, self.cube_faces = parameters, cube_faces
        for known in ("window", "rows"):
            self.__dict__.pop(known, None)

    def on_nets(self, nets: ControlNets) -> "SlidingParameters":
        """Return the same parameters for blocks with other knots."""
        return SlidingParameters(nets, self.parameters, self.cube_faces, self.triangles, self.fixed.copy())

    @property
    def on_faces(self) -> tuple[Array, IntArray]:
        """Return the parameters (N, 3) and their faces (N,), which `place` takes."""
        return self.parameters, self.cube_faces

    @property
    def blocks(self) -> IntArray:
        """Return the block of each parameter, (N,)."""
        return np.asarray(self.cube_faces // 6)

    def values(self, control: Array) -> Array:
        """Return F at the parameters, (N, 3)."""
        return self.window.derivatives(control)[0]

    @property
    def still(self) -> Mask:
        """Return the mask (N,) of the points that are not moved to untangle triangles."""
        return np.asarray(self.fixed.any(axis=1))

    def spans(self) -> IntArray:
        """Return the span of each parameter, with its block, (N, 4)."""
        found = np.empty((len(self.parameters), 4), dtype=np.int64)
        found[:, 0] = self.blocks
        for block, knots in enumerate(self.nets.knots):
            own = found[:, 0] == block
            for axis, row in enumerate(knots):
                inner = breakpoints(row)[1:-1]
                found[own, 1 + axis] = np.searchsorted(inner, self.parameters[own, axis], "right")
        return found

    def near_spans(self, spans: IntArray) -> Mask:
        """Return the mask (N,) of the points with parameters in one of the spans (k, 4) or next to it."""
        return with_neighbours(spans, self.nets)[numbers(self.spans(), self.nets)]

    def slide(
        self,
        control: Array,
        points: Array,
        normals: Array | None = None,
        *,
        keep_layout: bool = False,
        reach: float = np.inf,
    ) -> None:
        """Move every parameter by one Gauss-Newton step to the place where F's boundary is closest to its point (N, 3).

        A step across an edge continues on the next face of the boundary; the longest step in the parameters is half of
        the inverse of the block's number of control points in its longest direction.
        Points whose distance would grow, and points farther away than `reach`, keep their parameters. So do points with
        outward normals (N, 3) that would come to a place where F's boundary faces the other way: a few of them would
        fold F there. With `keep_layout`, steps that would flip a triangle are shortened.
        """
        window, field = self.window, np.ascontiguousarray(control.reshape(3, -1))
        polynomials, before = self._polynomials, self.on_faces
        longest = np.array([0.5 / max(shape) for shape in self.nets.shapes])
        edges = next_faces(self.nets), self.boxes
        outward = np.zeros_like(points) if normals is None else normals

        def part(rows: slice) -> tuple[Array, ...]:
            known = (window.indices[rows], window.in_a[rows], window.in_b[rows])
            at = (self.parameters[rows], self.cube_faces[rows], self.fixed[rows])
            return _slid(polynomials, edges, *at, *known, field, points[rows], outward[rows], longest, reach)

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
            moved = parameters + share[:, None] * (goal - parameters)
            folded = fold_over_edges(self.nets, moved, cube_faces, self.fixed)
            self.place(*folded)
        self._keep(parameters, cube_faces, new_flips(parameters, self.parameters, self.triangles))

    def at_closest_points(self, control: Array, points: Array, slides: int, sweeps: int) -> "SlidingParameters":
        """Return the parameters where F's boundary is closest to the points (N, 3), as far as no triangle flips.

        The parameters slide `slides` times; flipped triangles are relaxed in at most `sweeps` sweeps; then the
        parameters slide `slides` times again.
        """
        other = copy(self)
        for _ in range(slides):
            other.slide(control, points)
        if not self.nets.is_single:
            return other
        other.unflip()
        other._move(untangle_whole(other.parameters, self.triangles, sweeps, other.still))
        for _ in range(slides):
            other.slide(control, points, keep_layout=True)
        return other

    def relax(self, sweeps: int) -> None:
        """Untangle flipped triangles in a few sweeps, so that flips of several slides do not accumulate."""
        if not self.nets.is_single:
            return
        self._move(untangle(self.parameters, self.triangles, sweeps, self.still))

    def unflip(self) -> None:
        """Turn flipped triangles outwards by small moves of their own points; all other points stay."""
        self._move(unflip(self.parameters, self.triangles, self.still))

    def _move(self, parameters: Array) -> None:
        moved = np.abs(parameters - self.parameters).max(axis=1) > 1e-9
        self._keep(parameters, nearest_faces(parameters), moved)

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
        return polynomials_of(self.nets)

    @cached_property
    def rows(self) -> ControlRows:
        """Return the rows that yield F at the points."""
        return ControlRows(self.window.indices, self.window.weights(0, 0))


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _slid(
    polynomials: Polynomials,
    edges: Edges,
    parameters: Array,
    cube_faces: IntArray,
    fixed: Mask,
    indices: IntArray,
    in_a: Array,
    in_b: Array,
    control: Array,
    points: Array,
    normals: Array,
    max_steps: Array,
    reach: float,
) -> tuple[Array, Array, IntArray, IntArray, Array, Array]:
    """Compute the step of `SlidingParameters.slide` at points (N, 3) with a given FaceWindow.

    Returns the ends of the steps in the planes of the faces (N, 3), the new parameters, their faces and their
    FaceWindow.
    """
    goal, parameters, cube_faces = parameters.copy(), parameters.copy(), cube_faces.copy()
    before, (old, old_a, old_b) = parameters.copy(), (indices, in_a, in_b)
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
        agreed = _agreement(found[n], normals[n], cube_faces[n])
        step_a, step_b = damped_solution(aa, bb, ab, ra, rb, _DAMPING)
        face = cube_faces[n]
        free_a, free_b = not fixed[n, (face % 6 // 2 + 1) % 3], not fixed[n, (face % 6 // 2 + 2) % 3]
        if not (free_a and free_b):
            step_a, step_b = free_a * ra / (aa + 1e-150), free_b * rb / (bb + 1e-150)
        share = min(1.0, max_steps[face // 6] / max(np.sqrt(step_a**2 + step_b**2), 1e-300))
        goal[n, (face % 6 // 2 + 1) % 3] -= share * step_a
        goal[n, (face % 6 // 2 + 2) % 3] -= share * step_b
        if square > reach**2:
            continue
        for c in range(3):
            parameters[n, c] = goal[n, c]
        _fold(edges, parameters, cube_faces, fixed, n)
        fill_window(polynomials, parameters, cube_faces, n, indices, in_a, in_b)
        fill_tangents(indices, in_a, in_b, control, n, found)
        after = 0.0
        for c in range(3):
            after += (found[n, 0, c] - points[n, c]) ** 2
        if after > square or _agreement(found[n], normals[n], cube_faces[n]) < min(agreed, 0.0):
            cube_faces[n] = face
            write(before[n], parameters[n])
            write(old[n], indices[n])
            write(old_a[n], in_a[n])
            write(old_b[n], in_b[n])
    return goal, parameters, cube_faces, indices, in_a, in_b


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _agreement(found: Array, normal: Array, face: int) -> float:
    """Return (t_a x t_b) . n with F and its tangents, the rows of `found`, and the outward normal n of a point."""
    a, b = found[1], found[2]
    size = (a[1] * b[2] - a[2] * b[1]) * normal[0]
    size += (a[2] * b[0] - a[0] * b[2]) * normal[1]
    size += (a[0] * b[1] - a[1] * b[0]) * normal[2]
    return size if face % 2 == 1 else -size


def fold_over_edges(
    nets: ControlNets, parameters: Array, cube_faces: IntArray, fixed: Mask | None = None
) -> tuple[Array, IntArray]:
    """Return parameters and faces after steps that left a face continue on the neighbouring face; all blocks are cubes.

    The part of a step beyond the edge points inwards on the neighbouring face. fixed: as in SlidingParameters.
    """
    parameters, cube_faces = parameters.copy(), cube_faces.copy()
    held = np.zeros(parameters.shape, dtype=bool) if fixed is None else fixed
    _fold_all((next_faces(nets), np.ones((len(nets.knots), 3))), parameters, cube_faces, held)
    return parameters, cube_faces


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fold_all(edges: Edges, parameters: Array, cube_faces: IntArray, fixed: Mask) -> None:
    for n in range(len(parameters)):
        _fold(edges, parameters, cube_faces, fixed, n)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _fold(edges: Edges, parameters: Array, cube_faces: IntArray, fixed: Mask, n: int) -> None:
    """Continue the step of point n on the neighbouring face, in place.

    The step ends at the ends of an edge that carries the point.
    """
    table, boxes = edges
    face = cube_faces[n]
    block, constant = face // 6, face % 6 // 2
    axis, overshoot = constant, 0.0
    for d in range(3):
        outside = boxes[block, d] * max(-parameters[n, d], parameters[n, d] - 1.0)
        if d != constant and outside > overshoot:
            axis, overshoot = d, outside
    if overshoot > 0.0 and not fixed[n, constant]:
        other, inwards, side, reverse = table[face, axis, int(parameters[n, axis] > 0.5)]
        along = parameters[n, 3 - constant - axis]
        step = overshoot / boxes[other // 6, inwards]
        across = other % 6 // 2
        parameters[n, 3 - across - inwards] = 1.0 - along if reverse else along
        parameters[n, across] = float(other % 2)
        parameters[n, inwards] = 1.0 - step if side == 1 else step
        cube_faces[n] = other
    for d in range(3):
        parameters[n, d] = min(max(parameters[n, d], 0.0), 1.0)
