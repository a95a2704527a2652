"""Merges the cells of an arrangement across all cuts that no re-entrant edge of the body needs.

The facets between cells that lie in one plane and are connected form a sheet. Without a sheet, the cells on both sides
of each of its facets become one, and all others still have whole facets in common, provided that the sheet does not end
at a re-entrant edge: there one side of it is a face of the body.
"""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, IntArray
from ..surface.geometry import connected
from .arrangement import NEAR, Arrangement

Edge = tuple[int, int]


@dataclass(frozen=True, eq=False)
class ConvexCell:
    """A convex polyhedron: its faces as points, counterclockwise seen from outside, corners alone."""

    faces: tuple[tuple[int, ...], ...]

    @property
    def corners(self) -> list[int]:
        """Return the corners, ascending."""
        return sorted({corner for face in self.faces for corner in face})


def merged_cells(found: Arrangement) -> tuple[ConvexCell, ...] | None:
    """Return the cells merged across all sheets that can go; None where facets then do not lie on each other whole."""
    owners: dict[frozenset[int], list[tuple[int, int]]] = defaultdict(list)
    rings: dict[frozenset[int], tuple[int, ...]] = {}
    for number, cell in enumerate(found.cells):
        for plane, ids in cell:
            owners[frozenset(ids)].append((number, plane))
            rings[frozenset(ids)] = ids
    keys = list(owners)
    inner = [key for key in keys if len(owners[key]) == 2]
    outer = [key for key in keys if len(owners[key]) == 1]
    needed = _needed_edges(found, [(owners[key][0][1], rings[key]) for key in outer])
    sheets = _sheets([(owners[key][0][1], rings[key]) for key in inner])
    kept = {int(sheets[k]) for k, key in enumerate(inner) if needed & set(_edges(rings[key]))}
    links = [[cell for cell, _ in owners[key]] for k, key in enumerate(inner) if int(sheets[k]) not in kept]
    group = connected(np.array(links, dtype=np.int64).reshape(-1, 2), len(found.cells))
    faces: dict[int, dict[int, list[tuple[tuple[int, ...], int]]]] = defaultdict(lambda: defaultdict(list))
    for number, cell in enumerate(found.cells):
        for plane, ids in cell:
            beyond = [int(group[other]) for other, _ in owners[frozenset(ids)] if other != number]
            other = beyond[0] if beyond else -1
            if other != group[number]:
                faces[int(group[number])][plane].append((ids, other))
    cells = [_cell(found, rows) for rows in faces.values()]
    return None if any(cell is None for cell in cells) else tuple(cell for cell in cells if cell is not None)


def _edges(ids: tuple[int, ...]) -> list[Edge]:
    """Return the edges of a facet, each pair ascending."""
    return [(min(a, b), max(a, b)) for a, b in zip(ids, ids[1:] + ids[:1], strict=True)]


def _needed_edges(found: Arrangement, outer: list[tuple[int, tuple[int, ...]]]) -> set[Edge]:
    """Return the re-entrant edges between facets on the body's boundary, each a plane and points."""
    size = NEAR * float(np.linalg.norm(np.ptp(found.points, axis=0)))
    at: dict[Edge, list[int]] = defaultdict(list)
    for number, (_, ids) in enumerate(outer):
        for edge in _edges(ids):
            at[edge].append(number)
    needed = set[Edge]()
    for edge, numbers in at.items():
        (plane, ids), (other, others) = (outer[numbers[k]] for k in (0, -1))
        if len(numbers) == 2 and plane == other:
            continue
        normal = _normal(found.points[list(ids)])
        height = (found.points[list(others)] - found.points[edge[0]]) @ normal
        if len(numbers) != 2 or height.max() > size:
            needed.add(edge)
    return needed


def _normal(points: Array) -> Array:
    """Return the unit normal (3,) of a plane polygon (k, 3), by Newell's sum."""
    normal = np.cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0)
    return np.asarray(normal / np.linalg.norm(normal))


def _sheets(inner: list[tuple[int, tuple[int, ...]]]) -> IntArray:
    """Return the sheet of each facet inside the body, each a plane and points: those in one plane with common edges."""
    at: dict[tuple[int, Edge], int] = {}
    links = []
    for number, (plane, ids) in enumerate(inner):
        for edge in _edges(ids):
            links.append([at.setdefault((plane, edge), number), number])
    return connected(np.array(links, dtype=np.int64).reshape(-1, 2), len(inner))


def _cell(found: Arrangement, faces: dict[int, list[tuple[tuple[int, ...], int]]]) -> ConvexCell | None:
    """Return a merged cell from the facets in each of its planes, with the cells beyond (-1: outside).

    None is returned where two cells share one of its faces, or a cell and the outside.
    """
    if any(len({beyond for _, beyond in facets}) != 1 for facets in faces.values()):
        return None
    planes_at: dict[int, set[int]] = defaultdict(set)
    for plane, facets in faces.items():
        for ids, _ in facets:
            for i in ids:
                planes_at[i].add(plane)
    middle = found.points[list(planes_at)].mean(axis=0)
    rings = []
    for facets in faces.values():
        corners = sorted({i for ids, _ in facets for i in ids if len(planes_at[i]) >= 3})
        if len(corners) < 3:
            return None
        rings.append(_around(found.points, corners, middle))
    return ConvexCell(tuple(rings))


def _around(points: Array, corners: list[int], inside: Array) -> tuple[int, ...]:
    """Return the corners of a convex face in their order, counterclockwise seen from a side away from a point (3,)."""
    rows = points[corners] - points[corners].mean(axis=0)
    along, _, normal = np.linalg.svd(rows, full_matrices=False)[2]
    if normal @ (points[corners].mean(axis=0) - inside) < 0.0:
        normal = -normal
    angles = np.arctan2(rows @ np.cross(normal, along), rows @ along)
    return tuple(corners[k] for k in np.argsort(angles))
