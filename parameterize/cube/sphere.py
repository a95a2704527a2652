"""Lays a closed surface without handles on the unit sphere, one-to-one and with little distortion.

The surface is cut in two discs along the line where the lowest vibration of the net of its edges vanishes: each of the
two sides is in one piece (Fiedler, Czechoslovak Math. J. 25, 1975). Each disc is mapped to a hemisphere (Tutte 1963),
one-to-one but much compressed: a long arm shrinks exponentially with its length. Therefore the mesh edges along an arm
have the larger weights of a cone's edges, whose layout is even up to the tip. Then Newton's method lowers the symmetric
Dirichlet energy (Smith, Schaefer, ACM Trans. Graphics 34, 2015), which is infinite where a triangle has no area left,
so that no step turns a triangle over.
"""

import math
import time
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, Literal

import igl
import numpy as np
from scipy.sparse import coo_array, csc_array, csr_array, diags_array, eye_array
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import SuperLU, eigsh, splu

from ..arrays import Array, IntArray, Mask
from ..checkpoint import Checkpoints
from ..progress import Progress, ProgressCallback, ignore
from ..surface.geometry import edge_table, normals_and_areas
from ..threads import in_parallel
from .cube import CubeLayout
from .cutting import split_edges

_Weigh = Callable[[Array, Array, Mask], Array]

_SHIFT = -1e-6  # below all eigenvalues of the Laplacian, so that it can be factorised
_THIN = 1e-6  # least area of a triangle and least length of an edge, as shares of the means
_LEAST_ROOM = 1e-40  # least area of a triangle on the sphere, as a share of its own: powers of less would overflow
_LEAST_SHARE = 0.25  # of a divided edge's length, from its new vertex to either end
_SQUEEZED = 1e8  # energy of the first layout above which others are tried; that of a relaxed layout is some 50
_AWAY = 10.0  # extra weight of edges pointing away from the rim, in the second layout
# In the next layouts: the higher, the less edges that lead aside count. Four of 41 hard surfaces go beyond the first
# layout, and after Newton's steps their energy differs by some 2 % at most from that after the first one. Still, one of
# them, a bulb, ends folded from there, and with power 4 instead of 2 it ends 1.5 times as far.
_POWERS = (2, 4, 8, 16, 32, 64)
_ONE_WAY_POWERS = (4, 16)  # in the last layouts, where a point is pulled by neighbours nearer to the rim alone
_STEPS = 300  # Newton steps, at most
_CHECKPOINT, _CHECKPOINT_SECONDS = "sphere", 5.0
_DAMPING = 1e-8  # of a Newton step, as a share of the mean diagonal entry
_LEAST_GAIN = 1e-3  # share of the energy: the steps end once one of them gains less
_LONGER = (
    1.5  # factor of a whole step, again and again, while the energy falls: of tiny triangles it falls by half a step
)
_SHORTEST_STEP = 1e-10  # share of a Newton step
_PIECE = 1024  # triangles whose derivatives one thread computes at once
_ARMIJO = 1e-4  # share of the decrease that the slope promises which a step must reach


def lay_on_sphere(
    vertices: Array,
    faces: IntArray,
    progress: ProgressCallback = ignore,
    checkpoints: Checkpoints | None = None,
) -> CubeLayout:
    """Return the layout on the unit sphere of a closed surface without handles.

    vertices: (n, 3). faces: (m, 3), outward triangles. Every mesh edge that the line between the two discs crosses has
    a new vertex, after the vertices of the mesh. `progress` is called after each Newton step, with the stage "layout"
    and the energy as the loss. A checkpoint is kept every few seconds, and where the steps are interrupted.
    """
    checkpoints = checkpoints or Checkpoints.none()
    if (saved := checkpoints.load(_CHECKPOINT)) is not None:
        arrays, state = saved
        points, faces, directions, steps = arrays["points"], arrays["faces"], arrays["directions"], state["steps"]
        triangles = _Triangles(points, faces)
    else:
        points, faces, directions, triangles = _first_layout(vertices, faces)
        steps = 0

    def keep(directions: Array, steps: int) -> None:
        arrays = {"points": points, "faces": faces, "directions": directions}
        checkpoints.save(_CHECKPOINT, arrays, {"steps": steps})

    relaxed = _relaxed(directions, triangles, progress, steps, keep)
    return CubeLayout(points, faces, relaxed, len(vertices))


