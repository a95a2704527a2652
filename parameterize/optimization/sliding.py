"""Places points on the faces of blocks that form the boundary, and lets them slide there.

Between optimisation steps every parameter moves to the closest point of F's boundary, across edges of faces where
necessary. The paper keeps the parameters fixed (section 4.3.2), which keeps the network's correspondence; slides lower
the boundary error and the distortion together.
"""

from copy import copy
from functools import cached_property

import numba
import numpy as np

from ..arrays import Array, IntArray, Knots, Mask
from ..cube.cube import damped_solution, nearest_faces
from ..cube.flips import flipped, new_flips, unflip, untangle, untangle_whole
from ..spline.bspline import breakpoints
from ..spline.spline_map import ControlNets
from ..threads import in_parallel
from .adjacent_faces import Edges, next_faces
from .face_window import FaceWindow, Polynomials, agreement, fill_tangents, fill_window, polynomials_of
from .operators import pieces
from .spans import numbers, with_neighbours

_DAMPING = 1e-6  # against parallel tangents
_HALVINGS = 3
_NO_TRIANGLES = np.zeros((0, 3), dtype=np.int64)


class SlidingParameters:
    """Hold parameters (N, 3) on faces (N,) of a block, and the basis functions there.

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

    def place(self, parameters: Array, cube_faces: IntArray) -> None:
        """Set the parameters (N, 3) and their faces (N,)."""
        self.parameters, self.cube_faces = parameters, cube_faces
        self.__dict__.pop("window", None)

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
        field, before = np.ascontiguousarray(control.reshape(3, -1)), self.on_faces
        longest = np.array([0.5 / max(shape) for shape in self.nets.shapes])
        outward = np.zeros_like(points) if normals is None else normals
        polynomials, edges, window = self._polynomials, (next_faces(self.nets), self.boxes), self.window
        slid = FaceWindow.empty(len(points), self.nets.degree)
        goal, parameters, cube_faces = *np.empty((2, *points.shape)), np.empty_like(self.cube_faces)

        def part(rows: slice) -> None:
            here = self.parameters[rows], self.cube_faces[rows], self.fixed[rows], window.some(rows).arrays
            aims = field, points[rows], outward[rows], longest, reach
            found = goal[rows], parameters[rows], cube_faces[rows], slid.some(rows).arrays
            _slide(polynomials, edges, *here, *aims, *found)

        in_parallel(part, pieces(len(points)))
        self.place(parameters, cube_faces)
        self.window = slid
        if keep_layout:
            held = _held_back(edges, *before, *self.on_faces, self.fixed, goal, self.triangles)
            self._change(*held)

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
        x, y, z = (np.abs(parameters - self.parameters) > 1e-9).T
        changed = x | y | z
        moved = np.where(changed[:, None], parameters, self.parameters)
        cube_faces = self.cube_faces.copy()
        cube_faces[changed] = nearest_faces(moved[changed])
        self._change(moved, cube_faces, changed)

    def _change(self, parameters: Array, cube_faces: IntArray, changed: Mask) -> None:
        """Set the parameters and faces, of which some points (N,) have changed; the others keep their functions."""
        if not changed.any():
            return
        own = FaceWindow.at(self._polynomials, parameters[changed], cube_faces[changed])
        window = self.window.with_points(changed, own)
        self.place(parameters, cube_faces)
        self.window = window

    @cached_property
    def window(self) -> FaceWindow:
        """Return the basis functions that are not zero at the points."""
        return FaceWindow.at(self._polynomials, self.parameters, self.cube_faces)

    @cached_property
    def _polynomials(self) -> Polynomials:
        return polynomials_of(self.nets)


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _slide(
    polynomials: Polynomials,
    edges: Edges,
    before: Array,
    faces_before: IntArray,
    fixed: Mask,
    window: tuple[IntArray, Array, Array],
    control: Array,
    points: Array,
    normals: Array,
    max_steps: Array,
    reach: float,
    goal: Array,
    parameters: Array,
    cube_faces: IntArray,
    slid: tuple[IntArray, Array, Array],
) -> None:
    """Write the step of `SlidingParameters.slide` at points (N, 3) with a given FaceWindow.

    The results are the ends of the steps in the planes of the faces (N, 3), the new parameters, their faces and their
    FaceWindow.
    """
    (places, in_a, in_b), (new_places, new_a, new_b) = window, slid
    found = np.empty((1, 3, 3))
    for n in range(len(points)):
        fill_tangents(places, in_a, in_b, control, n, found, 0)
        square = aa = bb = ab = ra = rb = 0.0
        for c in range(3):
            off, along_a, along_b = found[0, 0, c] - points[n, c], found[0, 1, c], found[0, 2, c]
            square += off * off
            aa, bb, ab = aa + along_a * along_a, bb + along_b * along_b, ab + along_a * along_b
            ra, rb = ra + along_a * off, rb + along_b * off
        face = faces_before[n]
        agreed = agreement(found, 0, normals, n, face)
        step_a, step_b = damped_solution(aa, bb, ab, ra, rb, _DAMPING)
        a, b = (face % 6 // 2 + 1) % 3, (face % 6 // 2 + 2) % 3
        free_a, free_b = not fixed[n, a], not fixed[n, b]
        if not (free_a and free_b):
            step_a, step_b = free_a * ra / (aa + 1e-150), free_b * rb / (bb + 1e-150)
        share = min(1.0, max_steps[face // 6] / max(np.sqrt(step_a**2 + step_b**2), 1e-300))
        for c in range(3):
            goal[n, c] = before[n, c]
        goal[n, a] -= share * step_a
        goal[n, b] -= share * step_b
        if square <= reach**2:
            for c in range(3):
                parameters[n, c] = goal[n, c]
            cube_faces[n] = face
            fold(edges, parameters, cube_faces, fixed, n)
            fill_window(polynomials, parameters, cube_faces, n, new_places, new_a, new_b)
            fill_tangents(new_places, new_a, new_b, control, n, found, 0)
            after = 0.0
            for c in range(3):
                after += (found[0, 0, c] - points[n, c]) ** 2
            if after <= square and agreement(found, 0, normals, n, cube_faces[n]) >= min(agreed, 0.0):
                continue
        cube_faces[n] = face
        for c in range(3):
            parameters[n, c], new_places[n, c] = before[n, c], places[n, c]
        for order in range(2):
            for i in range(in_a.shape[2]):
                new_a[n, order, i], new_b[n, order, i] = in_a[n, order, i], in_b[n, order, i]


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def _held_back(
    edges: Edges,
    before: Array,
    faces_before: IntArray,
    slid: Array,
    slid_faces: IntArray,
    fixed: Mask,
    goal: Array,
    triangles: IntArray,
) -> tuple[Array, IntArray, Mask]:
    """Shorten steps from `before` towards `goal`, at first up to `slid`, until no further triangle flips.

    Returns the parameters, their faces, and the mask (N,) of the points that are no longer at `slid`.
    """
    parameters, cube_faces, changed = slid.copy(), slid_faces.copy(), np.zeros(len(slid), np.bool_)
    moved, share, allowed = np.zeros(len(slid), np.bool_), np.ones(len(slid)), flipped(before, triangles)
    for n in range(len(slid)):
        for c in range(3):
            moved[n] |= slid[n, c] != before[n, c]
        share[n] = 1.0 if moved[n] else 0.0  # others stay in any case
    for halving in range(_HALVINGS + 1):
        is_last, moved = halving == _HALVINGS, new_flips(parameters, before, triangles, allowed, moved)
        for n in range(len(slid)):
            if moved[n]:
                share[n] = 0.0 if is_last else 0.5 * share[n]
                changed[n], cube_faces[n] = True, faces_before[n]
                for c in range(3):
                    parameters[n, c] = before[n, c] + share[n] * (goal[n, c] - before[n, c])
                if not is_last:
                    fold(edges, parameters, cube_faces, fixed, n)
        if not moved.any():
            break
    return parameters, cube_faces, changed


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
def fold(edges: Edges, parameters: Array, cube_faces: IntArray, fixed: Mask, n: int) -> None:
    """Continue the step of point n that left its face on the neighbouring face, in place.

    The part of the step beyond the edge points inwards there. The step ends at the ends of an edge that carries the
    point. boxes, in `edges`, are the side lengths of the blocks; fixed: as in SlidingParameters.
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
