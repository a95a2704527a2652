"""Control-point optimisation: distortion, smoothness, boundary and injectivity of F together (section 4.3.2, step 3).

L-BFGS whose first Hessian is the quadratic part of the energy (Liu, Bouaziz, Kavan, "Quasi-Newton methods for real-time
simulation of hyperelastic materials", 2017): the ARAP energy is |J - R|^2 with R a rotation, so with R held it is a
Laplacian; smoothness is quadratic, and so is the boundary term with its parameters held. One inner solve costs a
few products with 1-D matrices. Between steps the boundary parameters slide (surface_fit.py).
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
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
from .conjugate import Operator, conjugate_gradients
from .progress import Progress, ProgressCallback, ignore
from .rotation import closest_rotation, cofactor, cross, least_eigenvalue
from .stages import History
from .surface_fit import SurfaceFit
from .tensor_grid import FastDiagonalization, SmoothnessOperator, gauss_grid, grams
from .volume import BSplineVolume

_log = logging.getLogger(__name__)
_CHECKPOINT = "spline"
_SLIDES = 2
_RELAXATIONS = 1
_ROUGH = torch.float32  # good enough for the directions; energies and gradients are float64
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
        cofactors = cofactor(flat)
        det = (flat[0] * cofactors[0]).sum(0)
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
        cofactors = cofactor(flat)
        low = (flat[0] * cofactors[0]).sum(0) < config.min_det
        push = (2.0 * penalty * weights * low).sqrt() * cofactors
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
    inverse = cofactor(sums)
    return inverse / (sums[0] * inverse[0]).sum(0)


class SplineEnergy:
    """Distortion, fairness, boundary, and the penalties on det J at Gauss points and in Bernstein form."""

    def __init__(self, config: SplineConfig, knots: Knots, surface: SurfaceFit, *, device: torch.device) -> None:
        self.config, self.surface = config, surface
        self.penalty = config.penalties[0]
        self._distortion = Distortion(knots, config, device=device)
        mass, slope, curve = grams(knots, config.degree, device)
        self._bending = SmoothnessOperator(mass, slope, curve, stiffness=0.0, bending=2.0 * config.fairness)
        self._rough_bending = self._bending.to(_ROUGH)
        self.barrier = SpanBarrier(knots, config.degree, config.min_coefficient, device=device)
        pull = (
            3e-4 * config.vertex / 6.0
        )  # points spread over six faces; below the true weight, which acts along normals only
        ends = torch.zeros_like(mass[0])
        ends[0, 0] = ends[-1, -1] = pull
        rough = tuple(2.0 * k + 2.0 * config.fairness * h + ends for k, h in zip(slope, curve, strict=True))
        self._precondition = FastDiagonalization(rough, mass).to(_ROUGH)

    def start_round(self, control: Tensor, penalty: float) -> None:
        """Take a penalty weight, and the limit of the distortion that suits the control points."""
        self.penalty = penalty
        self._distortion.set_limit(control)

    def volume_part(self, control: Tensor) -> tuple[float, Tensor, int]:
        """Distortion, fairness and barrier: energy, gradient, folded quadrature points."""
        arap, gradient, folded = self._distortion.energy_and_gradient(control, self.penalty)
        shortfall, push = self.barrier.energy_and_gradient(control)
        bent = self._bending(control)
        energy = arap + 0.5 * float((bent * control).sum()) + self.penalty * shortfall
        return energy, gradient + bent + self.penalty * push, folded

    def surface_part(self, control: Tensor) -> tuple[float, Tensor]:
        """The boundary term at the present parameters: energy and gradient."""
        energy, gradient = self.surface.energy_and_gradient(control)
        return self.config.vertex * energy, self.config.vertex * gradient

    def newton_direction(self, control: Tensor, right: Tensor) -> Tensor:
        """Approximate solution of Hessian x = -gradient, the parameters of the surface held."""
        surface = self.surface.hessian(_ROUGH)
        distortion = self._distortion.curvature(control, self.penalty)
        barrier = self.barrier.curvature(control)
        direction, _ = conjugate_gradients(
            lambda x: (
                distortion(x) + self._rough_bending(x) + self.penalty * barrier(x) + self.config.vertex * surface(x)
            ),
            right.to(_ROUGH),
            self._precondition,
            tolerance=self.config.tolerance,
            max_iterations=self.config.iterations,
        )
        return direction.to(right.dtype)


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
    with _one_thread_an_operation():
        energy = SplineEnergy(config, knots, surface, device=control.device)
        return _rounds(control, knots, energy, history, progress, checkpoints)


@contextmanager
def _one_thread_an_operation() -> Iterator[None]:
    """Most tensors here are small: handing them to a second thread costs more than it saves (up to 4 times)."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


def _rounds(
    control: Tensor,
    knots: Knots,
    energy: SplineEnergy,
    history: History,
    progress: ProgressCallback,
    checkpoints: Checkpoints,
) -> Optimized:
    """Descend, certify, watch the spans not proved, until certified or at the end of the penalties."""
    config, surface = energy.config, energy.surface
    energy.barrier.activate(edge_spans(tuple(len(breakpoints(k)) - 1 for k in knots)))  # type: ignore[arg-type]
    best = Optimized(control, certify(_as_volume(control, knots, config.degree)))
    first = 0
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        first, control, best = _restore(*saved, energy, best, knots)
        history.rows[:] = [tuple(row) for row in saved[1]["history"]]
    for number in range(first, len(config.penalties)):
        if best.certificate.verdict == "certified" and number > 0:
            break
        energy.start_round(control, config.penalties[number])
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
    """Shorten the step until the energy falls enough (Armijo); None where the direction does not lead down.

    The next length is where the parabola through the values and the slope at 0 has its minimum, between a tenth and a
    half of the last (Nocedal and Wright, section 3.5).
    """
    slope = float((direction * point.gradient).sum())
    length = 1.0
    while slope < 0.0 and length > _SHORTEST_STEP:
        trial = _evaluate(point.control + length * direction, energy)
        rise = trial.total - point.total
        if rise <= 1e-4 * length * slope:
            return trial
        parabola = -slope * length / (2.0 * (rise - slope * length)) if math.isfinite(rise) else 0.1
        length *= min(max(parabola, 0.1), 0.5)
    return None


def _descend(
    control: Tensor, energy: SplineEnergy, number: int, history: History, progress: ProgressCallback
) -> Tensor:
    """One round of L-BFGS steps with sliding boundary parameters."""
    steps = energy.config.steps
    total_steps = steps * len(energy.config.penalties)
    started = time.perf_counter()
    point = _evaluate(control, energy)
    for step in range(steps):
        found = _line_search(point, energy.newton_direction(point.control, -point.gradient), energy)
        if found is None:
            _log.info("round %d: no descent after step %d", number, step)
            break
        gain = point.total - found.total
        for _ in range(_SLIDES):
            energy.surface.slide(found.control, 0.5 / control.shape[1])
        energy.surface.relax(_RELAXATIONS)
        point = replace(found, outer=energy.surface_part(found.control))
        done = number * steps + step + 1
        history.add("spline", done - 1, point.total, point.folded, {"surface": point.outer[0]})
        left = (time.perf_counter() - started) / (step + 1) * (total_steps - done)
        progress(Progress("spline", done, total_steps, point.total, point.folded, left))
        if gain < (energy.config.gain if number else energy.config.first_gain) * point.total:
            break
    return point.control


def _as_volume(control: Tensor, knots: Knots, degree: int) -> BSplineVolume:
    points = control.permute(1, 2, 3, 0).cpu().numpy()
    return BSplineVolume((degree,) * 3, knots, points)
