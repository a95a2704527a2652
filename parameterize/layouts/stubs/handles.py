"""Finds the handles of a body along its skeleton, around which it is a tube, and cuts them off its surface."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray, Mask
from ...cube.cutting import subdivide_finely
from ...surface.filling import fill
from ...surface.holes import boundary_loops
from ...surface.topology import genus_of
from ..skeleton.graph import Branch, Skeleton

_TUBE = 2.5  # times the area of the ball's disc: a section of a tube; that of a square rod has 1.27
_LONG = 2.0  # radii: a handle is at least so long
_BESIDE = 1.0  # radii: its ends are so far away from sections that are none of a tube's
_FINE = 0.8  # radii of the thinnest handle: the longest edges, so that cuts run around it
_WIDE = 3.0  # radii: farther away from the curve of a handle a vertex belongs to the body


@dataclass(frozen=True, eq=False)
class Handle:
    """A tube that leaves a body and comes back to it.

    Attributes
    ----------
    curve : (k, 3) array
        The middle of the tube from end to end, of the units of the skeleton.
    radius : float
        The median distance of the curve from the surface.
    """

    curve: Array
    radius: float


def handles_of(skeleton: Skeleton, inside: Array) -> tuple[Handle, ...]:
    """Return as many handles as the skeleton has loops, whose removal leaves a body without loops; () where not so.

    inside: (n, 3) points spread evenly over the solid, which has volume 1. Each belongs to the nearest point of the
    curves; the volume of those of a stretch of a curve over its length is the area of the body's section there.
    """
    owners = np.concatenate([np.full(len(branch.points), k) for k, branch in enumerate(skeleton.branches)])
    nearest = np.asarray(cKDTree(np.concatenate([one.points for one in skeleton.branches])).query(inside)[1])
    counts = np.bincount(nearest, minlength=len(owners)) / len(inside)
    pieces = [_piece(branch, counts[owners == k]) for k, branch in enumerate(skeleton.branches)]
    chosen: list[Handle] = []
    left = list(range(len(pieces)))
    for k in sorted(left, key=lambda k: -_slenderness(pieces[k])):
        piece = pieces[k]
        if piece is not None and _connected_by(skeleton, [one for one in left if one != k]):
            left.remove(k)
            chosen.append(piece)
    return tuple(chosen) if len(chosen) == skeleton.handles else ()


def _slenderness(piece: Handle | None) -> float:
    return 0.0 if piece is None else float(np.linalg.norm(np.diff(piece.curve, axis=0), axis=1).sum()) / piece.radius


def _piece(branch: Branch, volumes: Array) -> Handle | None:
    """Return the longest piece of a branch around which the body is a tube; None where there is none.

    volumes: (k,), of the solid that is nearest to each of the branch's points.
    """
    step = branch.length / (len(branch.points) - 1)
    reach = max(1, round(float(np.median(branch.radii)) / step))
    means = np.convolve(np.pad(volumes, reach, mode="edge"), np.full(2 * reach + 1, 1.0 / (2 * reach + 1)), "valid")
    runs = _runs(means / step <= _TUBE * np.pi * branch.radii**2)
    if not len(runs):
        return None
    first, last = runs[np.argmax(runs[:, 1] - runs[:, 0])]
    radius = float(np.median(branch.radii[first : last + 1]))
    beside = int(np.ceil(_BESIDE * radius / step))
    first, last = first + beside, last - beside
    if (last - first) * step < _LONG * radius:
        return None
    return Handle(branch.points[first : last + 1], radius)


def _runs(mask: Mask) -> IntArray:
    """Return the first and the last place of each run of true values: (r, 2)."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int64))
    return np.stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1], axis=1)


def _connected_by(skeleton: Skeleton, branches: list[int]) -> bool:
    """Return whether the nodes stay connected by these branches alone."""
    piece = np.arange(len(skeleton.nodes))
    for k in branches:
        first, last = piece[list(skeleton.branches[k].ends)]
        piece[piece == last] = first
    return len(np.unique(piece)) == 1


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
