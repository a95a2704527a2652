"""VTK's .vtu and .vtp: points and cells of all pieces, whole numbers of cells as groups; other data are skipped."""

import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, IntArray
from ..errors import MeshError, check_indices
from ..groups import Groups, by_value
from .cells import Rows, from_cells
from .common import DAMAGED, Content, SurfaceFile, header_count, most_bytes
from .vtk_arrays import TYPES, WORDS, Decoder

KINDS = {0: "empty", 1: "vertex", 2: "poly_vertex", 3: "line", 4: "poly_line", 5: "triangle", 6: "triangle_strip"}
KINDS |= {7: "polygon", 8: "pixel", 9: "quad", 10: "tetra", 11: "voxel", 12: "hexahedron", 13: "wedge", 14: "pyramid"}
KINDS |= {15: "penta_prism", 16: "hexa_prism", 21: "line3", 35: "line4"}
PARTS = {"Verts": "vertex", "Lines": "poly_line", "Strips": "triangle_strip", "Polys": "polygon"}  # in VTK's order
Marks = dict[str, NDArray[Any]]  # by the name of an array, a number of each cell
APPENDED = re.compile(rb"<AppendedData\b([^>]*)>\s*_?")


def read_vtu(file: SurfaceFile) -> Content:
    """Read a .vtu of any version of the format; where it has several pieces, points in the same place are joined."""
    return _read(file, ".vtu", "UnstructuredGrid", _piece)


def read_vtp(file: SurfaceFile) -> Content:
    """Read a .vtp as `read_vtu` reads a .vtu."""
    return _read(file, ".vtp", "PolyData", _polygons)


Piece = tuple[Array, list[tuple[str, Rows]], Marks]


def _read(
    file: SurfaceFile, suffix: str, kind: str, read_piece: Callable[[ElementTree.Element, Decoder], Piece]
) -> Content:
    """Read a file of that kind of data set, piece by piece."""
    data = file.data
    root, decoder = _opened(data, most_bytes(file.max_faces), suffix, kind)
    steps = [grid.get("TimeValues", "").split() for grid in root.iter(kind)]
    notices = tuple(f"the first of {len(times)} time steps read" for times in steps if len(times) > 1)
    points, cells, marks = [np.empty((0, 3))], [], []
    for piece in root.iter("Piece"):
        first = sum(map(len, points))
        found, held, marked = read_piece(piece, decoder)
        points.append(found)
        cells += [(kind, _shifted(rows, first)) for kind, rows in held]
        marks += [marked] * bool(held)
    groups = _groups(marks, sum(len(rows) for _, rows in cells))
    if len(points) <= 2:
        return from_cells(points[-1], cells, notices, groups)
    return _joined(np.concatenate(points), cells, (*notices, f"{len(points) - 1} pieces joined"), groups)


def _opened(data: bytes, limit: int, suffix: str, kind: str) -> tuple[ElementTree.Element, Decoder]:
    """Return the tree of the file without its appended data, and the decoder of its arrays."""
    if b"<VTKFile" not in data[:4096] or b"</VTKFile>" not in data[-256:]:
        raise MeshError(f"not a whole {suffix}: no <VTKFile> ... </VTKFile>; {DAMAGED}")
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise MeshError(
            f"the {suffix} declares a document type, whose entities are not expanded: remove the declaration"
        )
    mark = APPENDED.search(data)
    text = data[: mark.start()] + b"</VTKFile>" if mark else data
    try:
        root = ElementTree.fromstring(text)  # noqa: S314 - it has no entities
    except (ElementTree.ParseError, ValueError, LookupError) as error:
        raise MeshError(f"not readable as XML ({error}); {DAMAGED}") from None
    if root.get("type") != kind:
        raise MeshError(f"the {suffix} holds {root.get('type')!r:.40}, expected {kind}: save it as one")
    word = WORDS.get(root.get("header_type", "UInt32"))
    if word is None:
        raise MeshError(f"the header_type is {root.get('header_type')!r:.40}, expected UInt32 or UInt64; {DAMAGED}")
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    appended = data[mark.end() :].rpartition(b"</AppendedData")[0] if mark else b""
    is_raw = mark is not None and b"base64" not in mark[1]
    decoder = Decoder(order, np.dtype(order + word), root.get("compressor", ""), appended, is_raw, limit)
    return root, decoder


