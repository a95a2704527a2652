"""Gmsh files, read by meshio once the sections that hold the mesh, and its node numbers, are checked.

meshio allocates up to the highest node number, so one damaged digit would take all memory.
"""

import re

import numpy as np

from ...arrays import IntArray
from ..errors import MeshError
from .cells import read_by_meshio
from .common import Content

NUMBERS_PER_NODE = 100  # the highest node number, over the number of nodes
NUMBERS_AT_LEAST = 10_000_000


def read_gmsh(data: bytes, _: int) -> Content:
    """Read the sections $MeshFormat, $Nodes and $Elements of a .msh file of version 2.2 or 4.1, text or binary."""
    import meshio.gmsh

    form = re.match(rb"\s*\$MeshFormat\s+(\S+)\s+([01])\s+8", data)
    if not form:
        raise MeshError("not a .msh: no $MeshFormat; save as Gmsh 4.1")
    version = form.group(1).decode("latin-1")
    if version not in ("2", "2.1", "2.2", "4.1"):
        raise MeshError(f"Gmsh format {version!r} is not supported: save as Gmsh 4.1 or 2.2")
    number_rows = _block_numbers if version == "4.1" else _row_numbers
    nodes = _section(data, b"Nodes")
    try:
        numbers = number_rows(nodes, binary=form.group(2) == b"1")
    except (ValueError, IndexError, OverflowError, MemoryError):
        raise MeshError("damaged node rows in the .msh: export it again") from None
    highest = max(NUMBERS_AT_LEAST, NUMBERS_PER_NODE * len(numbers))
    if not len(numbers) or numbers.min() < 1 or numbers.max() > highest:
        raise MeshError(f"node numbers of the .msh must be 1 to {highest}: renumber the nodes, or export it again")
    parts = [(name, _section(data, name)) for name in (b"MeshFormat", b"Nodes", b"Elements")]
    trimmed = b"".join(b"$%b\n%b$End%b\n" % (name, content, name) for name, content in parts)
    return read_by_meshio(trimmed, ".msh", meshio.gmsh.read)


def _section(data: bytes, name: bytes) -> bytes:
    """Return the bytes between the lines $name and $Endname."""
    start = re.search(rb"\$%b\r?\n" % name, data)
    stop = data.find(b"$End" + name, start.end()) if start else -1
    if not start or stop < 0:
        raise MeshError(f"the section ${name.decode()} of the .msh is missing or cut off: export it again")
    return data[start.end() : stop]


def _row_numbers(body: bytes, *, binary: bool) -> IntArray:
    """Return the node numbers of version 2: the count, then rows `number x y z`, 28 bytes each when binary."""
    head, _, rows = body.partition(b"\n")
    count = int(head)
    if binary:
        return np.frombuffer(rows, dtype=[("number", "<i4"), ("x", "<f8", 3)], count=count)["number"].astype(np.int64)
    words = rows.split()
    if len(words) != 4 * count:
        raise ValueError("not four words a row")
    return np.array([int(word) for word in words[::4]], dtype=np.int64)


def _block_numbers(body: bytes, *, binary: bool) -> IntArray:
    """Return those of version 4.1: counts, then blocks `dimension entity parametric count`, numbers, coordinates."""
    words = [] if binary else body.split()
    blocks = int(np.frombuffer(body, "<u8", 1)[0]) if binary else int(words[0])
    at, found = (32 if binary else 4), [np.empty(0, dtype=np.int64)]
    for _ in range(blocks):
        if binary:
            parametric = int(np.frombuffer(body, "<i4", 3, at)[2])
            count = int(np.frombuffer(body, "<u8", 1, at + 12)[0])
            numbers = np.frombuffer(body, "<u8", count, at + 20) if count else found[0]
            at += 20 + 32 * count
        else:
            parametric, count = int(words[at + 2]), int(words[at + 3])
            numbers = np.array([int(word) for word in words[at + 4 : at + 4 + count]], dtype=np.int64)
            at += 4 + 4 * count
        if parametric or count < 0 or at > (len(body) if binary else len(words)):
            raise ValueError("parametric nodes, or more promised than there are")
        found.append(numbers.astype(np.int64))
    return np.concatenate(found)
