"""Reading a surface file: its bytes within a limit, the reader of its format, checks, triangles."""

import gzip
import hashlib
import io
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

import numpy as np

from ...arrays import Array, IntArray
from ..errors import MeshError, check_face_count, check_finite, check_indices, without_unused_defects
from ..groups import Groups, few, renumbered
from ..triangulation import triangulate
from .common import DAMAGED, Content, most_bytes
from .gmsh import read_gmsh
from .medit import read_medit
from .obj import read_obj
from .off import read_off
from .ply import read_ply
from .stl import read_stl
from .vtu import read_vtu

# Each takes the bytes of a file, and how many faces it may have; MeshError, without the file's name, for a bad one.
READERS: dict[str, Callable[[bytes, int], Content]] = {
    ".obj": read_obj,
    ".stl": read_stl,
    ".ply": read_ply,
    ".off": read_off,
    ".mesh": read_medit,
    ".msh": read_gmsh,
    ".vtu": read_vtu,
}
FORMATS = tuple(READERS)


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Triangles before any repair: vertices (n, 3), faces (m, 3) with valid indices, groups; sha256 of the source."""

    vertices: Array
    faces: IntArray
    sha256: str
    notices: tuple[str, ...]
    groups: Groups


def read_mesh(path: Path, max_faces: int) -> RawMesh:
    """Read .obj, .stl, .ply, .off (surfaces) and .mesh, .msh, .vtu (solids: their boundary), each also as .gz."""
    if path.is_dir():
        raise MeshError("is a directory: name the surface file in it")
    if path.exists() and not path.is_file():
        raise MeshError("is no regular file: save the surface as one")
    suffixes = [suffix.lower() for suffix in path.suffixes]
    packed = suffixes[-1:] == [".gz"]
    suffix = "".join((suffixes[:-1] if packed else suffixes)[-1:])
    if suffix not in READERS:
        raise MeshError(f"unknown format: expected a name ending in one of {' '.join(FORMATS)}, or these with .gz")
    stored = _read_bytes(path, most_bytes(max_faces))
    data = _unpack(stored, most_bytes(max_faces)) if packed else stored
    if not data.strip():
        raise MeshError("the file is empty: export it again")
    content = READERS[suffix](data, max_faces)
    vertices, faces, notices, groups = triangles_of(content, max_faces)
    unpacked = ("unpacked from .gz",) * packed
    return RawMesh(vertices, faces, hashlib.sha256(stored).hexdigest(), unpacked + notices, groups)


def triangles_of(content: Content, max_faces: int) -> tuple[Array, IntArray, tuple[str, ...], Groups]:
    """Check vertices and polygons; return vertices, the triangles (m, 3) that these are cut into, notices, groups."""
    corners = np.fromiter(chain.from_iterable(content.polygons), dtype=np.int64)
    check_indices(content.vertices, corners)
    check_finite(content.vertices, corners)
    vertices, unused = without_unused_defects(content.vertices, corners)
    groups, too_many = few(content.groups)
    notices = content.notices + unused + too_many
    fewest = min(map(len, content.polygons), default=0)
    if fewest < 3:
        raise MeshError(f"a face has {fewest} corners, expected at least 3; {DAMAGED}")
    check_face_count(len(corners) - 2 * len(content.polygons), max_faces)  # before the time is spent on them
    faces = triangulate(vertices, content.polygons)
    pieces = [len(polygon) - 2 for polygon in content.polygons]
    if len(faces) > len(content.polygons):
        notices = (*notices, f"{len(content.polygons)} polygons cut into {len(faces)} triangles")
    return vertices, faces, notices, renumbered(groups, np.repeat(np.arange(len(pieces)), pieces))


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
        with gzip.open(io.BytesIO(stored)) as stream:
            data = stream.read(limit + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise MeshError(f"not a whole .gz file ({error}); {DAMAGED}") from None
    if len(data) > limit:
        raise MeshError(f"unpacks to more than {limit} bytes: decimate the surface or raise --max-faces")
    return data
