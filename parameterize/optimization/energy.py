"""The energy of a spline map in its control points: distortion, smoothness, boundary, penalties on det J.

Its second derivative, for Newton's method, is exact for the distortion wherever that is convex (the rotations turn with
J: holding them still, as local-global methods do, makes sliding along the surface slow), and Gauss-Newton for the
penalties. The boundary term is quadratic with its parameters held.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from ..arrays import Array, IntArray
from ..config import SplineConfig
from .cg import Operator, conjugate_gradients
from .contact import ContactPenalty, contact_penalty
from .determinant_penalty import SpanBarrier
from .edge_attraction import EdgeAnchors
from .normals import FacingPenalty, facing_penalty
from .polar import closest_rotation, cofactor_and_determinant, cross, least_eigenvalue
from .surface_distance import SurfaceFit
from .tensor_product import BendingOperator, FastDiagonalization, gauss_grid, grams

_ROUGH = torch.float32  # good enough for directions; energies and gradients are float64
Knots = tuple[Array, Array, Array]


class DistortionEnergy:
    """int a + s (a - l)_+^2 + w (alpha - det J)_+^2 over the cube with a = |J - R|^2, R the closest rotation.

    a is the ARAP energy of F; the second part keeps its maximum down; the third, like the paper's bijectivity term,
    holds against folds. Gauss quadrature.
    """

    def __init__(self, knots: Knots, config: SplineConfig, *, device: torch.device) -> None:
        degrees = (config.degree,) * 3
        self._grid, (u, v, w) = gauss_grid(
            knots, degrees, config.gauss, inner=config.inner_gauss, device=device, dtype=torch.float64
        )
        self._rough_grid = self._grid.to(_ROUGH)
        self._weights = (u[:, None, None] * v[:, None] * w).flatten()
        self._config = config
        self._limit = config.arap_limit

    def set_limit(self, control: Tensor) -> None:
        """Put the limit l above which distortion costs more in proportion to 1 + the mean distortion at `control`."""
        flat = self._rough_grid.jacobian(control.to(_ROUGH)).flatten(2)
        density = (flat - closest_rotation(flat)).square().sum(dim=(0, 1))
        self._limit = self._config.arap_limit * (1.0 + float(self._weights.to(_ROUGH) @ density))

    def energy_and_gradient(self, control: Tensor, penalty: float) -> tuple[float, Tensor, int]:
        """Energy, gradient (3, n_u, n_v, n_w), and the number of quadrature points with det J <= 0."""
        config, weights = self._config, self._weights
        jacobian = self._grid.jacobian(control)
        flat = jacobian.flatten(2)  # (3, 3, m)
        cofactors, det = cofactor_and_determinant(flat)
        shortfall = weights * (config.min_det - det).clamp_min(0.0)
        gap = flat - closest_rotation(flat)
        density = gap.square().sum(dim=(0, 1))
        excess = (density - self._limit).clamp_min(0.0)
        energy = weights @ (density + config.stiffening * excess.square())
        energy += penalty * (shortfall @ (config.min_det - det))
        dual = 2.0 * weights * (1.0 + 2.0 * config.stiffening * excess) * gap - 2.0 * penalty * shortfall * cofactors
        return float(energy), self._grid.adjoint(dual.view(jacobian.shape)), int((det <= 0.0).sum())

    def curvature(self, control: Tensor, penalty: float) -> Operator:
        """A positive semidefinite second derivative at `control`, as an operator in single precision.

        With S = R^T J, R turns by R [omega] when J changes by d, where (tr(S) I - S) omega = -sum_k R_k x d_k over the
        rows k, so the Hessian of a is 2 (d - R [omega]). It is positive where all sums of two singular values, the
        eigenvalues of tr(S) I - S, are at least 2; elsewhere these are lifted. The penalty's part is Gauss-Newton.
        """
        config, weights = self._config, self._weights.to(_ROUGH)
        jacobian = self._rough_grid.jacobian(control.to(_ROUGH))
        flat = jacobian.flatten(2)
        rotation = closest_rotation(flat)
        cofactors, det = cofactor_and_determinant(flat)
        push = (2.0 * penalty * weights * (det < config.min_det)).sqrt() * cofactors
        gap = flat - rotation
        excess = (gap.square().sum(dim=(0, 1)) - self._limit).clamp_min(0.0)
        pull = (8.0 * config.stiffening * weights * (excess > 0.0)).sqrt() * gap
        scale = 2.0 * weights * (1.0 + 2.0 * config.stiffening * excess)
        softness = _turning(rotation, flat)

        def product(x: Tensor) -> Tensor:
            change = self._rough_grid.jacobian(x).flatten(2)
            torque = cross(rotation, change).sum(0)  # (3, m)
            omega = (softness * torque).sum(1)  # of the opposite sign
            dual = scale * (change + cross(rotation, omega.expand_as(rotation)))
            dual += (pull * change).sum(dim=(0, 1)) * pull
            dual += (push * change).sum(dim=(0, 1)) * push
            return self._rough_grid.adjoint(dual.view(jacobian.shape))

        return product


def _turning(rotation: Tensor, jacobian: Tensor) -> Tensor:
    """(tr(S) I - S)^-1 with S = R^T J, its eigenvalues lifted so that the least is 2: (3, 3, m)."""
    stretch = torch.stack([rotation[k][:, None] * jacobian[k] for k in range(3)]).sum(0)  # S, symmetric
    sums = -stretch
    for i in range(3):
        sums[i, i] += stretch[0, 0] + stretch[1, 1] + stretch[2, 2]
    lift = (2.0 - least_eigenvalue(sums)).clamp_min(0.0)
    for i in range(3):
        sums[i, i] += lift
    cofactors, det = cofactor_and_determinant(sums)  # of a symmetric matrix
    return cofactors / det


class SplineEnergy:
    """Distortion, fairness, boundary, and the penalties on det J at Gauss points and in Bernstein form."""

    def __init__(self, config: SplineConfig, knots: Knots, surface: SurfaceFit, *, device: torch.device) -> None:
        self.config, self.surface = config, surface
        self.anchors = EdgeAnchors(surface, config)
        self._facing: FacingPenalty | None = None
        self._contact: ContactPenalty | None = None
        self._knots = knots
        self.penalty = config.penalties[0]
        self._distortion = DistortionEnergy(knots, config, device=device)
        mass, slope, curve = grams(knots, config.degree, device)
        self._bending = BendingOperator(mass, slope, curve, 2.0 * config.fairness)
        self._rough_bending = self._bending.to(_ROUGH)
        self.barrier = SpanBarrier(knots, config.degree, config.min_coefficient, device=device)
        ends = torch.zeros_like(mass[0])
        ends[0, 0] = ends[-1, -1] = config.pull * config.vertex / 6.0  # the points spread over six faces
        rough = tuple(2.0 * k + 2.0 * config.fairness * h + ends for k, h in zip(slope, curve, strict=True))
        self._precondition = FastDiagonalization(rough, mass).to(_ROUGH)

    def start_round(self, control: Tensor, penalty: float) -> None:
        """Take a penalty weight, and the limit of the distortion that suits the control points."""
        self.penalty = penalty
        self._distortion.set_limit(control)

    def watch_facing(self, control: Tensor) -> None:
        """Penalise, from now on, the places of F's boundary that hardly face the way the mesh does at `control`."""
        self._facing = facing_penalty(self.surface, control, self.config.min_facing, self.config.facing_margin)

    def watch_contact(self, control: Tensor) -> None:
        """Push apart, from now on, the sheets of F's boundary that are hardly apart at `control`."""
        self._contact = contact_penalty(self._knots, self.config.degree, control, self.config.gap)

    def slide(self, control: Tensor) -> None:
        """Let the surface's parameters slide towards their closest points, and watch how F faces there."""
        for _ in range(self.config.slides):
            self.surface.places.slide(control, self.surface.points, 0.5 / control.shape[1])
        self.surface.places.relax(self.config.relaxations)
        self.watch_facing(control)
        if self._contact is not None:
            self.watch_contact(control)

    def give_way(self, spans: IntArray, factor: float) -> None:
        """Multiply the weights of boundary data in and next to spans (k, 3) of the map by `factor`."""
        for fit in (self.surface, self.anchors.fit):
            fit.give_way(np.where(fit.places.near_spans(spans), factor, 1.0) * fit.yielding)

    def take_back(self, factor: float) -> None:
        """Divide by `factor` what such factors have become, up to 1."""
        for fit in (self.surface, self.anchors.fit):
            fit.give_way(np.minimum(fit.yielding / factor, 1.0))

    def volume_part(self, control: Tensor) -> tuple[float, Tensor, int]:
        """Distortion, fairness and barrier: energy, gradient, folded quadrature points."""
        arap, gradient, folded = self._distortion.energy_and_gradient(control, self.penalty)
        shortfall, push = self.barrier.energy_and_gradient(control)
        bent = self._bending(control)
        energy = arap + 0.5 * float((bent * control).sum()) + self.penalty * shortfall
        return energy, gradient + bent + self.penalty * push, folded

    def surface_part(self, control: Tensor) -> tuple[float, Tensor]:
        """The boundary terms at the present parameters: energy and gradient."""
        config = self.config
        off, pull = self.surface.energy_and_gradient(control)
        off_edges, pull_edges = self.anchors.fit.energy_and_gradient(control)
        energy = config.vertex * (off + config.anchors * off_edges)
        gradient = config.vertex * (pull + config.anchors * pull_edges)
        if self._contact is not None:
            overlap, apart = self._contact.energy_and_gradient(control)
            energy += config.vertex * config.contact * overlap
            gradient += config.vertex * config.contact * apart
        if self._facing is None:
            return energy, gradient
        turned, push = self._facing.energy_and_gradient(control)
        return energy + self.penalty * turned, gradient + self.penalty * push

    def newton_direction(self, control: Tensor, right: Tensor) -> Tensor:
        """Approximate solution of Hessian x = right at `control`, the parameters of the surface held."""
        config = self.config
        surface, anchors = self.surface.hessian(_ROUGH), self.anchors.fit.hessian(_ROUGH)
        distortion = self._distortion.curvature(control, self.penalty)
        barrier = self.barrier.curvature(control)
        facing = torch.zeros_like if self._facing is None else self._facing.curvature(control, _ROUGH)
        contact = torch.zeros_like if self._contact is None else self._contact.curvature(control, _ROUGH)

        def hessian(x: Tensor) -> Tensor:
            inner = distortion(x) + self._rough_bending(x) + self.penalty * (barrier(x) + facing(x))
            outer = surface(x) + config.anchors * anchors(x) + config.contact * contact(x)
            return inner + config.vertex * outer

        direction, _ = conjugate_gradients(
            hessian,
            right.to(_ROUGH),
            self._precondition,
            tolerance=config.tolerance,
            max_iterations=config.iterations,
        )
        return direction.to(right.dtype)
