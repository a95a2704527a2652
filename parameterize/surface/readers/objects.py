"""Meshes in memory: objects of trimesh, pyvista and meshio, which are known without importing these libraries."""

import hashlib
import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import MeshError
from .cells import Rows, arrays_of, from_cells
from .common import Content
from .file import RawMesh, triangles_of


def class_of(mesh: object) -> str | None:
    """Return the class of a mesh that `read_object` takes, such as "trimesh.Trimesh"; None for any other object."""
    for name in READERS:
        library, _, kind = name.partition(".")
        known = getattr(sys.modules.get(library), kind, None)
        if known is not None and isinstance(mesh, known):
            return name
    return None


def read_object(mesh: Any, kind: str, max_faces: int) -> RawMesh:
    """Return the triangles of a mesh of that class. Raises MeshError, without the class."""
    try:
        content = READERS[kind](mesh)
    except (TypeError, ValueError) as error:  # rows of different lengths, texts in place of numbers
        raise MeshError(" ".join(str(error).split())) from None
    if not content.polygons:
        raise MeshError("has no faces: give a closed surface")
    vertices, faces, notices = triangles_of(content, max_faces)
    digest = hashlib.sha256(vertices.tobytes() + faces.tobytes()).hexdigest()
    return RawMesh(vertices, faces, digest, notices)


def _read_pyvista(mesh: Any) -> Content:
    """Return polygons and strips; vertices and lines, which a PolyData may hold besides, are left out with a notice."""
    ends, strips = mesh.GetStrips().GetOffsetsArray(), mesh.GetStrips().GetConnectivityArray()
    cells: list[tuple[str, Rows]] = [
        ("polygon", [row.tolist() for row in mesh.irregular_faces]),
        (
            "triangle_strip",
            [row.tolist() for row in np.split(np.array(strips), np.array(ends)[1:-1])] * bool(mesh.n_strips),
        ),
        ("vertex", [()] * mesh.n_verts),
        ("line", [()] * mesh.n_lines),
    ]
    return from_cells(np.array(mesh.points, dtype=np.float64), cells)


READERS: dict[str, Callable[[Any], Content]] = {
    "trimesh.Trimesh": lambda mesh: Content(np.array(mesh.vertices, np.float64), np.asarray(mesh.faces).tolist()),
    "pyvista.PolyData": _read_pyvista,
    "meshio.Mesh": lambda mesh: from_cells(*arrays_of(mesh)),
}
