"""Names the face of a part that is clicked on the live page: by a point on the face, which ends at sharp edges."""

import math
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.surface.part import PartSurface

FEWEST, MOST = 2, 9  # digits of the point, of the box's size


@dataclass(frozen=True, eq=False)
class Picked:
    """Hold a face of a part: its region as text, its triangles (k,) and its area in the user's units."""

    region: str
    triangles: IntArray
    area: float


def picked(part: PartSurface, start: Array, end: Array) -> Picked | None:
    """Return the first face on the ray from one point (3,) through another; None where the ray meets no face."""
    shares = _shares(part, start, end - start)
    triangle = int(np.argmin(shares))
    if not math.isfinite(shares[triangle]):
        return None
    face = part.flood(triangle)
    return Picked(_region(part, face, start + shares[triangle] * (end - start)), face, part.area(face))


def _shares(part: PartSurface, start: Array, way: Array) -> Array:
    """Return the distance (m,) of each triangle along the ray, infinite where it is missed (Moller, Trumbore 1997)."""
    a, b, c = np.moveaxis(part.vertices[part.faces], 1, 0)
    across = np.cross(way, c - a)
    with np.errstate(
        divide="ignore", invalid="ignore", over="ignore"
    ):  # a ray misses the triangles that are parallel to it
        scale = 1.0 / np.sum((b - a) * across, axis=1)
        u = scale * np.sum((start - a) * across, axis=1)
        along = np.cross(start - a, b - a)
        v = scale * (along @ way)
        share = scale * np.sum((c - a) * along, axis=1)
        met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (share >= 0.0)
    return np.where(met, share, np.inf)


def _region(part: PartSurface, face: IntArray, place: Array) -> str:
    """Return the text of a point with as few digits as still lead to the face, seen from which it is written."""
    size = float(np.ptp(part.vertices[part.faces.ravel()], axis=0).max())
    for digits in range(FEWEST, MOST + 1):
        rounded = np.round(place, digits - math.ceil(math.log10(size))) + 0.0  # no -0
        if part.nearest(rounded[None])[0] in face:
            break
    return f"face({','.join(f'{value:.12g}' for value in rounded)})"
