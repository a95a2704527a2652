"""Merges the cells of an arrangement across all cuts that no re-entrant edge of the body needs.

The facets between cells that lie in one plane and are connected form a sheet. Without a sheet, the cells on both sides
of each of its facets become one, and all others still have whole facets in common, provided that this holds at
re-entrant edges, at which sheets end: the angle between two sheets or faces that follow each other there must not be
too large. Where some of several sheets suffice, those stay that are nearer to right angles.
"""

from collections import defaultdict
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, IntArray
from ...surface.geometry import connected
from ..planar.polygons import edges_of
from .arrangement import Arrangement, Facet

_LEAST = 1e-300  # divides lengths of facets that rounding has left without area: they have no direction
_STRAIGHT = 1e-4  # radians: sheets and faces that differ less from one plane are in one
_WIDEST = 0.56 * np.pi  # an angle between two sheets at a re-entrant edge that is left, little above a right angle:
# at wider ones the cells of a flat pyramid and of the block below it would become one

Edge = tuple[int, int]


@dataclass(frozen=True, eq=False)
class ConvexCell:
    """A convex polyhedron: its faces as points, counterclockwise seen from outside, corners alone."""

    faces: tuple[tuple[int, ...], ...]

    @property
    def corners(self) -> list[int]:
        """Return the corners, ascending."""
        return sorted({corner for face in self.faces for corner in face})


def merged_cells(arrangement: Arrangement) -> tuple[ConvexCell, ...] | None:
    """Return the cells merged across all sheets that can go; None where facets then do not lie on each other whole."""
    owners: dict[frozenset[int], list[tuple[int, int]]] = defaultdict(list)
    rings: dict[frozenset[int], tuple[int, ...]] = {}
    for number, cell in enumerate(arrangement.cells):
        for plane, ids in cell:
            owners[frozenset(ids)].append((number, plane))
            rings[frozenset(ids)] = ids
    keys = list(owners)
    inner = [key for key in keys if len(owners[key]) == 2]
    outer = [key for key in keys if len(owners[key]) == 1]
    facets, between = ([(owners[key][0][1], rings[key]) for key in keys] for keys in (outer, inner))
    sheets = _sheets(between)
    waists = {
        int(sheet) for (plane, _), sheet in zip(between, sheets, strict=True) if plane >= arrangement.waist_planes
    }
    kept = waists | _kept(arrangement, facets, between, sheets)
    links = [[cell for cell, _ in owners[key]] for k, key in enumerate(inner) if int(sheets[k]) not in kept]
    group = connected(np.array(links, dtype=np.int64).reshape(-1, 2), len(arrangement.cells))
    faces: dict[int, dict[int, list[tuple[tuple[int, ...], int]]]] = defaultdict(lambda: defaultdict(list))
    for number, cell in enumerate(arrangement.cells):
        for plane, ids in cell:
            beyond = [int(group[other]) for other, _ in owners[frozenset(ids)] if other != number]
            other = beyond[0] if beyond else -1
            if other != group[number]:
                faces[int(group[number])][plane].append((ids, other))
    cells = [_cell(arrangement, rows) for rows in faces.values()]
    return None if any(cell is None for cell in cells) else tuple(cell for cell in cells if cell is not None)


def _edges(ids: tuple[int, ...]) -> list[Edge]:
    """Return the edges of a facet, each pair ascending."""
    return [(min(a, b), max(a, b)) for a, b in edges_of(ids)]


def _kept(arrangement: Arrangement, outer: list[Facet], inner: list[Facet], sheets: IntArray) -> set[int]:
    """Return the sheets that have to stay: without any one of them an angle at a re-entrant edge is too large.

    The others go one by one, first that which leaves the smallest angles, then that which is least at right angles to
    the faces that it crosses.

    outer, inner: the facets on the body's boundary and inside. sheets: that of each facet inside.
    """
    normals = [_normal(arrangement.points[list(ids)]) for _, ids in outer]
    at, meeting = _by_edge(outer), _by_edge(inner)
    fans: dict[Edge, list[tuple[int, float]]] = {}
    squareness: dict[int, float] = defaultdict(lambda: 1.0)
    for edge, numbers in at.items():
        fan = _fan(arrangement, edge, [(outer[number], normals[number]) for number in numbers])
        for k in meeting.get(edge, ()) if fan is None else ():
            sines = [
                float(np.linalg.norm(np.cross(arrangement.normals[inner[k][0]], normals[number]))) for number in numbers
            ]
            squareness[int(sheets[k])] = min(squareness[int(sheets[k])], *sines)
        if fan is not None:
            start, turn = fan
            fans[edge] = [(-1, 0.0), (-1, turn)] + [
                (int(sheets[k]), _angle(arrangement, edge, inner[k][1], start)) for k in meeting.get(edge, ())
            ]
    kept = {sheet for fan in fans.values() for sheet, _ in fan if sheet >= 0}
    around = {sheet: [fan for fan in fans.values() if any(own == sheet for own, _ in fan)] for sheet in kept}
    while kept:
        widest = {
            sheet: max(_widest([angle for own, angle in fan if own in kept - {sheet} or own < 0]) for fan in own_fans)
            for sheet, own_fans in around.items()
            if sheet in kept
        }
        goes = min(kept, key=lambda sheet: (round(widest[sheet], 6), squareness[sheet], sheet))
        if widest[goes] > _WIDEST:
            break
        kept -= {goes}
    return kept