def _piece(piece: ElementTree.Element, decoder: Decoder) -> Piece:
    """Return a piece's points (n, 3), its cells by kind and their numbers; empty arrays for a piece without cells."""
    n, m = (header_count(piece.get(name, "")) for name in ("NumberOfPoints", "NumberOfCells"))
    if not m:
        return np.empty((0, 3)), [], {}
    places = _places(piece, decoder, n)
    types, ends, corners = _cells(piece, decoder, m)
    sizes = np.diff(ends, prepend=0)
    order = np.argsort(types, kind="stable")  # cells are returned kind by kind
    marks = {name: decoder.numbers(array, m)[order] for name, array in _marks(piece).items()}
    return places, by_kind(types, sizes, ends, corners), marks


@dataclass(frozen=True, eq=False)
class GridPiece:
    """A piece of a grid: points (n, 3), types (m,), ends (m,) of cells among their corners, and these.

    degrees: (m, 3) of higher-order cells, weights: (n,) of rational ones; None where the file has none.
    """

    points: Array
    types: IntArray
    ends: IntArray
    corners: IntArray
    degrees: IntArray | None
    weights: Array | None


def grid_of(data: bytes, limit: int) -> tuple[str, list[GridPiece]]:
    """Return the version of a .vtu's format, and its pieces with cells of any kind. Raises MeshError for a bad file.

    limit: bytes that its arrays may unpack to.
    """
    root, decoder = _opened(data, limit, ".vtu", "UnstructuredGrid")
    pieces = []
    for piece in root.iter("Piece"):
        n, m = (header_count(piece.get(name, "")) for name in ("NumberOfPoints", "NumberOfCells"))
        if m:
            given = {
                part: _named(piece, *part)
                for part in (("CellData", "HigherOrderDegrees"), ("PointData", "RationalWeights"))
            }
            degrees, weights = given.values()
            pieces.append(
                GridPiece(
                    _places(piece, decoder, n),
                    *_cells(piece, decoder, m),
                    None if degrees is None else decoder.numbers(degrees, 3 * m).astype(np.int64).reshape(m, 3),
                    None if weights is None else decoder.numbers(weights, n).astype(np.float64),
                )
            )
    return root.get("version", ""), pieces


def _cells(piece: ElementTree.Element, decoder: Decoder, count: int) -> tuple[IntArray, IntArray, IntArray]:
    """Return types and ends (count,) of a piece's cells, and all their corners."""
    types = decoder.numbers(_array(piece, "Cells", "types"), count).astype(np.int64)
    ends = decoder.numbers(_array(piece, "Cells", "offsets"), count).astype(np.int64)
    if np.diff(ends, prepend=0).min() < 0:
        raise MeshError(f"the offsets of the .vtu's cells decrease; {DAMAGED}")
    return types, ends, decoder.numbers(_array(piece, "Cells", "connectivity"), int(ends[-1])).astype(np.int64)


def _named(piece: ElementTree.Element, part: str, name: str) -> ElementTree.Element | None:
    return next((array for array in piece.iterfind(f"{part}/DataArray") if array.get("Name") == name), None)


