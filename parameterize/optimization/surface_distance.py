"""How well the boundary of F lies on the surface: residuals at surface points whose parameters slide.

Each surface point v has a parameter p on the cube's boundary. The energy is a weighted sum of r^T (Q + t I) r with
r = F(p) - v and Q the mean of n n^T over the triangles around v: on smooth parts that measures along the normal only,
on sharp edges across both sides, at corners in all directions. Between optimisation steps every parameter moves to
the closest point, over the cube's edges where it must: the paper keeps them fixed (section 4.3.2), which freezes the
network's correspondence; letting them slide lowers boundary error and distortion together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from torch import Tensor

from ..arrays import Array, IntArray
from ..cube.closest_point import damped_fit
from ..cube.cube import axis_and_side, face_number, nearest_faces, tangent_axes
from ..cube.flips import new_flips, untangle
from ..spline.bspline import basis_derivatives, breakpoints, sparse_rows
from ..surface.geometry import vertex_normals
from .cg import Operator
from .normals import FacingPenalty, facing_penalty
from .tensor_product import ControlRows

_DAMPING = 1e-6  # against parallel tangents
_HALVINGS = 3
_WATCHED = 3.0  # times the floor: points below may fall under it in the next step


class SurfaceFit:
    """points (N, 3) at volume 1, quadrics (N, 3, 3), weights (N,) that sum to 1, parameters (N, 3), faces (N,).

    triangles (m, 3) between the points; between them `relax` keeps the layout on the cube one-to-one.
    given_corners (8, 3): where the user wants the corners of the cube; edge_attraction.py holds F there.
    """

    def __init__(
        self,
        knots: tuple[Array, Array, Array],
        degree: int,
        points: Array,
        quadrics: Array,
        weights: Array,
        parameters: Array,
        cube_faces: IntArray,
        triangles: IntArray,
        *,
        device: torch.device,
        given_corners: Array | None = None,
    ) -> None:
        self.knots, self.degree, self.device = knots, degree, device
        self.triangles, self.given_corners = triangles, given_corners
        self._weights = weights
        self._normals = vertex_normals(points, triangles)
        self._facing: FacingPenalty | None = None
        self.yielding = np.ones(len(points))
        self.place(parameters, cube_faces)
        self.aim(points, quadrics)

    def place(self, parameters: Array, cube_faces: IntArray) -> None:
        """Take these parameters (N, 3) on these cube faces (N,)."""
        self.parameters, self.cube_faces = parameters, cube_faces
        indices, values = self._values()
        count = int(np.prod([len(k) - self.degree - 1 for k in self.knots]))
        self._rows = ControlRows.of(sparse_rows(values, indices, count), self.device)

    def aim(self, points: Array, quadrics: Array) -> None:
        """Take other points (N, 3) and quadrics (N, 3, 3)."""
        self.points, self._quadrics = points, quadrics
        self._points = torch.as_tensor(points, device=self.device)
        self.give_way(self.yielding)

    def give_way(self, yielding: Array) -> None:
        """Multiply the points' weights by `yielding` (N,), in place of earlier such factors."""
        self.yielding = yielding
        self._metric = torch.as_tensor((yielding * self._weights)[:, None, None] * self._quadrics, device=self.device)

    def near_spans(self, spans: IntArray) -> NDArray[np.bool_]:
        """Which points have their parameter in one of the spans (k, 3) or next to it: (N,)."""
        breaks = [breakpoints(k) for k in self.knots]
        shape = [len(b) - 1 for b in breaks]
        marked = np.zeros(shape, dtype=bool)
        marked[tuple(spans.T)] = True
        marked = binary_dilation(marked, np.ones((3, 3, 3), dtype=bool))
        where = [
            np.clip(np.searchsorted(b, x, "right") - 1, 0, n - 1)
            for b, x, n in zip(breaks, self.parameters.T, shape, strict=True)
        ]
        return marked[tuple(where)]

    def energy_and_gradient(self, control: Tensor) -> tuple[float, Tensor]:
        """Sum of r^T Q r at the present parameters and its gradient (3, n_u, n_v, n_w)."""
        residual = self._rows(control) - self._points  # (N, 3)
        pulled = (self._metric @ residual[:, :, None])[:, :, 0]
        return float((residual * pulled).sum()), 2.0 * self._rows.adjoint(pulled, control)

    def hessian(self, dtype: torch.dtype) -> Operator:
        """Second derivative of the energy, parameters held, as an operator on (3, n_u, n_v, n_w)."""
        rows, metric = self._rows.to(dtype), 2.0 * self._metric.to(dtype)

        def product(direction: Tensor) -> Tensor:
            return rows.adjoint((metric @ rows(direction)[:, :, None])[:, :, 0], direction)

        return product

    def watch_facing(self, control: Tensor, floor: float) -> None:
        """Penalise from now on where F's boundary, at the present parameters, hardly faces the way the mesh does."""
        rows = self._slopes()
        indices, _, d_a, d_b = rows
        _, ta, tb = _contracted(rows, control)
        normals = np.where(axis_and_side(self.cube_faces)[1] == 1, 1.0, -1.0)[:, None] * self._normals
        low = np.einsum("nc,nc->n", np.cross(ta, tb), normals) < _WATCHED * floor
        self._facing = facing_penalty(
            indices[low],
            (d_a[low], d_b[low]),
            control[0].numel(),
            normals[low],
            (self.yielding * self._weights)[low],
            floor,
            self.device,
        )

    def facing_energy_and_gradient(self, control: Tensor) -> tuple[float, Tensor]:
        """The penalty of the points watched, and its gradient."""
        if self._facing is None:
            return 0.0, torch.zeros_like(control)
        return self._facing.energy_and_gradient(control)

    def facing_curvature(self, control: Tensor, dtype: torch.dtype) -> Operator:
        """The Gauss-Newton part of its second derivative."""
        return torch.zeros_like if self._facing is None else self._facing.curvature(control, dtype)

    def residuals(self, control: Tensor) -> Array:
        """F(p) - v: (N, 3)."""
        return np.asarray((self._rows(control) - self._points).cpu())

    def slide(self, control: Tensor, max_step: float, *, keep_layout: bool = False) -> None:
        """One Gauss-Newton step of every parameter towards the point of F's boundary closest to its surface point.

        A step over an edge of the cube goes on upon the next face; `max_step` limits a step in the parameters. Points
        that would end up farther away stay where they are; with `keep_layout` steps that would turn a triangle are
        shortened.
        """
        values, ta, tb = _contracted(self._slopes(), control)
        residual = values - self.points
        step = -np.stack(damped_fit(ta, tb, residual, _DAMPING), axis=1)
        step *= np.minimum(1.0, max_step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-300))
        a, b = tangent_axes(axis_and_side(self.cube_faces)[0])
        moved = self.parameters.copy()
        rows = np.arange(len(moved))
        moved[rows, a] += step[:, 0]
        moved[rows, b] += step[:, 1]
        before = self.parameters, self.cube_faces
        self.place(*fold_over_edges(moved, self.cube_faces))
        stay = (self.residuals(control) ** 2).sum(axis=1) > (residual**2).sum(axis=1)
        self._keep(*before, stay)
        if keep_layout:
            self._hold_back(*before, moved)

    def _hold_back(self, parameters: Array, cube_faces: IntArray, goal: Array) -> None:
        """Shorten steps from `parameters` towards `goal` until no further triangle is turned."""
        share = np.where((self.parameters == parameters).all(axis=1), 0.0, 1.0)
        for _ in range(_HALVINGS):
            blocked = new_flips(parameters, self.parameters, self.triangles)
            if not blocked.any():
                break
            share[blocked] *= 0.5
            self.place(*fold_over_edges(parameters + share[:, None] * (goal - parameters), cube_faces))
        self._keep(parameters, cube_faces, new_flips(parameters, self.parameters, self.triangles))

    def relax(self, sweeps: int) -> None:
        """Lay flipped triangles out anew, within a few sweeps: what sliding tangles must not pile up."""
        places = untangle(self.parameters, self.triangles, sweeps)
        moved = np.abs(places - self.parameters).max(axis=1) > 1e-9
        self._keep(places, nearest_faces(places), moved)

    def _keep(self, parameters: Array, cube_faces: IntArray, chosen: NDArray[np.bool_]) -> None:
        """Take these parameters for the chosen points."""
        self.place(
            np.where(chosen[:, None], parameters, self.parameters), np.where(chosen, cube_faces, self.cube_faces)
        )

    def _window(self) -> _Window:
        """The functions that are not zero at the points."""
        tables = [basis_derivatives(k, self.degree, self.parameters[:, d], 1) for d, k in enumerate(self.knots)]
        first = np.stack([t[0] for t in tables])  # (3, N)
        values = np.stack([t[1] for t in tables])  # (3, 2, N, p + 1)
        sizes = [len(k) - self.degree - 1 for k in self.knots]
        stride = np.array([sizes[1] * sizes[2], sizes[2], 1])
        axis, side = axis_and_side(self.cube_faces)
        a, b = tangent_axes(axis)
        rows = np.arange(len(axis))
        window = np.arange(self.degree + 1)
        base = side * (np.array(sizes)[axis] - 1) * stride[axis]
        along_a = (first[a, rows][:, None] + window) * stride[a][:, None]
        along_b = (first[b, rows][:, None] + window) * stride[b][:, None]
        indices = base[:, None, None] + along_a[:, :, None] + along_b[:, None, :]
        return _Window(indices.reshape(len(rows), -1), values[a, :, rows], values[b, :, rows])

    def _values(self) -> tuple[IntArray, Array]:
        """Control point numbers (N, k) and weights of F, k = (p + 1)^2."""
        window = self._window()
        return window.indices, window.weights(0, 0)

    def _slopes(self) -> tuple[IntArray, Array, Array, Array]:
        """Control point numbers (N, k) and weights of F and of its two derivatives within the face."""
        window = self._window()
        return window.indices, window.weights(0, 0), window.weights(1, 0), window.weights(0, 1)


@dataclass(frozen=True, eq=False)
class _Window:
    """indices (N, k) of control points; in_a, in_b (N, 2, p + 1): values and derivatives in the face's directions."""

    indices: IntArray
    in_a: Array
    in_b: Array

    def weights(self, a: int, b: int) -> Array:
        """Of the derivative of order a and b: (N, k)."""
        return (self.in_a[:, a, :, None] * self.in_b[:, b, None, :]).reshape(len(self.indices), -1)


def _contracted(rows: tuple[IntArray, Array, Array, Array], control: Tensor) -> tuple[Array, Array, Array]:
    """F and its tangents t_a, t_b at the points of `rows`: (N, 3) each."""
    indices, *weights = rows
    local = np.asarray(control.cpu()).reshape(3, -1).T[indices]  # (N, k, 3)
    value, along_a, along_b = (np.einsum("nk,nkc->nc", w, local) for w in weights)
    return value, along_a, along_b


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
