"""Computes the energy of a spline map in its control points: distortion, smoothness, boundary, penalties on det J.

Its second derivative, for Newton's method, is exact for the distortion wherever that is convex (the rotations turn with
J; local-global methods hold the rotations fixed, which makes slides along the surface slow), and is the Gauss-Newton
matrix for the penalties. The boundary term is quadratic for fixed parameters.
"""

from collections.abc import Iterable

import numpy as np

from ..arrays import Array, IntArray
from ..conjugate_gradients import conjugate_gradients
from ..quality.distortion import own_boxes
from ..spline.spline_map import ControlNets, SplineMap
from .anchors import Anchors
from .bending import Fairness
from .contact import ContactPenalty, contact_penalty
from .determinant_penalty import DeterminantPenalty
from .distortion import DistortionTerm
from .normals import AlignmentPenalty, alignment_penalty
from .operators import weighted_sum
from .preconditioner import Preconditioner
from .reassignment import faces_towards, reassign
from .spans import acting_on, with_neighbours
from .surface_distance import Correspondence
from .term import RoundWeights, Term, Weights

_REACH = 0.03  # while F grows, surface points farther from F than this do not slide, and draw F in all directions
_RELAXATIONS = 1  # sweeps over the triangles that these flipped: after every step, so that flips do not pile up
_TOLERANCE, _ITERATIONS = 0.1, 7  # of a Newton direction, relative and at most: a better one does not save steps
_MORE_ITERATIONS = 20  # at most, without the scaled preconditioner
_SMOOTH_TOLERANCE, _SMOOTH_ITERATIONS = 1e-8, 5000  # of `smoothed`, whose result is a map and no direction


