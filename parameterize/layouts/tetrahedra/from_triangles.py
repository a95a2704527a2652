"""Makes the tetrahedra of a part that is given by triangles alone.

Its faces and curves are found by the angles of the mesh, coarse triangles are laid on them, Netgen fills these, and the
cubic nodes go to smooth curves and surfaces through the vertices of the mesh.
"""

import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ...arrays import Array, IntArray
from ...surface.geometry import connected
from ...surface.surface import Surface
from ...surface.topology import crossing_faces
from .coarse import Coarse
from .coarsening import coarse_of
from .mesh import ORDER, THIRDS, CubicNumbering, TetrahedralMesh, rows_in, volumes_of
from .mesher import MesherError, Sizes, run_netgen
from .outline import outline_of

PROGRAM = Path(__file__).with_name("filling_program.py")
_SAME = 1e-9  # of the diagonal: vertices of walls and of the surface this near are the same
_TRIES = 4  # coarse triangles that do not meet each other


def tetrahedra_of_surface(surface: Surface, sizes: Sizes) -> TetrahedralMesh:
    """Return the tetrahedra of the solids inside a surface, in the user's units. Raises MesherError."""
    walls = surface.walls.corners.reshape(-1, 3)
    points = np.concatenate([surface.vertices, walls])
    triangles = np.concatenate([surface.faces, len(surface.vertices) + np.arange(len(walls)).reshape(-1, 3)])
    same = cKDTree(points).query_pairs(_SAME * float(np.linalg.norm(np.ptp(points, axis=0))), output_type="ndarray")
    _, first, welded = np.unique(connected(same, len(points)), return_index=True, return_inverse=True)
    owners = surface.owners if len(surface.owners) else np.zeros(len(surface.faces), dtype=np.int64)
    sides = np.concatenate([np.stack([owners + 1, 0 * owners], axis=1), surface.walls.solids + 1])
    return tetrahedra_of_triangles(points[first], welded[triangles], sides, surface.sharp, sizes)


def tetrahedra_of_triangles(
    points: Array, triangles: IntArray, sides: IntArray, sharp: float, sizes: Sizes
) -> TetrahedralMesh:
    """Return the tetrahedra of solids bounded by triangles.

    Parameters
    ----------
    points : (n, 3) array
        In any unit.
    triangles : (m, 3) array of int
        Wound outward of the solid inside, none between the same solids twice.
    sides : (m, 2) array of int
        The solids inside and outside of each triangle, counted from 1, and 0 for none.
    sharp : float
        The angle in degrees between normals above which an edge is sharp.
    sizes : Sizes
        Of the edges of tetrahedra.

    Raises
    ------
    MesherError
        Where Netgen fails, or coarse triangles keep meeting each other.
    """
    outline = outline_of(points, triangles, sides, sharp)
    for _ in range(_TRIES):
        coarse = coarse_of(points, triangles, sides, outline, sizes)
        meeting = np.unique(crossing_faces(coarse.points, coarse.triangles))
        if not len(meeting):
            return _filled(coarse, sides[np.unique(outline.labels, return_index=True)[1]])
        sizes = sizes.shorter_at(coarse.points[coarse.triangles[meeting]])
    raise MesherError("coarse triangles of the surface meet each other")


def _filled(coarse: Coarse, sides: IntArray) -> TetrahedralMesh:
    """Return tetrahedra inside coarse triangles; sides: (faces, 2), the solids inside and outside of each face."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "triangles.npz"), Path(folder, "mesh.npz")
        np.savez(source, points=coarse.points, triangles=coarse.triangles, sides=sides[coarse.faces])
        run_netgen([str(PROGRAM), str(source), str(target)])
        if not target.exists():
            raise MesherError("Netgen ended without tetrahedra")
        with np.load(target) as arrays:
            points, cells, solids = arrays["points"], arrays["cells"], arrays["solids"]
    if not len(cells) or volumes_of(points[cells]).min() <= 0.0:
        raise MesherError("Netgen made flat tetrahedra")
    numbering = CubicNumbering.of(len(points), cells)
    if not _holds(numbering.faces, np.sort(coarse.triangles, axis=1)):
        raise MesherError("Netgen left triangles of the surface without tetrahedra")
    return TetrahedralMesh(
        points=points,
        cells=cells,
        solids=solids - 1,
        triangles=coarse.triangles,
        faces=coarse.faces + 1,
        segments=coarse.arcs,
        curves=coarse.curves + 1,
        nodes=_nodes(coarse, numbering, points)[numbering.cells],
    )


def _holds(table: IntArray, rows: IntArray) -> bool:
    """Return whether a table (m, 3) of rows in ascending order has all the rows (n, 3)."""
    at = np.minimum(rows_in(table, rows), len(table) - 1)
    return bool((table[at] == rows).all())


def _nodes(coarse: Coarse, numbering: CubicNumbering, points: Array) -> Array:
    """Return the cubic nodes (k, 3): on curves and faces there, the others where straight tetrahedra have them."""
    nodes = numbering.gathered(np.einsum("nk,tkx->tnx", THIRDS / ORDER, points[numbering.cells[:, :4]]))
    edges = coarse.edges()
    first = numbering.vertices + 2 * rows_in(numbering.edges, edges.ends)
    on_face = edges.arcs < 0
    face = np.zeros(len(edges.ends), dtype=np.int64)
    face[edges.of_triangles] = coarse.faces[:, None]
    arcs = edges.arcs[~on_face]
    turned = coarse.arcs[arcs, 0] > coarse.arcs[arcs, 1]
    thirds = coarse.surface.thirds(points[edges.ends[on_face]], face[on_face])
    for step in range(ORDER - 1):
        numbers = first + step
        nodes[numbers[on_face]] = thirds[step]
        share = (1.0 + np.where(turned, 1 - step, step)) / ORDER
        places = coarse.spans[arcs, 0] + share * np.diff(coarse.spans[arcs])[:, 0]
        nodes[numbers[~on_face]] = coarse.lines.at(coarse.curves[arcs], places)
    around = first[edges.of_triangles]
    sums = nodes[around].sum(axis=1) + nodes[around + 1].sum(axis=1)
    middles = sums / 4.0 - points[coarse.triangles].sum(axis=1) / 6.0
    own = numbering.first_face + rows_in(numbering.faces, np.sort(coarse.triangles, axis=1))
    nodes[own] = coarse.surface.onto(middles, coarse.faces)
    return nodes
