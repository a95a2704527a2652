"""Cuts the handles off a surface, and closes the holes that they leave."""

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray
from ...cube.cutting import subdivide_finely
from ...surface.filling import fill
from ...surface.holes import boundary_loops
from ...surface.topology import genus_of
from ..skeleton.graph import Skeleton
from .pieces import Handle

_FINE = 0.8  # radii of the thinnest handle: the longest edges, so that cuts run around it
_WIDE = 3.0  # radii: farther away from the curve of a handle a vertex belongs to the body


def without_handles(
    vertices: Array, faces: IntArray, skeleton: Skeleton, handles: tuple[Handle, ...], most: int
) -> tuple[Array, IntArray, list[tuple[Array, Array]]] | None:
    """Return the surface of the body alone, and the rims (k, 3) that each handle leaves at its first and last end.

    vertices: (n, 3); edges longer than a part of the handles' radius are cut, up to `most` points. None is returned
    where the cuts do not leave one surface without handles.
    """
    longest = _FINE * min(handle.radius for handle in handles)
    points, faces = subdivide_finely(vertices, faces, longest, most)
    owner = _owners(points, skeleton, handles)
    cut = (owner[faces] >= 0).all(axis=1)
    rims: list[list[Array]] = [[] for _ in handles]
    kept = faces[~cut]
    for loop in boundary_loops(points, kept):
        rims[int(np.bincount(owner[loop]).argmax())].append(points[loop])  # a vertex of what is cut off has an owner
        added, filling = fill(points, kept, loop)
        points, kept = np.concatenate([points, added]), np.concatenate([kept, filling])
    if any(len(ends) != 2 for ends in rims) or genus_of(kept) != 0:
        return None
    used, numbers = np.unique(kept, return_inverse=True)
    return points[used], numbers.reshape(-1, 3), [_in_order(ends, one) for ends, one in zip(rims, handles, strict=True)]


def _owners(points: Array, skeleton: Skeleton, handles: tuple[Handle, ...]) -> IntArray:
    """Return the number of the handle that each point (n, 3) of the surface belongs to, -1 for the body."""
    curves = [branch.points for branch in skeleton.branches]
    least = np.asarray(cKDTree(np.concatenate(curves)).query(points)[0])
    owner = np.full(len(points), -1)
    for number, handle in enumerate(handles):
        inner = handle.curve[1:-1]
        distance, place = cKDTree(handle.curve).query(points)
        own = (distance <= least) & (distance <= _WIDE * handle.radius)
        owner[own & (np.asarray(place) > 0) & (np.asarray(place) <= len(inner))] = number
    return owner


def _in_order(rims: list[Array], handle: Handle) -> tuple[Array, Array]:
    """Return the two rims of a handle, that at its first end first."""
    near = [float(np.linalg.norm(rim.mean(axis=0) - handle.curve[0])) for rim in rims]
    return (rims[0], rims[1]) if near[0] <= near[1] else (rims[1], rims[0])
