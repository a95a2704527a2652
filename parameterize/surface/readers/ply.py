"""PLY, text and binary: the places of its vertices, the corners of its faces and its triangle strips, groups.

Whole-number properties of faces become groups. Other elements are left out with a notice, other properties skipped.
"""

import re
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...arrays import Array, IntArray
from ..errors import MeshError, check_face_count
from ..groups import Groups, by_value, renumbered
from .cells import triangles_of_strips
from .common import DAMAGED, WHOLE_NUMBERS, Content, SurfaceFile, coordinates, corners, header_count, text_lines
from .ply_elements import Element, binary_rows, elements_of

NEWLINE = rb"(\r\n|\r|\n)"
BEGIN = re.compile(rb"ply[ \t]*" + NEWLINE)
END = re.compile(NEWLINE + rb"[ \t]*end_header[ \t]*(?=[\r\n]|$)")
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
CORNERS = ("vertex_index", "vertex_indices")
WHOLE = "bBhHiIqQ"  # types of a number that may be a group
Found = tuple[Array, list[list[int]], Groups]  # places (n, 3), polygons and their groups
READ = ("vertex", "face", "tristrips")


def read_ply(file: SurfaceFile) -> Content:
    """Read a PLY; a header that promises more than the file holds is refused before the rows are read."""
    data = file.data.removeprefix(b"\xef\xbb\xbf")
    begin, end = BEGIN.match(data), END.search(data)
    if not begin or not end:
        raise MeshError(f"not a PLY: no header from 'ply' to 'end_header'; {DAMAGED}")
    header = [line.split() for line in text_lines(data[: end.start()])]
    forms = [words[1] for words in header if words[:1] == ["format"] and len(words) > 1]
    if not forms or forms[0] not in ORDERS:
        raise MeshError(f"the PLY has the format {' '.join(forms[:1])[:40]!r}, expected one of {', '.join(ORDERS)}")
    elements = elements_of(header)
    counts = {element.name: element.count for element in elements}
    if not counts.get("vertex") or not (counts.get("face") or counts.get("tristrips")):
        found = f"{counts.get('vertex', 0)} vertices and {counts.get('face', 0)} faces"
        raise MeshError(f"the PLY holds {found}, a surface needs both: export the faces too")
    check_face_count(counts.get("face", 0), file.max_faces)
    ends = re.match(begin[1] + b"|" + NEWLINE + b"|", data[end.end() : end.end() + 2])  # first as the first line
    body = data[end.end() + (ends.end() if ends else 0) :]
    if ORDERS[forms[0]]:
        places, polygons, groups = _binary(body, elements, ORDERS[forms[0]])
    else:
        places, polygons, groups = _text(body, elements, len(header) + 2)
    besides = ", ".join(f"{e.count} {e.name[:20]!r}" for e in elements if e.count and e.name not in READ)
    return Content(places, polygons, (f"left out other elements: {besides}",) if besides else (), groups)


def _binary(body: bytes, elements: list[Element], order: str) -> Found:
    """Return places, polygons and groups of the rows of a binary file."""
    least = sum(element.least for element in elements)
    if len(body) < least:
        raise _too_few(elements, least, len(body), "bytes")
    places: Array = np.empty((0, 3))
    polygons: list[list[int]] = []
    groups: Groups = {}
    at = 0
    for element in elements:
        wanted, marks = _wanted(element), _marks(element)
        columns, at = binary_rows(body, at, element, order, wanted + marks)
        if element.name == "vertex":
            with np.errstate(invalid="ignore"):  # a signalling NaN, which is refused where a face uses it
                places = np.stack(columns, axis=1).astype(np.float64)
        elif element.name in READ and element.count:
            rows = _whole(columns[0])
            groups = _groups(element, marks, columns[1:], len(polygons)) or groups
            polygons += rows if element.name == "face" else triangles_of_strips(_parted(rows))
    return places, polygons, groups


