"""Nodes of glTF: which are in the scene, and where they, and instances at them, stand.

(Khronos, "glTF 2.0 Specification", 2021, sections 3.4 and 3.5; extensions KHR_node_visibility, MSFT_lod and
EXT_mesh_gpu_instancing.)
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ..errors import MeshError
from .common import DAMAGED
from .gltf_arrays import Arrays, item, whole
from .gltf_extensions import INSTANCES, LEVELS, VISIBILITY, extension

DEEPEST = 100  # nodes above a node
NO_TREE = f"the nodes of the glTF are no tree; {DAMAGED}"
LAST_ROW = (0.0, 0.0, 0.0, 1.0)  # of the matrix of a place
NOT_UNIT = 1e-2  # length of a rotation beside 1; numbers of 8 bits leave 4e-3 each
SAME = 1e-5  # of two matrices of single precision
MOVES = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}  # arrays of instances


class Nodes:
    """The nodes of a glTF, as trees. Raises MeshError where they are none."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.rows: list[dict[str, Any]] = document.get("nodes", [])
        self.parents: dict[int, int] = {}
        self._worlds: dict[int, Array] = {}
        for number, node in enumerate(self.rows):
            for child in node.get("children", []):
                if whole(child) in self.parents:
                    raise MeshError(NO_TREE)
                self.parents[child] = number
        self.roots = self._roots(document)
        self.coarser = {number for node in self.rows for number in extension(node, LEVELS).get("ids", [])}

    def _roots(self, document: dict[str, Any]) -> list[int]:
        """Return the first nodes of the scene that the file chooses, else of its first; without scenes, all roots."""
        scenes = document.get("scenes", [])
        if not scenes:
            return [number for number in range(len(self.rows)) if number not in self.parents]
        roots = [whole(number) for number in item(scenes, document.get("scene", 0), "scene").get("nodes", [])]
        if len(set(roots)) < len(roots) or not self.parents.keys().isdisjoint(roots):
            raise MeshError(NO_TREE)
        return roots

    def walk(self) -> Iterator[tuple[int, tuple[str, ...], str]]:
        """Yield each node of the scene with the names of the nodes down to it, and why it is not shown, "" if it is."""
        stack: list[tuple[int, tuple[str, ...], str]] = [(root, (), "") for root in reversed(self.roots)]
        while stack:
            number, above, hidden = stack.pop()
            if len(above) > DEEPEST:
                raise MeshError(f"the nodes of the glTF are nested more than {DEEPEST} deep: export it with fewer")
            node = self.node(number)
            names = (*above, str(node.get("name", "")))
            if not extension(node, VISIBILITY).get("visible", True):
                hidden = hidden or f"not visible ({VISIBILITY})"
            elif number in self.coarser:
                hidden = hidden or f"a coarser level of detail ({LEVELS})"
            yield number, names, hidden
            stack += [(child, names, hidden) for child in reversed(node.get("children", []))]

    def node(self, number: Any) -> dict[str, Any]:
        """Return a node by its number."""
        return item(self.rows, number, "node")

    def world(self, number: Any, depth: int = 0) -> Array:
        """Return the matrix (4, 4) from a node's coordinates to those of the scene."""
        node = self.node(number)
        if depth > DEEPEST:
            raise MeshError(NO_TREE)
        if number not in self._worlds:
            own, parent = _matrix(node), self.parents.get(number)
            self._worlds[number] = own if parent is None else self.world(parent, depth + 1) @ own
        return self._worlds[number]


def instance_count(arrays: Arrays, node: dict[str, Any]) -> int:
    """Return how often the mesh of a node is there: once, or once for each of its instances."""
    if INSTANCES not in node.get("extensions", {}):
        return 1
    attributes = extension(node, INSTANCES)["attributes"]
    if other := [name for name in attributes if name not in MOVES and not name.startswith("_")]:
        raise MeshError(
            f"instances have the attribute {other[0]!r:.40}, which is not read: export it without instances"
        )
    counts = {arrays.count(number) for number in attributes.values()}
    if len(counts) != 1:
        raise MeshError(f"the arrays of instances ({INSTANCES}) have {sorted(counts)} elements: export it again")
    return counts.pop()


def instance_places(arrays: Arrays, node: dict[str, Any], count: int) -> Array:
    """Return the matrices (count, 4, 4) from the mesh of a node to the node's coordinates, one for each instance."""
    attributes = extension(node, INSTANCES).get("attributes", {})
    given = {
        name: arrays.rows(attributes[name], kind, np.arange(count)).astype(np.float64)
        for name, kind in MOVES.items()
        if name in attributes
    }
    return _composed(count, given.get("TRANSLATION"), given.get("ROTATION"), given.get("SCALE"))


def check_last_row(matrices: Array) -> None:
    """Raise MeshError where matrices (n, 4, 4) do more than turn, scale and move, as those that are written by rows."""
    wrong = ~(abs(matrices[:, 3] - LAST_ROW) <= SAME).all(axis=1)
    if wrong.any():
        row = ", ".join(f"{number:g}" for number in matrices[wrong][0, 3])
        raise MeshError(f"a matrix of the glTF has the last row ({row}), expected (0, 0, 0, 1): export it again")


def _matrix(node: dict[str, Any]) -> Array:
    """Return the matrix (4, 4) of a node, given whole, or as translation, rotation and scale."""
    given = [node.get(name) for name in ("translation", "rotation", "scale")]
    composed = _composed(1, *(None if row is None else np.asarray([row], dtype=np.float64) for row in given))[0]
    if "matrix" not in node:
        return composed
    matrix = np.asarray(node["matrix"], dtype=np.float64).reshape(4, 4).T
    check_last_row(matrix[None])
    if given != [None, None, None] and not np.allclose(matrix, composed, rtol=SAME, atol=SAME):
        raise MeshError("a node of the glTF has a matrix and another translation, rotation or scale: export it again")
    return matrix


def _composed(count: int, translation: Array | None, rotation: Array | None, scale: Array | None) -> Array:
    """Return the matrices (count, 4, 4) that scale first, then turn by a quaternion x, y, z, w, then move.

    translation and scale: (count, 3). rotation: (count, 4). Raises MeshError for quaternions not of length 1.
    """
    found = np.tile(np.eye(4), (count, 1, 1))
    if rotation is not None:
        found[:, :3, :3] = _turned(rotation.reshape(count, 4))
    if scale is not None:
        found[:, :3, :3] *= scale.reshape(count, 1, 3)
    if translation is not None:
        found[:, :3, 3] = translation.reshape(count, 3)
    return found


def _turned(quaternions: ArrayLike) -> Array:
    """Return the rotations (n, 3, 3) of quaternions (n, 4), whose rounding is taken out."""
    given = np.asarray(quaternions, dtype=np.float64)
    lengths = np.linalg.norm(given, axis=1)
    wrong = ~(abs(lengths - 1.0) <= NOT_UNIT)
    if wrong.any():
        raise MeshError(
            f"a rotation of the glTF is a quaternion of length {lengths[wrong][0]:g}, expected 1; {DAMAGED}"
        )
    x, y, z, w = (given / lengths[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