def _polygons(piece: ElementTree.Element, decoder: Decoder) -> Piece:
    """Return a piece's points (n, 3), its polygons, strips, vertices and lines, and their numbers."""
    counts = [header_count(piece.get(f"NumberOf{name}", "0")) for name in PARTS]
    n = header_count(piece.get("NumberOfPoints", ""))
    if not sum(counts):
        return np.empty((0, 3)), [], {}
    cells: list[tuple[str, Rows]] = []
    for (name, kind), count in zip(PARTS.items(), counts, strict=True):
        if not count:
            continue
        ends = decoder.numbers(_array(piece, name, "offsets"), count).astype(np.int64)
        if np.diff(ends, prepend=0).min() < 0:
            raise MeshError(f"the offsets of the .vtp's {name} decrease; {DAMAGED}")
        corners = decoder.numbers(_array(piece, name, "connectivity"), int(ends[-1])).astype(np.int64)
        cells.append((kind, [row.tolist() for row in np.split(corners, ends[:-1])]))
    marks = {name: decoder.numbers(array, sum(counts)) for name, array in _marks(piece).items()}
    return _places(piece, decoder, n), cells, marks


def _places(piece: ElementTree.Element, decoder: Decoder, count: int) -> Array:
    """Return the points (n, 3) of a piece."""
    points = _array(piece, "Points", None)
    if points.get("NumberOfComponents", "3") != "3":
        raise MeshError("the points have not three coordinates each: export three")
    return decoder.numbers(points, 3 * count).astype(np.float64).reshape(count, 3)


def _marks(piece: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """Return the arrays of a piece that give each cell one whole number, by their names."""
    arrays = piece.iterfind("CellData/DataArray")
    whole = [array for array in arrays if TYPES.get(array.get("type", ""), "f")[0] != "f"]
    return {array.get("Name", ""): array for array in whole if array.get("NumberOfComponents", "1") == "1"}


def _groups(marks: list[Marks], count: int) -> Groups:
    """Return the groups of `count` cells of all pieces, by the arrays that every piece has."""
    names = [name for name in (marks[0] if marks else {}) if all(name in held for held in marks)]
    return by_value({name: np.concatenate([held[name] for held in marks]) for name in names}, count)


def _array(piece: ElementTree.Element, part: str, name: str | None) -> ElementTree.Element:
    """Return the DataArray of that name in a part of a piece, any where the name is None."""
    for array in piece.iterfind(f"{part}/DataArray"):
        if name is None or array.get("Name") == name:
            return array
    raise MeshError(f"the file lacks the array {name or 'of points'} in <{part}>; {DAMAGED}")


def by_kind(types: IntArray, sizes: IntArray, ends: IntArray, corners: IntArray) -> list[tuple[str, Rows]]:
    """Return cells by kind; raise MeshError naming a type that is not read."""
    cells: list[tuple[str, Rows]] = []
    for number in np.unique(types).tolist():
        mine = np.flatnonzero(types == number)
        kind = KINDS.get(number) or _name(number)
        if np.all(sizes[mine] == sizes[mine[0]]):
            places = ends[mine, None] - sizes[mine[0]] + np.arange(sizes[mine[0]])
            cells.append((kind, corners[places]))
        else:
            cells.append((kind, [corners[ends[i] - sizes[i] : ends[i]].tolist() for i in mine]))
    return cells


def _name(number: int) -> str:
    """Return VTK's name of a cell type, for every kind of curve that of a line."""
    import pyvista

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of kinds that PyVista will no longer name
            name = pyvista.CellType(number).name.lower()
    except ValueError:
        return f"VTK {number}"
    return "poly_line" if name.endswith(("_curve", "_edge")) else name


def _shifted(rows: Rows, first: int) -> Rows:
    return rows + first if isinstance(rows, np.ndarray) else [[i + first for i in row] for row in rows]


def _joined(points: Array, cells: list[tuple[str, Rows]], notices: tuple[str, ...], groups: Groups) -> Content:
    """Return the content of several pieces, whose cells share points that are in exactly the same place."""
    _, first, label = np.unique(points, axis=0, return_index=True, return_inverse=True)
    number = first[label.ravel()]
    for _, rows in cells:
        for row in [rows] if isinstance(rows, np.ndarray) else rows:
            check_indices(points, np.asarray(row, dtype=np.int64))
    same: list[tuple[str, Rows]] = [
        (kind, number[rows] if isinstance(rows, np.ndarray) else [number[row].tolist() for row in rows])
        for kind, rows in cells
    ]
    return from_cells(points, same, notices, groups)
