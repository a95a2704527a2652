"""glTF 2.0, .glb and .gltf, with its buffers inside or in files beside it: the triangles of the scene in their places.

Nodes and materials give groups by their names. The unit of the format is the metre. (Khronos, "glTF 2.0
Specification", 2021.)
"""

import binascii
import json
from base64 import b64decode
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, IntArray
from ..errors import MeshError, check_face_count, check_indices
from ..groups import gathered
from .beside import Beside
from .common import DAMAGED, Content

NUMBERS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}  # by componentType
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
WITHOUT_AREA = {0: "points", 1: "lines", 2: "line loops", 3: "line strips"}
TRIANGLES, STRIP, FAN = 4, 5, 6
COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")
DEEPEST = 100  # nodes above a node
UNIT = "m"


def read_glb(data: bytes, max_faces: int, beside: Beside) -> Content:
    """Read a .glb. beside: reads the files that it names."""
    return scene_of(*_chunks(data), max_faces, beside)


def read_gltf(data: bytes, max_faces: int, beside: Beside) -> Content:
    """Read a .gltf. beside: reads the files that it names."""
    return scene_of(data, b"", max_faces, beside)


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """Return the JSON and the binary chunk of a .glb."""
    if data[:4] != b"glTF" or len(data) < 20:
        raise MeshError(f"not a .glb: its first word is not glTF; {DAMAGED}")
    version, total = (int(number) for number in np.frombuffer(data, "<u4", 2, 4))
    if version != 2:
        raise MeshError(f"glTF version {version} is not supported: save it as 2.0")
    if total > len(data):
        raise MeshError(f"the .glb promises {total} bytes, it has {len(data)}; {DAMAGED}")
    found: dict[bytes, bytes] = {}
    place = 12
    while place + 8 <= total:
        size = int(np.frombuffer(data, "<u4", 1, place)[0])
        found.setdefault(data[place + 4 : place + 8], data[place + 8 : place + 8 + size])
        place += 8 + size
    if b"JSON" not in found:
        raise MeshError(f"the .glb has no description; {DAMAGED}")
    return found[b"JSON"], found.get(b"BIN\0", b"")


def scene_of(text: bytes, binary: bytes, max_faces: int, beside: Beside) -> Content:
    """Return the triangles of a scene from its description, JSON, and the buffer that comes with it."""
    try:
        document = json.loads(text.decode("utf-8-sig"))
        if not isinstance(document, dict) or "asset" not in document:
            raise MeshError("is no glTF: its description has no asset; export it again")
        scene = _Scene(document, binary, max_faces, beside)
        with np.errstate(all="ignore"):  # what is not finite is refused later
            return scene.content()
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        if isinstance(error, MeshError):
            raise
        said = " ".join(str(error).split())[:80]
        raise MeshError(f"not readable as glTF ({type(error).__name__} {said}); {DAMAGED}") from None


