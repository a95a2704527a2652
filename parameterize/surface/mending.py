"""The repairs of a mesh in their order, from the triangles of a file to a closed surface wound outward.

Nothing is repaired without a notice that says what was changed, and by how much.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, IntArray
from .bodies import Choice, check_choice, choose_component
from .errors import LARGEST, MeshError, check_face_count
from .holes import Close, check_close, close_holes
from .mesh_repair import MeshRepair
from .readers.file import RawMesh
from .sheets import split, without_doubled, without_flaps
from .topology import check_edges, check_vertices
from .welding import weld_and_drop, wind_alike, wind_outward

USUAL_SIZES = (1e-6, 1e6)


@dataclass(frozen=True)
class Asked:
    """What a user asks of a surface: the parameters of `load_surface`."""

    component: Choice
    close: Close
    max_faces: int


def mend(raw: RawMesh, asked: Asked) -> tuple[MeshRepair, list[str]]:
    """Return the closed surface of one component, wound outward, and notices. Raises MeshError."""
    check_choice(asked.component)
    check_close(asked.close)
    mesh, mended = without_defects(raw, asked.max_faces)
    mesh, chosen = choose_component(mesh, asked.component)
    mesh = mesh.compact()
    check_edges(mesh.faces, mesh.where)
    alike, turned = wind_alike(mesh.faces)
    mesh, closed = close_holes(replace(mesh, faces=alike), asked.close)
    check_edges(mesh.faces, mesh.where)
    check_vertices(mesh.faces, mesh.where)
    faces, outward = wind_outward(mesh.points, mesh.faces)
    return replace(mesh, faces=faces), [*mended, *chosen, *turned, *closed, *outward]


def without_defects(raw: RawMesh, max_faces: int) -> tuple[MeshRepair, list[str]]:
    """Return the mesh with all its components, without what is given twice or hangs loose, and all notices so far."""
    vertices, faces = raw.vertices, raw.faces
    check_face_count(len(faces), max_faces)
    if len(faces) < 4:
        raise MeshError(f"{len(faces)} triangles, a closed surface needs at least 4: export the whole surface")
    middle, size, remarks = _box(vertices, faces)
    unit = (vertices - middle) / size
    triangles, left, mended = weld_and_drop(unit, faces)
    if len(triangles) < 4:
        raise MeshError(f"{len(triangles)} triangles that are not degenerate, at least 4 are needed: export it again")
    mesh, doubled = without_doubled(MeshRepair(vertices, unit, triangles, left, middle, size))
    mesh, loose = without_flaps(mesh)
    mesh, touching = split(mesh)
    return mesh, [*raw.notices, *remarks, *mended, *doubled, *loose, *touching]


def _box(vertices: Array, faces: IntArray) -> tuple[Array, float, list[str]]:
    """Return the middle (3,) and the longest side of the used vertices' box, and notices of its size and place."""
    used = vertices[np.unique(faces)]
    low, high = used.min(axis=0), used.max(axis=0)
    size = float((high - low).max())
    if size < 1.0 / LARGEST:
        raise MeshError(f"longest side {size:g}: the surface is a single point or far too small; choose a smaller unit")
    remarks = []
    if not USUAL_SIZES[0] < size < USUAL_SIZES[1]:
        remarks.append(f"unusual size, longest side {size:g}: computed at size 1 and scaled back")
    middle = (low + high) / 2.0
    if abs(middle).max() > 1e6 * size:
        remarks.append(f"far from the origin ({abs(middle).max() / size:.1e} times its size): digits are lost")
    return middle, size, remarks
