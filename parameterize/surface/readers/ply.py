"""PLY, text and binary: the places of its vertices and the corners of its faces; other properties are skipped.

Text is read here. Binary files are read by meshio where faces have their corners alone, whose number may differ, and
by trimesh where faces have further properties, all faces then with the same number of corners.
"""

import io
import re
from dataclasses import dataclass

import numpy as np

from ..errors import MeshError, check_face_count
from .common import DAMAGED, Content, coordinates, corners, header_count, library, text_lines

SIZES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "double": 8}
SIZES |= {"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float32": 4, "float64": 8}
FOR_MESHIO = {"uchar", "uint8", "int", "int32", "uint", "uint32", "float", "float32", "double"}
CORNERS = ("vertex_index", "vertex_indices")


@dataclass(frozen=True)
class Element:
    """An element that the header names.

    properties: name and types of each in order: one type for a number, those of the length and the items for a list.
    """

    name: str
    count: int
    properties: list[tuple[str, list[str]]]


def read_ply(data: bytes, max_faces: int) -> Content:
    """Read a PLY; one that promises more than it holds is refused before a library reads it."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    head, mark, body = data.partition(b"end_header")
    if not data.startswith(b"ply") or not mark:
        raise MeshError(f"not a PLY: no header from 'ply' to 'end_header'; {DAMAGED}")
    lines = [line.split() for line in text_lines(head)]
    is_text = ["format", "ascii"] in [words[:2] for words in lines]
    elements = _elements(lines)
    counts = {element.name: element.count for element in elements}
    if counts.get("tristrips"):
        raise MeshError("the PLY holds triangle strips (element tristrips): save its faces as triangles")
    if not counts.get("vertex") or not counts.get("face"):
        found = f"{counts.get('vertex', 0)} vertices and {counts.get('face', 0)} faces"
        raise MeshError(f"the PLY holds {found}, a surface needs both: export the faces too")
    check_face_count(counts["face"], max_faces)
    if is_text:
        rows = [(line, text.split()) for line, text in enumerate(text_lines(body), len(lines)) if text.strip()]
        present, needed, unit = len(rows), sum(counts.values()), "rows"
    else:
        least = {element.name: sum(SIZES.get(types[0], 1) for _, types in element.properties) for element in elements}
        present, needed, unit = len(body), sum(least[name] * count for name, count in counts.items()), "bytes"
    if present < needed:
        promised = " and ".join(f"{count} {name}" for name, count in counts.items())
        raise MeshError(f"the header promises {promised}, at least {needed} {unit}, where {present} follow; {DAMAGED}")
    return _read_rows(rows, elements) if is_text else _read_binary(data, elements)


def _elements(lines: list[list[str]]) -> list[Element]:
    """Return the elements that the words of the header's lines name, in order."""
    elements: list[Element] = []
    for words in lines:
        if words[:1] == ["element"] and len(words) == 3:
            elements.append(Element(words[1], header_count(words[2]), []))
        elif words[:1] == ["property"] and len(words) > 2 and elements:
            is_list = words[1] == "list" and len(words) > 4
            elements[-1].properties.append((words[-1], words[2:4] if is_list else words[1:2]))
    return elements


def _read_rows(rows: list[tuple[int, list[str]]], elements: list[Element]) -> Content:
    """Return what the rows of a text hold, each given by its line number and its words."""
    places, polygons = [], []
    for element in elements:
        mine, rows = rows[: element.count], rows[element.count :]
        for line, words in mine:
            if element.name == "vertex":
                places.append(coordinates(_wanted(words, element, line), line))
            elif element.name == "face":
                polygons.append(corners(_wanted(words, element, line), line))
    return Content(np.array(places), polygons)


def _wanted(words: list[str], element: Element, line: int) -> list[str]:
    """Return the words of x, y and z in a vertex's row, or of the corners in a face's row."""
    held: dict[str, list[str]] = {}
    at = 0
    try:
        for name, types in element.properties:
            size = header_count(words[at]) if len(types) > 1 else 1
            at += len(types) - 1
            held[name] = words[at : at + size]
            at += size
        names = ["x", "y", "z"] if element.name == "vertex" else [name for name in held if name in CORNERS][:1]
        if at <= len(words):
            return [word for name in names for word in held[name]]
    except (LookupError, MeshError):
        pass
    raise MeshError(f"line {line}: no {element.name} as the header promises; {DAMAGED}")


def _read_binary(data: bytes, elements: list[Element]) -> Content:
    """Read a binary file whose header names these elements."""
    import meshio
    import trimesh.exchange.ply

    faces = next(element for element in elements if element.name == "face")
    used = {kind for element in elements for _, types in element.properties for kind in types}
    only_corners = [name in CORNERS for name, _ in faces.properties] == [True]
    with library(".ply"):
        if only_corners and used <= FOR_MESHIO and [element.name for element in elements] == ["vertex", "face"]:
            renamed = re.sub(rb"\bvertex_index\b", b"vertex_indices", data, count=1)
            mesh = meshio.read(io.BytesIO(renamed), file_format="ply")
            places, polygons = mesh.points, [row for block in mesh.cells for row in block.data.tolist()]
        else:
            held = trimesh.exchange.ply.load_ply(io.BytesIO(data), fix_texture=False, skip_materials=True)
            places, polygons = held["vertices"], held["faces"].astype(np.int64).tolist()
    if len(polygons) < faces.count:
        raise MeshError(f"{faces.count} faces promised, {len(polygons)} read; {DAMAGED}")
    return Content(np.asarray(places, dtype=np.float64), polygons)
