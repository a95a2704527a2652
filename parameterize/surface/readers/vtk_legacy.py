"""VTK's legacy .vtk, text or binary: polygons and cells; whole numbers of cells give groups, other data are skipped.

(The VTK User's Guide, "VTK File Formats"; version 5.1 gives cells by offsets, earlier ones by their sizes.)
"""

import re
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...arrays import IntArray
from ..errors import MeshError
from ..groups import by_value
from .cells import Rows, from_cells
from .common import DAMAGED, Content, SurfaceFile, header_count, number_array
from .vtu import PARTS, by_kind

TYPES = {"float": "f4", "double": "f8", "char": "i1", "unsigned_char": "u1", "short": "i2", "unsigned_short": "u2"}
TYPES |= {"int": "i4", "unsigned_int": "u4", "long": "i8", "unsigned_long": "u8", "vtkidtype": "i4"}
TYPES |= {f"vtktype{sign}int{8 * size}": f"{sign or 'i'}{size}" for sign in ("", "u") for size in (1, 4, 8)}
PARTS_BY_WORD = {"VERTICES": "Verts", "LINES": "Lines", "TRIANGLE_STRIPS": "Strips", "POLYGONS": "Polys"}
WORD = re.compile(rb"\s*(\S+)")
LINE = re.compile(rb"[^\n]*\n?")


def read_vtk(file: SurfaceFile) -> Content:
    """Read a .vtk that holds POLYDATA or an UNSTRUCTURED_GRID."""
    data = file.data
    head = data[:1024].split(b"\n", 3)
    if len(head) < 4 or not head[0].startswith(b"# vtk DataFile Version"):
        raise MeshError(f"not a .vtk: its first line is not '# vtk DataFile Version'; {DAMAGED}")
    form = head[2].strip().upper()
    if form not in (b"ASCII", b"BINARY"):
        raise MeshError(f"the third line of the .vtk is {form[:20].decode(errors='replace')!r}, not ASCII or BINARY")
    start = sum(len(line) + 1 for line in head[:3])
    return _Words(data, start, form == b"BINARY").content()


