"""Holes of a surface: found as loops of boundary edges, and filled where the user asks for it."""

from typing import Literal

import numpy as np

from ..arrays import Array, IntArray
from .errors import MeshError
from .filling import MOST_EDGES, fill
from .geometry import directed_edges, normals_and_areas, vertex_normals
from .mesh_repair import MeshRepair
from .welding import is_closed

Close = bool | Literal["all"]

LONGEST = 0.25  # of the box's diagonal: a longer loop is an end of the surface rather than a hole
LARGEST_SHARE = 0.05  # of the surface's area


def check_close(close: object) -> None:
    """Raise MeshError for a value that names no way to close holes."""
    if close not in (True, False, "all"):
        raise MeshError(f"close must be True, False or 'all', got {close!r:.80}")


def boundary_loops(points: Array, faces: IntArray) -> list[IntArray]:
    """Return the loops of vertices along the boundary of faces wound alike, each in the direction of its filling.

    Where holes meet in a vertex, a loop goes on along its own hole.
    """
    if is_closed(faces):
        return []
    sides = directed_edges(faces)
    base = int(faces.max()) + 1
    keys, counterparts = sides[:, 0] * base + sides[:, 1], sides[:, 1] * base + sides[:, 0]
    ends = sides[~np.isin(counterparts, keys)][:, ::-1]  # the filling runs along an edge against its face
    after = _successors(points, faces, ends)
    loops, left = [], np.ones(len(ends), dtype=bool)
    for first in range(len(ends)):
        loop, number = [], first
        while left[number]:
            left[number] = False
            loop.append(ends[number, 0])
            number = after[number]
        if loop:
            loops.append(np.array(loop))
    return loops


def _successors(points: Array, faces: IntArray, ends: IntArray) -> IntArray:
    """Return the edge (e,) with which the filling goes on after each edge from ends[:, 0] to ends[:, 1]."""
    leaving: dict[int, list[int]] = {}
    for number, start in enumerate(ends[:, 0].tolist()):
        leaving.setdefault(start, []).append(number)
    normals = vertex_normals(points, faces) if any(len(found) > 1 for found in leaving.values()) else points
    after = np.empty(len(ends), dtype=np.int64)
    for number, (before, vertex) in enumerate(ends.tolist()):
        found = leaving[vertex]
        rows = points[ends[found, 1]] - points[vertex]
        after[number] = found.pop(_nearest(rows, points[before] - points[vertex], normals[vertex]))
    return after


def _nearest(rows: Array, start: Array, normal: Array) -> int:
    """Return which row (k, 3) comes first, turning clockwise from `start` about a normal."""
    heights, ahead = rows @ normal, rows @ start
    angles = np.arctan2(np.cross(rows, start) @ normal, ahead - heights * (start @ normal))
    return int(np.argmin(np.mod(angles, 2.0 * np.pi)))


def close_holes(mesh: MeshRepair, close: Close) -> tuple[MeshRepair, list[str]]:
    """Return the mesh with all its holes filled, and a notice of their number and the area added.

    The faces must be wound alike, every vertex used. Raises MeshError, with the option that fills them, where `close`
    is False, and unless it is "all" for a loop longer than a quarter of the box's diagonal and for more than 5 % of
    area.
    """
    loops = boundary_loops(mesh.points, mesh.faces)
    if not loops:
        return mesh, []
    longest, most = _longest(mesh, loops), max(map(len, loops))
    if not close:
        edges, border = sum(map(len, loops)), min(int(loop.min()) for loop in loops)
        raise MeshError(
            f"open surface: {_loops(loops)} ({edges} edges), the first at {mesh.where(border)}: close the "
            f"{'hole' if len(loops) == 1 else 'holes'} with --close{' all' if longest > LONGEST else ''}, or in the "
            "program that made it"
        )
    if close != "all" and longest > LONGEST:
        raise MeshError(
            f"{_loops(loops)}, the longest {100 * longest:.0f} % of the box's diagonal, more than {100 * LONGEST:.0f} "
            "%: an end of the surface rather than a hole; --close all fills it, too"
        )
    if most > MOST_EDGES:
        raise MeshError(f"a boundary loop has {most} edges, more than {MOST_EDGES}: close it in another program")
    points, parts = mesh.points, [mesh.faces]
    for loop in loops:
        added, filled = fill(points, mesh.faces, loop)
        points = np.concatenate([points, added])
        parts.append(filled)
    before, after = (_area(points, np.concatenate(rows)) for rows in (parts[:1], parts[1:]))
    share = after / (before + after)
    if close != "all" and share > LARGEST_SHARE:
        raise MeshError(
            f"{_loops(loops)} whose filling is {100 * share:.1f} % of the surface, more than "
            f"{100 * LARGEST_SHARE:.0f} %: --close all fills them all the same"
        )
    patches = np.concatenate(parts[1:])
    length, area = longest * _diagonal(mesh) * mesh.size, after * mesh.size**2
    notice = (
        f"closed {_loops(loops)}, the longest {length:.3g} long ({100 * longest:.1f} % of the box's diagonal): "
        f"{len(patches)} faces added, their area {area:.3g}, {100 * share:.2g} % of the surface"
    )
    return mesh.with_patches(points[len(mesh.points) :], patches), [notice]


def _diagonal(mesh: MeshRepair) -> float:
    return float(np.linalg.norm(np.ptp(mesh.points, axis=0)))


def _longest(mesh: MeshRepair, loops: list[IntArray]) -> float:
    """Return the length of the longest loop over the diagonal of the surface's box."""
    lengths = [
        np.linalg.norm(np.roll(mesh.points[loop], -1, axis=0) - mesh.points[loop], axis=1).sum() for loop in loops
    ]
    return float(max(lengths) / _diagonal(mesh))


def _area(points: Array, faces: IntArray) -> float:
    return float(normals_and_areas(points, faces)[1].sum())


def _loops(loops: list[IntArray]) -> str:
    return f"{len(loops)} boundary {'loop' if len(loops) == 1 else 'loops'}"
