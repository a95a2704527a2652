"""A program of its own: the solids of a .brep file to coarse tetrahedra and their cubic nodes, by Netgen.

`mesher.py` runs it with the file, the .npz to write, and options as JSON: the largest edge, how fast edges may grow,
the edges around a full circle, and a file of places with shorter edges. It imports netgen and numpy alone.
"""

import json
import sys
from typing import Any

import numpy as np
from netgen.meshing import Mesh, SetMessageImportance
from netgen.occ import OCCGeometry

LIMITS = ("RLIMIT_AS", 4 << 30)  # bytes of address space: a mesh that needs more is of no use
THIRDS = [  # of the weights of the first three vertices, and of the fourth, at the cubic nodes
    *((3, 0, 0, 0), (0, 3, 0, 0), (0, 0, 3, 0), (0, 0, 0, 3)),
    *((2, 1, 0, 0), (1, 2, 0, 0), (2, 0, 1, 0), (1, 0, 2, 0), (2, 0, 0, 1), (1, 0, 0, 2)),
    *((0, 2, 1, 0), (0, 1, 2, 0), (0, 2, 0, 1), (0, 1, 0, 2), (0, 0, 2, 1), (0, 0, 1, 2)),
    *((0, 1, 1, 1), (1, 0, 1, 1), (1, 1, 0, 1), (1, 1, 1, 0)),
]


def limit_memory() -> None:
    """Limit the memory of this process, on systems that can."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(getattr(resource, LIMITS[0]), (LIMITS[1], LIMITS[1]))


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
    np.savez(
        target,
        points=np.array(mesh.Coordinates()),
        cells=cells,
        solids=mesh.Elements3D().NumPy()["index"] - 1,
        triangles=corners(mesh.Elements2D(), 3),
        faces=mesh.Elements2D().NumPy()["index"],
        segments=corners(mesh.Elements1D(), 2),
        curves=mesh.Elements1D().NumPy()["index"],
        nodes=cubic_nodes(mesh, len(cells)),
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
