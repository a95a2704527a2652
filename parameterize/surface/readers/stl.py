"""STL text before the parser: the solids without their names, which may hold any words, nor what stands before them."""

from __future__ import annotations

import re

SOLID = re.compile(rb"^[ \t]*((?:end)?solid)\b.*$", re.IGNORECASE | re.MULTILINE)
BEFORE = 4096  # bytes in which the first solid begins


def trim_stl(data: bytes) -> bytes:
    r"""An STL text with \n line ends that begins with `solid`; anything else as it is."""
    if b"\0" in data or len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return data
    text = data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    first = SOLID.search(text[:BEFORE])
    return SOLID.sub(rb"\1", text[first.start() :]) if first else data
