"""glTF 2.0, .glb and .gltf, with its buffers inside or in files beside it: the triangles of the scene in their places.

Nodes and materials give groups by their names. The unit of the format is the metre. Animations are left out: what
nodes, weights and joints say is the scene at rest. (Khronos, "glTF 2.0 Specification", 2021.)
"""

import json
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...arrays import Array, IntArray, Mask
from ..errors import MeshError, check_face_count, check_indices
from ..groups import gathered
from .common import DAMAGED, Content, SurfaceFile
from .gltf_arrays import Arrays, item
from .gltf_extensions import INSTANCES, compression_of, extension, unread
from .gltf_nodes import Nodes, instance_count, instance_places
from .gltf_shapes import joint_matrices, morphed, skinned, weights_of

WITHOUT_AREA = {0: "primitive{s} of points", 1: "line{s}", 2: "line loop{s}", 3: "line strip{s}"}  # by their modes
TRIANGLES, STRIP, FAN = 4, 5, 6
ARRAYS = ("POSITION", "JOINTS_", "WEIGHTS_")  # of a primitive, those that are read
UNIT = "m"


def read_glb(file: SurfaceFile) -> Content:
    """Read a .glb."""
    return _scene_of(*_chunks(file.data), file)


def read_gltf(file: SurfaceFile) -> Content:
    """Read a .gltf."""
    return _scene_of(file.data, b"", file)


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """Return the JSON and the binary chunk of a .glb."""
    if data[:4] != b"glTF" or len(data) < 20:
        raise MeshError(f"not a .glb: its first word is not glTF; {DAMAGED}")
    version, total = (int(number) for number in np.frombuffer(data, "<u4", 2, 4))
    _check_version(f"{version}.0")
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


def _scene_of(text: bytes, binary: bytes, file: SurfaceFile) -> Content:
    """Return the triangles of a scene from its description, JSON, and the buffer that comes with it."""
    try:
        document = json.loads(text.decode("utf-8-sig"))
        if not isinstance(document, dict) or "asset" not in document:
            raise MeshError("is no glTF: its description has no asset; export it again")
        _check_version(document["asset"].get("version", "2.0"))
        with np.errstate(all="ignore"):  # what is not finite is refused later
            notices = unread(document)
            arrays = Arrays(document, binary, file.beside)
            return _Scene(document, arrays, Nodes(document), file.max_faces).content(notices)
    except (ValueError, KeyError, IndexError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"not readable as glTF ({_in_words(error)}); {DAMAGED}") from None


def _check_version(version: object) -> None:
    """Raise MeshError for the version of another glTF: others are built in other ways."""
    if not str(version).startswith("2."):
        raise MeshError(f"glTF version {str(version):.20} is not supported: save it as 2.0")


def _in_words(error: Exception) -> str:
    """Return what is wrong with a description, whose parts are taken to be as the format says until one is not."""
    if isinstance(error, json.JSONDecodeError | UnicodeDecodeError):
        return f"its description is no JSON: {' '.join(str(error).split())[:80]}"
    if isinstance(error, KeyError):
        return f"its description lacks {str(error.args[0])[:40]!r}"
    return "a part of its description is not what the format says"


