"""Finds the rigid motions of a body: the affine functions that take no energy, and that no support holds.

They are known before anything is solved: of an elastic body six a part, of a scalar law one, less what its supports
hold. That is seen at the supports' points, so that a spring of any strength holds as a wall does, and no threshold on
eigenvalues tells a rigid motion from a slow vibration.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array, Mask
from parameterize.spline.body import all_control_points, as_body, size_of
from parameterize.spline.bspline import greville, interpolate_grid

from .discretization.coupling import Coupling
from .discretization.face_data import FaceRule
from .discretization.operator import FaceTerm
from .discretization.quadrature import gauss_rule, map_planes
from .discretization.weak import WeakFace
from .field import Points
from .forms.form import reaction
from .patch_system import PatchSystem
from .system import System

SAMPLES = np.array([0.07, 0.35, 0.62, 0.91])  # parameters a direction at which the law is asked for its fluxes
NO_FLUX = 1e-12  # share of the largest flux of an affine function, up to which another one has none
AT_REST = 1e-10  # share of the largest motion of the supports' points, up to which another one leaves them at rest
SLIDES = 1e-5  # sine of the angle to a support, up to which a motion slides along it: faces of files are not exact

Support = tuple[Array, Array]  # the motions of some points, and what of them is held: rows (m, k)


def rigid_motions(system: System) -> Array:
    """Return the coefficients (N, k) of the motions that take no energy.

    Where the trial space does not contain them, as that of a rational map, or of a degree below the map's, they are
    interpolated.
    """
    fixed = [full[0] == 0.0 for full in system.unknowns.spread(np.ones((1, *system.unknowns.shape)))]
    found = []
    for part in as_body(system.body).parts:
        motions = _without_energy([system.patches[i] for i in part])
        supports = [one for i in part for one in _supports(system.patches[i], fixed[i], motions)]
        supports += [one for face in system.matrix.faces for one in _on_faces(face, part, motions)]
        supports += [_by_coupling(one, motions) for one in system.matrix.couplings if one.is_within(part)]
        free = motions.combined(_unheld(supports)) if supports and motions.count else motions
        parts = [np.zeros((free.count, *patch.loads.shape)) for patch in system.patches]
        for i in part:
            parts[i] = free.coefficients(system.patches[i])
        found += [system.unknowns.chosen(each).ravel() for each in zip(*parts, strict=True)]
    return np.stack(found, axis=1) if found else np.zeros((system.right.size, 0))


@dataclass(frozen=True, eq=False)
class Affine:
    """Hold k functions a + B X of c components; X are the coordinates from a part's middle, over its size.

    table: (k, c, 4), a and then B. middle: (3,).
    """

    table: Array
    middle: Array
    size: float

    @property
    def count(self) -> int:
        """Return k."""
        return len(self.table)

    def combined(self, weights: Array) -> "Affine":
        """Return m sums of the functions with weights (k, m)."""
        return replace(self, table=np.tensordot(weights, self.table, (0, 0)))

    def __call__(self, x: Array) -> Array:
        """Return the values (k, c, ...) at points x (3, ...)."""
        place = np.moveaxis((np.moveaxis(np.asarray(x), 0, -1) - self.middle) / self.size, -1, 0)
        return np.tensordot(self.table, np.concatenate([np.ones((1, *x.shape[1:])), place]), (2, 0))

    def fluxes(self, patch: PatchSystem) -> Array:
        """Return the law's fluxes at some points of a patch, in rows (m, k); the largest of a point is 1."""
        x = Points.on(patch.volume, SAMPLES, SAMPLES, SAMPLES)
        slopes = self.table[:, :, 1:, None, None, None] * np.full(x.shape[1:], 1.0 / self.size)
        each = zip(self(x), slopes, strict=True)
        found = np.stack([np.asarray(patch.problem.form.flux(u, grad, x), dtype=np.float64) for u, grad in each])
        largest = np.abs(found).max(axis=(0, 1, 2))
        return (found / np.where(largest > 0.0, largest, 1.0)).reshape(self.count, -1).T

    def coefficients(self, patch: PatchSystem) -> Array:
        """Return the coefficients (k, c, n_u, n_v, n_w) of the functions in a patch's trial space."""
        space = patch.space
        u, v, w = (greville(knots, degree) for knots, degree in zip(space.knots, space.degrees, strict=True))
        values = self(Points.on(patch.volume, u, v, w))
        for axis, (knots, degree) in enumerate(zip(space.knots, space.degrees, strict=True), 2):
            values = np.moveaxis(interpolate_grid([knots], degree, np.moveaxis(values, axis, 0)), 0, axis)
        return values


