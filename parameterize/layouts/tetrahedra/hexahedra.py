"""Makes four hexahedra of each curved tetrahedron: each has a vertex, middles of edges and faces, and the centre.

The barycentric coordinates are trilinear in the parameters of a hexahedron, and the tetrahedron is cubic in these: a
patch of degree 3 or more is exactly a part of it. One of degree 2 agrees with it at its Greville points.
"""

from functools import cache

import numpy as np

from ...arrays import Array, IntArray
from ...spline.bspline import greville, interpolate_grid, open_uniform_knots
from ...spline.solids import PatchSolids
from ...spline.spline_map import ControlNets, SplineMap
from ..complex import Complex
from .curving import CurvedMesh
from .determinant import bernstein_of_nodes, bernstein_values
from .mesh import EDGES, FACES, ORDER

PARTS = 4  # hexahedra of a tetrahedron
_CORNERS = np.array([(0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)])  # of each part: its vertex, then those
# towards which u, v and w lead


def spline_of_tetrahedra(found: CurvedMesh, degree: int, names: tuple[str, ...] = ()) -> SplineMap:
    """Return the map of the four hexahedra of each tetrahedron, one after the other.

    names: of the solids; that of a single one is left out, because maps of other ways keep none either.
    """
    mesh = found.mesh
    knots = (open_uniform_knots(degree + 1, degree),) * 3
    points, hexahedra = hexahedra_of(found)
    numbers = np.repeat(mesh.solids, PARTS)
    solids = PatchSolids(numbers, names if len(names) > max(1, numbers.max()) else ())
    nets = ControlNets(degree, (knots,) * len(hexahedra), Complex(points, hexahedra).interfaces, solids)
    local = found.nodes[mesh.numbering.cells]
    control = np.einsum("hcn,tnx->xthc", control_points_of_nodes(degree), local, optimize=True)
    return SplineMap(nets, nets.merged(np.ascontiguousarray(control).reshape(3, -1)))


def hexahedra_of(found: CurvedMesh) -> tuple[Array, IntArray]:
    """Return the vertices (n, 3) of all hexahedra, and their numbers (4 t, 2, 2, 2)."""
    mesh, numbering = found.mesh, found.mesh.numbering
    edges = (numbering.cells[:, 4 : 4 + 2 * len(EDGES) : 2] - len(mesh.points)) // 2
    first_centre = len(mesh.points) + len(numbering.edges) + len(numbering.faces)
    own = np.concatenate(
        [
            mesh.cells,
            len(mesh.points) + edges,
            len(mesh.points) + len(numbering.edges) + numbering.cells[:, -len(FACES) :] - numbering.first_face,
            first_centre + np.arange(len(mesh.cells))[:, None],
        ],
        axis=1,
    )
    ends, sides = mesh.points[numbering.edges], mesh.points[numbering.faces]
    points = [mesh.points, ends.mean(axis=1), sides.mean(axis=1), mesh.points[mesh.cells].mean(axis=1)]
    return np.concatenate(points), own[:, _places()].reshape(-1, 2, 2, 2)


@cache
def _weights() -> Array:
    """Return the barycentric coordinates (4, 2, 2, 2, 4) of the corners of the parts."""
    found = np.zeros((PARTS, 2, 2, 2, 4))
    for part, (own, *others) in enumerate(_CORNERS.tolist()):
        for place in np.ndindex(2, 2, 2):
            vertices = [own, *(other for other, step in zip(others, place, strict=True) if step)]
            found[part, *place, vertices] = 1.0 / len(vertices)
    return found


@cache
def _places() -> IntArray:
    """Return which vertex, edge, face or centre (4, 2, 2, 2) of the tetrahedron each corner of the parts is."""
    sets = [{k} for k in range(4)] + [set(edge) for edge in EDGES.tolist()] + [set(face) for face in FACES.tolist()]
    sets.append(set(range(4)))
    corners = (_weights() > 0.0).reshape(-1, 4)
    return np.array([sets.index(set(np.flatnonzero(row).tolist())) for row in corners]).reshape(PARTS, 2, 2, 2)


@cache
def control_points_of_nodes(degree: int) -> Array:
    """Return the matrix (4, (degree + 1)^3, 20) from a tetrahedron's cubic nodes to its patches' control points."""
    knots = open_uniform_knots(degree + 1, degree)
    share = greville(knots, degree)
    ends = np.stack([1.0 - share, share])
    weights = np.einsum("hijkm,ia,jb,kc->habcm", _weights(), ends, ends, ends)
    values = bernstein_values(weights.reshape(-1, 4), ORDER) @ bernstein_of_nodes()
    rows = values.reshape(PARTS, *(len(share),) * 3, -1)
    parts = [interpolate_grid((knots,) * 3, degree, row) for row in rows]
    return np.stack([part.reshape(-1, part.shape[-1]) for part in parts])