@dataclass
class _Scene:
    """A glTF document while its nodes are visited. taken, placed: how many faces and points it has so far."""

    document: dict[str, Any]
    arrays: Arrays
    nodes: Nodes
    max_faces: int
    points: list[Array] = field(default_factory=list)
    faces: list[IntArray] = field(default_factory=list)
    named: list[tuple[str, IntArray]] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)
    skins: dict[int, Array] = field(default_factory=dict)
    taken: int = 0
    placed: int = 0

    def content(self, notices: tuple[str, ...]) -> Content:
        """Return the triangles of all nodes of the scene, with further notices."""
        meshes = {number for number, node in enumerate(self.nodes.rows) if "mesh" in node}
        for number, names, hidden in self.nodes.walk():
            if number in meshes and hidden:
                self.left_out[f"node{{s}} with a mesh, {hidden}"] += 1
            else:
                self._visit(number, names)
            meshes.discard(number)
        self.left_out["node{s} with a mesh, outside the scene"] += len(meshes)
        self.left_out["animation{s}: the scene is read at rest"] += len(self.document.get("animations", []))
        left_out = [f"left out {n} {kind.format(s='s' * (n != 1))}" for kind, n in self.left_out.items() if n]
        if not self.faces:
            raise MeshError(f"has no triangles{'; ' * bool(left_out)}{', '.join(left_out)}: export the surface")
        polygons = np.concatenate(self.faces).tolist()
        return Content(np.concatenate(self.points), polygons, (*left_out, *notices), gathered(self.named), UNIT)

    def _visit(self, number: int, names: tuple[str, ...]) -> None:
        """Take the mesh of a node, where it has one."""
        node = self.nodes.node(number)
        if "mesh" not in node:
            self.left_out["set{s} of instances without a mesh"] += bool(extension(node, INSTANCES))
            return
        if "skin" in node and extension(node, INSTANCES):
            raise MeshError(f"instances ({INSTANCES}) of a skinned mesh have no meaning: export it without one of them")
        for primitive in item(self.document.get("meshes", []), node["mesh"], "mesh")["primitives"]:
            mode = primitive.get("mode", TRIANGLES)
            if mode in WITHOUT_AREA:
                self.left_out[WITHOUT_AREA[mode]] += 1
            elif "POSITION" not in primitive["attributes"]:
                self.left_out["primitive{s} without positions"] += 1
            else:
                self._take(primitive, number, names)

    def _take(self, primitive: dict[str, Any], number: int, names: tuple[str, ...]) -> None:
        """Take the triangles of a primitive of the mesh at a node."""
        node = self.nodes.node(number)
        self._check_plain(primitive)
        count = instance_count(self.arrays, node)
        used, faces = self._faces(primitive, count)
        weights = weights_of(node, item(self.document["meshes"], node["mesh"], "mesh"))
        points = morphed(self.arrays, primitive, weights, used)
        if "skin" in node:  # the node's own place has no meaning then
            moved, mirrored = skinned(self.arrays, primitive, self._joints(node["skin"]), points, used)
        else:
            places = self.nodes.world(number) @ instance_places(self.arrays, node, count)
            moved = points @ places[:, :3, :3].transpose(0, 2, 1) + places[:, None, :3, 3]
            mirrored = np.repeat(np.linalg.det(places[:, :3, :3]) < 0, len(points))
        self._add(moved.reshape(-1, 3), _turned(_repeated(faces, len(points), count), mirrored), primitive, names)

    def _check_plain(self, primitive: dict[str, Any]) -> None:
        """Raise MeshError where a primitive has compressed arrays alone."""
        attributes = primitive["attributes"]
        read = [attributes[name] for name in attributes if name.startswith(ARRAYS)]
        read += [primitive["indices"]] if "indices" in primitive else []
        if (packed := compression_of(primitive)) and not all(map(self.arrays.is_stored, read)):
            raise MeshError(f"compressed by {packed}, which is not read: save it without compression")

    def _faces(self, primitive: dict[str, Any], instances: int) -> tuple[IntArray, IntArray]:
        """Return the vertices of a primitive that triangles use, (n,) ascending, and these triangles (m, 3) of them.

        The limit of faces is checked for all instances before arrays take memory.
        """
        mode = primitive.get("mode", TRIANGLES)
        vertices = self.arrays.count(primitive["attributes"]["POSITION"])
        corners = self.arrays.count(primitive["indices"]) if "indices" in primitive else vertices
        check_face_count(self.taken + instances * (corners // 3 if mode == TRIANGLES else corners - 2), self.max_faces)
        row: IntArray = np.arange(corners)
        if "indices" in primitive:
            row = self.arrays.numbers(primitive["indices"], "SCALAR", row).ravel()
        faces = _triangles(row, mode)
        check_indices(np.broadcast_to(0.0, (vertices, 3)), faces)
        used, numbers = np.unique(faces, return_inverse=True)
        return used, numbers.reshape(-1, 3)

    def _joints(self, number: Any) -> Array:
        """Return the matrices (j, 4, 4) of the joints of a skin."""
        skin = item(self.document.get("skins", []), number, "skin")
        if number not in self.skins:
            self.skins[number] = joint_matrices(self.arrays, self.nodes, skin)
        return self.skins[number]

    def _add(self, points: Array, faces: IntArray, primitive: dict[str, Any], names: tuple[str, ...]) -> None:
        """Add triangles in their place to those of the scene, and to the groups of their nodes and their material."""
        numbers = self.taken + np.arange(len(faces))
        self.taken += len(faces)
        self.faces.append(faces + self.placed)
        self.placed += len(points)
        self.points.append(points)
        material = {}
        if "material" in primitive:
            material = item(self.document.get("materials", []), primitive["material"], "material")
        self.named += [(name, numbers) for name in (*names, str(material.get("name", "")))]


def _repeated(faces: IntArray, points: int, count: int) -> IntArray:
    """Return the triangles (count * m, 3) of `count` copies of triangles (m, 3) of so many points."""
    return (faces + points * np.arange(count)[:, None, None]).reshape(-1, 3)


def _turned(faces: IntArray, mirrored: Mask) -> IntArray:
    """Return triangles (m, 3), those turned round of which most corners are mirrored. mirrored: of each point (n,)."""
    return np.where(mirrored[faces].sum(axis=1)[:, None] >= 2, faces[:, ::-1], faces)


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
