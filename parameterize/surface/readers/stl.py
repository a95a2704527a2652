"""STL, text and binary, read once the counts are checked.

Names of solids in a text may be any words: they are removed first, with all lines before the first solid. The names
of several solids become groups, and facets of one solid share vertices, so that solids that touch are told apart.
"""

import re

import numpy as np

from ...arrays import Array, IntArray
from ..errors import MeshError, check_face_count
from ..groups import gathered
from .common import DAMAGED, Content, SurfaceFile

SOLID = re.compile(rb"^[ \t]*((?:end)?solid)\b(.*)$", re.IGNORECASE | re.MULTILINE)
ENDED = re.compile(rb"\bendfacet\b", re.IGNORECASE)
BEFORE = 4096  # bytes in which the first solid begins
FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
CORNER = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)


def read_stl(file: SurfaceFile) -> Content:
    """Read the triangles of an STL whose size or number of corners fits its facets.

    The facets of a single solid have vertices of their own.
    """
    data = file.data
    promised = int.from_bytes(data[80:84], "little")
    expected = 84 + 50 * promised
    is_binary = len(data) == expected
    text = data if is_binary or b"\0" in data else _trimmed(data)
    says_solid = text[:512].lstrip().lower().startswith(b"solid")
    if not is_binary and says_solid and b"\0" not in data:
        promised = _facets(text)
    elif len(data) < 84:
        raise MeshError(f"not an STL: {len(data)} bytes, the header alone takes 84; {DAMAGED}")
    elif not is_binary:
        raise MeshError(f"STL of {promised} triangles must have {expected} bytes, this one has {len(data)}; {DAMAGED}")
    check_face_count(promised, file.max_faces)
    corners = np.frombuffer(data, FACET, promised, 84)["corners"] if is_binary else _corners(text)
    vertices, numbers = corners.reshape(-1, 3).astype(np.float64), np.arange(3 * promised)
    if solids := [] if is_binary else _solids(data):
        vertices, numbers = _shared_by_solid(vertices, solids)
    notices = ("binary STL although it starts with 'solid'",) * (is_binary and says_solid)
    return Content(vertices, numbers.reshape(-1, 3), notices, gathered(solids))


def _trimmed(data: bytes) -> bytes:
    r"""Return a text that begins with `solid`, its lines ended by \n and its solids without names; others as it is."""
    text = _with_newlines(data)
    first = SOLID.search(text[:BEFORE])
    return SOLID.sub(rb"\1", text[first.start() :]) if first else data


def _solids(data: bytes) -> list[tuple[str, range]]:
    """Return the name and the facets of each solid where there are several; "solid 2" where the second has no name."""
    text = _with_newlines(data)
    begun = [match for match in SOLID.finditer(text) if match[1].lower() == b"solid"]
    if len(begun) < 2:
        return []
    facets = [match.start() for match in ENDED.finditer(SOLID.sub(_blanked, text))]
    starts = np.searchsorted(facets, [match.start() for match in begun])
    ends = [*starts[1:], len(facets)]
    names = [match[2].decode("utf-8", errors="replace").strip() for match in begun]
    parts = zip(names, starts, ends, strict=True)
    return [(name or f"solid {k}", range(start, end)) for k, (name, start, end) in enumerate(parts, 1)]


def _shared_by_solid(corners: Array, solids: list[tuple[str, range]]) -> tuple[Array, IntArray]:
    """Return the places (n, 3) of the corners (k, 3) of each solid, in their order, and the number of each corner's."""
    owners = np.repeat(np.arange(len(solids)), [3 * len(facets) for _, facets in solids])
    rows = np.column_stack([owners, corners])
    _, first, place = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    return corners[first[order]], np.argsort(order)[place.ravel()]


def _blanked(line: re.Match[bytes]) -> bytes:
    """Return a line of the same length whose name, which may hold any words, is blank."""
    return b" " * len(line[0])


def _with_newlines(data: bytes) -> bytes:
    r"""Return a text without its byte order mark, its lines ended by \n."""
    return data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _corners(text: bytes) -> Array:
    """Return the corners (3 m, 3) of the facets of a text."""
    try:
        return np.array(CORNER.findall(text), dtype=np.float64)
    except ValueError as error:  # which names the word
        raise MeshError(f"not readable as .stl ({error}); {DAMAGED}") from None


def _facets(text: bytes) -> int:
    """Return the number of facets; raise MeshError where their beginnings, ends and corners do not match."""
    lower = text.lower()
    facets = len(re.findall(rb"\bendfacet\b", lower))
    opened = len(re.findall(rb"\bfacet\s+normal\b", lower))
    corners = len(re.findall(rb"\bvertex\s", lower))
    if b"endsolid" not in lower or opened != facets or corners != 3 * facets:
        raise MeshError(f"STL text with {opened} facets begun, {facets} ended and {corners} corners; {DAMAGED}")
    return facets