class SplineEnergy:
    """Sum the terms of the energy, with the terms of the solid and the terms of the boundary in separate tuples.

    The terms of `inner` depend on the control points alone; the terms of `outer` also depend on the surface's
    parameters.

    One cube that has not grown starts near its map: its preconditioner is scaled, and points of the surface stay off
    places where F's boundary faces away. A bone that grew so ended 1.8 times as far.
    """

    def __init__(self, nets: ControlNets, surface: Correspondence, weights: Weights, *, grown: bool = False) -> None:
        self.surface, self.nets = surface, nets
        self.anchors = Anchors(surface)
        self._alignment: AlignmentPenalty | None = None
        self._contact: ContactPenalty | None = None
        self._approach: Correspondence | None = None
        self._weights, self._grows, self._near = weights, False, nets.is_single and not grown
        self._round = RoundWeights(0.0, weights.surface)
        self._measure_in(np.ones((len(nets.knots), 3)), np.zeros(int(nets.first_spans[-1])))

    def _measure_in(self, boxes: Array, span_weights: Array) -> None:
        """Make the terms of the solid, in which each block has the side lengths `boxes` (blocks, 3).

        span_weights: (m,), the weights of all spans in the penalty on det J.
        """
        nets = self.nets
        knots = tuple((u * a, v * b, w * c) for (u, v, w), (a, b, c) in zip(nets.knots, boxes, strict=True))
        self.surface.sliding.measure_in(boxes)
        self.distortion, self.fairness = DistortionTerm(nets, knots), Fairness(nets, knots, self._weights.fairness)
        self.determinants = DeterminantPenalty(nets, knots)
        self.determinants.weigh(span_weights)
        self.inner: tuple[Term, ...] = (self.distortion, self.fairness, self.determinants)
        self._precondition = Preconditioner(nets, self.fairness, self._round.surface, scaled=self._near)

    @property
    def outer(self) -> tuple[Term, ...]:
        """Return the terms of the boundary that are in effect at present."""
        if self._approach is not None:
            return (self._approach,)
        terms: tuple[Term | None, ...] = (self.surface, self.anchors, self._contact, self._alignment)
        return tuple(term for term in terms if term is not None)

    def start_round(
        self, control: Array, penalty: float, share: float | None = None, *, by_faces: bool = False
    ) -> None:
        """Set the weight of the penalty, the limit of the distortion and the floors of det J for the control points.

        share: the share of the weight of the surface's data while F grows into the solid; None where F does not grow.
        by_faces: whether the faces of F are drawn to the surface in this round, in place of the surface's data.
        """
        self._round = RoundWeights(penalty, self._weights.surface * (1.0 if share is None else share))
        if not self.nets.is_single:
            self._measure_in(own_boxes(SplineMap(self.nets, control).body), self.determinants.weights)
            reassign(self.surface, control, first=by_faces)
            self._approach = faces_towards(self.surface, control) if by_faces else None
        self.distortion.start_round(control, penalty)
        if self._weights.least_floor < 1.0:
            self.determinants.lower_floors(self.distortion.lower_floors(control, self._weights.least_floor))
        if not self.nets.is_single or (share is None and not self._grows):
            return
        self._grows = share is not None
        self._precondition = Preconditioner(self.nets, self.fairness, self._round.surface, scaled=self._near)
        reach = _REACH if self._grows else np.inf
        self.surface.hold(np.linalg.norm(self.surface.residuals(control), axis=1) > reach)

    def watch_alignment(self, control: Array) -> None:
        """Penalise, from now on, the places where the normal of F's boundary hardly agrees with the mesh at `control`.

        While F grows there is no such penalty, because F is too far from the mesh for the normals to be compared.
        """
        self._alignment = None if self._grows else alignment_penalty(self.surface, control)

    def watch_contact(self, control: Array) -> IntArray:
        """Penalise, from now on, contact between sheets of F's boundary at `control`; return the spans in contact.

        The spans have the shape (k, 4).
        """
        self._contact = contact_penalty(SplineMap(self.nets, control))
        return self._contact.spans

    def slide(self, control: Array) -> None:
        """Let the surface's parameters slide towards their closest points, and penalise wrong normals of F there."""
        if self._approach is not None:
            return
        sliding = self.surface.sliding
        goals = self.surface.points, self.surface.normals if self._near else None
        if self._grows:
            sliding.slide(control, *goals, keep_layout=True, reach=_REACH)
        else:
            sliding.slide(control, *goals)
            sliding.relax(_RELAXATIONS)
        self.watch_alignment(control)
        if self._contact is not None:
            self._contact = contact_penalty(SplineMap(self.nets, control), near=self._contact.near)

    def relax(self, spans: IntArray, factor: float) -> None:
        """Multiply by `factor` the weights of the boundary data in and next to the spans (k, 4) of the map."""
        for fit in (self.surface, self.anchors):
            fit.relax(np.where(fit.sliding.near_spans(spans), factor, 1.0) * fit.relaxation)

    @property
    def yields(self) -> bool:
        """Return whether some of the boundary data have less than their whole weight."""
        return any(bool((fit.relaxation < 1.0).any()) for fit in (self.surface, self.anchors))

    def take_back(self, factor: float) -> None:
        """Divide the factors that `relax` has applied by `factor`; a factor becomes 1 at most."""
        for fit in (self.surface, self.anchors):
            fit.relax(np.minimum(fit.relaxation / factor, 1.0))

    def volume_part(self, control: Array) -> tuple[float, Array, int]:
        """Return the energy of the solid's terms, its gradient (3, n), and the number of folded points.

        The points are those of the distortion's quadrature.
        """
        return *self._sum(self.inner, control), self.distortion.folded

    def surface_part(self, control: Array) -> tuple[float, Array]:
        """Return the energy of the boundary's terms at the present parameters, and its gradient (3, n)."""
        return self._sum(self.outer, control)

    def _sum(self, terms: Iterable[Term], control: Array) -> tuple[float, Array]:
        energy, gradient = 0.0, np.zeros_like(control)
        for term in terms:
            weight, (value, slope) = term.weight(self._round), term.energy_and_gradient(control)
            energy += weight * value
            gradient += weight * slope
        return energy, self.nets.merged(gradient)

    def smoothed(self, control: Array, spans: IntArray) -> Array:
        """Return control points that bend F least in and next to the spans (k, 4); all other control points stay.

        Unlike the penalty on det J, this does not depend on which side of a fold has the wrong orientation.
        """
        free = acting_on(with_neighbours(spans, self.nets), self.nets)
        moved = conjugate_gradients(
            lambda x: self.nets.merged(self.fairness.bend(x) * free),
            -self.nets.merged(self.fairness.bend(control) * free),
            lambda x: x,
            tolerance=_SMOOTH_TOLERANCE,
            max_iterations=_SMOOTH_ITERATIONS,
        ).x
        return control + moved

    def newton_direction(self, control: Array, right: Array, damping: float = 0.0) -> Array:
        """Return an approximate solution of (Hessian + damping) x = right at `control`, with fixed parameters."""
        self.distortion.damp(damping)
        terms = [(term.weight(self._round), term.curvature(control)) for term in (*self.inner, *self.outer)]
        operator, residual = weighted_sum(terms), right.astype(np.float32)
        if self._near:
            self._precondition.scale(operator.diagonal(residual))
        direction = conjugate_gradients(
            lambda x: self.nets.merged(operator(x)),
            residual,
            self._precondition,
            tolerance=_TOLERANCE,
            max_iterations=_ITERATIONS if self._near else _MORE_ITERATIONS,
        ).x
        return np.asarray(direction, dtype=np.float64)
