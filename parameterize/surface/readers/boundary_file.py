"""The boundary of solid cells: the faces that belong to one cell alone, wound outward.

Faces are compared by their sets of vertices. A quadrangle also meets the two triangles of another cell into which a
diagonal cuts it, as where tetrahedra and hexahedra meet.
"""

import numpy as np

from ...arrays import Array, IntArray, Mask
from ..errors import MeshError


def _prism(n: int) -> list[list[int]]:
    """Return the faces of a prism over n corners, whose other end has the corners n to 2 n - 1."""
    sides = [[i, (i + 1) % n, (i + 1) % n + n, i + n] for i in range(n)]
    return [list(range(n))[::-1], list(range(n, 2 * n)), *sides]


FACES = {  # of each kind of cell, outward where its volume is positive
    "tetra": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    "pyramid": [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
    "wedge": _prism(3),
    "hexahedron": _prism(4),
    "penta_prism": _prism(5),
    "hexa_prism": _prism(6),
}


def boundary_and_inner(
    vertices: Array, solids: list[tuple[str, IntArray]], polygons: list[list[int]]
) -> tuple[list[list[int]], IntArray, tuple[str, ...]]:
    """Return the boundary of solid cells, the numbers of the polygons that are no face of a cell, and notices.

    solids: cells by their kind, corners (k, corners) in range. Raises MeshError where more than two cells share a face.
    """
    faces: dict[int, list[IntArray]] = {}
    twice = 0
    for kind in dict.fromkeys(kind for kind, _ in solids):
        given = np.concatenate([rows for other, rows in solids if other == kind])
        cells = given[_first_of_each(given)]
        twice += len(given) - len(cells)
        for size, found in _outward_faces(vertices, kind, cells).items():
            faces.setdefault(size, []).append(found)
    tables = _without_repeats({size: np.concatenate(found) for size, found in faces.items()})
    free = {size: table[_met_once(table)] for size, table in tables.items()}
    outer = _without_matched_quads(free)
    notices = (f"left out {twice} cells that are given twice",) if twice else ()
    outside = np.flatnonzero(~_are_faces(polygons, tables))
    return [row for table in outer.values() for row in table.tolist()], outside, notices


def _outward_faces(vertices: Array, kind: str, cells: IntArray) -> dict[int, IntArray]:
    """Return the faces of cells of one kind by their number of corners, turned where a cell's volume is negative."""
    placed = vertices[cells] - vertices[cells[:, :1]]  # (k, corners, 3)
    volume = np.zeros(len(cells))
    for face in FACES[kind]:
        for i, j in zip(face[1:], face[2:], strict=False):
            a, b, c = (placed[:, corner] for corner in (face[0], i, j))
            volume += np.sum(a * np.cross(b, c), axis=1)
    inverted = volume < 0
    found: dict[int, list[IntArray]] = {}
    for face in FACES[kind]:
        rows = cells[:, face]
        rows[inverted] = rows[inverted][:, ::-1]
        found.setdefault(len(face), []).append(rows)
    return {size: np.stack(rows, axis=1).reshape(-1, size) for size, rows in found.items()}


def _without_repeats(faces: dict[int, IntArray]) -> dict[int, IntArray]:
    """Return the faces of collapsed cells without repeated corners; faces of fewer than three corners are left out."""
    kept: dict[int, list[IntArray]] = {}
    for size, table in faces.items():
        whole = np.all(np.diff(np.sort(table, axis=1), axis=1) > 0, axis=1)
        kept.setdefault(size, []).append(table[whole])
        for row in table[~whole].tolist():
            distinct = list(dict.fromkeys(row))
            if len(distinct) > 2:
                kept.setdefault(len(distinct), []).append(np.array([distinct]))
    return {size: np.concatenate(tables) for size, tables in kept.items()}


def _groups(rows: IntArray) -> IntArray:
    """Return a number (m,) for each row (m, k), the same for rows with the same vertices in any order."""
    ordered = np.sort(rows, axis=1)
    order = np.lexsort(ordered.T)
    steps = np.any(np.diff(ordered[order], axis=0) != 0, axis=1)
    numbers = np.zeros(len(rows), dtype=np.int64)
    numbers[order[1:]] = np.cumsum(steps)
    return numbers


def _first_of_each(rows: IntArray) -> IntArray:
    """Return the numbers of the rows that no earlier row equals, in order."""
    return np.sort(np.unique(_groups(rows), return_index=True)[1])


def _met_once(faces: IntArray) -> Mask:
    """Return the mask of faces (m, corners) that belong to one cell alone."""
    numbers = _groups(faces)
    counts = np.bincount(numbers)
    if counts.max(initial=0) > 2:
        shared = np.count_nonzero(counts > 2)
        raise MeshError(f"{shared} faces have more than two cells: cells overlap, export the volume again")
    return np.asarray(counts[numbers] == 1)


def _places(rows: IntArray, table: IntArray) -> IntArray:
    """Return for each row (m, k) the number of the row with its vertices in a table (n, k), -1 without one."""
    numbers = _groups(np.concatenate([table, rows]))
    place = np.full(len(numbers), -1)
    place[numbers[: len(table)]] = np.arange(len(table))
    return place[numbers[len(table) :]]


HALVES = np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])  # by either diagonal


