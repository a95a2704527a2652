"""Estimates the error of a solution from its residual (docs/solver.md)."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray, Mask
from parameterize.spline.interface import Interface
from parameterize.spline.volume import FACE_NAMES

from ..field import Points
from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.form import Form
from .error_norms import Errors, ratio
from .face_data import has_face
from .residual import INSIDE, Inside, OnFace, Solved, blocks, dot, mean, quadratic, residuals_of
from .smooth_parts import smooth_parts
from .space import TrialSpace
from .waves import Directions, Waves, wave_lengths
from .weak import WeakFace

OnRegions = tuple[WeakFace, TrialSpace, Array]  # terms on faces, with the space and the coefficients of their patches


def estimated_squares(
    patches: Sequence[Solved], interfaces: Sequence[Interface] = (), on_regions: Sequence[OnRegions] = ()
) -> Array:
    """Return the squared norms (3,) of the estimated error, of its energy norm, and of the solution.

    on_regions: the terms of conditions on regions of a body, with the solution's coefficients on their patches. They
    are those over the patches of this process; the squares of all processes are summed.
    """
    parts, glued = smooth_parts(patches, interfaces)
    waves = [Waves.of(residual, is_body=bool(glued)) for residual in residuals_of(parts)]
    own = [one for one in waves if one.residual.is_own]
    squares = chain(*map(_inside, own), *map(_on_outer_faces, own), _at_interfaces(waves, glued))
    return np.asarray(sum(chain(squares, map(_on_regions, on_regions) if glued else ()), np.zeros(3)))


def error_estimate(squares: Array, work: float | None = None, energy: float | None = None) -> Errors:
    """Return the estimated error from the squared norms (3,) of `estimated_squares`, over the whole body.

    energy: a(u_h, u_h) for a symmetric law, otherwise None. work: the same where given values are zero, otherwise None.
    With `work`, the work of the loads on the error is the square of its energy norm, and an equal share of u_h is added
    to the estimate: discrete bodies in bending are too stiff by that share.
    """
    square, energy_of_error, norm = squares.tolist()
    norm = math.sqrt(norm)
    soft = norm * energy_of_error / work if work is not None and work > 0.0 else 0.0
    l2 = math.hypot(math.sqrt(square), soft)
    size = math.sqrt(energy) if energy is not None and energy > 0.0 else 0.0
    return Errors(l2, ratio(l2, norm), energy_relative=ratio(math.sqrt(energy_of_error), size))


def why_not_estimated(spaces: Sequence[TrialSpace], problems: Sequence[BoundaryValueProblem]) -> str:
    """Return why the residual does not suffice for an estimate on patches; "" where it does."""
    if any(1 in space.degrees for space in spaces):
        return "degree 1 has too little of a residual inside"
    if any(space.whole is not space and space.is_only_continuous for space in spaces):
        return "several processes share a space that is only continuous"
    laws = {problem.in_volume: problem for problem in problems}.values()
    return next((why for law in laws if (why := law.not_differentiable or law.form.caveat)), "")


def _inside(waves: Waves) -> Iterator[Array]:
    """Yield the squared norms (3,) of the error, of its energy norm and of the solution, piece by piece."""
    counts = waves.residual.space.gauss_points
    for piece in waves.residual.inside():
        found = np.zeros(3)
        for oscillates, part in _parts(piece.residual, counts):
            found[:2] += (_on_body if waves.is_body else _on_cube)(part, oscillates, piece, waves, counts)
        found[2] = (piece.weights * piece.u**2).sum()
        yield found


def _on_cube(
    part: Array, oscillates: Directions, piece: Inside, waves: Waves, counts: Sequence[int]
) -> tuple[float, float]:
    """Return the squared norms of the error and of its energy norm from a part of the residual, by the least factor."""
    factor = _on_points(waves.factor(piece.spans, oscillates, piece.places, layer=piece.layer))
    answer = part / factor
    error = float(_integrals(answer**2, piece.weights, counts).sum())
    return error, float(_integrals(part * answer, piece.weights, counts).sum())


def _on_body(
    part: Array, oscillates: Directions, piece: Inside, waves: Waves, counts: Sequence[int]
) -> tuple[float, float]:
    """Return the squared norms of the error and of its energy norm from a part of the residual, by the law's matrix.

    Of the waves that make up a standing one the largest answer counts on each span.
    """
    weighted = blocks(piece.weights, counts) * part
    gram = np.array([[(one * other).sum(axis=INSIDE) for other in part] for one in weighted])
    gram = np.moveaxis(gram, (0, 1), (-2, -1))  # (k, s_u, s_v, s_w, c, c)
    error, work = np.zeros((2, *gram.shape[:-2]))
    for inverse in waves.inverses(piece.spans, oscillates, piece.places, layer=piece.layer):
        answer = inverse @ gram
        error = np.maximum(error, np.einsum("...ij,...ij->...", answer, inverse))
        work = np.maximum(work, np.einsum("...ii->...", answer))
    return float(error.sum()), float(work.sum())


@dataclass(frozen=True, eq=False)
class _Skin:
    """Hold how waves on a face decay into k patches behind it, (k, s_u, s_v, s_w) each.

    resistance: the flux through the face that belongs to a wave of size 1 on it. depth: the integral of the square of
    its decay along the normal.
    """

    resistance: Array
    depth: Array

    @classmethod
    def of(cls, waves: Waves, here: OnFace, oscillates: Directions) -> "_Skin":
        """Return the decay of waves that oscillate in some directions along a face.

        A wave with the factor S in the law decays like exp(-k t) along the normal, where k^2 times the factor of the
        normal's direction is S.
        """
        normal = here.spans.slopes[here.axis]
        size = np.sqrt(dot(normal, normal))
        across = _across(waves.problem.form, normal / size, here.spans.middle)
        factor = waves.factor(here.spans, oscillates, here.places, across=here.axis)
        return cls(np.sqrt(factor * across), np.minimum(0.5 * np.sqrt(across / factor), 1.0 / size))


def _on_outer_faces(waves: Waves) -> Iterator[Array]:
    """Yield the squared norms (3,) of the error and of its energy norm that come from data on whole outer faces."""
    patches = waves.residual.patches
    for face in FACE_NAMES:
        alike = defaultdict(list)
        for place, patch in enumerate(patches):
            if has_face(patch.space, face) and face not in patch.regions:
                alike[patch.problem.key_on(face)].append(place)
        for places in map(np.array, alike.values()):
            problem, here = patches[places[0]].problem, waves.residual.on_face(face, places)
            if face in problem.dirichlet:
                yield _held(waves, here, problem)
            elif waves.is_body:
                yield _given_flux(waves, here, problem)


def _held(waves: Waves, here: OnFace, problem: BoundaryValueProblem) -> Array:
    """Return the squared norms (3,) of the error inside that comes from given values of u outside of the space.

    A wave on a face, whose factor in the law is S, decays like exp(-k t) along the parameter t across the face, where
    k^2 times the factor of t's own direction is S.
    """
    across = quadratic(problem.form.tensor(here.spans.middle), here.spans.slopes[here.axis])
    total = 0.0
    for oscillates, part in _parts(problem.boundary_at(here.x, here.face) - here.u, here.counts):
        depth = 0.5 * np.sqrt(across / waves.factor(here.spans, oscillates, here.places, across=here.axis))
        squares = _integrals(part**2, here.volume, here.counts) * np.minimum(depth, 1.0)
        total += float(squares[here.has_area].sum())
    return np.array([total, 0.0, 0.0])


def _given_flux(waves: Waves, here: OnFace, problem: BoundaryValueProblem) -> Array:
    """Return the squared norms (3,) of the error and of its energy norm that come from a given flux on a face."""
    missing = -here.flux(problem.form)
    if not problem.conditions:  # a face without a part in any region has no flux
        alpha, given = problem.on_face(here.face, here.x, here.normal)
        missing += given if alpha is None else given - alpha * here.u
    total = np.zeros(3)
    for oscillates, part in _parts(missing, here.counts):
        skin = _Skin.of(waves, here, oscillates)
        total += _behind(_integrals(part**2, here.area, here.counts), skin.resistance, skin.depth, here.has_area)
    return total


def _at_interfaces(waves: Sequence[Waves], interfaces: Sequence[Interface]) -> Iterator[Array]:
    """Yield the squared norms (3,) of the error and of its energy norm that come from jumps of the flux.

    A process takes the interfaces whose first patch it owns.
    Interfaces of the same faces, in the same ways, of patches of the same two groups are taken at once.
    """
    where = {n: (own, i) for own in waves for i, n in enumerate(own.residual.numbers.tolist())}
    alike = defaultdict(list)
    for interface in (way for way in interfaces if where[way.first[0]][0].residual.is_own):
        (p, face_p), (q, face_q) = interface.first, interface.second
        key = id(where[p][0]), face_p, id(where[q][0]), face_q, interface.swapped, interface.flipped
        alike[key].append((where[p][1], where[q][1], interface))
    for members in alike.values():
        first, second, ways = zip(*members, strict=True)
        (p, face_p), (q, face_q) = ways[0].first, ways[0].second
        one, other = where[p][0], where[q][0]
        sides = (
            (own, own.residual.on_face(face, np.array(places)))
            for own, face, places in ((one, face_p, first), (other, face_q, second))
        )
        yield _jump(ways[0], *sides)


Side = tuple[Waves, OnFace]  # of several interfaces


def _jump(interface: Interface, one: Side, other: Side) -> Array:
    """Return the squared norms (3,) that come from the jumps of the flux at interfaces that differ in the patches."""
    (waves, first), (waves_q, second) = one, other

    def turned(array: Any) -> Any:
        flat = np.moveaxis(array.squeeze(second.axis - 3), (-2, -1), (0, 1))
        return np.expand_dims(np.moveaxis(interface.turned(flat), (0, 1), (-2, -1)), first.axis - 3)

    jump = -first.flux(waves.problem.form) - turned(second.flux(waves_q.problem.form))
    total = np.zeros(3)
    for oscillates, part in _parts(jump, first.counts):
        behind = [False] * 3
        for own, of_second, _ in interface.directions:
            behind[of_second] = oscillates[own]
        skin, skin_q = _Skin.of(waves, first, oscillates), _Skin.of(waves_q, second, behind)
        resistance, depth = skin.resistance + turned(skin_q.resistance), skin.depth + turned(skin_q.depth)
        has_area = first.has_area & turned(second.has_area)
        total += _behind(_integrals(part**2, first.area, first.counts), resistance, depth, has_area)
    return total


def _behind(squares: Array, resistance: Array, depth: Array, has_area: Mask) -> Array:
    """Return the squared norms (3,) of the error behind a face and of its energy norm, from a flux that is missing."""
    found = [(squares * depth / resistance**2)[has_area].sum(), (squares / resistance)[has_area].sum(), 0.0]
    return np.array(found)


def _on_regions(held: OnRegions) -> Array:
    """Return the squared norms (3,) of the error and of its energy norm that come from conditions on regions.

    A region covers parts of spans. What is left of its residual on a part of a span without its mean counts as the
    slowest of the waves along the face.
    """
    face, space, coefficients = held
    form, (u, flux) = face.form, face.traces(coefficients)
    free = np.eye(form.components)[:, :, None] - face.projector
    missing = face.loads - np.einsum("cdm,dm->cm", free, flux + face.initial) - np.einsum("cdm,dm->cm", face.factor, u)
    lack = face.values - np.einsum("cdm,dm->cm", face.projector, u)
    cells, one, other = _cells(space, face)
    across = _across(form, face.normal, face.x)
    waves = (one, other, one + other, one - other)
    factor = np.min([form.symbol(wave, face.x) for wave in waves], axis=0)
    depth, resistance = 0.5 * np.sqrt(across / factor), np.sqrt(factor * across)
    squares, lacking = (face.weights * _without_means(part, cells, face.weights) for part in (missing, lack))
    error = float((depth * (squares / resistance**2 + lacking)).sum())
    return np.array([error, float((squares / resistance).sum()), 0.0])


def _cells(space: TrialSpace, face: WeakFace) -> tuple[IntArray, Array, Array]:
    """Return the span (m,) of each point of faces, and the waves (3, m) of one period a span along the face."""
    cells, waves = face.owners, []
    for axis in (a for a in range(3) if a != face.axis):
        breaks, lengths = space.breaks[axis], wave_lengths(space.knots[axis], space.degrees[axis])
        span = np.clip(np.searchsorted(breaks, face.places[:, axis], side="right") - 1, 0, len(lengths) - 1)
        cells = cells * len(lengths) + span
        waves.append(2.0 * np.pi / lengths[span] * face.inverse[axis])
    return cells, waves[0], waves[1]


def _without_means(values: Array, cells: IntArray, weights: Array) -> Array:
    """Return the squares (m,), summed over components, of values (c, m) without their means over cells."""
    sizes = np.bincount(cells, weights)
    means = [np.bincount(cells, weights * row)[cells] / sizes[cells] for row in values]
    return np.asarray(((values - np.stack(means)) ** 2).sum(axis=0))


def _across(form: Form, normal: Array, x: Points) -> Array:
    """Return the least factor (...) by which the law multiplies waves along unit normals (3, ...), without reaction."""
    return np.asarray(np.linalg.eigvalsh(form.matrix_along(normal, x))[..., 0])


def _parts(residual: Array, counts: Sequence[int]) -> Iterator[tuple[Directions, Array]]:
    """Yield the parts of a residual (.., q_u, q_v, q_w) that are constant on a span in some directions only.

    Each part comes with the directions in which it oscillates with mean zero, never those with one point a span. The
    part that is constant in all directions is left out: it is almost zero for a Galerkin solution.
    """
    parts: dict[tuple[bool, ...], Array] = {(): blocks(residual, counts)}
    for axis, count in zip(INSIDE, counts, strict=True):
        means = {key: mean(part, axis) for key, part in parts.items()}
        rest = {(*key, True): part - means[key] for key, part in parts.items()} if count > 1 else {}
        parts = {(*key, False): own for key, own in means.items()} | rest
    del parts[False, False, False]
    yield from parts.items()


def _on_points(values: Array) -> Array:
    """Return values (k, s_u, s_v, s_w) of spans in the shape of blocks, with length 1 for the points."""
    return values[:, :, None, :, None, :, None]


def _integrals(field: Array, weights: Array, counts: Sequence[int]) -> Array:
    """Return the integrals (k, s_u, s_v, s_w) over spans of the sum over components of blocks (c, k, ...)."""
    found: Array = (blocks(weights, counts) * field).sum(axis=(0, *INSIDE))
    return found
