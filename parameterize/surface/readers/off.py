"""OFF text: vertices and faces; the colours, normals and texture coordinates that may follow in a row are skipped."""

import re

import numpy as np

from ..errors import MeshError, check_face_count
from .common import DAMAGED, Content, coordinates, corners, header_count, text_lines

HEADER = re.compile(r"(?:ST)?C?N?OFF", re.IGNORECASE)


def read_off(data: bytes, max_faces: int) -> Content:
    """Read an OFF, COFF, NOFF or STOFF text, or a mixture of these; comments are skipped."""
    lines = [line.split("#", 1)[0].strip() for line in text_lines(data)]
    rows = [(number, line) for number, line in enumerate(lines, 1) if line]
    header = HEADER.match(rows[0][1]) if rows else None
    if not header:
        raise MeshError(f"not an OFF: the first word must be OFF; {DAMAGED}")
    same_line = rows[0][1][header.end() :].split()  # the counts may stand there or on the next line
    rows = rows[1:]
    counts = same_line or (rows.pop(0)[1].split() if rows else [])
    if counts[:1] == ["BINARY"]:
        raise MeshError("binary OFF is not supported: save it as text")
    if len(counts) < 2:
        raise MeshError(f"the OFF lacks the counts of vertices and faces; {DAMAGED}")
    n, m = header_count(counts[0]), header_count(counts[1])
    if len(rows) < n + m:
        raise MeshError(f"OFF promises {n} vertices and {m} faces, {len(rows)} rows follow; {DAMAGED}")
    check_face_count(m, max_faces)
    vertices = np.array([coordinates(line.split(), number) for number, line in rows[:n]])
    return Content(vertices.reshape(-1, 3), [_corners(line.split(), number) for number, line in rows[n : n + m]])


def _corners(words: list[str], line: int) -> list[int]:
    """Return the vertex numbers of a row `n i_1 ... i_n ...`."""
    size = int(words[0]) if words[0].isdecimal() and len(words[0]) < 4 else 0
    if not 0 < size < len(words):
        raise MeshError(f"line {line}: a face needs its number of corners and as many vertices; {DAMAGED}")
    return corners(words[1 : size + 1], line)
