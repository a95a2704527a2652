"""Cells of volume formats: triangles and polygons as they are, or the boundary of tetrahedra."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Array, IntArray
from ..errors import MeshError, check_finite, check_indices
from .common import DAMAGED, Content, library

POLYGONS = ("triangle", "quad", "polygon")
OUTWARD_FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])  # of a tetrahedron of positive volume


def read_by_meshio(data: bytes, suffix: str, read: Callable[[str], Any]) -> Content:
    """Read a file by one of meshio's readers, which take a file's name."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, f"mesh{suffix}")
        copy.write_bytes(data)
        with library(suffix):
            vertices, cells = arrays_of(read(str(copy)))
    return from_cells(vertices, cells)


def arrays_of(mesh: Any) -> tuple[Array, list[tuple[str, IntArray]]]:
    """Return points and cells of a meshio.Mesh as `from_cells` takes them."""
    cells = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
    return np.asarray(mesh.points, dtype=np.float64), cells


def from_cells(vertices: Array, cells: list[tuple[str, IntArray]]) -> Content:
    """Return vertices and polygons of cells given by their kind, as meshio calls it, and corners (k, corners)."""
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise MeshError(f"points must have shape (n, 3), got {vertices.shape}: export three coordinates each")
    check_finite(vertices)
    cells = [(kind, rows) for kind, rows in cells if len(rows)]
    for kind, rows in cells:
        if kind not in (*POLYGONS, "tetra", "vertex", "line"):
            raise MeshError(f"holds {len(rows)} cells of type {kind}: save linear tetrahedra or triangles")
        check_indices(vertices, rows)
    tetrahedra = [rows for kind, rows in cells if kind == "tetra"]
    if any(rows.shape[1:] != (4,) for rows in tetrahedra):
        raise MeshError(f"a tetrahedron has fewer corners than 4; {DAMAGED}")
    if tetrahedra:
        return Content(vertices, tetrahedra_boundary(vertices, np.concatenate(tetrahedra)).tolist())
    polygons = [polygon for kind, rows in cells if kind in POLYGONS for polygon in rows.tolist()]
    if not polygons:
        raise MeshError("no tetrahedra and no triangles: export the volume or its surface")
    return Content(vertices, polygons)


def tetrahedra_boundary(vertices: Array, tetrahedra: IntArray) -> IntArray:
    """Return the boundary triangles (m, 3), oriented outward, of tetrahedra (k, 4) in either orientation."""
    a, b, c, d = (vertices[tetrahedra[:, i]] for i in range(4))
    inverted = np.sum(np.cross(b - a, c - a) * (d - a), axis=1) < 0
    corners = np.where(inverted[:, None], tetrahedra[:, [1, 0, 2, 3]], tetrahedra)
    faces = corners[:, OUTWARD_FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[np.sort(first[count == 1])]
