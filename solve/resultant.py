"""Adds up forces and their moments, from forces at points and from the coefficients' parts of integrals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import collocation, greville

from .discretization.space import TrialSpace
from .patch_system import PatchSystem


@dataclass(frozen=True)
class Resultants:
    """Add up vectors of c components, and their moments about the origin where `has_moments`: c = 3."""

    components: int
    has_moments: bool

    @property
    def none(self) -> Array:
        """Return the resultant (c,), or (6,) of force and moment, of nothing."""
        return np.zeros(6 if self.has_moments else self.components)

    def of(self, forces: Array, places: Array | None) -> Array:
        """Return the resultant of forces (c, ...) at places (3, ...)."""
        flat = forces.reshape(len(forces), -1)
        if not self.has_moments:
            return np.asarray(flat.sum(axis=1))
        assert places is not None
        x, y, z = np.asarray(places).reshape(3, -1)
        a, b, c = flat
        moment = [(y * c - z * b).sum(), (z * a - x * c).sum(), (x * b - y * a).sum()]
        return np.concatenate([flat.sum(axis=1), moment])

    def places(self, patches: Sequence[PatchSystem]) -> list[Array | None]:
        """Return for each patch the coefficients (3, n_u, n_v, n_w) of the position in its trial space.

        A test function that is a turn of the body has the coefficients axis x position. Where the space does not
        contain the position, as that of a rational map, it is interpolated.
        """
        if not self.has_moments:
            return [None] * len(patches)
        known: dict[int, tuple[list[Array], list[Array]]] = {}
        return [_places(patch, known) for patch in patches]


def _places(patch: PatchSystem, known: dict[int, tuple[list[Array], list[Array]]]) -> Array:
    if id(patch.space) not in known:
        known[id(patch.space)] = _interpolation(patch.space)
    points, matrices = known[id(patch.space)]
    u, v, w = points
    a, b, c = matrices
    grid = patch.volume.grid(u, v, w)
    return np.asarray(np.einsum("ai,bj,ck,ijkd->dabc", a, b, c, grid, optimize=True))


def _interpolation(space: TrialSpace) -> tuple[list[Array], list[Array]]:
    """Return for each direction the Greville points, and the matrix from values there to coefficients."""
    points = [greville(knots, degree) for knots, degree in zip(space.knots, space.degrees, strict=True)]
    each = zip(space.knots, space.degrees, points, strict=True)
    return points, [np.linalg.inv(collocation(knots, degree, own).toarray()) for knots, degree, own in each]
