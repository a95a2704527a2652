"""PLY text before the parser: its vertices and faces as OBJ records, whatever other properties stand beside them."""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..errors import MeshError
from .headers import DAMAGED, header_count
from .obj import face_record

Properties = list[tuple[str, bool]]  # names in a row's order, and whether each is a list


def text_ply_to_obj(data: bytes) -> bytes | None:
    """The records `v x y z` and `f a b ...` of a PLY of format ascii; None for a binary one.

    Each record stands on its line of the file, so that errors name it. The header must have been checked. Raises
    MeshError, without the file's name, for rows without the properties that the header names.
    """
    head = data.partition(b"end_header")[0]
    if not re.search(rb"[\r\n]format[ \t]+ascii\b", head):
        return None
    text = data.decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
    lines = [line.split() for line in text.split("\n")]
    end = lines.index(["end_header"]) if ["end_header"] in lines else len(lines)
    rows = (number for number in range(end + 1, len(lines)) if lines[number])
    records = [""] * len(lines)
    for name, count, properties in _elements(lines[:end]):
        for _, number in zip(range(count), rows, strict=False):
            if name in ("vertex", "face"):
                try:
                    held = _row(lines[number], properties)
                    records[number] = _vertex(held) if name == "vertex" else _face(held)
                except (LookupError, ValueError):
                    raise MeshError(f"line {number + 1}: no {name} as the header promises; {DAMAGED}") from None
    return "\n".join(records).encode()


def _elements(lines: list[list[str]]) -> Iterator[tuple[str, int, Properties]]:
    """Name, count and properties of each element of the header."""
    starts = [i for i, words in enumerate(lines) if words[:1] == ["element"] and len(words) == 3]
    for start, stop in zip(starts, [*starts[1:], len(lines)], strict=True):
        rows = [words for words in lines[start + 1 : stop] if words[:1] == ["property"] and len(words) > 2]
        yield lines[start][1], header_count(lines[start][2]), [(words[-1], words[1] == "list") for words in rows]


def _row(words: list[str], properties: Properties) -> dict[str, list[str]]:
    """The words of each property; raises LookupError and ValueError where there are fewer."""
    held: dict[str, list[str]] = {}
    at = 0
    for name, is_list in properties:
        size = header_count(words[at]) if is_list else 1
        at += is_list
        held[name] = words[at : at + size]
        if len(held[name]) < size:
            raise LookupError(name)
        at += size
    return held


def _vertex(held: dict[str, list[str]]) -> str:
    return f"v {held['x'][0]} {held['y'][0]} {held['z'][0]}"


def _face(held: dict[str, list[str]]) -> str:
    return face_record(held["vertex_index" if "vertex_index" in held else "vertex_indices"])