class _Words:
    """The words and the arrays of a legacy file, from one place to the next."""

    def __init__(self, data: bytes, place: int, binary: bool) -> None:
        self._data, self._place, self._binary = data, place, binary
        self._points = np.empty((0, 3))
        self._parts: dict[str, list[list[int]]] = {}
        self._cells: list[tuple[str, Rows]] = []
        self._order: IntArray | None = None  # of the cells of a grid, which are returned kind by kind
        self._rows: tuple[IntArray, IntArray] | None = None  # ends of the cells of a grid, and all their corners
        self._marks: dict[str, NDArray[np.int64]] = {}

    def content(self) -> Content:
        """Return the points and cells."""
        if self._keyword() != "DATASET":
            raise MeshError(f"the .vtk has no DATASET in its fourth line; {DAMAGED}")
        kind = self._keyword()
        if kind not in ("POLYDATA", "UNSTRUCTURED_GRID"):
            raise MeshError(f"the .vtk holds {kind[:40]!r}, expected POLYDATA or UNSTRUCTURED_GRID: save it as one")
        readers: dict[str, Callable[[], None]] = {
            "POINTS": self._read_points,
            "CELLS": self._read_cells,
            "CELL_TYPES": self._read_types,
            "METADATA": self._skip_metadata,
            "FIELD": self._skip_field,
            "CELL_DATA": self._read_marks,
            **{word: partial(self._read_part, name) for word, name in PARTS_BY_WORD.items()},
        }
        while (word := self._keyword()) and word != "POINT_DATA":
            if word not in readers:
                raise MeshError(f"the .vtk has an unknown section {word[:40]!r}; {DAMAGED}")
            readers[word]()
            if word == "CELL_DATA":
                break
        cells = self._cells or [(PARTS[name], self._parts[name]) for name in PARTS if name in self._parts]
        count = sum(len(rows) for _, rows in cells)
        order = np.arange(count) if self._order is None else self._order
        marks = {name: values[order] for name, values in self._marks.items() if len(values) == count}
        return from_cells(self._points, cells, groups=by_value(marks, count))

    def _word(self) -> str:
        """Return the next word, "" at the end."""
        found = WORD.match(self._data, self._place)
        if not found:
            return ""
        self._place = found.end()
        return found[1].decode("ascii", errors="replace")

    def _keyword(self) -> str:
        return self._word().upper()

    def _count(self) -> int:
        return header_count(self._word())

    def _array(self, kind: str, count: int) -> NDArray[np.float64 | np.int64]:
        """Return the `count` numbers that follow the line, (count,)."""
        dtype = TYPES.get(kind.lower())
        if dtype is None:
            raise MeshError(f"an array of the .vtk has the type {kind[:40]!r}: save it as numbers")
        self._skip_line()
        whole = np.dtype(dtype).kind in "iu"
        if self._binary:
            size = count * np.dtype(dtype).itemsize
            if self._place + size > len(self._data):
                raise MeshError(
                    f"the .vtk promises {size} more bytes, {len(self._data) - self._place} follow; {DAMAGED}"
                )
            found = np.frombuffer(self._data, f">{dtype}", count, self._place)
            self._place += size
        else:
            words: list[str] = []
            if count > len(self._data) - self._place:
                raise MeshError(f"the .vtk promises {count} more numbers than it has bytes; {DAMAGED}")
            for _ in range(count):
                word = WORD.match(self._data, self._place)
                if not word:
                    raise MeshError(f"the .vtk promises {count} numbers, {len(words)} follow; {DAMAGED}")
                self._place = word.end()
                words.append(word[1].decode("ascii", errors="replace"))
            found = number_array(words, "an array of the .vtk", whole=whole)
        return found.astype(np.int64 if whole else np.float64)

    def _skip_line(self) -> None:
        line = LINE.match(self._data, self._place)
        self._place = line.end() if line else self._place

    def _read_points(self) -> None:
        count = self._count()
        self._points = self._array(self._word(), 3 * count).astype(np.float64).reshape(count, 3)

    def _lists(self) -> tuple[IntArray, IntArray]:
        """Return the ends (n,) of lists of corners, and the corners."""
        count, size = self._count(), self._count()
        place = self._place
        self._skip_line()
        if self._keyword() != "OFFSETS":
            self._place = place
            return _by_sizes(self._array("int", size), count)
        ends = self._array(self._word(), count)[1:]
        if self._keyword() != "CONNECTIVITY":
            raise MeshError(f"the .vtk has offsets without a connectivity; {DAMAGED}")
        corners = self._array(self._word(), size)
        if np.diff(ends, prepend=0).min(initial=0) < 0 or ends.max(initial=0) > size:
            raise MeshError(f"the offsets of the .vtk decrease, or reach too far; {DAMAGED}")
        return ends.astype(np.int64), corners.astype(np.int64)

    def _read_part(self, name: str) -> None:
        ends, corners = self._lists()
        self._parts[name] = [row.tolist() for row in np.split(corners[: ends[-1] if len(ends) else 0], ends[:-1])]
        self._parts[name] = self._parts[name] if len(ends) else []

    def _read_cells(self) -> None:
        self._rows = self._lists()

    def _read_types(self) -> None:
        types = self._array("int", self._count()).astype(np.int64)
        if self._rows is None or len(self._rows[0]) != len(types):
            raise MeshError(f"the .vtk gives {len(types)} types, which are not as many as its cells; {DAMAGED}")
        ends, corners = self._rows
        self._cells = by_kind(types, np.diff(ends, prepend=0), ends, corners)
        self._order = np.argsort(types, kind="stable")

    def _skip_metadata(self) -> None:
        """Skip lines until an empty one."""
        self._skip_line()
        while (line := LINE.match(self._data, self._place)) and line[0].strip():
            self._place = line.end()

    def _skip_field(self) -> None:
        self._field(0)

    def _field(self, cells: int) -> None:
        """Read the arrays of a FIELD; keep whole numbers of `cells` cells."""
        self._word()
        for _ in range(self._count()):
            name = self._word()
            if name == "METADATA":
                self._skip_metadata()
                name = self._word()
            width, count = self._count(), self._count()
            self._keep(name, self._array(self._word(), width * count), cells)

    def _read_marks(self) -> None:
        """Read the numbers of cells, up to an attribute that is none of SCALARS and FIELD."""
        count = self._count()
        while (word := self._keyword()) in ("SCALARS", "FIELD", "METADATA"):
            if word == "METADATA":
                self._skip_metadata()
            elif word == "FIELD":
                self._field(count)
            else:
                name, kind = self._word(), self._word()
                line = LINE.match(self._data, self._place)
                width = header_count(line[0].split()[0].decode(errors="replace")) if line and line[0].split() else 1
                self._skip_line()
                if self._keyword() != "LOOKUP_TABLE":
                    raise MeshError(f"the scalars {name[:40]!r} of the .vtk have no LOOKUP_TABLE; {DAMAGED}")
                self._word()
                self._keep(name, self._array(kind, width * count), count)

    def _keep(self, name: str, values: NDArray[np.float64 | np.int64], cells: int) -> None:
        if values.dtype.kind == "i" and values.shape == (cells,):
            self._marks[name] = values.astype(np.int64)


def _by_sizes(numbers: NDArray[np.float64 | np.int64], count: int) -> tuple[IntArray, IntArray]:
    """Return ends and corners of `count` lists, each of which begins with its length."""
    row = numbers.astype(np.int64).tolist()
    starts: list[int] = []
    place = 0
    for _ in range(count):
        if place >= len(row) or row[place] < 0 or place + 1 + row[place] > len(row):
            raise MeshError(f"the .vtk promises {count} cells, {len(starts)} follow; {DAMAGED}")
        starts.append(place)
        place += 1 + row[place]
    sizes = np.array([row[start] for start in starts], dtype=np.int64)
    kept = np.ones(len(row), dtype=bool)
    kept[starts] = False
    kept[place:] = False
    return np.cumsum(sizes), np.asarray(row, dtype=np.int64)[kept]
