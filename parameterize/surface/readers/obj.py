"""Wavefront OBJ: vertices and faces alone, each word checked, so that errors name the line.

References to texture coordinates and normals are dropped: at a seam they would split a vertex.
"""

from array import array
from collections.abc import Iterator

import numpy as np

from ..errors import MeshError
from .common import Content, coordinates, corners, text_lines

FACES = ("f", "fo")


def read_obj(data: bytes, _: int) -> Content:
    """Read the records `v x y z` and `f a b c ...`; negative vertex numbers count back from the last vertex so far."""
    if b"\0" in data:
        raise MeshError("not an OBJ: it holds binary data; export as OBJ text")
    places = array("d")
    polygons: list[list[int]] = []
    relative = False
    for line, words in _records(text_lines(data)):
        if words[:1] == ["v"]:
            places.extend(coordinates(words[1:], line))
        elif words and words[0] in FACES:
            numbers = corners([word.split("/", 1)[0] for word in words[1:]], line)
            if 0 in numbers:
                raise MeshError(f"line {line}: vertex number 0, OBJ counts from 1; export the file again")
            relative = relative or min(numbers) < 0
            polygons.append([i - 1 if i > 0 else i + len(places) // 3 for i in numbers])
    vertices = np.array(places).reshape(-1, 3)
    if not len(vertices) or not polygons:
        raise MeshError(
            f"{len(vertices)} vertices and {len(polygons)} faces are no surface: the file is not an OBJ, or it is empty"
        )
    notices = ["byte order mark skipped"] if data.startswith(b"\xef\xbb\xbf") else []
    notices += ["negative (relative) vertex numbers resolved"] if relative else []
    return Content(vertices, polygons, tuple(notices))


def _records(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield number and words of each line; a vertex or face that ends in a backslash goes on in the next line."""
    numbered = enumerate(lines, 1)
    for number, line in numbered:
        words = _words(line)
        while words and words[-1][-1] == "\\" and words[0].rstrip("\\") in ("v", *FACES):
            words[-1] = words[-1].rstrip("\\")
            words = [word for word in words if word] + _words(next(numbered, (0, ""))[1])
        yield number, words


def _words(line: str) -> list[str]:
    return line.split("#", 1)[0].split()
