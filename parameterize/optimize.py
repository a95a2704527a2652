"""Control-point optimisation: distortion, smoothness, boundary and injectivity of F together (section 4.3.2, step 3).

L-BFGS whose first Hessian is the quadratic part of the energy (Liu, Bouaziz, Kavan, "Quasi-Newton methods for real-time
simulation of hyperelastic materials", 2017): the ARAP energy is |J - R|^2 with R a rotation, so with R held it is a
Laplacian; smoothness is quadratic, and so is the boundary term with its parameters held. One inner solve costs a
few products with 1-D matrices. Between steps the boundary parameters slide (surface_fit.py).
"""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from .barrier import SpanBarrier, edge_spans
from .bspline import Array, breakpoints
from .certificate import Certificate, certify
from .checkpoint import Checkpoints
from .config import SplineConfig
from .conjugate import conjugate_gradients
from .progress import Progress, ProgressCallback, ignore
from .rotation import closest_rotation, cofactor, determinant
from .stages import History
from .surface_fit import SurfaceFit
from .tensor_grid import FastDiagonalization, SmoothnessOperator, gauss_grid, grams
from .volume import BSplineVolume

_log = logging.getLogger(__name__)
_CHECKPOINT = "spline"
_SHORTEST_STEP = 1e-6
_PATIENT_ROUNDS = (
    2  # after so many, the surface gives way where the map is not proved: a cube edge in a valley cannot fit
)
Knots = tuple[Array, Array, Array]


@dataclass(frozen=True, eq=False)
class Optimized:
    """Control points (3, n_u, n_v, n_w) at volume 1 and what the certificate says of them."""

    control: Tensor
    certificate: Certificate


class Distortion:
    """int |J - R|^2 + w (alpha - det J)_+^2 over the cube, R the closest rotation, by Gauss quadrature.

    The first part is the ARAP energy of F; the second, like the paper's bijectivity term, holds against folds.
    """

    def __init__(self, knots: Knots, config: SplineConfig, *, device: torch.device) -> None:
        self._grid, (u, v, w) = gauss_grid(
            knots, (config.degree,) * 3, config.gauss, device=device, dtype=torch.float64
        )
        self._weights = u[:, None, None] * v[:, None] * w
        self._alpha = config.min_det

    def energy_and_gradient(self, control: Tensor, penalty: float) -> tuple[float, Tensor, int]:
        """Energy, gradient (3, n_u, n_v, n_w), and the number of quadrature points with det J <= 0."""
        jacobian = self._grid.jacobian(control)
        flat, weights = jacobian.flatten(2), self._weights.flatten()  # (3, 3, m), (m,)
        det = determinant(flat)
        low = torch.nonzero(det < self._alpha)[:, 0]
        shortfall = weights[low] * (self._alpha - det[low])
        push = (-2.0 * penalty) * shortfall * cofactor(flat[:, :, low])
        energy = penalty * float((shortfall * (self._alpha - det[low])).sum())
        dual = flat - closest_rotation(flat)
        energy += float((weights * dual.square().sum(dim=(0, 1))).sum())
        dual *= 2.0 * weights
        dual[:, :, low] += push
        return energy, self._grid.adjoint(dual.reshape(jacobian.shape)), int((det <= 0.0).sum())


