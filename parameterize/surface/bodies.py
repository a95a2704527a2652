"""The bodies of a surface: copies are dropped, one is chosen, cavities are told."""

from numbers import Integral
from typing import Literal

import igl
import numpy as np

from ..arrays import Array, IntArray, in_brackets
from .errors import MeshError
from .geometry import connected, directed_edges
from .mesh_repair import MeshRepair
from .solid import Solid
from .topology import crossing_faces, crossing_places
from .welding import is_oriented

Choice = int | Literal["largest"] | None

LARGEST = "largest"  # in volume
LISTED = 8


def check_choice(component: object) -> None:
    """Raise MeshError for a value that names no component."""
    if component is None or component == LARGEST or (isinstance(component, Integral) and int(component) >= 0):
        return
    raise MeshError(f"component must be a whole number, counted from 0, or {LARGEST!r}, got {component!r:.80}")


def choose_component(mesh: MeshRepair, component: Choice) -> tuple[MeshRepair, list[str]]:
    """Return the only or the chosen component (0 has most faces), and notices. Raises MeshError."""
    mesh, groups, copies = _without_copies(mesh)
    if component is None and len(groups) == 1:
        return mesh, copies
    sizes = ", ".join(f"{i}: {len(group)} faces" for i, group in enumerate(groups[:LISTED]))
    sizes += f", and {len(groups) - LISTED} more" if len(groups) > LISTED else ""
    if component is None:
        raise MeshError(_many(mesh, groups, sizes))
    volumes = _volumes(mesh, groups)
    chosen = int(np.argmax(volumes)) if component == LARGEST else int(component)
    if chosen >= len(groups):
        raise MeshError(f"component {component} does not exist: there are {len(groups)}, counted from 0 ({sizes})")
    if len(groups) == 1:
        return mesh.with_faces(groups[0]), copies
    notice = f"component {chosen} taken of {len(groups)} ({sizes})"
    nested = _inside(mesh, groups, chosen)
    if nested:
        named = f"component {nested[0]}" if len(nested) == 1 else f"{len(nested)} components"
        share = float(volumes[nested].sum()) / volumes[chosen]
        notice += f", with what is inside it: {named}, a cavity or another body, {share:.2%} of its volume"
    beside = float(np.delete(volumes, [chosen, *nested]).sum())
    if len(groups) > 1 + len(nested):
        units = mesh.size**3
        notice += f"; the ones left out enclose {beside * units:.3g}, this one {volumes[chosen] * units:.3g}"
    return mesh.with_faces(groups[chosen]), [*copies, notice]


