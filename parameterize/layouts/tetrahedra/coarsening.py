"""Makes coarse triangles of a fine mesh."""

import numpy as np

from ...arrays import Array, IntArray
from .coarse import LONG, Coarse, Edges
from .curves import curves_through
from .lengths import Lengths
from .mesher import Sizes
from .outline import Outline
from .smooth_faces import SmoothFaces

_SWEEPS = 6  # of collapses, splits, flips and moves
_STRAIGHT = -0.9  # cosine between two arcs that leave a vertex, below which they are one smooth curve
_PASSES = 80  # of one kind, at most


def coarse_of(points: Array, triangles: IntArray, sides: IntArray, outline: Outline, sizes: Sizes) -> Coarse:
    """Return coarse triangles on the smooth faces of a mesh, with edges of such sizes."""
    surface = SmoothFaces(points, triangles, outline)
    coarse = _start(points, triangles, outline, surface)
    beside = np.zeros((int(outline.labels.max()) + 1, 2), dtype=bool)
    beside[outline.labels] = sides > 0
    lengths = Lengths(points, triangles, beside, sizes)
    flipped(coarse)
    for _ in range(_SWEEPS):
        wanted = lengths.at(coarse, coarse.edges())
        collapse_short(coarse, wanted)
        wanted = split_long(coarse, wanted)
        flipped(coarse)
        coarse.relax(coarse.edges(), wanted)
    flipped(coarse)
    split_ears(coarse)
    coarse.compact()
    return coarse


def _start(points: Array, triangles: IntArray, outline: Outline, surface: SmoothFaces) -> Coarse:
    """Return the triangles of the mesh itself."""
    lines = curves_through(points, outline.chains)
    arcs = [np.stack([chain[:-1], chain[1:]], axis=1) for chain in outline.chains]
    counts = [len(arc) for arc in arcs]
    curves = np.repeat(np.arange(len(arcs)), counts)
    starts = lines.starts - lines.first[curves] if len(arcs) else np.empty(0)
    fixed = np.zeros(len(points), dtype=bool)
    fixed[outline.corners] = True
    coarse = Coarse(
        surface,
        lines,
        points.copy(),
        triangles.copy(),
        outline.labels.copy(),
        np.zeros((len(triangles), 3)),
        np.concatenate(arcs) if arcs else np.empty((0, 2), dtype=np.int64),
        curves,
        np.stack([starts, starts + lines.spans], axis=1),
        fixed,
    )
    coarse.up = coarse.normals_at(coarse.triangles, coarse.faces)
    return coarse


def _relative(coarse: Coarse, edges: Edges, wanted: Array) -> Array:
    """Return the lengths (e,) of edges over those wanted at their ends (n,)."""
    a, b = coarse.points[edges.ends[:, 0]], coarse.points[edges.ends[:, 1]]
    return np.linalg.norm(a - b, axis=1) / wanted[edges.ends].mean(axis=1)


def split_long(coarse: Coarse, wanted: Array) -> Array:
    """Split edges that are too long, and return the wanted lengths at all vertices."""
    for _ in range(_PASSES):
        edges = coarse.edges()
        count = len(coarse.points)
        if not coarse.split(edges, _relative(coarse, edges, wanted) - LONG):
            break
        coarse.flip(coarse.edges())
        new = coarse.edges()
        far = np.full(len(coarse.points) - count, np.inf)
        for side in (0, 1):
            at, other = new.ends[:, side], new.ends[:, 1 - side]
            chosen = (at >= count) & (other < count)
            steps = 0.5 * np.linalg.norm(coarse.points[at[chosen]] - coarse.points[other[chosen]], axis=1)
            np.minimum.at(far, at[chosen] - count, wanted[other[chosen]] + steps)
        wanted = np.concatenate([wanted, far])
    return wanted


def collapse_short(coarse: Coarse, wanted: Array) -> None:
    """Collapse edges that are too short."""
    for _ in range(_PASSES):
        edges = coarse.edges()
        if not coarse.collapse(edges, _relative(coarse, edges, wanted), LONG * wanted):
            break


def flipped(coarse: Coarse) -> None:
    """Flip edges until no triangle gains."""
    for _ in range(_PASSES):
        if not coarse.flip(coarse.edges()):
            break


def split_ears(coarse: Coarse) -> None:
    """Split the third sides of triangles of which two lie on curves that go on smoothly from one to the other.

    A curved triangle has no angle there, and a tetrahedron no volume.
    """
    for _ in range(_PASSES):
        edges = coarse.edges()
        arcs = edges.arcs[edges.of_triangles]  # (m, 3), from the triangle's vertices 0, 1, 2
        wanted = np.zeros(len(edges.ends))
        for side in range(3):  # its end is a vertex at which the next side begins
            both = np.flatnonzero((arcs[:, side] >= 0) & (arcs[:, (side + 1) % 3] >= 0))
            vertex = coarse.triangles[both, (side + 1) % 3]
            ways = [_leaving(coarse, arcs[both, (side + k) % 3], vertex) for k in (0, 1)]
            ears = both[np.sum(ways[0] * ways[1], axis=1) < _STRAIGHT]
            wanted[edges.of_triangles[ears, (side + 2) % 3]] = 1.0
        if not coarse.split(edges, wanted):
            break


def _leaving(coarse: Coarse, arcs: IntArray, vertices: IntArray) -> Array:
    """Return the directions (k, 3) in which arcs (k,) leave vertices (k,)."""
    at_start = coarse.arcs[arcs, 0] == vertices
    eps = 1e-9 * np.diff(coarse.spans[arcs])[:, 0]
    places = np.where(at_start, coarse.spans[arcs, 0] + eps, coarse.spans[arcs, 1] - eps)
    ways = coarse.lines.tangents(coarse.curves[arcs], places)
    return np.where(at_start[:, None], ways, -ways)
