"""Computes the exponents of solutions at the edge of a wedge: u grows as r^lambda, its gradient as r^(lambda - 1).

A wedge has one sector for each material. In a plane across the edge an elastic sector has four functions r^lambda times
those of M. L. Williams (Journal of Applied Mechanics 19, 1952, p. 526), in plane strain, and two of the displacement
along the edge, which a scalar law has alone. Lambda is a zero of the determinant of all conditions at the rays.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from parameterize.arrays import Array, Floats

REGULAR = 1.0  # exponent of solutions with a finite gradient
WEAK = 0.95  # from this exponent on the growth, by less than 1.4 over three decades, is no peak on any mesh; the angles
# of fitted bodies, which are right to some degrees, would give it where there is none
_LEAST = 0.05  # the exponents of motions, which are 0, lie below
_HEIGHT = 1.0  # largest imaginary part looked at: those of edges of two materials are some 0.1
_POINTS = 120  # on each side of the rectangle around which the determinant's argument is followed
_HALVINGS = 9


@dataclass(frozen=True)
class Sector:
    """Hold a sector of one material: its angle in radians, the shear modulus or the factor of a scalar law, and nu."""

    angle: float
    shear: float = 1.0
    poisson_ratio: float | None = None  # None for a scalar law

    @property
    def unknowns(self) -> int:
        """Return the number of the sector's functions."""
        return 2 if self.poisson_ratio is None else 6


@cache
def exponent(sectors: tuple[Sector, ...], first: tuple[float, ...], last: tuple[float, ...]) -> float:
    """Return the least real part of the exponents of a wedge; REGULAR where it is WEAK or larger.

    first, last: the projector onto the directions that are held at the first and at the last ray, row by row; for an
    elastic wedge 9 entries along r, theta and the edge, for a scalar law one.
    """
    if not _zeros(sectors, first, last, WEAK):
        return REGULAR
    low, high = _LEAST, WEAK
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _zeros(sectors, first, last, middle) else (middle, high)
    return 0.5 * (low + high)


def _zeros(sectors: tuple[Sector, ...], first: tuple[float, ...], last: tuple[float, ...], right: float) -> int:
    """Return the number of exponents with a real part from _LEAST to `right`: the turns of the determinant."""
    corners = [complex(x, y) for x, y in ((_LEAST, -1), (right, -1), (right, 1), (_LEAST, 1))]
    along = np.linspace(0.0, 1.0, _POINTS, endpoint=False)
    path = np.concatenate([a + (b - a) * along for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)])
    path = path.real + 1j * _HEIGHT * path.imag
    values = np.linalg.slogdet(_conditions(path, sectors, first, last))[0]
    turns = np.angle(np.roll(values, -1) * values.conj()).sum() / (2.0 * np.pi)
    return int(round(float(turns)))


def _conditions(
    exponents: Floats, sectors: tuple[Sector, ...], first: tuple[float, ...], last: tuple[float, ...]
) -> Floats:
    """Return the matrices (m, n, n) of the conditions at all rays on the functions of all sectors."""
    count = sectors[0].unknowns
    half, total = count // 2, count * len(sectors)
    found = np.zeros((len(exponents), total, total), dtype=np.complex128)
    found[:, :half, :count] = _bound(exponents, sectors[0], 0.0, first)
    angle = 0.0
    for i, (one, other) in enumerate(zip(sectors, sectors[1:], strict=False)):
        angle += one.angle
        rows, here = slice(half + i * count, half + (i + 1) * count), i * count
        found[:, rows, here : here + count] = np.concatenate(_at(exponents, one, angle), axis=1)
        found[:, rows, here + count : here + 2 * count] = -np.concatenate(_at(exponents, other, angle), axis=1)
    found[:, total - half :, total - count :] = _bound(exponents, sectors[-1], angle + sectors[-1].angle, last)
    return found


def _bound(exponents: Floats, sector: Sector, angle: float, held: tuple[float, ...]) -> Floats:
    """Return the conditions (m, k, n) at an outer ray: no u along held directions, no stress along others."""
    u, stress = _at(exponents, sector, angle)
    projector: Array = np.reshape(held, (u.shape[1], u.shape[1]))
    return projector @ (2.0 * sector.shear * u) + (np.eye(len(projector)) - projector) @ stress


def _at(exponents: Floats, sector: Sector, angle: float) -> tuple[Floats, Floats]:
    """Return u and the stress on a ray, over lambda, of a sector's functions: (m, k, n) each, along r, theta, z."""
    power = exponents
    out = np.stack([np.cos(power * angle), np.sin(power * angle)], axis=-1)[:, None]
    shear = np.stack([-out[..., 1], out[..., 0]], axis=-1)
    if sector.poisson_ratio is None:
        return out / sector.shear, shear
    more, less, zero = power + 1.0, power - 1.0, np.zeros_like(power)
    kappa = 4.0 * (1.0 - sector.poisson_ratio)
    tame = np.where(less == 0.0, 1.0, less)  # sine over this: at lambda = 1 the fourth function is theta
    cosines = np.cos(more * angle), np.sin(more * angle), np.cos(less * angle), np.sin(less * angle) / tame
    slopes = -more * cosines[1], more * cosines[0], -less * np.sin(less * angle), np.cos(less * angle)
    radial = np.stack([zero, zero, kappa * cosines[2], kappa * cosines[3]], axis=-1)
    across = np.stack([zero, zero, kappa * np.sin(less * angle), -kappa * np.cos(less * angle) / tame], axis=-1)
    function, slope = np.stack(cosines, axis=-1), np.stack(slopes, axis=-1)
    u, stress = np.zeros((2, len(power), 3, 6), dtype=np.complex128)
    u[:, 0, :4] = (radial - more[:, None] * function) / (2.0 * sector.shear)
    u[:, 1, :4] = (across - slope) / (2.0 * sector.shear)
    u[:, 2:, 4:] = out / sector.shear
    stress[:, 0, :4], stress[:, 1, :4] = -slope, more[:, None] * function
    stress[:, 2:, 4:] = shear
    return u, stress