@dataclass
class _Scene:
    """A glTF document while its nodes are visited."""

    document: dict[str, Any]
    binary: bytes
    max_faces: int
    beside: Beside
    points: list[Array] = field(default_factory=list)
    faces: list[IntArray] = field(default_factory=list)
    named: list[tuple[str, IntArray]] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)
    visited: set[int] = field(default_factory=set)
    buffers: dict[int, bytes] = field(default_factory=dict)

    def content(self) -> Content:
        """Return the triangles of all nodes of the scene."""
        nodes = self.document.get("nodes", [])
        scenes = self.document.get("scenes", [])
        inner = {child for node in nodes for child in node.get("children", [])}
        roots = [number for number in range(len(nodes)) if number not in inner]
        if scenes:
            roots = scenes[self.document.get("scene", 0)].get("nodes", [])
        for number in roots:
            self._visit(number, np.eye(4), (), 0)
        if not self.faces:
            raise MeshError("has no triangles: export the surface")
        notices = [f"left out {count} {kind}" for kind, count in self.left_out.items()]
        polygons = np.concatenate(self.faces).tolist()
        return Content(np.concatenate(self.points), polygons, tuple(notices), gathered(self.named), UNIT)

    def _visit(self, number: int, above: Array, names: tuple[str, ...], depth: int) -> None:
        """Take the mesh of a node and those below it."""
        if number in self.visited or depth > DEEPEST:
            raise MeshError(f"the nodes of the glTF are no tree; {DAMAGED}")
        self.visited.add(number)
        node = self.document["nodes"][_index(number)]
        place = above @ _matrix(node)
        names = (*names, str(node.get("name", "")))
        if "mesh" in node:
            if "skin" in node:
                self.left_out["skins: the mesh is in its rest position"] += 1
            for primitive in self.document["meshes"][_index(node["mesh"])]["primitives"]:
                self._take(primitive, place, names)
        for child in node.get("children", []):
            self._visit(child, place, names, depth + 1)

    def _take(self, primitive: dict[str, Any], place: Array, names: tuple[str, ...]) -> None:
        """Take the triangles of a primitive."""
        extensions = primitive.get("extensions", {})
        if packed := [name for name in COMPRESSED if name in extensions]:
            raise MeshError(f"compressed by {packed[0]}, which is not read: save it without compression")
        mode = primitive.get("mode", TRIANGLES)
        if mode in WITHOUT_AREA:
            self.left_out[WITHOUT_AREA[mode]] += 1
            return
        points = self._numbers(primitive["attributes"]["POSITION"], "VEC3").astype(np.float64)
        row = np.arange(len(points))
        if "indices" in primitive:
            row = self._numbers(primitive["indices"], "SCALAR").astype(np.int64).ravel()
        faces = _triangles(row, mode)
        check_indices(points, faces)
        first = sum(map(len, self.faces))
        check_face_count(first + len(faces), self.max_faces)
        if np.linalg.det(place[:3, :3]) < 0:
            faces = faces[:, ::-1]
        self.faces.append(faces + sum(map(len, self.points)))
        self.points.append(points @ place[:3, :3].T + place[:3, 3])
        numbers = first + np.arange(len(faces))
        material = self.document["materials"][_index(primitive["material"])] if "material" in primitive else {}
        self.named += [(name, numbers) for name in (*names, str(material.get("name", "")))]

    def _numbers(self, number: int, kind: str) -> NDArray[Any]:
        """Return the numbers of an accessor, (n, width)."""
        accessor = self.document["accessors"][_index(number)]
        if accessor["type"] != kind:
            raise MeshError(f"an accessor of the glTF holds {accessor['type']!r:.20}, expected {kind}; {DAMAGED}")
        if "sparse" in accessor or "bufferView" not in accessor:
            raise MeshError("sparse arrays of glTF are not read: save it without morph targets")
        view = self.document["bufferViews"][_index(accessor["bufferView"])]
        if any(name in view.get("extensions", {}) for name in COMPRESSED):
            raise MeshError("compressed by EXT_meshopt_compression, which is not read: save it without compression")
        dtype, width, count = np.dtype(NUMBERS[accessor["componentType"]]), WIDTHS[kind], _index(accessor["count"])
        step = _index(view.get("byteStride", 0)) or dtype.itemsize * width
        start = _index(view.get("byteOffset", 0)) + _index(accessor.get("byteOffset", 0))
        data = self._buffer(_index(view["buffer"]))
        if (
            count < 1
            or step < dtype.itemsize * width
            or start + (count - 1) * step + dtype.itemsize * width > len(data)
        ):
            raise MeshError(f"an array of the glTF reaches beyond its {len(data)} bytes; {DAMAGED}")
        found = np.ndarray((count, width), dtype, data, start, (step, dtype.itemsize))
        if accessor.get("normalized") and dtype.kind in "iu":
            return np.maximum(found / float(np.iinfo(dtype).max), -1.0)
        return found

    def _buffer(self, number: int) -> bytes:
        if number not in self.buffers:
            uri = self.document["buffers"][number].get("uri")
            if uri is None:
                self.buffers[number] = self.binary
            else:
                self.buffers[number] = _embedded(uri) if uri.startswith("data:") else self.beside(uri)
        return self.buffers[number]


def _embedded(uri: str) -> bytes:
    """Return the bytes of a data URI."""
    try:
        return b64decode(uri.partition(",")[2], validate=True)
    except binascii.Error as error:
        raise MeshError(f"an array of the glTF is no base64 ({error}); {DAMAGED}") from None


def _index(value: Any) -> int:
    """Return a whole number that is not negative; a list would count a negative one from its end."""
    if not isinstance(value, int) or value < 0:
        raise MeshError(f"a number of the glTF must be whole and not negative, got {value!r:.40}; {DAMAGED}")
    return value


def _matrix(node: dict[str, Any]) -> Array:
    """Return the matrix (4, 4) of a node, given whole or as translation, rotation and scale."""
    if "matrix" in node:
        return np.asarray(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = (float(number) for number in node.get("rotation", (0.0, 0.0, 0.0, 1.0)))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    found = np.eye(4)
    found[:3, :3] = rotation * np.asarray(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64).reshape(3)
    found[:3, 3] = np.asarray(node.get("translation", (0.0, 0.0, 0.0)), dtype=np.float64).reshape(3)
    return found


def _triangles(row: IntArray, mode: int) -> IntArray:
    """Return the triangles (m, 3) of a row of corners by the mode of its primitive."""
    if mode == TRIANGLES and len(row) % 3 == 0:
        return row.reshape(-1, 3)
    if mode == STRIP and len(row) >= 3:
        faces = np.stack([row[:-2], row[1:-1], row[2:]], axis=1)
        faces[1::2] = faces[1::2, [1, 0, 2]]
        return faces
    if mode == FAN and len(row) >= 3:
        return np.stack([np.full(len(row) - 2, row[0]), row[1:-1], row[2:]], axis=1)
    raise MeshError(f"{len(row)} corners make no triangles in mode {mode!r:.20}; {DAMAGED}")
