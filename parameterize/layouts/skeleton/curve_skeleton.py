"""From a closed surface to the curve skeleton of the body inside it."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray, in_brackets
from ...surface.solid import Solid
from .contraction import contract, divide, drop_stubs
from .graph import Branch, Skeleton, SkeletonError
from .lattice import Depth, Lattice, lattices
from .limbs import add_limbs
from .smooth_curves import smoothed
from .thinning import web_of
from .web import Web

SAMPLES = 20_000  # points inside, at most, of which the share in balls is counted: it is true to a percent
RESOLVED = 2.5  # cells: the median radius of each branch, so that its curve runs in its middle
CLEAR = 0.3  # cells: the least radius of a curve, where blocks of this width are laid
ENOUGH = 500_000  # points of the box: a finer lattice for thin branches alone is not worth its seconds
UNREACHED = 2.0  # cells: a vertex of a part that the lattice holds has a point inside within one and a half
KNOTTED = (
    "a knotted tunnel: the body is no graph of thick branches, so it cannot be cut into blocks along its skeleton; "
    "fill the tunnel or cut the model into pieces"
)
_MOST_PAIRS = 2_000_000  # of points and balls compared at once: 50 MB


def skeleton_of(vertices: Array, faces: IntArray, genus: int, where: Callable[[Array], str] = in_brackets) -> Skeleton:
    """Return the skeleton of the body inside a closed surface, with as many loops as the genus and a tip in each limb.

    Parameters
    ----------
    vertices : (n, 3) array
        Of a surface in one piece that encloses volume 1.
    faces : (m, 3) array of int
        Triangles, wound outward.
    genus : int
        The number of handles, from Euler's formula.
    where : function
        Turns a place (3,) into words for messages, such as its coordinates in the user's units.

    Raises
    ------
    SkeletonError
        A part is too thin for the finest lattice, or a tunnel is knotted: the body is no thick graph.
    """
    body, coarse, found = Solid(vertices, faces), None, None
    for coarse in lattices(vertices, faces, genus):
        if not coarse.has_topology(genus):
            continue
        depth = Depth(coarse.inside)
        skeleton = _measured(_curves(coarse, depth, genus), coarse, body)
        if _is_inside(skeleton, body):
            found = skeleton
            if _is_resolved(skeleton) or coarse.inside.size > ENOUGH:
                break
    if found is not None:
        return found
    if coarse is None:
        raise SkeletonError("the body is too thin: a lattice across it has far too many points; thicken it")
    place = _thinnest(coarse, vertices)
    raise SkeletonError(
        f"a part of the body, or a gap between two parts, is too thin near {where(place)}: of {genus} handles a "
        f"lattice of {coarse.cell:.2g} (at volume 1) finds {coarse.betti}; thicken the part, or widen the gap"
    )


def _curves(lattice: Lattice, depth: Depth, genus: int) -> Web:
    """Return the smooth curves of loops and limbs. Raises SkeletonError for a knotted tunnel."""
    web = Web()
    if genus:
        web = web_of(lattice.inside)
        if web.betti() != genus or web.pieces() != 1:
            raise SkeletonError(KNOTTED)
        web.without_ends()
    add_limbs(web, depth, lattice.cell)
    contract(web, depth)
    drop_stubs(web, depth)
    divide(web, depth)
    return smoothed(web, depth)


def _is_inside(skeleton: Skeleton, body: Solid) -> bool:
    """Return whether all points of a skeleton lie inside the body."""
    points = np.concatenate([skeleton.nodes, *(branch.points for branch in skeleton.branches)])
    return bool(np.all(body.contains(points)))


def _is_resolved(skeleton: Skeleton) -> bool:
    """Return whether each branch is some cells thick, and no point of it nearly on the surface."""
    thin = min((float(np.median(branch.radii)) for branch in skeleton.branches), default=np.inf)
    shallow = min((float(branch.radii.min()) for branch in skeleton.branches), default=np.inf)
    return thin > RESOLVED * skeleton.cell and shallow > CLEAR * skeleton.cell


def _thinnest(lattice: Lattice, vertices: Array) -> Array:
    """Return a place (3,) where the body is too thin for a lattice.

    It is the vertex of the surface that is farthest from the points inside; where all are near, the shallowest inner
    point of the thinned body.
    """
    gaps = np.asarray(cKDTree(lattice.places(np.argwhere(lattice.inside))).query(vertices)[0])
    points = web_of(lattice.inside).points()
    if gaps.max() > UNREACHED * lattice.cell or not len(points):
        return np.asarray(vertices[np.argmax(gaps)])
    return lattice.places(points[np.argmin(Depth(lattice.inside).at(points))])


def _measured(web: Web, lattice: Lattice, body: Solid) -> Skeleton:
    """Return the skeleton with the true distances from the surface."""
    number = {key: i for i, key in enumerate(web.nodes)}
    nodes = lattice.places(np.array(list(web.nodes.values())))
    curves = [lattice.places(arc.path) for arc in web.arcs]
    branches = tuple(
        Branch((number[arc.first], number[arc.last]), points, body.depths(points))
        for arc, points in zip(web.arcs, curves, strict=True)
    )
    at_nodes = body.depths(nodes)
    index = np.argwhere(lattice.inside)
    samples = lattice.places(index[:: len(index) // SAMPLES + 1])
    centers = np.concatenate([nodes, *curves])
    tube = _share_in_balls(samples, centers, np.concatenate([at_nodes, *(branch.radii for branch in branches)]))
    return Skeleton(nodes, at_nodes, branches, tube, lattice.cell)


def _share_in_balls(samples: Array, centers: Array, radii: Array) -> float:
    """Return the share of samples (m, 3) that lie in one of the balls, centers (k, 3), radii (k,)."""
    covered = np.zeros(len(samples), dtype=bool)
    step = _MOST_PAIRS // len(samples)
    for begin in range(0, len(centers), step):
        part = slice(begin, begin + step)
        gaps = np.linalg.norm(samples[:, None] - centers[None, part], axis=2)
        covered |= (gaps < radii[None, part]).any(axis=1)
    return float(covered.mean())
