"""Shapes of glTF meshes: positions of their vertices after morph targets and skins.

(Khronos, "glTF 2.0 Specification", 2021, sections 3.7.2.2 and 3.7.3.)
"""

from typing import Any

import numpy as np

from ...arrays import Array, IntArray, Mask
from ..errors import MeshError
from .common import DAMAGED
from .gltf_arrays import Arrays
from .gltf_nodes import Nodes, check_last_row

# Sums of weights are 1 up to rounding, of eight numbers of 8 bits at most 16e-3; what is rounded is divided by the sum.
NOT_WHOLE = 2e-2


def weights_of(node: dict[str, Any], mesh: dict[str, Any]) -> Array | None:
    """Return the weights (k,) of the morph targets of a mesh at a node: the node's, else the mesh's, None for zeros."""
    given = node.get("weights", mesh.get("weights"))
    return None if given is None else np.asarray(given, dtype=np.float64).reshape(len(given))


def morphed(arrays: Arrays, primitive: dict[str, Any], weights: Array | None, used: IntArray) -> Array:
    """Return the positions (n, 3) of the vertices `used`, (n,) ascending, with the weighted targets added.

    Raises MeshError where the weights are not one for each target.
    """
    position = primitive["attributes"]["POSITION"]
    points = arrays.rows(position, "VEC3", used).astype(np.float64)
    targets = primitive.get("targets", [])
    if weights is None:
        return points
    if len(weights) != len(targets):
        raise MeshError(f"{len(weights)} weights for {len(targets)} morph targets of the glTF: export it again")
    for weight, target in zip(weights, targets, strict=True):
        if "POSITION" in target:
            arrays.check_count(target["POSITION"], arrays.count(position), "a morph target")
            points += weight * arrays.rows(target["POSITION"], "VEC3", used)
    return points


def joint_matrices(arrays: Arrays, nodes: Nodes, skin: dict[str, Any]) -> Array:
    """Return the matrices (j, 4, 4) of the joints of a skin, from the mesh to the scene."""
    joints = skin["joints"]
    worlds = np.array([nodes.world(joint) for joint in joints]).reshape(len(joints), 4, 4)
    if "inverseBindMatrices" not in skin:
        return worlds
    number = skin["inverseBindMatrices"]
    if arrays.count(number) < len(joints):
        raise MeshError(f"a skin of the glTF has {arrays.count(number)} matrices for {len(joints)} joints; {DAMAGED}")
    columns = arrays.rows(number, "MAT4", np.arange(len(joints))).astype(np.float64)
    inverse = columns.reshape(-1, 4, 4).transpose(0, 2, 1)
    check_last_row(inverse)
    return worlds @ inverse


def skinned(
    arrays: Arrays, primitive: dict[str, Any], joints: Array, points: Array, used: IntArray
) -> tuple[Array, Mask]:
    """Return where a skin puts points (n, 3), and which of them (n,) it mirrors.

    joints: their matrices (j, 4, 4). used: (n,), the vertices that the points are. The matrix of a vertex is the sum of
    those of its joints, by their weights. Raises MeshError for weights that make no mean, and for joints of none.
    """
    blended, total = np.zeros((len(points), 3, 4)), np.zeros(len(points))
    for number in range(_influences(primitive["attributes"])):
        chosen, weights = _influence(arrays, primitive["attributes"], number, len(joints), used)
        for joint, weight in zip(chosen.T, weights.T, strict=True):
            blended += weight[:, None, None] * joints[joint, :3]
            total += weight
    wrong = np.flatnonzero(~(abs(total - 1.0) <= NOT_WHOLE))
    if len(wrong):
        vertex, weight = used[wrong[0]], total[wrong[0]]
        raise MeshError(f"the weights of vertex {vertex} of a skin sum to {weight:g}, expected 1: normalize them")
    blended /= total[:, None, None]
    moved = np.einsum("nij,nj->ni", blended[:, :, :3], points) + blended[:, :, 3]
    return moved, np.linalg.det(blended[:, :, :3]) < 0


def _influences(attributes: dict[str, Any]) -> int:
    """Return how many sets of joints and weights a primitive has, each of four."""
    sets = [{name[len(kind) :] for name in attributes if name.startswith(kind)} for kind in ("JOINTS_", "WEIGHTS_")]
    expected = {str(number) for number in range(len(sets[0]))}
    if not expected or sets != [expected, expected]:
        raise MeshError(
            "a skinned mesh of the glTF needs JOINTS_0 and WEIGHTS_0, and further sets in pairs; " + DAMAGED
        )
    return len(expected)


def _influence(
    arrays: Arrays, attributes: dict[str, Any], number: int, count: int, used: IntArray
) -> tuple[IntArray, Array]:
    """Return a set of joints (n, 4), each below `count`, and their weights (n, 4), of the vertices that are used."""
    names = f"JOINTS_{number}", f"WEIGHTS_{number}"
    for name in names:
        arrays.check_count(attributes[name], arrays.count(attributes["POSITION"]), name)
    joints, weights = (
        arrays.numbers(attributes[names[0]], "VEC4", used),
        arrays.rows(attributes[names[1]], "VEC4", used),
    )
    if joints.max() >= count:
        raise MeshError(f"{names[0]} of the glTF names joint {joints.max()}, its skin has {count} (from 0); {DAMAGED}")
    if (weights < 0).any():
        raise MeshError(f"{names[1]} of the glTF has negative weights: normalize the weights of the skin")
    return joints, weights.astype(np.float64)
