"""Shared by the readers: the content they return, lines and numbers of a text, errors of libraries."""

import io
import logging
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, IntArray
from ..errors import MeshError
from ..groups import Groups

DAMAGED = "the file is truncated or damaged, export it again"
BYTES_PER_FACE = 500  # an ASCII STL facet, the most wasteful of the formats, takes about 300
BYTES_AT_LEAST = 64 << 20
NUMBER = r"[-+]?(?:(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?|nan|inf(?:inity)?)"
NUMBERS = re.compile(rf"{NUMBER}(?: {NUMBER})*+", re.ASCII | re.IGNORECASE)
WHOLE_NUMBERS = re.compile(r"[-+]?\d{1,18}(?: [-+]?\d{1,18})*+", re.ASCII)

Beside = Callable[[str], bytes]  # from the name that a file gives to another one to its content; raises MeshError


@dataclass(frozen=True, eq=False)
class SurfaceFile:
    """The bytes of a surface file, unpacked, and how they are read.

    max_faces: the most faces that it may have. beside: reads the files that it names. deflection: of a solid model, the
    largest distance of the triangles from curved faces, in the file's unit; None for the usual one.
    """

    data: bytes
    max_faces: int
    beside: Beside
    deflection: float | None = None


@dataclass(frozen=True, eq=False)
class Brep:
    """The exact faces of a solid model, of which triangles were made.

    text: in the BREP format of OpenCASCADE 7, in the unit of the lengths. faces: (m,), the face of each triangle, in
    the order of the text, counted from 1; 0 for a triangle of none.
    """

    text: bytes
    faces: IntArray


@dataclass(frozen=True, eq=False)
class SolidPart:
    """A solid of a file: its name, or "", the numbers of its triangles, and its exact faces."""

    name: str
    triangles: IntArray
    brep: Brep | None = None


Solids = tuple[SolidPart, ...]
Polygons = list[list[int]] | IntArray  # an array (m, 3) of triangles


@dataclass(frozen=True, eq=False)
class Content:
    """The content of a surface file.

    vertices: (n, 3). polygons: the vertex numbers of each face, counted from 0; they may be out of range.
    notices: one line each on data that were left out or changed. groups: numbers of polygons by name. shapes: of some
    groups, in words. unit: of lengths, "" where the format has none. solids: of a solid model, and brep. conflict: why
    they cannot be taken together, "" where they can.
    """

    vertices: Array
    polygons: Polygons
    notices: tuple[str, ...] = ()
    groups: Groups = field(default_factory=dict)
    unit: str = ""
    solids: Solids = ()
    brep: Brep | None = None
    conflict: str = ""
    shapes: Mapping[str, str] = field(default_factory=dict)


def most_bytes(max_faces: int) -> int:
    """Return how many bytes a file of `max_faces` faces may take, packed or unpacked."""
    return BYTES_AT_LEAST + BYTES_PER_FACE * max_faces


def header_count(word: str) -> int:
    """Return the number of elements that a word of the header gives; raise MeshError where it is no number."""
    if not re.fullmatch(r"\d{1,18}", word, re.ASCII):
        raise MeshError(f"the header's count {word[:20]!r} is not a number of elements; {DAMAGED}")
    return int(word)


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


def number_array(words: Sequence[str], what: str, *, whole: bool = False) -> NDArray[Any]:
    """Return words as float64 or, where they are whole numbers, as int64 (n,); raise MeshError for other words."""
    if words and not (WHOLE_NUMBERS if whole else NUMBERS).fullmatch(" ".join(words)):
        raise MeshError(f"{what} has a word that is no {'whole ' * whole}number; {DAMAGED}")
    return np.array(words, dtype=np.str_).astype(np.int64 if whole else np.float64)


@contextmanager
def library(suffix: str) -> Iterator[None]:
    """Raise MeshError for any error of a library's parser in the block, whose output and logs are silenced."""
    logger = logging.getLogger("trimesh")
    before, logger.disabled = logger.disabled, True
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    except Exception as error:  # a parser may fail on a damaged file in any way
        first = (str(error).strip().splitlines() or [type(error).__name__])[0][:120]
        raise MeshError(f"not readable as {suffix} ({first}); {DAMAGED}") from None
    finally:
        logger.disabled = before
