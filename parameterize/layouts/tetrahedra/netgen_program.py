"""A program of its own: the solids of a .brep file to coarse tetrahedra and their cubic nodes, by Netgen.

`mesher.py` runs it with the file, the .npz to write, and options as JSON: the largest edge, how fast edges may grow,
the edges around a full circle, and a file of places with shorter edges. It imports netgen and numpy alone.
"""

import json
import sys
from contextlib import suppress
from typing import Any

import numpy as np
from netgen.meshing import Mesh, SetMessageImportance
from netgen.occ import OCCGeometry

MEMORY = 4 << 30  # bytes of address space: a mesh that needs more is of no use
THIRDS = [  # of the weights of the first three vertices, and of the fourth, at the cubic nodes
    *((3, 0, 0, 0), (0, 3, 0, 0), (0, 0, 3, 0), (0, 0, 0, 3)),
    *((2, 1, 0, 0), (1, 2, 0, 0), (2, 0, 1, 0), (1, 0, 2, 0), (2, 0, 0, 1), (1, 0, 0, 2)),
    *((0, 2, 1, 0), (0, 1, 2, 0), (0, 2, 0, 1), (0, 1, 0, 2), (0, 0, 2, 1), (0, 0, 1, 2)),
    *((0, 1, 1, 1), (1, 0, 1, 1), (1, 1, 0, 1), (1, 1, 1, 0)),
]

SIXTHS = [  # of the weights of a face's vertices: points inside, and on its edges
    *((4, 1, 1), (1, 4, 1), (1, 1, 4), (2, 2, 2), (3, 2, 1), (3, 1, 2), (2, 3, 1), (1, 3, 2), (2, 1, 3), (1, 2, 3)),
    *((3, 3, 0), (3, 0, 3), (0, 3, 3), (5, 1, 0), (1, 5, 0), (5, 0, 1), (1, 0, 5), (0, 5, 1), (0, 1, 5)),
]
FINE = 6  # the degree of polynomials that are taken for the part itself


def limit_memory() -> None:
    """Limit the memory of this process, on systems that can."""
    try:
        import resource
    except ImportError:
        return
    with suppress(ValueError, OSError):  # macOS has the limit and refuses it
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def corners(elements: Any, count: int) -> Any:
    """Return the vertex numbers (n, count) of elements, counted from 0."""
    return np.asarray(elements.NumPy()["nodes"], dtype=np.int64)[:, :count] - 1


def right_handed(rows: Any) -> Any:
    """Return rows (n, 4 or more), one number for each vertex, with two vertices exchanged: Netgen's are left-handed."""
    return rows[:, [1, 0, 2, 3]]


def cubic_nodes(mesh: Mesh, count: int) -> Any:
    """Return the cubic nodes (t, 20, 3) of the tetrahedra, on the surfaces and edges of the part."""
    mesh.Curve(3)
    nodes = np.zeros((count, len(THIRDS), 3))
    mesh.CalcElementMapping(np.ascontiguousarray(right_handed(np.array(THIRDS))[:, :3] / 3.0), nodes)
    return nodes


def powers(weights: Any) -> Any:
    """Return the twenty cubic monomials (n, 20) of barycentric coordinates (n, 4)."""
    exponents = [row for row in np.ndindex(4, 4, 4) if sum(row) <= 3]
    return np.stack([np.prod(weights[:, :3] ** row, axis=1) for row in exponents], axis=1)


def gaps(mesh: Mesh, nodes: Any) -> Any:
    """Return how far (t, 4) the faces of cubic tetrahedra are from the part, those opposite to vertices 0 to 3."""
    mesh.Curve(FINE)
    weights = np.array(SIXTHS) / 6.0
    rows = np.concatenate([np.insert(weights, vertex, 0.0, axis=1) for vertex in range(4)])
    fine = np.zeros((len(nodes), len(rows), 3))
    mesh.CalcElementMapping(np.ascontiguousarray(right_handed(rows)[:, :3]), fine)
    cubic = powers(rows) @ np.linalg.inv(powers(np.array(THIRDS) / 3.0))
    away = np.linalg.norm(fine - np.einsum("mn,tnx->tmx", cubic, nodes), axis=2)
    return away.reshape(len(nodes), 4, -1).max(axis=2)


def main(source: str, target: str, options: str) -> None:
    """Write the arrays of a TetrahedralMesh; see mesh.py."""
    limit_memory()
    SetMessageImportance(0)
    wanted = json.loads(options)
    geometry = OCCGeometry(source)
    mesh = geometry.GenerateMesh(
        maxh=wanted["largest"],
        grading=wanted["growth"],
        curvaturesafety=wanted["around"] / (2.0 * np.pi),
        segmentsperedge=1,
        meshsizefilename=wanted["places"],
        parallel_meshing=False,
    )
    cells = right_handed(corners(mesh.Elements3D(), 4))
    nodes = cubic_nodes(mesh, len(cells))
    np.savez(
        target,
        points=np.array(mesh.Coordinates()),
        cells=cells,
        solids=mesh.Elements3D().NumPy()["index"] - 1,
        triangles=corners(mesh.Elements2D(), 3),
        faces=mesh.Elements2D().NumPy()["index"],
        segments=corners(mesh.Elements1D(), 2),
        curves=mesh.Elements1D().NumPy()["index"],
        nodes=nodes,
        gaps=gaps(mesh, nodes),
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
