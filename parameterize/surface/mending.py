"""The repairs of a mesh in their order, from the triangles of a file to a closed surface wound outward.

Nothing is repaired without a notice that says what was changed, and by how much.
"""

from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from ..arrays import Array, IntArray, listed
from .bodies import Choice, check_choice, choose_component
from .errors import LARGEST, MeshError, check_face_count
from .geometry import used_vertices
from .gluing import Solids, glued
from .holes import Close, check_close, close_holes
from .mesh_repair import MeshRepair
from .readers.file import RawMesh
from .sheets import split, without_doubled, without_flaps
from .shells import wound_as_walls
from .solids import only
from .topology import check_edges, check_vertices, crossing_faces
from .welding import is_known_sound, weld_and_drop, wind_alike

USUAL_SIZES = (1e-6, 1e6)


@dataclass(frozen=True)
class Asked:
    """What a user asks of a surface: the parameters of `load_surface`."""

    component: Choice
    close: Close
    max_faces: int


def mend(raw: RawMesh, asked: Asked) -> tuple[Solids, list[str]]:
    """Return the outer boundary of the solids, closed and wound as it bounds them, and notices. Raises MeshError."""
    check_choice(asked.component)
    check_close(asked.close)
    mesh, owners, notices = (_of_solids if len(raw.solids) > 1 else _of_components)(raw, asked)
    names = _names(raw, mesh, owners)
    if len(names) == 1:
        return Solids(mesh, owners, names, crossing_faces(mesh.points, mesh.faces)), notices
    solids, touching = glued(mesh, owners, names)
    check_edges(solids.mesh.faces, solids.mesh.where)
    check_vertices(solids.mesh.faces, solids.mesh.where)
    return solids, [*notices, *touching]


def _of_components(raw: RawMesh, asked: Asked) -> tuple[MeshRepair, IntArray, list[str]]:
    """Return the closed components of a mesh, wound as walls of bodies, the body of each face, and notices."""
    mesh, mended = without_defects(raw, asked.max_faces)
    mesh, chosen = choose_component(mesh, asked.component, asked.close)
    mesh, closed = _closed(mesh.compact(), asked.close)
    mesh, owners, outward = wound_as_walls(mesh)
    return mesh, owners, [*mended, *chosen, *closed, *outward]


def _closed(mesh: MeshRepair, close: Close) -> tuple[MeshRepair, list[str]]:
    """Return the mesh wound alike and with its holes filled, and notices. Raises MeshError where that is no surface."""
    if is_known_sound(mesh.faces):
        return mesh, []
    check_edges(mesh.faces, mesh.where)
    alike, turned = wind_alike(mesh.faces)
    mesh, closed = close_holes(replace(mesh, faces=alike), close)
    check_edges(mesh.faces, mesh.where)
    check_vertices(mesh.faces, mesh.where)
    return mesh, [*turned, *closed]


def _of_solids(raw: RawMesh, asked: Asked) -> tuple[MeshRepair, IntArray, list[str]]:
    """Return the meshes of several solids as one, each mended by itself, the solid of each face, and notices."""
    check_face_count(len(raw.faces), asked.max_faces)
    found = [_of_solid(raw, number, asked) for number in range(len(raw.solids))]
    meshes, notices = [mesh for mesh, _, _ in found], [lines for _, _, lines in found]
    rows = zip(meshes, raw.solids, strict=True)
    old = np.concatenate([np.where(mesh.old < 0, -1, solid.triangles[mesh.old]) for mesh, solid in rows])
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    vertices = np.concatenate([mesh.vertices for mesh in meshes])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)])
    middle, size, _ = _box(vertices, faces)
    whole = MeshRepair(vertices, (vertices - middle) / size, faces, old, middle, size)
    owners = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    told = {line: [k for k, lines in enumerate(notices) if line in lines] for line in dict.fromkeys(chain(*notices))}
    return whole, owners, [*raw.notices, *(f"solid {listed(numbers)}: {line}" for line, numbers in told.items())]


def _of_solid(raw: RawMesh, number: int, asked: Asked) -> tuple[MeshRepair, IntArray, list[str]]:
    """Return one of several solids as `_of_components` returns a mesh. Raises MeshError, with its number and name."""
    solid = raw.solids[number]
    try:
        return _of_components(only(replace(raw, notices=()), (solid,)), asked)
    except MeshError as error:
        name = f" ({solid.name!r:.40})" if solid.name else ""
        raise MeshError(f"solid {number}{name}: {error}") from None


def _names(raw: RawMesh, mesh: MeshRepair, owners: IntArray) -> tuple[str, ...]:
    """Return the names of the bodies of a mesh: that of the solid, or of the first group that has all of its faces."""
    count = int(owners.max()) + 1
    if count == len(raw.solids):
        return tuple(solid.name for solid in raw.solids)
    if count == 1:
        return ("",)
    rows = [mesh.old[owners == number] for number in range(count)]
    return tuple(next((name for name, own in raw.groups.items() if np.isin(row, own).all()), "") for row in rows)


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
    mesh, notices = MeshRepair(vertices, unit, triangles, left, middle, size), [*raw.notices, *remarks, *mended]
    for repair in () if is_known_sound(triangles) else (without_doubled, without_flaps, split):
        mesh, repaired = repair(mesh)
        notices += repaired
    return mesh, notices


def _box(vertices: Array, faces: IntArray) -> tuple[Array, float, list[str]]:
    """Return the middle (3,) and the longest side of the used vertices' box, and notices of its size and place."""
    used = vertices[used_vertices(faces)]
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