def _first_layout(vertices: Array, faces: IntArray) -> tuple[Array, IntArray, Array, "_Triangles"]:
    """Return the points (n, 3) of the cut surface, its triangles (m, 3), first directions (n, 3), and all as one."""
    points, faces, upper = _halves(vertices, faces)
    triangles = _Triangles(points, faces)
    directions = _hemispheres(points, faces, upper, lambda straight, *_: np.ones(len(straight)))
    for weigh in _for_long_arms():
        if triangles.energy(directions) <= _SQUEEZED:
            break
        directions = min(directions, _hemispheres(points, faces, upper, weigh), key=triangles.energy)
    return points, faces, directions, triangles


def _halves(vertices: Array, faces: IntArray) -> tuple[Array, IntArray, Mask]:
    """Split edges where the lowest vibration vanishes; return points, triangles and the mask of the upper triangles.

    The exact places of the new vertices do not matter: they keep the distance _LEAST_SHARE, a share of the edge, from
    its ends.
    """
    edges, _ = edge_table(faces)
    links = _links(edges, 1.0 / _lengths(vertices, edges), len(vertices))
    begin = np.cos(np.arange(len(vertices)))  # else the library begins with random numbers
    _, modes = eigsh(_laplacian(links), k=2, sigma=_SHIFT, v0=begin)
    height = np.where(modes[:, 1] == 0.0, np.finfo(np.float64).tiny, modes[:, 1])
    cut = edges[height[edges[:, 0]] * height[edges[:, 1]] < 0.0]
    start, end = height[cut].T
    share = np.clip(start / (start - end), _LEAST_SHARE, 1.0 - _LEAST_SHARE)[:, None]
    points = np.concatenate([vertices, (1.0 - share) * vertices[cut[:, 0]] + share * vertices[cut[:, 1]]])
    faces = split_edges(faces, cut, len(vertices))
    return points, faces, np.concatenate([height, np.zeros(len(cut))])[faces].sum(axis=1) > 0.0


def _for_long_arms() -> Iterator[_Weigh]:
    """Yield weights of mesh edges (see `_hemispheres`) that shrink a long arm less; the mesh decides which are best.

    Rings of points around an arm are evenly spaced where the edges along it have the weights of a cone's edges: the
    square of the distance to the tip, in lengths of the edge. Edges across the arm would mix points from different
    sides of it; the higher the power, the less weight they have. The last weights mix least: each point follows only
    neighbours nearer to the rim.
    """
    yield lambda straight, *_: 1.0 + _AWAY * straight
    for power in _POWERS:
        yield lambda straight, left, _, p=power: 1.0 + straight**p * left**2  # type: ignore[misc]
    for power in _ONE_WAY_POWERS:
        yield lambda straight, left, outwards, p=power: 1.0 + straight**p * left * outwards  # type: ignore[misc]


def _hemispheres(vertices: Array, faces: IntArray, upper: Mask, weigh: _Weigh) -> Array:
    """Return directions (n, 3) of points (n, 3); the upper and the lower triangles go to the two hemispheres.

    The common rim goes to the equator by arc length; every other point is a weighted mean of its neighbours in the
    disc. `weigh` returns the weights of mesh edges from three arrays (e,): the squared cosine of the angle between the
    edge and the path to the rim; the distance to the point farthest from the rim, in lengths of the edge; and whether
    the pulling neighbour is nearer to the rim than the pulled point.
    """
    rim = np.asarray(igl.boundary_loop(faces[upper]), dtype=np.int64)
    length = np.linalg.norm(vertices[np.roll(rim, -1)] - vertices[rim], axis=1)
    angle = 2.0 * np.pi * (np.cumsum(length) - length) / length.sum()
    flat = np.zeros((len(vertices), 2))
    flat[rim] = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    directions = np.zeros((len(vertices), 3))
    for half, side in ((upper, 1.0), (~upper, -1.0)):
        used = np.unique(faces[half])
        inner = np.setdiff1d(used, rim)
        edges, _ = edge_table(faces[half])
        length = _lengths(vertices, edges)
        away = dijkstra(_links(edges, length, len(vertices)), indices=rim, min_only=True)[edges]
        straight, left = ((away[:, 1] - away[:, 0]) / length) ** 2, (away.max() - away.mean(axis=1)) / length
        nearer = away[:, 1] < away[:, 0]
        pulls = weigh(straight, left, nearer), weigh(straight, left, ~nearer)
        links = _links(edges, np.concatenate(pulls), len(vertices))
        matrix = csc_array(_laplacian(links)[inner][:, inner])
        flat[inner] = _factors(matrix, "MMD_AT_PLUS_A").solve(links[inner][:, rim] @ flat[rim])
        square = (flat[used] ** 2).sum(axis=1, keepdims=True)  # stereographic
        directions[used] = np.hstack([2.0 * flat[used], side * (1.0 - square)]) / (1.0 + square)
    return directions


