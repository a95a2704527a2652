"""Cheap checks of a surface file before a parser sees it: counts against the size, truncation, the format's marks.

Parsers allocate what a header promises and return what they could read; these checks refuse such a file first.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from ..errors import MeshError

PLY_BYTES = {"char": 1, "uchar": 1, "short": 2, "ushort": 2, "int": 4, "uint": 4, "float": 4, "double": 8}
PLY_BYTES |= {"int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float32": 4, "float64": 8}
PLY_FACES = (
    rb"element\s+face\s+\d+\s+property\s+list\s+(?:uchar|uint8|int|int32)\s+u?int(?:32)?\s+vertex_ind(?:ex|ices)"
)
PLY_POINTS = rb"element\s+vertex\s+\d+" + b"".join(
    rb"\s+property\s+(?:float|float32|double)\s+" + axis for axis in (b"x", b"y", b"z")
)
PLY_MORE = rb"(?:\s+property\s+(?:float|float32|double|uchar|uint8|int|int32|uint|uint32)\s+\w+)*"
PLAIN_PLY = re.compile(rb"\s" + PLY_POINTS + PLY_MORE + rb"\s+" + PLY_FACES + rb"\s*\Z")
DAMAGED = "the file is truncated or damaged, export it again"


@dataclass(frozen=True)
class Header:
    """What a file promises: its number of polygons (None where the format does not say), and notices."""

    polygons: int | None = None
    notices: tuple[str, ...] = ()


def check_header(data: bytes, suffix: str, max_faces: int) -> Header:
    """Check the bytes of a file by its format (".stl", ".ply", ".vtu"; the others are checked where they are trimmed).

    Raises MeshError, without the file's name, for a file that is no such format, promises more than it holds, or has
    more than max_faces faces.
    """
    if suffix not in CHECKS:
        return Header()
    header = CHECKS[suffix](data)
    if header.polygons is not None:
        check_face_count(header.polygons, max_faces)
    return header


def check_face_count(count: int, max_faces: int) -> None:
    """Raise MeshError where a surface has more faces than allowed."""
    if count > max_faces:
        raise MeshError(
            f"{count} faces, more than max_faces={max_faces}: raise --max-faces, or bring them down with --decimate"
        )


def header_count(word: bytes | str) -> int:
    """The number of elements that a header's word gives; raises MeshError where it is none."""
    text = word.decode("latin-1") if isinstance(word, bytes) else word
    if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
        raise MeshError(f"the header's count {text[:20]!r} is no number of elements; {DAMAGED}")
    return int(text)


def _check_stl(data: bytes) -> Header:
    says_solid = data[:512].lstrip().lower().startswith(b"solid")
    promised = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + 50 * promised:
        notice = ("binary STL although it starts with 'solid'",) if says_solid else ()
        return Header(promised, notice)
    if says_solid and b"\0" not in data:
        return _check_ascii_stl(data)
    if len(data) < 84:
        raise MeshError(f"not an STL: {len(data)} bytes, the header alone takes 84; {DAMAGED}")
    expected = 84 + 50 * promised
    raise MeshError(f"STL of {promised} triangles must have {expected} bytes, this one has {len(data)}; {DAMAGED}")


def _check_ascii_stl(data: bytes) -> Header:
    lower = data.lower()
    facets = len(re.findall(rb"\bendfacet\b", lower))
    opened = len(re.findall(rb"\bfacet\s+normal\b", lower))
    corners = len(re.findall(rb"\bvertex\s", lower))
    if b"endsolid" not in lower or opened != facets or corners != 3 * facets:
        raise MeshError(f"STL text with {opened} facets begun, {facets} ended and {corners} corners; {DAMAGED}")
    return Header(facets)


def _check_ply(data: bytes) -> Header:
    head, mark, _ = data.partition(b"end_header")
    if not data.removeprefix(b"\xef\xbb\xbf").startswith(b"ply") or not mark:
        raise MeshError(f"not a PLY: no header from 'ply' to 'end_header'; {DAMAGED}")
    body = data[len(head) + len(mark) :]
    lines = [line.split() for line in head.decode("latin-1").splitlines()]
    is_text = ["format", "ascii"] in [words[:2] for words in lines]
    counts: dict[str, int] = {}
    least = 0  # bytes the elements take at the least: a list may be empty, a text element needs one digit and a break
    for words in lines:
        if words[:1] == ["element"] and len(words) == 3:
            element = words[1]
            counts[element] = header_count(words[2])
            least += 2 * counts[element] if is_text else 0
        elif words[:1] == ["property"] and len(words) >= 3 and counts and not is_text:
            least += counts[element] * PLY_BYTES.get(words[2] if words[1] == "list" else words[1], 1)
    if counts.get("tristrips"):
        raise MeshError("PLY with triangle strips (element tristrips): save its faces as triangles")
    if not counts.get("vertex") or not counts.get("face"):
        found = f"{counts.get('vertex', 0)} vertices and {counts.get('face', 0)} faces"
        raise MeshError(f"PLY with {found} is no surface: export the faces too")
    promised = " and ".join(f"{count} {element}" for element, count in counts.items())
    _check_room(promised, least, len(body))
    rows = len(re.findall(rb"[^\s][^\r\n]*", body))
    if is_text and rows < sum(counts.values()):
        raise MeshError(f"PLY promises {promised} elements, {rows} rows follow; {DAMAGED}")
    return Header(counts["face"])


def plain_ply(data: bytes) -> bytes | None:
    """A PLY for meshio, which keeps polygons whole, or None where it holds more than meshio reads."""
    head, mark, body = data.partition(b"end_header")
    return re.sub(rb"\bvertex_index\b", b"vertex_indices", head) + mark + body if PLAIN_PLY.search(head) else None


def _check_vtu(data: bytes) -> Header:
    if b"<VTKFile" not in data[:4096] or b"</VTKFile>" not in data[-256:]:
        raise MeshError(f"not a whole .vtu: no <VTKFile> ... </VTKFile>; {DAMAGED}")
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise MeshError("the .vtu declares a document type: entities are not expanded here, take the declaration out")
    pieces = len(re.findall(rb"<Piece\b", data))
    if pieces > 1:
        raise MeshError(
            f"the .vtu holds {pieces} pieces: merge them into one, in ParaView with Merge Blocks, and save it"
        )
    for name in (b"NumberOfPoints", b"NumberOfCells"):
        for match in re.findall(name + rb"\s*=\s*[\"'](\d+)[\"']", data):
            count = header_count(match)  # at least a byte each, compressed or not
            _check_room(f"{name.decode()}={count}", count, len(data))
    return Header()


def _check_room(promised: str, needed: int, available: int) -> None:
    if needed > available:
        raise MeshError(f"the header promises {promised}, at least {needed} bytes, where {available} follow; {DAMAGED}")


CHECKS: dict[str, Callable[[bytes], Header]] = {
    ".stl": _check_stl,
    ".ply": _check_ply,
    ".vtu": _check_vtu,
}
