"""The energy of a spline map in its control points: distortion, smoothness, boundary, penalties on det J.

Its second derivative, for Newton's method, is exact for the distortion wherever that is convex (the rotations turn with
J: holding them still, as local-global methods do, makes sliding along the surface slow), and Gauss-Newton for the
penalties. The boundary term is quadratic with its parameters held.
"""

import numpy as np

from ..arrays import Array, IntArray, Knots
from ..config import SplineConfig
from .bending import bending_operator, grams
from .contact import ContactPenalty, contact_penalty
from .determinant_penalty import SpanBarrier, acting_on, with_neighbours
from .distortion import DistortionEnergy
from .edge_attraction import EdgeAnchors
from .normals import FacingPenalty, facing_penalty
from .operators import conjugate_gradients, weighted_sum
from .surface_distance import SurfaceFit
from .tensor_product import FastDiagonalization

_REACH = 0.03  # while F grows, surface points farther from F than this do not slide, and draw F in all directions


class SplineEnergy:
    """Distortion, fairness, boundary, and the penalties on det J at Gauss points and in Bernstein form."""

    def __init__(self, config: SplineConfig, knots: Knots, surface: SurfaceFit) -> None:
        self.config, self.surface = config, surface
        self.anchors = EdgeAnchors(surface, config)
        self._facing: FacingPenalty | None = None
        self._contact: ContactPenalty | None = None
        self._knots = knots
        self.penalty, self.vertex = 0.0, config.vertex
        self._grows = False
        self._distortion = DistortionEnergy(knots, config)
        self._grams = grams(knots, (config.degree,) * 3)
        self._bending, self._rough_bending = (
            bending_operator(self._grams, 2.0 * config.fairness, dtype) for dtype in (np.float64, np.float32)
        )
        self.barrier = SpanBarrier(knots, config.degree, config.min_coefficient)
        self._precondition = self._preconditioner()

    def _preconditioner(self) -> FastDiagonalization:
        config, (mass, slope, curve) = self.config, self._grams
        rough = tuple(2.0 * k + 2.0 * config.fairness * h for k, h in zip(slope, curve, strict=True))
        for matrix in rough:
            matrix[[0, -1], [0, -1]] += config.pull * self.vertex / 6.0  # the points spread over six faces
        return FastDiagonalization(rough, mass).in_single()

    def start_round(self, control: Array, penalty: float, share: float | None = None) -> None:
        """Take a penalty weight, and the limit of the distortion and the floors of det J that suit the control points.

        share: while F grows into the solid, that of the weight of the surface's data.
        """
        self.penalty = penalty
        self._distortion.set_limit(control)
        if self.config.least_floor < 1.0:
            self.barrier.lower_floors(self._distortion.lower_floors(control))
        if share is None and not self._grows:
            return
        self._grows = share is not None
        self.vertex = self.config.vertex * (1.0 if share is None else share)
        self._precondition = self._preconditioner()
        reach = _REACH if self._grows else np.inf
        self.surface.hold(np.linalg.norm(self.surface.residuals(control), axis=1) > reach)

    def watch_facing(self, control: Array) -> None:
        """Penalise, from now on, the places of F's boundary that hardly face the way the mesh does at `control`."""
        if self._grows:  # F is too far away for that to mean something
            self._facing = None
            return
        self._facing = facing_penalty(self.surface, control, self.config.min_facing, self.config.facing_margin)

    def watch_contact(self, control: Array) -> IntArray:
        """Push apart, from now on, the sheets of F's boundary that hardly are at `control`; return their spans."""
        self._contact = self._contact_at(control)
        return self._contact.spans

    def _contact_at(self, control: Array, near: IntArray | None = None) -> ContactPenalty:
        return contact_penalty(self._knots, self.config.degree, control, self.config.gap, near)

    def slide(self, control: Array) -> None:
        """Let the surface's parameters slide towards their closest points, and watch how F faces there."""
        places, points, longest = self.surface.places, self.surface.points, 0.5 / max(control.shape[1:])
        if self._grows:
            places.slide(control, points, longest, keep_layout=True, reach=_REACH)
        else:
            for _ in range(self.config.slides):
                places.slide(control, points, longest)
            places.relax(self.config.relaxations)
        self.watch_facing(control)
        if self._contact is not None:
            self._contact = self._contact_at(control, self._contact.near)

    def give_way(self, spans: IntArray, factor: float) -> None:
        """Multiply the weights of boundary data in and next to spans (k, 3) of the map by `factor`."""
        for fit in (self.surface, self.anchors.fit):
            fit.give_way(np.where(fit.places.near_spans(spans), factor, 1.0) * fit.yielding)

    @property
    def yields(self) -> bool:
        """Whether some boundary data has less than its whole weight."""
        return any(bool((fit.yielding < 1.0).any()) for fit in (self.surface, self.anchors.fit))

    def take_back(self, factor: float) -> None:
        """Divide by `factor` what such factors have become, up to 1."""
        for fit in (self.surface, self.anchors.fit):
            fit.give_way(np.minimum(fit.yielding / factor, 1.0))

    def volume_part(self, control: Array) -> tuple[float, Array, int]:
        """Distortion, fairness and barrier: energy, gradient, folded quadrature points."""
        arap, gradient, folded = self._distortion.energy_and_gradient(control, self.penalty)
        shortfall, push = self.barrier.energy_and_gradient(control)
        bent = self._bending(control)
        energy = arap + 0.5 * float(np.vdot(bent, control)) + self.penalty * shortfall
        return energy, gradient + bent + self.penalty * push, folded

    def surface_part(self, control: Array) -> tuple[float, Array]:
        """Return the boundary terms at the present parameters: energy and gradient."""
        config = self.config
        off, pull = self.surface.energy_and_gradient(control)
        off_edges, pull_edges = self.anchors.fit.energy_and_gradient(control)
        energy = self.vertex * (off + config.anchors * off_edges)
        gradient = self.vertex * (pull + config.anchors * pull_edges)
        if self._contact is not None:
            overlap, apart = self._contact.energy_and_gradient(control)
            energy += config.vertex * config.contact * overlap
            gradient += config.vertex * config.contact * apart
        if self._facing is None:
            return energy, gradient
        turned, push = self._facing.energy_and_gradient(control)
        return energy + self.penalty * turned, gradient + self.penalty * push

    def smoothed(self, control: Array, spans: IntArray) -> Array:
        """Bend F as little as possible in and next to spans (k, 3): return the control points, the others held.

        Which side is folded over which plays no part in this, as it does where det J is penalised.
        """
        near = with_neighbours(spans, self.barrier.weights.shape)
        free = acting_on(near, self.config.degree)
        moved, _ = conjugate_gradients(
            lambda x: self._bending(x) * free,
            -(self._bending(control) * free),
            lambda x: x,
            tolerance=self.config.smoothing_tolerance,
            max_iterations=self.config.smoothing_iterations,
        )
        return control + moved

    def newton_direction(self, control: Array, right: Array, damping: float = 0.0) -> Array:
        """Solve roughly (Hessian + damping) x = right at `control`, the parameters of the surface held."""
        config = self.config
        surface, anchors = self.surface.hessian(), self.anchors.fit.hessian()
        distortion = self._distortion.curvature(control, self.penalty, damping)
        barrier = self.barrier.curvature(control)
        terms = [
            (1.0, distortion),
            (1.0, self._rough_bending),
            (self.penalty, barrier),
            (self.vertex, surface),
            (self.vertex * config.anchors, anchors),
        ]
        if self._facing is not None:
            terms.append((self.penalty, self._facing.curvature(control)))
        if self._contact is not None:
            terms.append((config.vertex * config.contact, self._contact.curvature(control)))
        direction, _ = conjugate_gradients(
            weighted_sum(terms),
            right.astype(np.float32),
            self._precondition,
            tolerance=config.tolerance,
            max_iterations=config.iterations,
        )
        return direction.astype(np.float64)
