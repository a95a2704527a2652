"""Wavefront OBJ: vertices, faces and their groups, each number checked, so that errors name the line.

References to texture coordinates and normals are dropped: at a seam they would split a vertex. Groups, materials and
objects name the faces after them. Records that are no part of the surface, such as lines, are left out with a notice.
"""

import re
from array import array
from collections import Counter
from collections.abc import Iterator

import numpy as np

from ..errors import MeshError
from ..groups import Groups, gathered
from .common import NUMBER, Content, SurfaceFile, coordinates, corners, text_lines

FACES = ("f", "fo")
PATCHES = ("surf", "bsp", "bzp", "call")  # free-form surfaces, and other files
BESIDE = ("p", "l", "curv", "curv2")  # points, lines, curves
NAMING = ("g", "usemtl", "o")  # the faces that follow, until the next of the same kind
SKIPPED = {"vt", "vn", "vp", "s", "mg", "mtllib", "usemap", "maplib", "bevel", "lod", "shadow_obj"}
SKIPPED |= {"trace_obj", "c_interp", "d_interp", "ctech", "stech", "cstype", "deg", "bmat", "step", "parm", "end"}
LISTED = 5  # kinds of records left out
PLAIN = re.compile(rf"(?:(?:#.*|v(?: (?i:{NUMBER})){{3}}|f(?: [1-9]\d{{0,17}}){{3}})?\n)*+", re.ASCII)


def read_obj(file: SurfaceFile) -> Content:
    """Read the records `v x y z` and `f a b c ...`; negative vertex numbers count back from the last vertex so far."""
    if b"\0" in file.data:
        raise MeshError("not an OBJ: it holds binary data; export as OBJ text")
    lines = text_lines(file.data)
    if (plain := _plain(lines)) is not None:
        return plain
    places = array("d")
    polygons: list[list[int]] = []
    named: list[tuple[int, list[str]]] = []
    relative = False
    highest, highest_line = 0, 0
    left_out: Counter[str] = Counter()
    for line, words in _records(lines):
        if words[:1] == ["v"]:
            places.extend(coordinates(words[1:], line))
        elif words and words[0] in FACES:
            numbers = corners([word.split("/", 1)[0] for word in words[1:]], line)
            if 0 in numbers:
                raise MeshError(f"line {line}: vertex number 0, OBJ counts from 1; export the file again")
            if -min(numbers) > len(places) // 3:
                raise _out_of_range(min(numbers), line, len(places) // 3)
            relative = relative or min(numbers) < 0
            if max(numbers) > highest:
                highest, highest_line = max(numbers), line
            polygons.append([i - 1 if i > 0 else i + len(places) // 3 for i in numbers])
        elif words and words[0] in NAMING:
            named.append((len(polygons), words))
        elif words and words[0] in PATCHES:
            raise MeshError(f"line {line}: a record {words[0]!r}, which is not read: export the surface as polygons")
        elif words and words[0] not in SKIPPED:
            left_out[words[0]] += 1
    vertices = np.array(places).reshape(-1, 3)
    if not len(vertices) or not polygons:
        raise MeshError(
            f"{len(vertices)} vertices and {len(polygons)} faces are no surface: the file is not an OBJ, or it is empty"
        )
    if highest > len(vertices):
        raise _out_of_range(highest, highest_line, len(vertices))
    notices = ["byte order mark skipped"] if file.data.startswith(b"\xef\xbb\xbf") else []
    notices += ["negative (relative) vertex numbers resolved"] if relative else []
    if left_out:
        listed = ", ".join(f"{count} {ascii(word[:20])}" for word, count in left_out.most_common(LISTED))
        more = f" and {len(left_out) - LISTED} more kinds" if len(left_out) > LISTED else ""
        notices.append(f"left out records that are no vertices or faces: {listed}{more}")
    return Content(vertices, polygons, tuple(notices), _groups(named, len(polygons)))


def _plain(lines: list[str]) -> Content | None:
    """Return the content of a file of vertices and triangles alone, read at once; None for any other one."""
    if not PLAIN.fullmatch("\n".join([*lines, ""])):
        return None
    places, numbers = (" ".join([line[2:] for line in lines if line[:1] == kind]) for kind in "vf")
    vertices = np.array(places.split(), dtype=np.float64).reshape(-1, 3)
    faces = np.array(numbers.split(), dtype=np.int64).reshape(-1, 3) - 1
    if not len(vertices) or not len(faces) or faces.max() >= len(vertices):
        return None
    return Content(vertices, faces)


def _groups(named: list[tuple[int, list[str]]], count: int) -> Groups:
    """Return the groups of `count` faces of the records that name them, each with the number of the next face."""
    parts = []
    for kind in NAMING:
        mine = [(start, words[1:]) for start, words in named if words[0] == kind]
        ends = [*(start for start, _ in mine[1:]), count]
        for (start, names), end in zip(mine, ends, strict=False):
            parts += [(name, range(start, end)) for name in (names if kind == "g" else [" ".join(names)])]
    return gathered(parts)


def _out_of_range(number: int, line: int, present: int) -> MeshError:
    return MeshError(
        f"line {line}: vertex number {number} is out of range, there are {present} vertices; export it again"
    )


def _records(lines: list[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield number and words of each line; a record of numbers that ends in a backslash continues in the next line."""
    numbered = enumerate(lines, 1)
    for number, line in numbered:
        words = _words(line)
        while words and words[-1][-1] == "\\" and words[0].rstrip("\\") in ("v", *FACES, *BESIDE, *PATCHES):
            words[-1] = words[-1].rstrip("\\")
            words = [word for word in words if word] + _words(next(numbered, (0, ""))[1])
        yield number, words


def _words(line: str) -> list[str]:
    return line.split("#", 1)[0].split()
