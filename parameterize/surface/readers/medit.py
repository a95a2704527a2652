"""Medit files before the parser: the sections that hold a mesh, in the one layout it reads.

The parser takes a section's name and its count on two lines for granted, and knows few of the format's other sections.
"""

from __future__ import annotations

import re

from ..errors import MeshError
from .headers import DAMAGED, header_count

ASIDE = re.compile(rb'#[^\r\n]*|"[^"\r\n]*"')  # comments, and names of other files
KEYWORD = re.compile(rb"(?<!\S)([A-Z][A-Za-z]{3,})(?!\S)")
COLUMNS = {b"Vertices": 4, b"Triangles": 4, b"Quadrilaterals": 5, b"Tetrahedra": 5}  # the last is a reference number
COLUMNS |= {b"Pyramids": 6, b"Prisms": 7, b"Hexahedra": 9}  # named by the refusal


def trim_medit(data: bytes) -> bytes:
    """Vertices and cells of a .mesh text of dimension 3; empty sections are left out.

    Raises MeshError, without the file's name, for a file that is no such text or promises more than it holds.
    """
    text = ASIDE.sub(b" ", data.removeprefix(b"\xef\xbb\xbf"))
    before, *parts = KEYWORD.split(text)
    if before.strip() or parts[:1] != [b"MeshVersionFormatted"]:
        raise MeshError("not a .mesh: expected the text format that starts with MeshVersionFormatted")
    kept = [b"MeshVersionFormatted 2\nDimension 3\n"]
    for name, body in zip(parts[::2], parts[1::2], strict=True):
        if name == b"Dimension" and body.split() != [b"3"]:
            raise MeshError("the .mesh is not of dimension 3: export three coordinates each")
        if name in COLUMNS:
            words = body.split()
            count = header_count(words[0] if words else b"")
            size = count * COLUMNS[name]
            if size > len(words) - 1:
                promised = f"{count} {name.decode()}, {size} numbers"
                raise MeshError(f".mesh promises {promised}, {len(words) - 1} follow; {DAMAGED}")
            if count:
                kept.append(b"%b\n%d\n%b\n" % (name, count, b" ".join(words[1 : size + 1])))
    return b"".join(kept)
