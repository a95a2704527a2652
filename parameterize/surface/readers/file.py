"""Reading a surface file: its bytes within a limit, the reader of its format, checks, triangles."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from itertools import chain
from pathlib import Path

import numpy as np

from ...arrays import Array, IntArray
from ...files import gunzip
from ..errors import MeshError, check_face_count, check_finite, check_indices, without_unused_defects
from ..groups import Groups, few, renumbered
from ..triangulation import triangulate
from .common import DAMAGED, Brep, Content, Polygons, Solids, SurfaceFile, most_bytes
from .zip_file import Archive, in_archive, in_folder

# Modules and functions, loaded on use; each raises MeshError, without the file's name, for a bad file.
READERS = {
    ".obj": "obj.read_obj",
    ".stl": "stl.read_stl",
    ".ply": "ply.read_ply",
    ".off": "off.read_off",
    ".mesh": "medit.read_medit",
    ".msh": "gmsh.read_gmsh",
    ".vtu": "vtu.read_vtu",
    ".vtp": "vtu.read_vtp",
    ".vtk": "vtk_legacy.read_vtk",
    ".3mf": "threemf.read_3mf",
    ".glb": "gltf.read_glb",
    ".gltf": "gltf.read_gltf",
    ".step": "cad.read_step",
    ".stp": "cad.read_step",
    ".iges": "cad.read_iges",
    ".igs": "cad.read_iges",
}
FORMATS = tuple(READERS)
CURVED = (".step", ".stp", ".iges", ".igs")  # solid models, whose faces are curved
PACKED = (".gz", ".zip")


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Triangles before any repair: vertices (n, 3), faces (m, 3) with valid indices, groups; sha256 of the source.

    unit: of lengths, "" where it is not known. solids: of a solid model, and brep. conflict: why they cannot be taken
    together, "" where they can. shapes: of some groups, in words.
    """

    vertices: Array
    faces: IntArray
    sha256: str
    notices: tuple[str, ...]
    groups: Groups
    unit: str = ""
    solids: Solids = ()
    brep: Brep | None = None
    conflict: str = ""
    shapes: Mapping[str, str] = field(default_factory=dict)


def reader_of(suffix: str) -> Callable[[SurfaceFile], Content]:
    """Return the reader of a format."""
    module, function = READERS[suffix].split(".")
    found: Callable[[SurfaceFile], Content] = getattr(import_module(f".{module}", __package__), function)
    return found


def read_mesh(path: Path, max_faces: int, deflection: float | None = None) -> RawMesh:
    """Read a file of `FORMATS`, also as .gz or as the only surface of a .zip.

    deflection: largest distance of the triangles from the curved faces of a solid model, in the file's unit.
    """
    if path.is_dir():
        raise MeshError("is a directory: name the surface file in it")
    if path.exists() and not path.is_file():
        raise MeshError("is no regular file: save the surface as one")
    suffix, packed = _endings(path.name)
    if suffix not in FORMATS and packed != ".zip":
        raise MeshError(
            f"unknown format: expected a name ending in one of {' '.join(FORMATS)}, or these with .gz or .zip"
        )
    limit = most_bytes(max_faces)
    stored = data = _read_bytes(path, limit)
    unpacked: tuple[str, ...] = ()
    beside = in_folder(path.parent, limit)
    if packed == ".gz":
        data, unpacked = _unpack(stored, limit), ("unpacked from .gz",)
    elif packed == ".zip":
        archive = Archive(stored, limit)
        member = archive.only(FORMATS)
        data, suffix, unpacked = archive.read(member), _endings(member)[0], (f"unpacked {member!r:.80} from .zip",)
        beside = in_archive(archive, member)
    if not data.strip():
        raise MeshError("the file is empty: export it again")
    if deflection is not None and suffix not in CURVED:
        raise MeshError(f"deflection is for {' '.join(CURVED)}, whose faces are curved: leave --deflection out")
    content = reader_of(suffix)(SurfaceFile(data, max_faces, beside, deflection))
    vertices, faces, notices, groups = triangles_of(content, max_faces)
    digest = hashlib.sha256(stored).hexdigest()
    return RawMesh(
        vertices,
        faces,
        digest,
        unpacked + notices,
        groups,
        content.unit,
        content.solids,
        content.brep,
        content.conflict,
        content.shapes,
    )


def _endings(name: str) -> tuple[str, str]:
    """Return the ending of the format and that of the packing, "" where there is none."""
    suffixes = [suffix.lower() for suffix in Path(name).suffixes]
    packed = suffixes.pop() if suffixes[-1:] and suffixes[-1] in PACKED else ""
    return "".join(suffixes[-1:]), packed


def triangles_of(content: Content, max_faces: int) -> tuple[Array, IntArray, tuple[str, ...], Groups]:
    """Check vertices and polygons; return vertices, the triangles (m, 3) that these are cut into, notices, groups."""
    polygons = content.polygons
    corners, sizes = _flat(polygons)
    check_indices(content.vertices, corners)
    check_finite(content.vertices, corners)
    vertices, unused = without_unused_defects(content.vertices, corners)
    groups, too_many = few(content.groups)
    notices = content.notices + unused + too_many
    fewest = int(sizes.min()) if len(sizes) else 0
    if fewest < 3:
        raise MeshError(f"a face has {fewest} corners, expected at least 3; {DAMAGED}")
    check_face_count(len(corners) - 2 * len(sizes), max_faces)  # before the time is spent on them
    faces = polygons if isinstance(polygons, np.ndarray) else triangulate(vertices, polygons)
    if len(faces) > len(sizes):
        notices = (*notices, f"{len(sizes)} polygons cut into {len(faces)} triangles")
    return vertices, faces, notices, renumbered(groups, np.repeat(np.arange(len(sizes)), sizes - 2))


def _flat(polygons: Polygons) -> tuple[IntArray, IntArray]:
    """Return the corners of all polygons, one after the other, and the number of corners of each."""
    if isinstance(polygons, np.ndarray):
        return polygons.ravel(), np.full(len(polygons), 3)
    corners = np.fromiter(chain.from_iterable(polygons), dtype=np.int64)
    return corners, np.fromiter(map(len, polygons), dtype=np.int64)


def _read_bytes(path: Path, limit: int) -> bytes:
    try:
        size = path.stat().st_size
        if size > limit:
            raise MeshError(f"{size} bytes, more than the limit of {limit}: decimate the surface or raise --max-faces")
        return path.read_bytes()
    except FileNotFoundError:
        raise MeshError("no such file: check the name and the folder") from None
    except OSError as error:
        raise MeshError(f"cannot be read ({error.strerror}): check its permissions") from None


def _unpack(stored: bytes, limit: int) -> bytes:
    try:
        data = gunzip(stored, limit)
    except ValueError as error:
        raise MeshError(f"{error}; {DAMAGED}") from None
    if len(data) > limit:
        raise MeshError(f"unpacks to more than {limit} bytes: decimate the surface or raise --max-faces")
    return data
