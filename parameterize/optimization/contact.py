"""Penalises parts of F's boundary that run into one another, or nearly so.

Det J > 0 everywhere does not keep two sheets of the boundary apart: the walls of a narrow valley may pass through one
another. A sample of the boundary lies in another sheet where the boundary winds around the point just outside of the
sample. The other sheet is that of the nearest sample with the opposite normal, and the penalty pushes the two samples
apart along the normal there, as in contact mechanics (node to surface, Wriggers, Computational Contact Mechanics, 2006,
chapter 6).
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from ..arrays import Array, Floats, IntArray
from ..spline.sampled_boundary import SampledBoundary
from ..spline.spline_map import SplineMap
from ..surface.geometry import vertex_normals
from ..surface.solid import Solid
from .operators import ControlRows, PiecewiseOperator
from .sliding import SlidingParameters
from .term import RoundWeights

_GAP = 1e-3  # between sheets, in a domain of volume 1: the check of the boundary proves such a gap
_WEIGHT = 10.0  # times that of the distance from the surface, whose data hold the sheets where they are
_SAMPLES = 110  # a direction and face of one cube
_CANDIDATES = 256  # nearest samples among which one that faces the opposite way is looked for
_OPPOSITE = -0.5  # cosine of the angle between the normals of opposite samples, at most
_CROSSES = 0.3  # the same of samples on different blocks
_CHUNK = 4096  # samples at a time, which take some 40 MB
_REACH = 0.05  # distance from a contact, in a domain of volume 1, within which a round's steps look for others


@dataclass(frozen=True, eq=False)
class ContactPenalty:
    """Compute the mean over the boundary's samples of (gap - (F(p) - F(q)) . n)_+^2, with k samples p in contact.

    first, second: the rows that yield F(p) and F(q). normals: (k, 3), the outward normals of the boundary at q. share:
    the weight of one sample in the mean. spans: (2 k, 4), the spans of p and q. near: (m,), the samples that may come
    into contact during a few more Newton steps.
    """

    first: ControlRows
    second: ControlRows
    normals: Floats
    share: float
    gap: float
    spans: IntArray
    near: IntArray

    def weight(self, weights: RoundWeights) -> float:
        """Return the weight of the penalty, a multiple of the weight of the surface's data."""
        return _WEIGHT * weights.surface

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the penalty at control points (3, n), and its gradient of the same shape."""
        shortfall = np.maximum(self.gap - self.distances(control), 0.0)
        return self.share * float((shortfall**2).sum()), self._pull(-2.0 * self.share * shortfall, control)

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the second derivative at `control` as an operator in single precision."""
        scale = 2.0 * self.share * (self.distances(control) < self.gap).astype(np.float32)
        first, second = self.first.in_single(), self.second.in_single()
        single = replace(self, first=first, second=second, normals=self.normals.astype(np.float32))

        def product(x: Floats) -> Floats:
            return single._pull(scale * single.distances(x), x)

        metric = scale[:, None, None] * single.normals[:, :, None] * single.normals[:, None, :]
        return PiecewiseOperator(
            [product],
            lambda parts, _: parts[0],
            lambda like: first.diagonal(metric, like) + second.diagonal(metric, like),
        )

    def distances(self, control: Floats) -> Floats:
        """Return the distances (F(p) - F(q)) . n, (k,); a distance is negative where p lies behind the sheet of q."""
        return ((self.first(control) - self.second(control)) * self.normals).sum(axis=1)

    def _pull(self, factor: Floats, like: Floats) -> Floats:
        along = factor[:, None] * self.normals
        return self.first.adjoint(along, like) - self.second.adjoint(along, like)


def contact_penalty(spline: SplineMap, gap: float = _GAP, near: IntArray | None = None) -> ContactPenalty:
    """Return the penalty for the boundary of a map; the penalty is empty where no two sheets are near each other.

    gap: the least distance between two sheets, in units of the map's control points. near: the only samples to be
    examined, from a penalty a few steps before; the examination of all samples takes longer than a Newton step.
    """
    boundary = _sampled(spline)
    normals = vertex_normals(boundary.points, boundary.triangles)
    asked = np.arange(len(boundary.points)) if near is None else near
    touching = asked
    if len(asked):
        outside = boundary.points[asked] + gap * normals[asked]  # just outside, yet the boundary may wind around it
        touching = asked[Solid(boundary.points, boundary.triangles).contains(outside)]
    near = _around(boundary.points, touching) if near is None else near
    touching, facing = _facing_samples(boundary.points, normals, boundary.patches, touching)
    first, second = (
        SlidingParameters(spline.nets, boundary.parameters[chosen], boundary.sample_faces[chosen])
        for chosen in (touching, facing)
    )
    return ContactPenalty(
        first.window.rows(0, 0),
        second.window.rows(0, 0),
        normals[facing],
        1.0 / len(boundary.points),
        gap,
        np.concatenate([first.spans(), second.spans()]),
        near,
    )


def _sampled(spline: SplineMap) -> SampledBoundary:
    """Return samples of the boundary: as many on each face of one cube, a few in each span of several blocks."""
    if spline.nets.is_single:
        return SampledBoundary.on(spline.volume, *[np.linspace(0.0, 1.0, _SAMPLES)] * 3)
    return SampledBoundary.of(spline.body, samples=2)


def _around(points: Array, touching: IntArray) -> IntArray:
    """Return the numbers (m,) of the points within the distance _REACH of a touching point."""
    if not touching.size:
        return touching
    return np.flatnonzero(np.isfinite(cKDTree(points[touching]).query(points, distance_upper_bound=_REACH)[0]))


def _facing_samples(points: Array, normals: Array, blocks: IntArray, touching: IntArray) -> tuple[IntArray, IntArray]:
    """Return the samples of `touching` that have an opposite sample near them, and the nearest opposite one: (k,) each.

    Two samples are opposite where their normals point in opposite directions; on different blocks, also where these are
    nearly perpendicular, as on both sides of an edge from which two rods leave a junction.
    """
    tree, nearest = cKDTree(points), np.full(len(touching), -1)
    for start in range(0, len(touching), _CHUNK):
        chunk = slice(start, start + _CHUNK)
        near = np.asarray(tree.query(points[touching[chunk]], k=_CANDIDATES)[1])  # (k, candidates), nearest first
        cosines = np.einsum("kc,knc->kn", normals[touching[chunk]], normals[near])
        other = blocks[near] != blocks[touching[chunk], None]
        opposite = cosines < np.where(other, _CROSSES, _OPPOSITE)
        first = near[np.arange(len(near)), opposite.argmax(axis=1)]
        nearest[chunk] = np.where(opposite.any(axis=1), first, -1)
    found = nearest >= 0
    return touching[found], nearest[found]
