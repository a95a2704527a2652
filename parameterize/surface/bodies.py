"""The bodies of a surface: copies are dropped, and one is chosen or all are kept."""

from itertools import chain
from numbers import Integral
from typing import Literal

import igl
import numpy as np

from ..arrays import Array, IntArray
from .errors import MeshError
from .geometry import edge_table, signed_volume
from .holes import Close
from .mesh_repair import MeshRepair
from .shells import components, inside, labels_of, sizes_of
from .welding import is_oriented

Choice = int | Literal["largest"] | None

LARGEST = "largest"  # in volume


def check_choice(component: object) -> None:
    """Raise MeshError for a value that names no component."""
    if component is None or component == LARGEST or (isinstance(component, Integral) and int(component) >= 0):
        return
    raise MeshError(f"component must be a whole number, counted from 0, or {LARGEST!r}, got {component!r:.80}")


def choose_component(mesh: MeshRepair, component: Choice, close: Close) -> tuple[MeshRepair, list[str]]:
    """Return the chosen component (0 has most faces), or all of them for None, and notices.

    Raises MeshError for a component that does not exist, and for one of several that is open and is not closed.
    """
    mesh, groups, copies = _without_copies(mesh)
    if component is None:
        if len(groups) > 1 and not close:
            _check_closed(mesh, groups)
        return mesh, copies
    sizes = sizes_of(groups)
    volumes = _volumes(mesh, groups)
    chosen = int(np.argmax(volumes)) if component == LARGEST else int(component)
    if chosen >= len(groups):
        raise MeshError(f"component {component} does not exist: there are {len(groups)}, counted from 0 ({sizes})")
    if len(groups) == 1:
        return mesh.with_faces(groups[0]), copies
    notice = f"component {chosen} taken of {len(groups)} ({sizes})"
    (nested,) = inside(mesh, groups, [chosen])
    if nested:
        named = f"component {nested[0]}" if len(nested) == 1 else f"{len(nested)} components"
        share = float(volumes[nested].sum()) / volumes[chosen]
        notice += f", with what is inside it: {named}, a cavity or another body, {share:.2%} of its volume"
    beside = float(np.delete(volumes, [chosen, *nested]).sum())
    if len(groups) > 1 + len(nested):
        units = mesh.size**3
        notice += f"; the ones left out enclose {beside * units:.3g}, this one {volumes[chosen] * units:.3g}"
    return mesh.with_faces(groups[chosen]), [*copies, notice]


def outer_bodies(mesh: MeshRepair) -> list[int | None]:
    """Return the numbers of the components that lie inside no other one; None alone where there is one of these."""
    mesh, groups, _ = _without_copies(mesh)
    if len(groups) == 1:
        return [None]
    inner = set().union(*inside(mesh, groups, range(len(groups))))
    outer = [number for number in range(len(groups)) if number not in inner]
    return [None] if len(outer) == 1 else [*outer]


def _check_closed(mesh: MeshRepair, groups: list[IntArray]) -> None:
    """Raise MeshError where one of several components is open."""
    for number, group in enumerate(groups):
        if edge_table(mesh.faces[group])[1].min() < 2:
            raise MeshError(
                f"{len(groups)} components ({sizes_of(groups)}), component {number} is open: choose one with "
                "--component largest or --component N, or fill its holes with --close"
            )


def _volumes(mesh: MeshRepair, groups: list[IntArray]) -> Array:
    """Return the volume that each component encloses, in the box of side 1; of an open one, about its middle."""
    faces = mesh.faces if is_oriented(mesh.faces) else np.asarray(igl.bfs_orient(mesh.faces)[0])
    label = labels_of(groups)
    corners = mesh.points[faces]  # (m, 3, 3)
    count = np.bincount(label)
    middle = np.stack([np.bincount(label, corners[:, :, k].mean(axis=1)) / count for k in range(3)], axis=1)
    a, b, c = (corners[:, k] - middle[label] for k in range(3))
    return np.asarray(abs(np.bincount(label, np.sum(np.cross(a, b) * c, axis=1) / 6.0)))


def _fills(mesh: MeshRepair, groups: list[IntArray], copy: int, original: int) -> bool:
    """Return whether a copy is a body in a cavity whose wall the original is: it is wound the other way."""
    volumes = [signed_volume(mesh.points, mesh.faces[groups[number]]) for number in (copy, original)]
    return volumes[0] * volumes[1] < 0.0 and original in chain(*inside(mesh, groups, range(len(groups))))


def _without_copies(mesh: MeshRepair) -> tuple[MeshRepair, list[IntArray], list[str]]:
    """Return the mesh without components whose faces all lie exactly on those of others, its components, a notice."""
    groups = components(mesh.faces)
    if len(groups) == 1:
        return mesh, groups, []
    place = np.unique(mesh.points, axis=0, return_inverse=True)[1].ravel()
    label = labels_of(groups)
    _, key = np.unique(np.sort(place[mesh.faces], axis=1), axis=0, return_inverse=True)
    first = np.full(int(key.max()) + 1, len(groups))
    np.minimum.at(first, key.ravel(), label)
    owner = first[key.ravel()]
    same = [number for number, group in enumerate(groups) if np.all(owner[group] < number)]
    same = [number for number in same if not _fills(mesh, groups, number, int(owner[groups[number][0]]))]
    if not same:
        return mesh, groups, []
    dropped = np.isin(label, same)
    found = mesh.with_faces(np.flatnonzero(~dropped))
    bodies = "1 component" if len(same) == 1 else f"{len(same)} components"
    notice = f"dropped {bodies} ({np.count_nonzero(dropped)} faces) exactly on the faces of others"
    return found, components(found.faces), [f"{notice}: the volume is unchanged"]
