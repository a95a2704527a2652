"""Estimates what the distance between a spline's boundary and the true surface changes in a quantity.

The derivative of a quantity J along a motion of the boundary with the normal speed V_n is an integral over it, of V_n
times a density that follows from u and its adjoint z (Sokolowski, Zolesio, *Introduction to Shape Optimization*, 1992,
section 3.3). With the given flux t and u = g along the directions of a projector P,

    density = (f - react(u)) . (1 - P) z - flux(u) : (1 - P) grad z + (d/dn + H) (t . z) + flux(z) n . P d(u - g)/dn,

H the sum of the principal curvatures. A pressure p, whose direction turns with the surface, has - div(p z) in place of
the third term. To first order the distance changes J by the integral of the density times V_n.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Protocol, runtime_checkable

import numpy as np

from parameterize.arrays import Array

from ..field import BodyField
from ..solution import Solution
from .boundary import BoundaryPiece, Values, pieces_of

Density = Callable[[BoundaryPiece, Values], Array]


@runtime_checkable
class TrueSurface(Protocol):
    """Describe the surface that the boundary of a spline approximates."""

    def offsets(self, points: Array, normals: Array) -> Array:
        """Return how far (m,) the surface lies from points (m, 3), along their outward unit normals (m, 3)."""


@dataclass(frozen=True)
class GeometryPart:
    """Hold what the distance to the true surface changes in a quantity.

    change: J on the true body minus J on the spline's, to first order. spread: the root of the sum over the spans of
    the boundary of the squares of what each changes: it is large where large changes cancel, as around a place on the
    boundary. distance: the largest one along a normal. wider: a factor of the part.
    """

    change: float
    spread: float
    distance: float
    wider: float = 1.0

    @property
    def part(self) -> float:
        """Return half of the width that the distance gives an interval.

        On a hollow cylinder the change was right to 10 %; the sum without signs was up to 50 times as large.
        """
        return self.wider * hypot(self.change, self.spread)


def geometry_parts(
    solution: Solution, adjoints: Sequence[BodyField], surface: TrueSurface, more: Sequence[Density] = ()
) -> list[GeometryPart]:
    """Return what the distance to a surface changes in the quantity of each adjoint.

    more: for each quantity the density of its own change, with the solution as it is; by default there is none.
    """
    changes, squares, distance = np.zeros(len(adjoints)), np.zeros(len(adjoints)), 0.0
    for piece in pieces_of(solution, adjoints):
        offset = surface.offsets(np.ascontiguousarray(piece.x.T), np.ascontiguousarray(piece.normal.T))
        distance = max(distance, float(np.abs(offset).max()))
        for number, z in enumerate(piece.z):
            slope = density(piece, z) + (more[number](piece, z) if more else 0.0)
            each = np.bincount(piece.elements, piece.weights * offset * slope)
            changes[number] += each.sum()
            squares[number] += each @ each
    rows = zip(changes.tolist(), np.sqrt(squares).tolist(), strict=True)
    return [GeometryPart(change, spread, distance) for change, spread in rows]


def density(piece: BoundaryPiece, z: Values) -> Array:
    """Return the derivative (m,) of an adjoint's quantity by a shift of the boundary along the normal, per area."""
    u, given, normal = piece.u, piece.given, piece.normal
    free = np.eye(len(u.u))[:, :, None] - given.projector
    slope_u, slope_z = (np.einsum("cam,am->cm", own.grad, normal) for own in (u, z))
    z_free, grad_free = np.einsum("cdm,dm->cm", free, z.u), np.einsum("cdm,dam->cam", free, z.grad)
    found = ((piece.source - u.reaction) * z_free).sum(axis=0) - (u.flux * grad_free).sum(axis=(0, 1))
    pull = np.einsum("cam,am->cm", z.flux, normal)
    found += np.einsum("cm,cdm,dm->m", pull, given.projector, slope_u) - (pull * given.value_slope).sum(axis=0)
    return found + _of_fluxes(piece, z, slope_u, slope_z)


def _of_fluxes(piece: BoundaryPiece, z: Values, slope_u: Array, slope_z: Array) -> Array:
    """Return the part (m,) of given fluxes and exchanges."""
    given, is_pressed = piece.given, piece.given.pressure.any()
    flux = given.loads - np.einsum("cdm,dm->cm", given.factor, piece.u.u)
    steeper = given.load_slope - np.einsum("cdm,dm->cm", given.factor_slope, piece.u.u)
    steeper = steeper - np.einsum("cdm,dm->cm", given.factor, slope_u)
    if is_pressed:  # its direction turns with the surface
        flux = flux + given.pressure * piece.normal
        steeper = steeper + (given.pressure_slope * piece.normal).sum(axis=0) * piece.normal
    found = (steeper * z.u + flux * slope_z).sum(axis=0) + piece.curvature * (flux * z.u).sum(axis=0)
    if is_pressed:
        found -= given.pressure * np.einsum("aam->m", z.grad) + (given.pressure_slope * z.u).sum(axis=0)
    return np.asarray(found)