def _without_energy(patches: Sequence[PatchSystem]) -> Affine:
    """Return the affine functions on a part of a body that have no flux."""
    volumes, c = [patch.volume for patch in patches], patches[0].problem.form.components
    points = all_control_points(volumes)
    # one component resists every gradient (the Legendre-Hadamard condition), and constants alone are left
    table = np.eye(4)[:1, None] if c == 1 else np.eye(4 * c).reshape(-1, c, 4)
    every = Affine(table, 0.5 * (points.min(axis=0) + points.max(axis=0)), size_of(volumes))
    _, values, vectors = np.linalg.svd(_reduced(every.fluxes(patch) for patch in patches))
    return every.combined(vectors[values <= NO_FLUX * values[0]].T)


def _supports(patch: PatchSystem, fixed: Mask, motions: Affine) -> Iterator[Support]:
    """Yield what holds motions on a patch: fixed coefficients and a reaction, as `_unheld` takes it.

    fixed: (n_u, n_v, n_w), whether a coefficient is fixed.
    """
    if fixed.any():
        moves = motions.coefficients(patch)[:, :, fixed]
        yield _rows(moves), _rows(moves)
    if patch.problem.form.has_reaction:
        for _, _, x in map_planes(patch.volume, gauss_rule(patch.space)):
            yield _by_reaction(patch, x, motions(x))


def _on_faces(face: FaceTerm, part: Sequence[int], motions: Affine) -> Iterator[Support]:
    """Yield what terms on faces of a part, patches by their numbers, hold of motions."""
    own = np.isin(face.patches, part)
    if isinstance(face, WeakFace):
        yield _by_region(face, own[face.owners], motions(np.asarray(face.x)))
    elif isinstance(face, FaceRule):  # Robin's term, with its factor in the measure
        moves = motions(face.points)[..., (face.measure > 0.0) & own[:, None, None]]
        yield _rows(moves), _rows(moves)


def _by_coupling(coupling: Coupling, motions: Affine) -> Support:
    """Return what a coupling of regions holds."""
    moves, held = coupling.moves(motions)
    return _rows(moves), _rows(held)


def _by_region(face: WeakFace, own: Mask, moves: Array) -> Support:
    """Return the support of own points (m,) of faces with regions; moves (k, c, m)."""
    held = np.einsum("cdm,kdm->kcm", face.holding, moves)
    here = own & ((np.einsum("ccm->m", face.projector) > 0.5) | face.is_sprung)
    return _rows(moves[..., here]), _rows(held[..., here])


def _by_reaction(patch: PatchSystem, x: Points, moves: Array) -> Support:
    """Return the support of a law's reaction at points (3, ...), for moves (k, c, ...)."""
    form = patch.problem.form
    none = np.zeros((form.components, 3, *x.shape[1:]))
    answers = np.stack([reaction(form, move, none, x) for move in moves])
    largest = np.abs(answers).max(axis=(0, 1), initial=0.0)
    held = answers / np.where(largest > 0.0, largest, 1.0)
    return _rows(moves[..., largest > 0.0]), _rows(held[..., largest > 0.0])


def _rows(moves: Array) -> Array:
    """Return moves (k, ...) as rows (m, k)."""
    return moves.reshape(len(moves), -1).T


def _reduced(rows: Iterator[Array]) -> Array:
    """Return the triangle (k, k) that has the same singular values and right vectors as rows (m, k) of all."""
    found = np.concatenate(list(rows))
    return np.asarray(np.linalg.qr(np.concatenate([found, np.zeros((found.shape[1],) * 2)]), mode="r"))


def _unheld(supports: Sequence[Support]) -> Array:
    """Return the weights (k, m) of the motions that supports do not hold: they leave them at rest, or slide along."""
    _, sizes, vectors = np.linalg.svd(_reduced(iter(moves for moves, _ in supports)))
    moving = sizes > AT_REST * sizes.max(initial=0.0)
    scaled = vectors[moving].T / sizes[moving]
    _, shares, turned = np.linalg.svd(_reduced(iter(held for _, held in supports)) @ scaled)
    return np.concatenate([vectors[~moving].T, scaled @ turned[shares <= SLIDES].T], axis=1)
