"""Meshes in memory: objects of trimesh, pyvista and meshio, recognised without importing these libraries."""

import hashlib
import sys
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..errors import MeshError
from ..groups import by_value, gathered
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
    if not len(content.polygons):
        raise MeshError("has no faces: give a closed surface")
    vertices, faces, notices, groups = triangles_of(content, max_faces)
    digest = hashlib.sha256(vertices.tobytes() + faces.tobytes()).hexdigest()
    return RawMesh(vertices, faces, digest, notices, groups)


def _read_trimesh(mesh: Any) -> Content:
    """Return the triangles; whole numbers of the faces, also in the metadata, are groups."""
    faces = np.asarray(mesh.faces)
    held = {name: values for name, values in mesh.metadata.items() if isinstance(values, np.ndarray)}
    groups = by_value(_named({**held, **mesh.face_attributes}), len(faces))
    return Content(np.array(mesh.vertices, np.float64), faces.tolist(), groups=groups)


def _read_meshio(mesh: Any) -> Content:
    """Return the cells; their sets and their whole numbers are groups."""
    points, cells = arrays_of(mesh)
    count = sum(len(rows) for _, rows in cells)
    starts = np.cumsum([0, *(len(rows) for _, rows in cells)]).tolist()
    data = {name: np.concatenate(blocks) for name, blocks in mesh.cell_data.items()}
    sets = [
        (str(name), start + np.asarray(numbers, dtype=np.int64))
        for name, blocks in mesh.cell_sets.items()
        for start, numbers in zip(starts, blocks, strict=False)
        if numbers is not None
    ]
    return from_cells(points, cells, groups={**by_value(_named(data), count), **gathered(sets)})


def _named(arrays: Mapping[Any, Any]) -> dict[str, Any]:
    return {str(name): values for name, values in arrays.items()}


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
    before = mesh.n_verts + mesh.n_lines  # VTK has these first
    data = {name: np.asarray(mesh.cell_data[name]) for name in mesh.cell_data}
    marks = {name: np.concatenate([values[before:], values[:before]]) for name, values in data.items()}
    return from_cells(np.array(mesh.points, dtype=np.float64), cells, groups=by_value(marks, mesh.n_cells))


READERS: dict[str, Callable[[Any], Content]] = {
    "trimesh.Trimesh": _read_trimesh,
    "pyvista.PolyData": _read_pyvista,
    "meshio.Mesh": _read_meshio,
}
