"""OFF before the parser: the same vertices and faces as OBJ records, each on the line it stands on in the file.

Colours, normals and texture coordinates, which follow a row's coordinates or corners, are left out.
"""

from __future__ import annotations

import re

from ..errors import MeshError
from .headers import DAMAGED, header_count
from .obj import CORNER, face_record

HEADER = re.compile(r"(?:ST)?C?N?OFF", re.IGNORECASE)


def off_to_obj(data: bytes) -> bytes:
    r"""An OFF, COFF, NOFF, STOFF or a mixture of these as OBJ text; comments and \r line ends are taken as meant.

    Raises MeshError, without the file's name, for a file that is no such text, promises more rows than it holds, or
    has a face without its corners.
    """
    text = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    lines = [line.split("#", 1)[0] for line in text.split("\n")]
    rows = [number for number, line in enumerate(lines) if line.strip()]
    first = lines[rows[0]].lstrip() if rows else ""
    header = HEADER.match(first)
    if not header:
        raise MeshError(f"not an OFF: the first word must be OFF; {DAMAGED}")
    lines[rows[0]] = first[header.end() :]  # the counts may follow on the same line
    rows = rows if lines[rows[0]].strip() else rows[1:]
    numbers = lines[rows[0]].split() if rows else []
    if numbers[:1] == ["BINARY"]:
        raise MeshError("a binary OFF is not read: save it as text")
    if len(numbers) < 2:
        raise MeshError(f"OFF without the counts of vertices and faces; {DAMAGED}")
    vertices, faces = header_count(numbers[0]), header_count(numbers[1])
    present = len(rows) - 1
    if present < vertices + faces:
        raise MeshError(f"OFF promises {vertices} vertices and {faces} faces, {present} rows follow; {DAMAGED}")
    records = [""] * len(lines)
    for number in rows[1 : 1 + vertices]:
        records[number] = "v " + lines[number]
    for number in rows[1 + vertices : 1 + vertices + faces]:
        records[number] = _face(lines[number].split(), number + 1)
    return "\n".join(records).encode()


def _face(words: list[str], number: int) -> str:
    """The record of a row `n i_1 ... i_n ...`, numbers counted from 0; `number` is the line's."""
    size = int(words[0]) if CORNER.fullmatch(words[0]) else 0
    corners = words[1 : size + 1]
    try:
        if corners and len(corners) == size:
            return face_record(corners)
    except ValueError:
        pass
    raise MeshError(f"line {number}: a face needs its number of corners and as many vertices; {DAMAGED}")
