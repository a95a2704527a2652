"""Medit text: the sections that hold vertices and cells, whose references are groups; marks on them are skipped."""

import re

import numpy as np
from numpy.typing import NDArray

from ...arrays import IntArray
from ..errors import MeshError, check_indices
from ..groups import by_value
from .cells import from_cells
from .common import DAMAGED, NUMBERS, WHOLE_NUMBERS, Content, SurfaceFile, header_count, text_lines

ASIDE = re.compile(r'#[^\n]*|"[^"\n]*"')  # comments, and names of other files
KEYWORD = re.compile(r"(?<!\S)([A-Z][A-Za-z]{2,}\d?)(?!\S)")
CELLS = {"Triangles": ("triangle", 3), "Quadrilaterals": ("quad", 4), "Tetrahedra": ("tetra", 4)}
CELLS |= {"Pyramids": ("pyramid", 5), "Prisms": ("wedge", 6), "Hexahedra": ("hexahedron", 8), "Edges": ("line", 2)}
CELLS |= {"Hexaedra": CELLS["Hexahedra"]}  # so written by some programs
CURVED = re.compile(r"(Triangle|Quadrilateral|Tetrahedra|Pyramid|Prism|Hexahedra)s?[PQ]\d")


def read_medit(file: SurfaceFile) -> Content:
    """Read vertices and cells of a .mesh text of dimension 3."""
    before, *parts = KEYWORD.split(ASIDE.sub(" ", "\n".join(text_lines(file.data))))
    if before.strip() or parts[:1] != ["MeshVersionFormatted"]:
        raise MeshError("not a .mesh: expected the text format that starts with MeshVersionFormatted")
    vertices = np.empty((0, 3))
    cells: list[tuple[str, IntArray]] = []
    references: list[IntArray] = []
    for name, body in zip(parts[::2], parts[1::2], strict=True):
        words = body.split()
        if name == "Dimension" and words != ["3"]:
            raise MeshError("the .mesh is not of dimension 3: export three coordinates each")
        if name == "Vertices":
            vertices = _table(name, words, 3, NUMBERS)[:, :-1].astype(np.float64)
        elif name in CELLS:
            kind, size = CELLS[name]
            rows = _table(name, words, size, WHOLE_NUMBERS).astype(np.int64)
            cells.append((kind, rows[:, :-1] - 1))
            references.append(rows[:, -1])
        elif CURVED.fullmatch(name) and words[:1] != ["0"]:
            raise MeshError(
                f"holds {' '.join(words[:1])[:20]} curved cells, {name}: save linear tetrahedra or triangles"
            )
    for _kind, table in cells:
        check_indices(vertices, table, first=1)
    marks = np.concatenate([*references, np.empty(0, dtype=np.int64)])
    return from_cells(vertices, cells, groups=by_value({"ref": marks}, len(marks)))


def _table(name: str, words: list[str], columns: int, numbers: re.Pattern[str]) -> NDArray[np.str_]:
    """Return the rows of a section (count, columns + 1), the reference number at the end of each, still as words."""
    count = header_count(words[0] if words else "")
    size = count * (columns + 1)
    if size > len(words) - 1:
        raise MeshError(f"the .mesh promises {count} {name}, {size} numbers, {len(words) - 1} follow; {DAMAGED}")
    rows = words[1 : size + 1]
    if count and not numbers.fullmatch(" ".join(rows)):
        raise MeshError(f"the .mesh has a word that is not a number among its {name}; {DAMAGED}")
    return np.array(rows, dtype=np.str_).reshape(count, columns + 1)
