"""The shells of a surface, its components: which lie inside which, walls of cavities, bodies beside each other."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..arrays import IntArray
from .errors import MeshError
from .geometry import connected, signed_volume
from .mesh_repair import MeshRepair
from .solid import Solid

LEAST_VOLUME = 1e-12  # share of the cube over the box's longest side
LISTED = 8


def components(faces: IntArray) -> list[IntArray]:
    """Return the face numbers of each component (faces sharing a vertex), the largest first."""
    label = connected(faces[:, [0, 1, 0, 2]].reshape(-1, 2), int(faces.max()) + 1)[faces[:, 0]]
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(groups, key=lambda group: (-len(group), int(group[0])))


def labels_of(groups: list[IntArray]) -> IntArray:
    """Return the number of the component of each face (m,)."""
    label = np.empty(sum(map(len, groups)), dtype=np.int64)
    for number, group in enumerate(groups):
        label[group] = number
    return label


def sizes_of(groups: list[IntArray]) -> str:
    """Return the numbers of faces of components in words."""
    sizes = ", ".join(f"{i}: {len(group)} faces" for i, group in enumerate(groups[:LISTED]))
    return sizes + (f", and {len(groups) - LISTED} more" if len(groups) > LISTED else "")


def inside(mesh: MeshRepair, groups: list[IntArray], outers: Iterable[int]) -> list[list[int]]:
    """Return the numbers of the components that lie inside each of some of them."""
    corners = [mesh.points[mesh.faces[group]].reshape(-1, 3) for group in groups]
    low, high = (np.array([choose(points, axis=0) for points in corners]) for choose in (np.min, np.max))
    found = []
    for outer in outers:
        solid = Solid(mesh.points, mesh.faces[groups[outer]])
        within = np.flatnonzero(np.all((low > low[outer]) & (high < high[outer]), axis=1)).tolist()
        found.append([i for i in within if np.all(np.abs(solid.winding_numbers(corners[i])) > 0.5)])
    return found


def _around(mesh: MeshRepair, groups: list[IntArray]) -> list[list[int]]:
    """Return the numbers of the components inside which each one lies; a body that fills a cavity lies in its wall."""
    if len(groups) == 1:
        return [[]]
    within = inside(mesh, groups, range(len(groups)))
    places = [np.unique(mesh.points[np.unique(mesh.faces[group])], axis=0).tobytes() for group in groups]
    return [
        [k for k in range(len(groups)) if inner in within[k] or (k < inner and places[k] == places[inner])]
        for inner in range(len(groups))
    ]


def wound_as_walls(mesh: MeshRepair) -> tuple[MeshRepair, IntArray, list[str]]:
    """Return closed components wound as the walls of bodies, the body of each face (m,), from 0 on, and notices.

    A component inside an odd number of others is the wall of a cavity, and is wound inward; all others bound bodies.
    The faces of one component must be wound alike. Raises MeshError for a component that encloses no volume.
    """
    groups = components(mesh.faces)
    around = _around(mesh, groups)
    hollow = np.array([len(outer) % 2 == 1 for outer in around])
    volumes = np.array([signed_volume(mesh.points, mesh.faces[group]) for group in groups])
    if np.any(abs(volumes) < LEAST_VOLUME):
        raise MeshError("encloses no volume (a flat or doubled sheet): give it thickness")
    number = np.cumsum(~hollow) - 1
    walls = [max(outer, key=lambda k: len(around[k])) if len(outer) % 2 else k for k, outer in enumerate(around)]
    turned = (volumes < 0.0) != hollow
    label = labels_of(groups)
    faces = np.where(turned[label][:, None], mesh.faces[:, ::-1], mesh.faces)
    notices = ["inverted orientation flipped: faces now point outward"] if turned[~hollow].any() else []
    if number[-1] > 0:
        notices.append(f"{number[-1] + 1} bodies are kept ({sizes_of(groups)}): --component takes one")
    if hollow.any():
        share = abs(volumes[hollow]).sum() / abs(volumes[~hollow]).sum()
        kept = "1 cavity is kept" if hollow.sum() == 1 else f"{hollow.sum()} cavities are kept"
        notices.append(f"{kept}, {share:.2%} of the volume around: --component takes a body with its cavities filled")
    return replace(mesh, faces=faces), number[walls][label], notices
