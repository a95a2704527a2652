"""Reading a surface file: bytes within a limit, header check, the format's parser, triangles."""

from __future__ import annotations

import gzip
import hashlib
import io
import logging
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...arrays import Array, IntArray
from ..errors import MeshError
from ..triangulation import triangulate
from .gmsh import trim_gmsh
from .headers import DAMAGED, check_face_count, check_header, plain_ply
from .medit import trim_medit
from .obj import trim_obj
from .off import off_to_obj
from .ply import text_ply_to_obj
from .stl import trim_stl
from .vtu import unpacking_at_most

TRIMESH_FORMATS = (".stl", ".ply")
MESHIO_FORMATS = {".obj": "obj", ".ply": "ply", ".mesh": "medit", ".msh": "gmsh", ".vtu": "vtu"}
FORMATS = (".obj", ".stl", ".ply", ".off", ".mesh", ".msh", ".vtu")
REWRITTEN: dict[str, Callable[[bytes], bytes | None]] = {
    ".obj": bytes,
    ".off": off_to_obj,
    ".ply": text_ply_to_obj,
}  # as OBJ records, where a file is text
POLYGONS = ("triangle", "quad", "polygon")
BYTES_PER_FACE = 500  # an ASCII STL facet, the most wasteful of the formats, takes about 300
BYTES_AT_LEAST = 64 << 20
LARGEST = 1e90  # coordinate: volumes beyond its cube leave double precision
OUTWARD_FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])  # of a tetrahedron of positive volume


@dataclass(frozen=True, eq=False)
class RawMesh:
    """Triangles as a file gives them: vertices (n, 3), faces (m, 3), indices in range; sha256 of the file's bytes."""

    vertices: Array
    faces: IntArray
    sha256: str
    notices: tuple[str, ...]


def read_mesh(path: Path, max_faces: int) -> RawMesh:
    """Read .obj, .stl, .ply, .off (surfaces) and .mesh, .msh, .vtu (tetrahedra: their boundary), each also as .gz.

    Raises MeshError, without the file's name.
    """
    if path.is_dir():
        raise MeshError("is a directory: name the surface file in it")
    suffixes = [suffix.lower() for suffix in path.suffixes]
    packed = suffixes[-1:] == [".gz"]
    suffix = "".join((suffixes[:-1] if packed else suffixes)[-1:])
    if suffix not in FORMATS:
        raise MeshError(f"unknown format: expected a name ending in one of {' '.join(FORMATS)}, or these with .gz")
    limit = BYTES_AT_LEAST + BYTES_PER_FACE * max_faces
    stored = _read_bytes(path, limit)
    data = _unpack(stored, limit) if packed else stored
    if not data.strip():
        raise MeshError("the file is empty: export it again")
    if suffix == ".stl":
        data = trim_stl(data)
    header = check_header(data, suffix, max_faces)
    notices = [*(["unpacked from .gz"] if packed else []), *header.notices]
    as_obj = REWRITTEN[suffix](data) if suffix in REWRITTEN else None
    if as_obj is not None:
        suffix, (data, remarks) = ".obj", trim_obj(as_obj, max_faces)
        notices += remarks
    elif suffix == ".msh":
        data = trim_gmsh(data)
    elif suffix == ".mesh":
        data = trim_medit(data)
    promised = header.polygons or 0
    plain = plain_ply(data) if suffix == ".ply" else None
    if suffix in TRIMESH_FORMATS and plain is None:
        vertices, faces = _parse_trimesh(data, suffix)
        count = min(len(faces), promised)
    else:
        vertices, faces, count = _parse_meshio(plain or data, suffix, max_faces)
    if count < promised:
        raise MeshError(f"{promised} faces promised, {count} read; {DAMAGED}")
    if len(faces) > count:
        notices.append(f"{count} polygons cut into {len(faces)} triangles")
    return RawMesh(vertices, faces, hashlib.sha256(stored).hexdigest(), tuple(notices))


def check_finite(vertices: Array) -> None:
    """Raise MeshError for coordinates that are NaN, infinite or too large to compute volumes with."""
    broken = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(broken):
        raise MeshError(
            f"{len(broken)} vertices with NaN or infinite coordinates, the first is vertex {broken[0]} (from 0): "
            "export the surface again"
        )
    if abs(vertices).max(initial=0.0) > LARGEST:
        raise MeshError(f"coordinates beyond {LARGEST:g} cannot be computed with: choose a larger unit of length")