def _without_matched_quads(faces: dict[int, IntArray]) -> dict[int, IntArray]:
    """Return faces without quadrangles whose two halves are faces, too, and without these halves."""
    if 3 not in faces or 4 not in faces:
        return faces
    triangles, quads = faces[3], faces[4]
    met = _places(quads[:, HALVES].reshape(-1, 3), triangles).reshape(-1, 2, 2)  # quadrangle, diagonal, half
    matched = np.all(met >= 0, axis=2)
    left = np.ones(len(triangles), dtype=bool)
    left[met[matched].ravel()] = False
    return {**faces, 3: triangles[left], 4: quads[~matched.any(axis=1)]}


def _are_faces(polygons: list[list[int]], faces: dict[int, IntArray]) -> Mask:
    """Return which polygons are faces of cells, half of a quadrangular one, or two triangular ones together."""
    found = np.zeros(len(polygons), dtype=bool)
    empty = np.empty((0, 3), dtype=np.int64)
    quads = faces.get(4, np.empty((0, 4), dtype=np.int64))
    triangles = np.concatenate([faces.get(3, empty), quads[:, HALVES].reshape(-1, 3)])
    for size in sorted({len(polygon) for polygon in polygons}):
        mine, rows = _of_size(polygons, size)
        table = triangles if size == 3 else faces.get(size, np.empty((0, size), dtype=np.int64))
        found[mine] = _places(rows, table) >= 0
        if size == 4:
            met = _places(rows[:, HALVES].reshape(-1, 3), faces.get(3, empty)).reshape(-1, 2, 2)
            found[mine] |= np.any(np.all(met >= 0, axis=2), axis=1)
    return found


def faces_alike(faces: list[list[int]], polygons: list[list[int]]) -> IntArray:
    """Return the number (m,) of the polygon with the same corners as each face, -1 where there is none."""
    return _found(faces, {size: [_of_size(polygons, size)] for size in {len(row) for row in polygons}})


def cells_behind(faces: list[list[int]], solids: list[tuple[str, IntArray]]) -> IntArray:
    """Return the solid cell of each face (m,) of the boundary, counted through `solids`; -1 for collapsed cells."""
    tables: dict[int, list[tuple[IntArray, IntArray]]] = {}
    first = 0
    for kind, rows in solids:
        for face in FACES[kind]:
            tables.setdefault(len(face), []).append((np.arange(first, first + len(rows)), rows[:, face]))
        first += len(rows)
    return _found(faces, tables)


def _of_size(polygons: list[list[int]], size: int) -> tuple[IntArray, IntArray]:
    """Return numbers (k,) and corners (k, size) of the polygons of that many corners."""
    numbers = np.array([i for i, polygon in enumerate(polygons) if len(polygon) == size], dtype=np.int64)
    return numbers, np.array([polygons[i] for i in numbers], dtype=np.int64).reshape(-1, size)


def _found(faces: list[list[int]], tables: dict[int, list[tuple[IntArray, IntArray]]]) -> IntArray:
    """Return for each face (m,) the number beside the row with its corners in tables by their size, or -1."""
    found = np.full(len(faces), -1)
    for size, parts in tables.items():
        numbers, rows = (np.concatenate(column) for column in zip(*parts, strict=True))
        mine, asked = _of_size(faces, size)
        found[mine] = np.append(numbers, -1)[_places(asked, rows)]
    return found