def components(faces: IntArray) -> list[IntArray]:
    """Return the face numbers of each component (faces sharing a vertex), the largest first."""
    label = connected(directed_edges(faces), int(faces.max()) + 1)[faces[:, 0]]
    order = np.argsort(label, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
    return sorted(groups, key=lambda group: (-len(group), int(group[0])))


def outer_bodies(mesh: MeshRepair) -> list[int | None]:
    """Return the numbers of the components that lie inside no other one; None alone where there is one component."""
    mesh, groups, _ = _without_copies(mesh)
    if len(groups) == 1:
        return [None]
    inner = {number for outer in range(len(groups)) for number in _inside(mesh, groups, outer)}
    return [number for number in range(len(groups)) if number not in inner]


def _many(mesh: MeshRepair, groups: list[IntArray], sizes: str) -> str:
    """Return the refusal of several components."""
    widths = [np.linalg.norm(np.ptp(mesh.points[np.unique(mesh.faces[group])], axis=0)) for group in groups[:LISTED]]
    outer = int(np.argmax(widths))
    nested = _inside(mesh, groups, outer)
    if nested:
        return (
            f"{len(groups)} nested shells ({sizes}), component {nested[0]} lies inside component {outer}: a body "
            f"with a cavity gets no map, of one cube or of blocks; fill it by choosing --component {outer}, or connect "
            "it with the outside by a hole"
        )
    if (crossed := _crossed(mesh, groups)) is not None:
        (first, second), place = crossed
        return (
            f"{len(groups)} components ({sizes}), components {first} and {second} cross each other at "
            f"{in_brackets(place)}: unite them in the program that made them, or choose one with --component largest "
            "or --component N"
        )
    return (
        f"{len(groups)} components ({sizes}): choose one with --component largest or --component N, take each with "
        "`iga-nn batch --split`, or join them"
    )


def _crossed(mesh: MeshRepair, groups: list[IntArray]) -> tuple[tuple[int, int], Array] | None:
    """Return two components that cross each other, and a place (3,) in the user's units; None where there are none."""
    pairs = crossing_faces(mesh.points, mesh.faces)
    owners = np.sort(_labels(groups)[pairs], axis=1)
    between = np.flatnonzero(owners[:, 0] != owners[:, 1])
    if not len(between):
        return None
    first, second = owners[between[0]].tolist()
    (place,) = crossing_places(mesh.points, mesh.faces, pairs[between[:1]])
    return (first, second), place * mesh.size + mesh.middle


def _volumes(mesh: MeshRepair, groups: list[IntArray]) -> Array:
    """Return the volume that each component encloses, in the box of side 1; of an open one, about its middle."""
    faces = mesh.faces if is_oriented(mesh.faces) else np.asarray(igl.bfs_orient(mesh.faces)[0])
    label = _labels(groups)
    corners = mesh.points[faces]  # (m, 3, 3)
    count = np.bincount(label)
    middle = np.stack([np.bincount(label, corners[:, :, k].mean(axis=1)) / count for k in range(3)], axis=1)
    a, b, c = (corners[:, k] - middle[label] for k in range(3))
    return np.asarray(abs(np.bincount(label, np.sum(np.cross(a, b) * c, axis=1) / 6.0)))


def _inside(mesh: MeshRepair, groups: list[IntArray], outer: int) -> list[int]:
    """Return the numbers of the components that lie inside one of them."""
    corners = [mesh.points[mesh.faces[group]].reshape(-1, 3) for group in groups]
    low, high = corners[outer].min(axis=0), corners[outer].max(axis=0)
    nested = []
    for i, points in enumerate(corners):
        if i != outer and np.all(points.min(axis=0) > low) and np.all(points.max(axis=0) < high):
            solid = Solid(mesh.points, mesh.faces[groups[outer]])
            if np.all(np.abs(solid.winding_numbers(points)) > 0.5):
                nested.append(i)
    return nested


def _without_copies(mesh: MeshRepair) -> tuple[MeshRepair, list[IntArray], list[str]]:
    """Return the mesh without components whose faces all lie exactly on those of others, its components, a notice."""
    groups = components(mesh.faces)
    if len(groups) == 1:
        return mesh, groups, []
    place = np.unique(mesh.points, axis=0, return_inverse=True)[1].ravel()
    label = _labels(groups)
    _, key = np.unique(np.sort(place[mesh.faces], axis=1), axis=0, return_inverse=True)
    first = np.full(int(key.max()) + 1, len(groups))
    np.minimum.at(first, key.ravel(), label)
    owner = first[key.ravel()]
    same = [number for number, group in enumerate(groups) if np.all(owner[group] < number)]
    if not same:
        return mesh, groups, []
    dropped = np.isin(label, same)
    found = mesh.with_faces(np.flatnonzero(~dropped))
    bodies = "1 component" if len(same) == 1 else f"{len(same)} components"
    notice = f"dropped {bodies} ({np.count_nonzero(dropped)} faces) exactly on the faces of others"
    return found, components(found.faces), [f"{notice}: the volume is unchanged"]


def _labels(groups: list[IntArray]) -> IntArray:
    """Return the number of the component of each face (m,)."""
    label = np.empty(sum(map(len, groups)), dtype=np.int64)
    for number, group in enumerate(groups):
        label[group] = number
    return label