def check_indices(vertices: Array, faces: IntArray) -> None:
    """Raise MeshError where faces name vertices that do not exist."""
    wrong = np.flatnonzero((faces.ravel() < 0) | (faces.ravel() >= len(vertices)))
    if len(wrong):
        raise MeshError(
            f"{len(wrong)} vertex numbers out of range, the first is {int(faces.ravel()[wrong[0]])} (counted from 0) "
            f"where there are {len(vertices)} vertices; export the file again"
        )


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


def _parse_trimesh(data: bytes, suffix: str) -> tuple[Array, IntArray]:
    import trimesh

    try:
        with _quiet():
            mesh = trimesh.load_mesh(io.BytesIO(data), file_type=suffix[1:], process=False)
        vertices = np.array(mesh.vertices, dtype=np.float64)
        faces = np.array(mesh.faces, dtype=np.int64)
    except Exception as error:  # a parser may fail on a damaged file in any way
        raise MeshError(f"not readable as {suffix} ({_first_line(error)}); {DAMAGED}") from None
    check_indices(vertices, faces)
    return vertices, faces


def _parse_meshio(data: bytes, suffix: str, max_faces: int) -> tuple[Array, IntArray, int]:
    """Vertices, triangles, and the number of polygons they were cut from."""
    import meshio

    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder, f"mesh{suffix}")
        copy.write_bytes(data)
        try:
            with _quiet(), unpacking_at_most(BYTES_AT_LEAST + BYTES_PER_FACE * max_faces):
                mesh = meshio.read(copy, file_format=MESHIO_FORMATS[suffix])
        except (Exception, SystemExit) as error:  # meshio exits the process on some files
            raise MeshError(f"not readable as {suffix} ({_first_line(error)}); {DAMAGED}") from None
    vertices = np.asarray(mesh.points, dtype=np.float64)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise MeshError(f"points of shape {vertices.shape} are not in space: export three coordinates each")
    check_finite(vertices)
    others = [block for block in mesh.cells if block.type not in (*POLYGONS, "tetra", "vertex", "line")]
    if others:
        found = f"{len(others[0].data)} cells of type {others[0].type}"
        raise MeshError(f"holds {found}: save linear tetrahedra or triangles")
    blocks = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
    for kind, rows in blocks:
        if kind in POLYGONS and (rows.ndim != 2 or rows.shape[1] < 3):
            raise MeshError(f"a face with fewer corners than it promises; {DAMAGED}")
        if kind == "tetra" and rows.shape[1:] != (4,):
            raise MeshError(f"tetrahedra with fewer corners than 4; {DAMAGED}")
        check_indices(vertices, rows)
    tetrahedra = [rows for kind, rows in blocks if kind == "tetra"]
    if tetrahedra:
        faces = tetrahedra_boundary(vertices, np.concatenate(tetrahedra))
        return vertices, faces, len(faces)
    polygons = [polygon for kind, rows in blocks if kind in POLYGONS for polygon in rows.tolist()]
    if not polygons:
        raise MeshError("no tetrahedra and no triangles in the file: export the volume or its surface")
    check_face_count(sum(map(len, polygons)) - 2 * len(polygons), max_faces)  # before the time is spent on them
    return vertices, triangulate(vertices, polygons), len(polygons)


def tetrahedra_boundary(vertices: Array, tetrahedra: IntArray) -> IntArray:
    """Boundary triangles (m, 3), oriented outward, of tetrahedra (k, 4) in either orientation."""
    a, b, c, d = (vertices[tetrahedra[:, i]] for i in range(4))
    inverted = np.sum(np.cross(b - a, c - a) * (d - a), axis=1) < 0
    corners = np.where(inverted[:, None], tetrahedra[:, [1, 0, 2, 3]], tetrahedra)
    faces = corners[:, OUTWARD_FACES].reshape(-1, 3)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    boundary: IntArray = faces[np.sort(first[count == 1])]
    return boundary


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep the parsers from printing and logging what they raise."""
    logger = logging.getLogger("trimesh")
    before, logger.disabled = logger.disabled, True
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    finally:
        logger.disabled = before


def _first_line(error: BaseException) -> str:
    return (str(error).strip().splitlines() or [type(error).__name__])[0][:120]