class SplineEnergy:
    """Distortion, fairness, boundary, and the penalties on det J at Gauss points and in Bernstein form."""

    def __init__(self, config: SplineConfig, knots: Knots, surface: SurfaceFit, *, device: torch.device) -> None:
        self.config, self.surface = config, surface
        self.penalty = config.penalties[0]
        self._distortion = Distortion(knots, config, device=device)
        mass, slope, curve = grams(knots, config.degree, device)
        self._bending = SmoothnessOperator(mass, slope, curve, stiffness=0.0, bending=2.0 * config.fairness)
        self._smooth = SmoothnessOperator(mass, slope, curve, stiffness=2.0, bending=2.0 * config.fairness)
        self.barrier = SpanBarrier(knots, config.degree, config.min_coefficient, device=device)
        pull = (
            0.1 * config.vertex / 6.0
        )  # points spread over six faces; below the true weight, which acts along normals only
        ends = torch.zeros_like(mass[0])
        ends[0, 0] = ends[-1, -1] = pull
        rough = tuple(2.0 * k + 2.0 * config.fairness * h + ends for k, h in zip(slope, curve, strict=True))
        self._precondition = FastDiagonalization(rough, mass)

    def volume_part(self, control: Tensor) -> tuple[float, Tensor, int]:
        """Distortion, fairness and barrier: energy, gradient, folded quadrature points."""
        arap, gradient, folded = self._distortion.energy_and_gradient(control, self.penalty)
        bent = self._bending(control)
        shortfall, push = self.barrier.energy_and_gradient(control)
        energy = arap + 0.5 * float((bent * control).sum()) + self.penalty * shortfall
        return energy, gradient + bent + self.penalty * push, folded

    def surface_part(self, control: Tensor) -> tuple[float, Tensor]:
        """The boundary term at the present parameters: energy and gradient."""
        energy, gradient = self.surface.energy_and_gradient(control)
        return self.config.vertex * energy, self.config.vertex * gradient

    def newton_direction(self, right: Tensor) -> Tensor:
        """Approximate inverse Hessian times a vector: distortion with rotations held, without barrier."""
        direction, _ = conjugate_gradients(
            lambda x: self._smooth(x) + self.config.vertex * self.surface.hessian_product(x),
            right,
            self._precondition,
            tolerance=1e-2,
            max_iterations=60,
        )
        return direction


class LBFGS:
    """Two-loop recursion around an initial inverse Hessian (Nocedal and Wright, algorithm 7.4)."""

    def __init__(self, pairs: int) -> None:
        self._pairs = pairs
        self._steps: list[Tensor] = []
        self._changes: list[Tensor] = []

    def forget(self) -> None:
        """Start afresh."""
        self._steps.clear()
        self._changes.clear()

    def remember(self, step: Tensor, change: Tensor) -> None:
        """Keep a pair of step and gradient change, unless its curvature is not safely positive."""
        if float((step * change).sum()) <= 1e-10 * float(step.norm() * change.norm()):
            return
        self._steps.append(step)
        self._changes.append(change)
        del self._steps[: -self._pairs], self._changes[: -self._pairs]

    def direction(self, gradient: Tensor, energy: SplineEnergy) -> Tensor:
        """Descent direction at the given gradient."""
        right, alphas = -gradient, []
        for s, y in zip(reversed(self._steps), reversed(self._changes), strict=True):
            alpha = float((s * right).sum()) / float((s * y).sum())
            alphas.append(alpha)
            right = right - alpha * y
        result = energy.newton_direction(right)
        for s, y, alpha in zip(self._steps, self._changes, reversed(alphas), strict=True):
            beta = float((y * result).sum()) / float((s * y).sum())
            result = result + (alpha - beta) * s
        return result


def optimize(
    control: Tensor,
    knots: Knots,
    surface: SurfaceFit,
    config: SplineConfig,
    *,
    history: History,
    progress: ProgressCallback = ignore,
    checkpoints: Checkpoints | None = None,
) -> Optimized:
    """Minimise from `control` (3, n_u, n_v, n_w), volume 1, in rounds: descend, certify, watch the spans not proved.

    Each round raises the weight of the penalties on det J, so the first ones shape the map and the later ones
    unfold what is left. Where spans stay unproved, the surface data near them loses weight. The result is the first
    certified map, else the one with the fewest unproved spans.
    A checkpoint is kept after every round.
    """
    checkpoints = checkpoints or Checkpoints(None, {}, resume=False)
    energy = SplineEnergy(config, knots, surface, device=control.device)
    energy.barrier.activate(edge_spans(tuple(len(breakpoints(k)) - 1 for k in knots)))  # type: ignore[arg-type]
    best = Optimized(control, certify(_as_volume(control, knots, config.degree)))
    first = 0
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        first, control, best = _restore(*saved, energy, best, knots)
        history.rows[:] = [tuple(row) for row in saved[1]["history"]]
    for number in range(first, len(config.penalties)):
        if best.certificate.verdict == "certified" and number > 0:
            break
        energy.penalty = config.penalties[number]
        surface.reproject(control)
        control = _descend(control, energy, number, history, progress)
        certificate = certify(_as_volume(control, knots, config.degree))
        _log.info("round %d: %s, %d spans unproved", number, certificate.verdict, len(certificate.unproved))
        if number == 0 or len(certificate.unproved) <= len(best.certificate.unproved):
            best = Optimized(control, certificate)
        energy.barrier.activate(certificate.unproved)
        if number >= _PATIENT_ROUNDS and len(certificate.unproved):
            near = surface.near_spans(certificate.unproved)
            surface.give_way(np.where(near, 0.5, 1.0) * surface.yielding)
        _save(checkpoints, number + 1, control, best, energy, history)
    return best


