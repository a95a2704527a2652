"""Lines and numbers of the formats that are text: OBJ, OFF, PLY and Medit."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..errors import MeshError

NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf(?:inity)?)"
NUMBERS = re.compile(rf"{NUMBER}(?: {NUMBER})*+", re.ASCII | re.IGNORECASE)
WHOLE_NUMBERS = re.compile(r"[-+]?\d{1,18}(?: [-+]?\d{1,18})*+", re.ASCII)


def text_lines(data: bytes) -> list[str]:
    r"""Return the lines of a text without its byte order mark; \n, \r\n and \r end a line."""
    text = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    return text.split("\n")


def coordinates(words: Sequence[str], line: int) -> list[float]:
    """Return the three coordinates that a record begins with; raise MeshError naming its line where it has fewer."""
    place = " ".join(words[:3])
    if len(words) < 3 or not NUMBERS.fullmatch(place):
        raise MeshError(f"line {line}: a vertex needs three numbers, got {place[:40]!r}")
    return [float(word) for word in words[:3]]


def corners(words: Sequence[str], line: int) -> list[int]:
    """Return the vertex numbers of a face; raise MeshError naming its line where they are none, or fewer than three."""
    if words and not WHOLE_NUMBERS.fullmatch(" ".join(words)):
        raise MeshError(f"line {line}: a face needs vertex numbers, got {' '.join(words)[:40]!r}")
    if len(words) < 3:
        raise MeshError(f"line {line}: a face has {len(words)} corners, expected at least 3; export it again")
    return [int(word) for word in words]