def _by_edge(facets: list[Facet]) -> dict[Edge, list[int]]:
    """Return the numbers of the facets at each edge."""
    numbers: dict[Edge, list[int]] = defaultdict(list)
    for number, (_, ids) in enumerate(facets):
        for edge in _edges(ids):
            numbers[edge].append(number)
    return numbers


def _fan(
    arrangement: Arrangement, edge: Edge, faces: list[tuple[Facet, Array]]
) -> tuple[tuple[Array, Array], float] | None:
    """Return two directions across a re-entrant edge, and the angle of the body there; None for any other edge.

    Angles are measured from the first direction, which lies in a face, to the second one, which leads into the body.
    faces: those of the body at the edge, with their outward normals. Where four faces meet no angle is too large.
    """
    (first, normal), (last, _) = faces[0], faces[-1]
    start = _across(arrangement, edge, first[1]), -normal
    turn = _angle(arrangement, edge, last[1], start)
    if len(faces) != 2:
        return start, 2.0 * np.pi * len(faces)
    return (start, turn) if first[0] != last[0] and turn > np.pi + _STRAIGHT else None


def _across(arrangement: Arrangement, edge: Edge, ids: tuple[int, ...]) -> Array:
    """Return the unit vector (3,) in a facet that leads away from one of its edges."""
    along = arrangement.points[edge[1]] - arrangement.points[edge[0]]
    away = arrangement.points[list(ids)].mean(axis=0) - arrangement.points[edge[0]]
    away = away - (away @ along) / max(float(along @ along), _LEAST) * along
    return np.asarray(away / max(float(np.linalg.norm(away)), _LEAST))


def _angle(arrangement: Arrangement, edge: Edge, ids: tuple[int, ...], start: tuple[Array, Array]) -> float:
    """Return the angle, from 0 to 2 pi, by which a facet at an edge is turned from a first direction to a second."""
    away = _across(arrangement, edge, ids)
    return float(np.arctan2(away @ start[1], away @ start[0]) % (2.0 * np.pi))


def _widest(angles: list[float]) -> float:
    """Return the largest difference of angles that follow each other."""
    return float(np.diff(sorted(angles)).max())


def _normal(points: Array) -> Array:
    """Return the unit normal (3,) of a plane polygon (k, 3), by Newell's sum."""
    normal = np.cross(points - points[0], np.roll(points, -1, axis=0) - points[0]).sum(axis=0)
    return np.asarray(normal / max(float(np.linalg.norm(normal)), _LEAST))


def _sheets(inner: list[Facet]) -> IntArray:
    """Return the sheet of each facet inside the body, each a plane and points: those in one plane with common edges."""
    at: dict[tuple[int, Edge], int] = {}
    links = []
    for number, (plane, ids) in enumerate(inner):
        for edge in _edges(ids):
            links.append([at.setdefault((plane, edge), number), number])
    return connected(np.array(links, dtype=np.int64).reshape(-1, 2), len(inner))


def _cell(arrangement: Arrangement, faces: dict[int, list[tuple[tuple[int, ...], int]]]) -> ConvexCell | None:
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
    middle = arrangement.points[list(planes_at)].mean(axis=0)
    rings = []
    for facets in faces.values():
        corners = sorted({i for ids, _ in facets for i in ids if len(planes_at[i]) >= 3})
        if len(corners) < 3:
            return None
        rings.append(_around(arrangement.points, corners, middle))
    return ConvexCell(tuple(rings))


def _around(points: Array, corners: list[int], inside: Array) -> tuple[int, ...]:
    """Return the corners of a convex face in their order, counterclockwise seen from a side away from a point (3,)."""
    rows = points[corners] - points[corners].mean(axis=0)
    along, _, normal = np.linalg.svd(rows, full_matrices=False)[2]
    if normal @ (points[corners].mean(axis=0) - inside) < 0.0:
        normal = -normal
    angles = np.arctan2(rows @ np.cross(normal, along), rows @ along)
    return tuple(corners[k] for k in np.argsort(angles))
