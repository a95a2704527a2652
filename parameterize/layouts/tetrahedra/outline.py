"""Finds in a triangle mesh what a part from CAD has: smooth faces, the curves between them, and corners.

Curves run along sharp edges, along edges between solids, along creases (which no smooth surface through the vertices
could pass near enough), and along the seams where a plane ends and a rounding begins.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, IntArray, Mask
from ...surface.features import SHARP, chains_between
from ...surface.geometry import connected, corner_angles, directed_edges, normals_and_areas

STRAY = 1e-3  # of the diagonal: facets that a smooth surface would leave by more are meant as they are
FACET = 7e-4  # of the diagonal: a rounding does not leave its facets by more
_COPLANAR = 2e-3  # radians between the normals of triangles of one plane, as files hold numbers in single precision
_WIDE = 4.0  # times as wide as the facets beside it, a plane is no facet of a rounding
_LOOSE = 0.25  # of the diagonal: connected edges with loose ends that are shorter together are noise of scans
_SHORTEST = 0.01  # of the diagonal: so are those without loose ends
_TIP = 1.0  # radians that the angles around a vertex lack to a full turn, where it is the tip of a cone


@dataclass(frozen=True, eq=False)
class Outline:
    """The smooth faces of a triangle mesh, and what bounds them.

    labels: (m,), the face of each triangle, from 0 on. chains: the vertices along each curve between corners; a closed
    one begins and ends with the same. corners: (c,), vertices. normals: (m, 3, 3), of the smooth surface at the corners
    of each triangle.
    """

    labels: IntArray
    chains: tuple[IntArray, ...]
    corners: IntArray
    normals: Array


@dataclass(frozen=True, eq=False)
class Pairs:
    """The edges of a mesh at which triangles meet.

    edges: (e, 2), vertices. triangles: (e, 2), the first two at each. forced: (e,), whether these are not the only two,
    or have not the same solids. angles: (e,), between their normals.
    """

    edges: IntArray
    triangles: IntArray
    forced: Mask
    angles: Array


def outline_of(points: Array, faces: IntArray, sides: IntArray, sharp: float = SHARP) -> Outline:
    """Return the outline of a mesh, points (n, 3) and faces (m, 3), with the solids (m, 2) in and outside of each."""
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    pairs = _pairs(points, faces, sides)
    parts = connected(pairs.triangles[~pairs.forced & (pairs.angles < _COPLANAR)], len(faces))
    beside = parts[pairs.triangles]
    widths = _widths(points, faces, parts, pairs)
    strays = pairs.angles[:, None] * np.sort(widths, axis=1) / (8.0 * diagonal)  # of the narrower, of the wider part
    creased = pairs.forced | (pairs.angles > np.radians(sharp)) | (strays[:, 0] > STRAY)
    lengths = np.linalg.norm(points[pairs.edges[:, 0]] - points[pairs.edges[:, 1]], axis=1)
    soft = ~creased & (beside[:, 0] != beside[:, 1])
    wider = (widths > _WIDE * widths[:, ::-1]) & (strays[:, 1:] > FACET)
    planes = _planes(beside[soft], lengths[soft], wider[soft], np.bincount(parts))
    seams = soft & planes[beside].any(axis=1)
    kept = (creased | seams) & (pairs.forced | _is_long(pairs.edges, creased | seams, lengths, diagonal))
    labels = connected(pairs.triangles[~kept], len(faces))
    chains, corners = _chains(points, pairs.edges[kept], np.radians(sharp), diagonal)
    tips = np.setdiff1d(_tips(points, faces), pairs.edges[kept])
    normals = _normals(points, faces, pairs, kept & creased, planes[parts])
    return Outline(labels, chains, np.union1d(corners, tips), normals)


def _pairs(points: Array, faces: IntArray, sides: IntArray) -> Pairs:
    """Return the edges of a mesh without boundary and the triangles at each."""
    directed = np.sort(directed_edges(faces), axis=1)
    order = np.lexsort(directed.T[::-1])
    edges, first, counts = np.unique(directed[order], axis=0, return_index=True, return_counts=True)
    triangles = np.stack([order[first], order[first + np.minimum(counts, 2) - 1]], axis=1) // 3
    normals, _ = normals_and_areas(points, faces)
    a, b = normals[triangles[:, 0]], normals[triangles[:, 1]]
    angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1))
    forced = (counts != 2) | (sides[triangles[:, 0]] != sides[triangles[:, 1]]).any(axis=1)
    return Pairs(edges, triangles, forced, angles)


def _widths(points: Array, faces: IntArray, parts: IntArray, pairs: Pairs) -> Array:
    """Return the widths (e, 2) across each edge of the plane parts beside it, those of boxes along their own axes."""
    axes, extents = _boxes(points[faces].reshape(-1, 3), np.repeat(parts, 3))
    normals, _ = normals_and_areas(points, faces)
    along = points[pairs.edges[:, 1]] - points[pairs.edges[:, 0]]
    across = np.cross(normals[pairs.triangles], along[:, None] / np.linalg.norm(along, axis=1)[:, None, None])
    beside = parts[pairs.triangles]
    shares = np.abs(np.einsum("esx,esxk->esk", across, axes[beside]))
    return np.asarray(np.einsum("esk,esk->es", shares, extents[beside]))


def _boxes(corners: Array, owners: IntArray) -> tuple[Array, Array]:
    """Return the axes (p, 3, 3), as columns, and the extents (p, 3) of the boxes of the points (n, 3) of each owner."""
    count = int(owners.max()) + 1
    sums = np.stack([np.bincount(owners, corners[:, k]) for k in range(3)], axis=1)
    away = corners - (sums / np.bincount(owners)[:, None])[owners]
    spread = np.zeros((count, 3, 3))
    np.add.at(spread, owners, away[:, :, None] * away[:, None, :])
    axes = np.linalg.eigh(spread)[1]
    places = np.einsum("nx,nxk->nk", away, axes[owners])
    high, low = np.full((count, 3), -np.inf), np.full((count, 3), np.inf)
    np.maximum.at(high, owners, places)
    np.minimum.at(low, owners, places)
    return axes, high - low


def _planes(beside: IntArray, lengths: Array, wider: Mask, sizes: IntArray) -> Mask:
    """Return which parts are planes of their own, and not facets of a rounding.

    beside: (k, 2), the parts at each edge at which the surface bends a little, of `lengths` (k,). wider: (k, 2),
    whether each is much wider than the other. sizes: the number of triangles of each part.
    """
    whole, wide = np.zeros(len(sizes)), np.zeros(len(sizes))
    np.add.at(whole, beside, lengths[:, None])
    np.add.at(wide, beside, lengths[:, None] * wider)
    return np.asarray((sizes > 1) & (wide > 0.5 * whole))


def _is_long(edges: IntArray, chosen: Mask, lengths: Array, diagonal: float) -> Mask:
    """Return which of the chosen edges are connected to enough others."""
    found, degrees = edges[chosen], np.bincount(edges[chosen].ravel(), minlength=int(edges.max()) + 1)
    component = connected(found, len(degrees))
    total = np.bincount(component[found[:, 0]], lengths[chosen], minlength=len(degrees))
    loose = np.bincount(component[degrees == 1], minlength=len(degrees)) > 0
    enough = total >= np.where(loose, _LOOSE, _SHORTEST) * diagonal
    long = np.zeros(len(edges), dtype=bool)
    long[chosen] = enough[component[found[:, 0]]]
    return long


def _chains(points: Array, edges: IntArray, sharp: float, diagonal: float) -> tuple[tuple[IntArray, ...], IntArray]:
    """Return the chains of edges between corners, and the corners: a chain turns there, or not two edges meet."""
    around: dict[int, list[int]] = {}
    for a, b in edges.tolist():
        around.setdefault(a, []).append(b)
        around.setdefault(b, []).append(a)
    corners = {vertex for vertex, ends in around.items() if len(ends) != 2}
    for chain in chains_between(around, corners):
        corners.update(_turns(points, np.array(chain), sharp, diagonal))
    chains = tuple(np.array(chain) for chain in chains_between(around, corners))
    return chains, np.array(sorted(corners), dtype=np.int64)


def _turns(points: Array, chain: IntArray, sharp: float, diagonal: float) -> Iterator[int]:
    """Yield the vertices of a chain at which it turns sharply, or by more than a smooth curve could follow."""
    steps = np.diff(points[chain], axis=0)
    closed = chain[0] == chain[-1]
    before, after = (np.roll(steps, 1, axis=0), steps) if closed else (steps[:-1], steps[1:])
    inner = chain[:-1] if closed else chain[1:-1]
    crossed = np.linalg.norm(np.cross(before, after), axis=1)
    angles = np.arctan2(crossed, np.sum(before * after, axis=1))
    bends = np.flatnonzero(angles > _COPLANAR)
    lengths = np.linalg.norm(steps, axis=1)
    at = np.concatenate([[0.0], np.cumsum(lengths)])[:-1] if closed else np.cumsum(lengths)[:-1]
    if not len(bends):
        return
    places = at[bends]
    if closed:
        gaps = np.diff(np.append(places, places[0] + lengths.sum()))
        runs = np.minimum(np.roll(gaps, 1), gaps)
    else:
        gaps = np.diff(np.concatenate([[0.0], places, [lengths.sum()]]))
        runs = np.minimum(gaps[:-1], gaps[1:])
    hard = (angles[bends] > sharp) | (angles[bends] * runs / 8.0 > STRAY * diagonal)
    yield from inner[bends[hard]].tolist()


def _tips(points: Array, faces: IntArray) -> IntArray:
    """Return the vertices at which cones end, inwards or outwards."""
    around = np.bincount(faces.ravel(), corner_angles(points, faces).ravel(), minlength=len(points))
    used = np.bincount(faces.ravel(), minlength=len(points)) > 0
    return np.flatnonzero(used & (np.abs(2.0 * np.pi - around) > _TIP))


def _normals(points: Array, faces: IntArray, pairs: Pairs, creased: Mask, plane: Mask) -> Array:
    """Return the normals (m, 3, 3) of the smooth surface at the corners of each triangle.

    It is the mean of the triangles around, up to creases; those of planes, where there are any, count alone.
    """
    smooth = ~creased
    corners = np.arange(3 * len(faces)).reshape(-1, 3)
    links = []
    for end in range(2):
        vertex = pairs.edges[smooth, end]
        at = [np.argmax(faces[pairs.triangles[smooth, k]] == vertex[:, None], axis=1) for k in range(2)]
        links.append(np.stack([corners[pairs.triangles[smooth, k], at[k]] for k in range(2)], axis=1))
    group = connected(np.concatenate(links), corners.size)
    facets, _ = normals_and_areas(points, faces)
    angles = corner_angles(points, faces).ravel()
    of_planes = np.bincount(group, np.repeat(plane, 3)) > 0
    weights = np.where(of_planes[group] & ~np.repeat(plane, 3), 0.0, angles)
    sums = np.stack([np.bincount(group, weights * np.repeat(facets[:, k], 3)) for k in range(3)], axis=1)
    lengths = np.linalg.norm(sums, axis=1)
    units = sums / np.maximum(lengths, 1e-300)[:, None]
    return units[group].reshape(-1, 3, 3)