def _lengths(vertices: Array, edges: IntArray) -> Array:
    """Return the lengths (e,) of edges (e, 2), which are at least the share _THIN of their mean."""
    length = np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1)
    return np.asarray(np.maximum(length, _THIN * length.mean()))


def _links(edges: IntArray, weights: Array, count: int) -> csr_array:
    """Return the weights of edges (e, 2) between `count` points as a sparse matrix (count, count).

    weights: (e,) for a symmetric matrix; or else (2 e,), the pulls of second ends on first ends, then the pulls of
    first ends on second ends.
    """
    i, j = np.concatenate([edges, edges[:, ::-1]]).T
    return csr_array(coo_array((np.resize(weights, len(i)), (i, j)), shape=(count, count)))


def _laplacian(links: csr_array) -> csr_array:
    return csr_array(diags_array(links.sum(axis=1)) - links)


def _factors(matrix: csc_array, order: Literal["MMD_AT_PLUS_A", "NATURAL"]) -> SuperLU[Any]:
    """Return the factors of a matrix that needs no pivots: positive definite, or diagonally dominant."""
    return splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def _volumes(corners: Array) -> Array:
    """Return the determinants (m,) of the corners (m, 3, 3) of triangles, from differences: triangles may be tiny."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray((corners[:, 0] * across).sum(axis=1))


class _Triangles:
    """Compute the symmetric Dirichlet energy of triangles (m, 3) of the surface, scaled to the area of the unit sphere.

    The energy is the sum of D (1 + (A / a)^2), with the Dirichlet energy D, the signed area a on the sphere and the
    area A on the surface.
    """

    def __init__(self, vertices: Array, faces: IntArray) -> None:
        self.faces = faces
        _, area = normals_and_areas(vertices, faces)
        scale = 4.0 * np.pi / area.sum()
        self._area = scale * np.maximum(area, _THIN * area.mean())
        corners = vertices[faces]
        sides = np.sqrt(scale) * (corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]])  # (m, 3, 3), opposite to the corners
        self._stiffness = sides @ np.swapaxes(sides, 1, 2) / (4.0 * self._area[:, None, None])

    def energies(self, directions: Array) -> Array:
        """Return the energy (m,) of each triangle.

        It is infinite where a triangle is turned over, seen from the sphere's centre, or too small for double
        precision.
        """
        corners = directions[self.faces]
        area = 0.5 * _volumes(corners)
        sides = corners - corners[:, :1]  # else tiny triangles are lost in the rounding of their corners
        dirichlet = np.einsum("mij,mic,mjc->m", self._stiffness, sides, sides)
        regular = area > _LEAST_ROOM * self._area
        squeezed = np.divide(self._area, area, out=np.ones(len(area)), where=regular)
        return np.where(regular, dirichlet * (1.0 + squeezed**2), np.inf)

    def energy(self, directions: Array) -> float:
        """Return the energy of all triangles."""
        return float(self.energies(directions).sum())

    def derivatives(self, directions: Array, tangents: Array) -> tuple[Array, Array]:
        """Return the gradient (m, 6) and a positive second derivative (m, 6, 6) in steps along tangents (n, 3, 2)."""
        from .sphere_kernels import derivatives, lift

        def piece(rows: slice) -> tuple[Array, Array]:
            mine = self.faces[rows], self._stiffness[rows], self._area[rows]
            gradients, hessians = derivatives(directions, tangents, *mine)
            lift(hessians, *np.linalg.eigh(hessians))
            return gradients, hessians

        rows = [slice(start, start + _PIECE) for start in range(0, len(self.faces), _PIECE)]
        gradients, hessians = zip(*in_parallel(piece, rows), strict=True)
        return np.concatenate(gradients), np.concatenate(hessians)

    @cached_property
    def rank(self) -> IntArray:
        """Return the place (n,) of each point in an order of elimination that fills in little."""
        links = _links(edge_table(self.faces)[0], np.ones(1), int(self.faces.max()) + 1)
        pattern = csc_array(_laplacian(links) + eye_array(links.shape[0]))
        return np.asarray(_factors(pattern, "MMD_AT_PLUS_A").perm_c, dtype=np.int64)


def _relaxed(
    directions: Array,
    triangles: _Triangles,
    progress: ProgressCallback = ignore,
    done: int = 0,
    keep: Callable[[Array, int], None] = lambda *_: None,
) -> Array:
    """Return directions of lower energy by Newton steps, which are shortened until no triangle turns over.

    A step is also shortened until the energy falls, and lengthened while it falls further. Directions with triangles
    too small for double precision are returned unchanged. done: the number of steps that have led to the directions.
    keep: a function that keeps directions and this number for a run that resumes.
    """
    energy = triangles.energy(directions)
    if not math.isfinite(energy):
        return directions
    reached, kept = (directions, done), time.monotonic()
    try:
        while reached[1] < _STEPS and (found := _stepped(directions, energy, triangles)) is not None:
            gain, number = energy - found[1], reached[1] + 1
            directions, energy = found
            reached = directions, _STEPS if gain < _LEAST_GAIN * energy else number
            progress(Progress("layout", number, _STEPS, energy, 0, None))
            if time.monotonic() - kept > _CHECKPOINT_SECONDS:
                keep(*reached)
                kept = time.monotonic()
    except KeyboardInterrupt:
        keep(*reached)
        raise
    keep(directions, _STEPS)
    return directions


def _stepped(directions: Array, energy: float, triangles: _Triangles) -> tuple[Array, float] | None:
    """Return the directions after a Newton step, and their energy; None where it does not fall."""
    unknowns = (2 * triangles.rank[triangles.faces][:, :, None] + np.arange(2)).reshape(-1, 6)
    rows, columns = np.repeat(unknowns, 6, axis=1).ravel(), np.tile(unknowns, (1, 6)).ravel()
    size = 2 * len(directions)
    tangents = _tangents(directions)
    slopes, hessians = triangles.derivatives(directions, tangents)
    slope = np.asarray(np.bincount(unknowns.ravel(), slopes.ravel(), size), dtype=np.float64)
    matrix = coo_array((hessians.ravel(), (rows, columns)), shape=(size, size)).tocsc()
    damping = _DAMPING * matrix.diagonal().mean()
    step = _factors(csc_array(matrix + damping * eye_array(size)), "NATURAL").solve(-slope)
    move, length = np.einsum("nca,na->nc", tangents, step.reshape(-1, 2)[triangles.rank]), 1.0

    def moved(length: float) -> tuple[Array, float]:
        trial = directions + length * move
        trial /= np.linalg.norm(trial, axis=1, keepdims=True)
        return trial, triangles.energy(trial)

    found = moved(length)
    while found[1] > energy + _ARMIJO * length * float(slope @ step):
        length *= 0.5
        if length < _SHORTEST_STEP:
            return None
        found = moved(length)
    while length >= 1.0 and (further := moved(_LONGER * length))[1] < found[1]:
        found, length = further, _LONGER * length
    return found


def _tangents(directions: Array) -> Array:
    """Return two unit vectors (n, 3, 2) that are orthogonal to each direction (n, 3)."""
    other = np.where(np.abs(directions[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(directions, other)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(directions, first)], axis=2)
