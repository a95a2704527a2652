"""Wavefront OBJ before the parser: its vertices and faces alone, each word checked, so that errors name the line.

Texture and normal references go: at a seam they would split a vertex. Corners given by vertex number need the file's.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..errors import MeshError
from .headers import check_face_count

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|[-+]?(?:nan|inf|infinity)"
VERTEX = re.compile(rf"(?:(?:{NUMBER})(?: |$)){{3}}", re.ASCII | re.IGNORECASE)
FACE = re.compile(r"[-+]?\d{1,18}(?: [-+]?\d{1,18})*", re.ASCII)

RECORDS = ("v", "f", "fo")
CORNER = re.compile(r"\d{1,18}", re.ASCII)


def trim_obj(data: bytes, max_faces: int) -> tuple[bytes, list[str]]:
    r"""The records `v x y z` and `f a b c ...`, relative (negative) numbers resolved, and notices.

    Byte order mark, comments, line ends (\r\n, \r) and continued records are taken as meant.
    Raises MeshError, without the file's name, naming the line.
    """
    if b"\0" in data:
        raise MeshError("not an OBJ: it holds binary data; export as OBJ text")
    text = data.decode("utf-8-sig", errors="replace").replace("\r\n", "\n").replace("\r", "\n")
    vertices: list[str] = []
    faces: list[str] = []
    relative = False
    for number, words in _records(text):
        if words[:1] == ["v"]:
            vertices.append("v " + _vertex(words, number))
        elif words[:1] in (["f"], ["fo"]):
            corners = _face(words, number)
            if "-" in corners:
                relative = True
                corners = " ".join(str(i if i > 0 else i + len(vertices) + 1) for i in map(int, corners.split()))
            faces.append("f " + corners)
    if not vertices or not faces:
        raise MeshError(f"{len(vertices)} vertices and {len(faces)} faces are no surface: not an OBJ, or an empty one")
    check_face_count(len(faces), max_faces)
    notices = ["byte order mark skipped"] if data.startswith(b"\xef\xbb\xbf") else []
    notices += ["negative (relative) vertex numbers resolved"] if relative else []
    return "\n".join([*vertices, *faces, ""]).encode(), notices


def face_record(corners: list[str]) -> str:
    """The record of a face whose corners, words of another format, count from 0. Raises ValueError for other words."""
    if not all(map(CORNER.fullmatch, corners)):
        raise ValueError(f"corners {corners!r:.80}")
    return "f " + " ".join(str(int(corner) + 1) for corner in corners)


def _records(text: str) -> Iterator[tuple[int, list[str]]]:
    """Line number and words of each record; a vertex or a face that ends in a backslash goes on in the next line."""
    lines = enumerate(text.split("\n"), 1)
    for number, line in lines:
        words = _words(line)
        while words and words[-1][-1] == "\\" and words[0].rstrip("\\") in RECORDS:
            words[-1] = words[-1].rstrip("\\")
            words = [word for word in words if word] + _words(next(lines, (0, ""))[1])
        yield number, words


def _words(line: str) -> list[str]:
    return line.split("#", 1)[0].split()


def _vertex(words: list[str], number: int) -> str:
    place = " ".join(words[1:4])
    if not VERTEX.fullmatch(place):
        raise MeshError(f"line {number}: a vertex needs three numbers, got {place[:40]!r}")
    return place


def _face(words: list[str], number: int) -> str:
    indices = [word.split("/", 1)[0] for word in words[1:]]
    corners = " ".join(indices)
    if indices and not FACE.fullmatch(corners):
        raise MeshError(f"line {number}: a face needs vertex numbers, got {' '.join(words[1:5])[:40]!r}")
    if len(indices) < 3:
        raise MeshError(f"line {number}: a face has {len(indices)} corners, expected at least 3; export it again")
    if any(not index.strip("+-0") for index in indices):
        raise MeshError(f"line {number}: vertex number 0, OBJ counts from 1; export the file again")
    return corners