def _save(
    checkpoints: Checkpoints, number: int, control: Tensor, best: Optimized, energy: SplineEnergy, history: History
) -> None:
    tensors = {
        "control": control,
        "best": best.control,
        "parameters": torch.as_tensor(energy.surface.parameters),
        "cube_faces": torch.as_tensor(energy.surface.cube_faces),
        "yielding": torch.as_tensor(energy.surface.yielding),
        "active": torch.as_tensor(energy.barrier.active),
    }
    checkpoints.save(_CHECKPOINT, tensors, {"number": number, "history": history.rows})


def _restore(
    tensors: dict[str, Tensor], state: dict[str, Any], energy: SplineEnergy, best: Optimized, knots: Knots
) -> tuple[int, Tensor, Optimized]:
    """Next round, control points and best result of a checkpoint; parameters and active spans go back in place."""
    device = best.control.device
    energy.surface.place(tensors["parameters"].numpy(), tensors["cube_faces"].numpy())
    energy.surface.give_way(tensors["yielding"].numpy())
    energy.barrier.activate(tensors["active"].numpy())
    control, kept = tensors["control"].to(device), tensors["best"].to(device)
    return int(state["number"]), control, Optimized(kept, certify(_as_volume(kept, knots, energy.config.degree)))


@dataclass(frozen=True, eq=False)
class _Point:
    """Control points with energy and gradient, the boundary's part apart: it alone changes when parameters slide."""

    control: Tensor
    inner: tuple[float, Tensor]
    outer: tuple[float, Tensor]
    folded: int

    @property
    def total(self) -> float:
        return self.inner[0] + self.outer[0]

    @property
    def gradient(self) -> Tensor:
        return self.inner[1] + self.outer[1]


def _evaluate(control: Tensor, energy: SplineEnergy) -> _Point:
    value, gradient, folded = energy.volume_part(control)
    return _Point(control, (value, gradient), energy.surface_part(control), folded)


def _line_search(point: _Point, direction: Tensor, energy: SplineEnergy) -> _Point | None:
    """Halve the step until the energy falls enough (Armijo); None where the direction does not lead down."""
    slope = float((direction * point.gradient).sum())
    length = 1.0
    while slope < 0.0 and length > _SHORTEST_STEP:
        trial = _evaluate(point.control + length * direction, energy)
        if trial.total <= point.total + 1e-4 * length * slope:
            return trial
        length *= 0.5
    return None


def _descend(
    control: Tensor, energy: SplineEnergy, number: int, history: History, progress: ProgressCallback
) -> Tensor:
    """One round of L-BFGS steps with sliding boundary parameters."""
    steps = energy.config.steps
    total_steps = steps * len(energy.config.penalties)
    lbfgs = LBFGS(energy.config.history)
    started = time.perf_counter()
    point = _evaluate(control, energy)
    for step in range(steps):
        found = _line_search(point, lbfgs.direction(point.gradient, energy), energy)
        if found is None:
            lbfgs.forget()
            found = _line_search(point, lbfgs.direction(point.gradient, energy), energy)
        if found is None:
            _log.info("round %d: no descent after step %d", number, step)
            break
        lbfgs.remember(found.control - point.control, found.gradient - point.gradient)
        energy.surface.slide(found.control, 0.5 / control.shape[1])
        point = replace(found, outer=energy.surface_part(found.control))
        done = number * steps + step + 1
        history.add("spline", done - 1, point.total, point.folded, {"surface": point.outer[0]})
        left = (time.perf_counter() - started) / (step + 1) * (total_steps - done)
        progress(Progress("spline", done, total_steps, point.total, point.folded, left))
    return point.control


def _as_volume(control: Tensor, knots: Knots, degree: int) -> BSplineVolume:
    points = control.permute(1, 2, 3, 0).cpu().numpy()
    return BSplineVolume((degree,) * 3, knots, points)
