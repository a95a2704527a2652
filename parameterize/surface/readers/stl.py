"""STL, text and binary, read by trimesh once the counts are checked.

Names of solids in a text may be any words: they are removed first, with all lines before the first solid. The names
of several solids become groups.
"""

import io
import re

import numpy as np

from ..errors import MeshError, check_face_count
from ..groups import Groups, gathered
from .common import DAMAGED, Content, SurfaceFile, library

SOLID = re.compile(rb"^[ \t]*((?:end)?solid)\b(.*)$", re.IGNORECASE | re.MULTILINE)
ENDED = re.compile(rb"\bendfacet\b", re.IGNORECASE)
BEFORE = 4096  # bytes in which the first solid begins


def read_stl(file: SurfaceFile) -> Content:
    """Read the triangles of an STL whose size or number of corners fits its facets; each has vertices of its own."""
    import trimesh

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
    with library(".stl"):
        mesh = trimesh.load_mesh(io.BytesIO(text), file_type="stl", process=False)
        vertices, triangles = np.array(mesh.vertices, dtype=np.float64), mesh.faces.tolist()
    if len(triangles) < promised:
        raise MeshError(f"{promised} faces promised, {len(triangles)} read; {DAMAGED}")
    notices = ("binary STL although it starts with 'solid'",) * (is_binary and says_solid)
    return Content(vertices, triangles, notices, {} if is_binary else _solids(data))


def _trimmed(data: bytes) -> bytes:
    r"""Return a text that begins with `solid`, its lines ended by \n and its solids without names; others as it is."""
    text = _with_newlines(data)
    first = SOLID.search(text[:BEFORE])
    return SOLID.sub(rb"\1", text[first.start() :]) if first else data


def _solids(data: bytes) -> Groups:
    """Return the facets of each solid by its name where there are several; "solid 2" where the second has none."""
    text = _with_newlines(data)
    begun = [match for match in SOLID.finditer(text) if match[1].lower() == b"solid"]
    if len(begun) < 2:
        return {}
    facets = [match.start() for match in ENDED.finditer(SOLID.sub(_blanked, text))]
    starts = np.searchsorted(facets, [match.start() for match in begun])
    ends = [*starts[1:], len(facets)]
    names = [match[2].decode("utf-8", errors="replace").strip() for match in begun]
    parts = zip(names, starts, ends, strict=True)
    return gathered((name or f"solid {k}", range(start, end)) for k, (name, start, end) in enumerate(parts, 1))


def _blanked(line: re.Match[bytes]) -> bytes:
    """Return a line of the same length whose name, which may hold any words, is blank."""
    return b" " * len(line[0])


def _with_newlines(data: bytes) -> bytes:
    r"""Return a text without its byte order mark, its lines ended by \n."""
    return data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def _facets(text: bytes) -> int:
    """Return the number of facets; raise MeshError where their beginnings, ends and corners do not match."""
    lower = text.lower()
    facets = len(re.findall(rb"\bendfacet\b", lower))
    opened = len(re.findall(rb"\bfacet\s+normal\b", lower))
    corners = len(re.findall(rb"\bvertex\s", lower))
    if b"endsolid" not in lower or opened != facets or corners != 3 * facets:
        raise MeshError(f"STL text with {opened} facets begun, {facets} ended and {corners} corners; {DAMAGED}")
    return facets
