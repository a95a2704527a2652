"""OFF text: vertices and faces; the colours, normals and texture coordinates that may follow in a row are skipped.

Geomview's manual ("OFF files") has a stream of words, in which a line's end matters only after a face: the rest of its
line is a colour. Other programs write one vertex or face a line, with colours that the header does not announce, or
let no line's end matter. A file is read in each of these ways until one fits its number of words.
"""

import re
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..errors import MeshError, check_face_count
from .common import DAMAGED, Content, SurfaceFile, coordinates, corners, header_count, text_lines

HEADER = re.compile(r"(ST)?(C)?(N)?(4)?(n)?OFF")


@dataclass
class OffWords:
    """The words of a text, read up to number `at`; lines[k] is the line of word k."""

    words: list[str]
    lines: list[int]
    at: int = 0

    def next(self, count: int) -> list[str]:
        """Return the next words; raise MeshError where there are fewer."""
        self.at += count
        if self.at > len(self.words):
            raise MeshError(f"the OFF ends within a vertex or a face; {DAMAGED}")
        return self.words[self.at - count : self.at]

    def line(self) -> list[str]:
        """Return the words that are left of the line of the word read last."""
        start, last = self.at, self.lines[self.at - 1]
        while self.at < len(self.words) and self.lines[self.at] == last:
            self.at += 1
        return self.words[start : self.at]

    def place(self) -> int:
        """Return the line of the word to be read next."""
        return self.lines[min(self.at, len(self.lines) - 1)]


def read_off(file: SurfaceFile) -> Content:
    """Read an OFF, COFF, NOFF or STOFF text, or a mixture of these; comments are skipped."""
    rows = [(number, line.split("#", 1)[0].split()) for number, line in enumerate(text_lines(file.data), 1)]
    words = OffWords([word for _, row in rows for word in row], [number for number, row in rows for _ in row])
    besides = _header(words)
    n, m = _counts(words)
    check_face_count(m, file.max_faces)
    start, left = words.at, len(words.words) - words.at
    if left < 3 * n + 4 * m:
        raise MeshError(
            f"OFF promises {n} vertices and {m} faces, at least {3 * n + 4 * m} words, {left} follow; {DAMAGED}"
        )
    uneven, failure = None, None
    for with_rest, with_colour in product((True, False), (True, False)):
        words.at = start
        try:
            places = [_vertex(words, None if with_rest else besides) for _ in range(n)]
            polygons = [_face(words, with_colour=with_colour) for _ in range(m)]
        except MeshError as error:
            failure = failure or error
            continue
        vertices, after = np.array(places).reshape(-1, 3), len(words.words) - words.at
        if not after:
            return Content(vertices, polygons)
        uneven = uneven or Content(vertices, polygons, (f"left out {after} words after the last face",))
    if uneven:
        return uneven
    raise failure or MeshError(f"the OFF holds no face; {DAMAGED}")


def _header(words: OffWords) -> int:
    """Read the keyword; return how many words follow the coordinates of a vertex."""
    keyword = words.words[0] if words.words else ""
    header = HEADER.match(keyword if "nOFF" in keyword else keyword.upper())
    if not header:
        raise MeshError(f"not an OFF: the first word must be OFF; {DAMAGED}")
    if header[4] or header[5]:
        raise MeshError(f"{header[0]} is not supported, its vertices have other than three coordinates: save as OFF")
    words.at = 1
    if header.end() < len(keyword):  # some programs write OFF8 12 0
        words.at, words.words[0] = 0, keyword[header.end() :]
    if words.words[words.at : words.at + 1] == ["BINARY"]:
        raise MeshError("binary OFF is not supported: save it as text")
    return 2 * bool(header[1]) + 4 * bool(header[2]) + 3 * bool(header[3])


def _counts(words: OffWords) -> tuple[int, int]:
    """Read the numbers of vertices, of faces, and of edges, which some programs leave out at the end of the line."""
    if len(words.words) < words.at + 2:
        raise MeshError(f"the OFF lacks the counts of vertices and faces; {DAMAGED}")
    n, m = (header_count(word) for word in words.next(2))
    following = words.lines[words.at :]
    if following and (following[0] == words.lines[words.at - 1] or following[1:2] != following[:1]):
        words.next(1)
    return n, m


def _vertex(words: OffWords, besides: int | None) -> list[float]:
    """Read a vertex and skip `besides` further words, or with None the rest of its line."""
    line = words.place()
    found = coordinates(words.next(3), line)
    if besides is None:
        words.line()
    else:
        words.next(besides)
    return found


def _face(words: OffWords, *, with_colour: bool) -> list[int]:
    """Read a face `n i_1 ... i_n`; with a colour, skip the rest of its line."""
    line, size = words.place(), words.next(1)[0]
    if not size.isdecimal() or len(size) > 3:
        raise MeshError(f"line {line}: a face needs its number of corners and as many vertices; {DAMAGED}")
    found = corners(words.next(int(size)), line)
    if with_colour:
        words.line()
    return found
