"""Cells of every format by kind: surface cells become polygons, solid cells their boundary, others none.

Kinds are called as meshio calls them, their corners ordered as VTK orders them (The VTK User's Guide, "Cell types").
"""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...arrays import Array, IntArray
from ..errors import MeshError, check_finite, check_indices
from ..groups import Groups, renumbered
from .boundary_file import FACES, boundary_and_inner, cells_behind, faces_alike
from .common import DAMAGED, Content

Rows = IntArray | Sequence[Sequence[int]]  # the corners of cells of one kind; (k, corners), or of several lengths
BY_AXES = {"pixel": ("quad", [0, 1, 3, 2]), "voxel": ("hexahedron", [0, 1, 3, 2, 4, 5, 7, 6])}  # numbered as x, y, z go
CORNERS = {"triangle": 3, "quad": 4, "tetra": 4, "pyramid": 5, "wedge": 6, "hexahedron": 8, "pixel": 4, "voxel": 8}
CORNERS |= {"penta_prism": 10, "hexa_prism": 12}
STRIP = "triangle_strip"
SURFACES = ("triangle", "quad", "polygon", "pixel", STRIP)
NONE = np.empty(0, dtype=np.int64)
WITHOUT_AREA = ("empty", "vertex", "poly_vertex", "poly_line", "line")  # and line3, line4, ...: curved ones


def arrays_of(mesh: Any) -> tuple[Array, list[tuple[str, Rows]]]:
    """Return points and cells of a meshio.Mesh as `from_cells` takes them."""
    cells: list[tuple[str, Rows]] = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
    return np.asarray(mesh.points, dtype=np.float64), cells


def from_cells(
    vertices: Array, cells: Sequence[tuple[str, Rows]], notices: tuple[str, ...] = (), groups: Groups | None = None
) -> Content:
    """Return vertices and polygons of cells, given by their kind and their corners.

    Solid cells give their boundary, and the surface cells that are none of their faces are kept beside it. Points and
    lines are left out with a notice. groups: numbers of cells by name, counted through all of `cells`; a face of the
    boundary has the groups of the surface cell with its corners; without one, the groups of the solid cell behind it.
    Raises MeshError for every other kind, and where solid cells overlap.
    """
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise MeshError(f"points must have shape (n, 3), got {vertices.shape}: export three coordinates each")
    left_out: Counter[str] = Counter()
    solids: list[tuple[str, IntArray]] = []
    polygons: list[list[int]] = []
    owners, solid_owners, count = [NONE], [NONE], 0  # the cells that polygons and solids come from
    for kind, rows in cells:
        numbers = np.arange(count, count + len(rows))
        count += len(rows)
        if not len(rows):
            continue
        if kind in WITHOUT_AREA or (kind.startswith("line") and kind[4:].isdecimal()):
            left_out[kind] += len(rows)
        elif BY_AXES.get(kind, (kind,))[0] in FACES:
            solids.append(_as_table(kind, rows, vertices))
            solid_owners.append(numbers)
        else:
            found = _polygons(kind, rows, vertices)
            polygons += found
            owners.append(np.repeat(numbers, [len(row) - 2 for row in rows]) if kind == STRIP else numbers)
    if left_out:
        said = ", ".join(f"{count} {kind}" for kind, count in left_out.items())
        notices = (*notices, f"left out cells without area: {said}")
    owner = np.concatenate(owners)
    if solids:
        outer, inner, about = boundary_and_inner(vertices, solids, polygons)
        solid_owner = np.concatenate(solid_owners)
        outer_owner = _owners(outer, (polygons, owner), (solids, solid_owner), groups) if groups else NONE
        owner = np.concatenate([outer_owner, owner[inner]])
        polygons, notices = outer + [polygons[i] for i in inner], (*notices, *about)
    if not polygons:
        raise MeshError("has no faces and no solid cells: export the volume or its surface")
    return Content(vertices, polygons, notices, renumbered(groups, owner) if groups else {})


def _polygons(kind: str, rows: Rows, vertices: Array) -> list[list[int]]:
    """Return the polygons of surface cells; raise MeshError for cells of other kinds."""
    if kind in CORNERS:
        return _as_table(kind, rows, vertices)[1].tolist()
    if kind not in SURFACES:
        raise MeshError(f"holds {len(rows)} cells of type {kind}: save linear cells, tetrahedra or triangles")
    return triangles_of_strips(rows) if kind == STRIP else [list(map(int, row)) for row in rows]


def _owners(
    outer: list[list[int]],
    polygons: tuple[list[list[int]], IntArray],
    solids: tuple[list[tuple[str, IntArray]], IntArray],
    groups: Groups,
) -> IntArray:
    """Return the cells (m,) whose groups the faces of the boundary are in; polygons and solids: their cells."""
    in_some = np.zeros(max(int(numbers[-1]) for numbers in groups.values()) + 2, dtype=bool)
    for numbers in groups.values():
        in_some[numbers] = True
    (places, owner), behind = polygons, solids[1][cells_behind(outer, solids[0])]
    alike = np.append(owner, -1)[faces_alike(outer, places)]
    return np.where(in_some[np.minimum(alike, len(in_some) - 1)], alike, behind)


def _as_table(kind: str, rows: Rows, vertices: Array) -> tuple[str, IntArray]:
    """Return cells with a fixed number of corners, checked, and their kind: pixels become quads, voxels hexahedra."""
    try:
        table = np.asarray(rows, dtype=np.int64)
    except ValueError:
        table = np.empty((0, 0), dtype=np.int64)
    if table.ndim != 2 or table.shape[1] != CORNERS[kind]:
        raise MeshError(f"a cell of type {kind} has not its {CORNERS[kind]} corners; {DAMAGED}")
    same, order = BY_AXES.get(kind, (kind, list(range(CORNERS[kind]))))
    if same in FACES:
        check_indices(vertices, table)
        check_finite(vertices, table)
    return same, table[:, order]


def triangles_of_strips(rows: Rows) -> list[list[int]]:
    """Return the triangles of strips, every second one turned, so that all are wound as the first."""
    found = []
    for row in rows:
        if len(row) < 3:
            raise MeshError(f"a triangle strip has {len(row)} corners, expected at least 3; {DAMAGED}")
        for k, (a, b, c) in enumerate(zip(row, row[1:], row[2:], strict=False)):
            found.append([int(b), int(a), int(c)] if k % 2 else [int(a), int(b), int(c)])
    return found