def _text(body: bytes, elements: list[Element], first: int) -> Found:
    """Return places, polygons and groups of the rows of a text, whose first line has the number `first`."""
    rows = [(line, text.split()) for line, text in enumerate(text_lines(body), first) if text.strip()]
    needed = sum(element.count for element in elements if element.properties)
    if len(rows) < needed:
        raise _too_few(elements, needed, len(rows), "rows")
    places: list[list[float]] = []
    polygons: list[list[int]] = []
    groups: Groups = {}
    at = 0
    for element in elements:
        wanted, marks = _wanted(element), _marks(element)
        marked: list[list[str]] = []
        before = len(polygons)
        for line, words in rows[at : at + element.count] if wanted else []:
            found = _words(words, element, wanted + marks, line)
            if element.name == "vertex":
                places.append(coordinates(found, line))
            elif element.name == "face":
                polygons.append(corners(found[: len(found) - len(marks)], line))
                marked.append(found[len(found) - len(marks) :])
            else:
                polygons += triangles_of_strips(_parted([corners(found, line)]))
        if marked and marks:
            groups = _groups(element, marks, [_numbers(column) for column in zip(*marked, strict=True)], before)
        at += element.count if element.properties else 0
    return np.array(places), polygons, groups


def _marks(element: Element) -> list[int]:
    """Return the numbers of the properties of faces that may be groups: whole numbers."""
    if element.name != "face":
        return []
    return [k for k, (_, types) in enumerate(element.properties) if len(types) == 1 and types in WHOLE]


def _numbers(words: Sequence[str]) -> IntArray:
    """Return words as whole numbers; none where some are no such numbers."""
    return np.array(words if WHOLE_NUMBERS.fullmatch(" ".join(words)) else [], dtype=np.int64)


def _groups(element: Element, marks: list[int], columns: Sequence[ArrayLike], before: int) -> Groups:
    """Return the groups of faces by the columns of their marks; `before`: the number of polygons before these faces."""
    names = [element.properties[k][0] for k in marks]
    found = by_value(dict(zip(names, columns, strict=True)), element.count)
    return renumbered(found, np.append(np.full(before, -1), np.arange(element.count)))


def _wanted(element: Element) -> list[int]:
    """Return the numbers of the properties that are read: x, y and z of vertices, the corners of others."""
    if element.name not in READ or not element.count:
        return []
    names = [name if len(types) == 1 + (name in CORNERS) else "" for name, types in element.properties]
    if element.name == "vertex":
        found = [names.index(name) for name in ("x", "y", "z") if name in names]
    else:
        found = [k for k, name in enumerate(names) if name in CORNERS][:1]
    if len(found) != (3 if element.name == "vertex" else 1):
        lacking = "coordinates x, y and z" if element.name == "vertex" else "a list vertex_indices"
        raise MeshError(f"the PLY's elements {element.name} lack {lacking}: export them")
    return found


def _words(words: list[str], element: Element, wanted: list[int], line: int) -> list[str]:
    """Return the words of the wanted properties in a row."""
    held: list[list[str]] = []
    at = 0
    try:
        for _, types in element.properties:
            size = header_count(words[at]) if len(types) > 1 else 1
            at += len(types) - 1
            held.append(words[at : at + size])
            at += size
        if at <= len(words):
            return [word for k in wanted for word in held[k]]
    except (LookupError, MeshError):
        pass
    raise MeshError(f"line {line}: no {element.name} as the header promises; {DAMAGED}")


def _whole(rows: NDArray[Any] | list[tuple[float, ...]]) -> list[list[int]]:
    """Return the corners of faces; raise MeshError where they are no whole numbers."""
    if isinstance(rows, np.ndarray) and rows.dtype.kind in "iu":
        return rows.tolist()
    found = [list(row) for row in rows]
    if any(value % 1 != 0 for row in found for value in row):  # of nan and infinities, nan
        raise MeshError(f"a face of the PLY has corners that are no whole numbers; {DAMAGED}")
    return [[int(value) for value in row] for row in found]


def _parted(strips: list[list[int]]) -> list[list[int]]:
    """Return the strips, which are separated by -1."""
    parted: list[list[int]] = [[]]
    for strip in strips:
        for number in strip:
            if number == -1:
                parted.append([])
            else:
                parted[-1].append(number)
        parted.append([])
    return [strip for strip in parted if strip]


def _too_few(elements: list[Element], needed: int, present: int, unit: str) -> MeshError:
    promised = " and ".join(f"{element.count} {element.name[:20]}" for element in elements)
    return MeshError(f"the header promises {promised}, at least {needed} {unit}, where {present} follow; {DAMAGED}")
