"""Gmsh .msh of the versions 2 to 4.1, text and binary: nodes, elements and their physical groups.

Source: the Gmsh reference manual, "MSH file format" and "Legacy formats".
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, IntArray
from ..errors import MeshError
from .cells import Rows, from_cells
from .common import DAMAGED, Content, SurfaceFile
from .gmsh_groups import Physical, groups_of, physical_names, physical_of_entities
from .words import Binary, Source, Text

# Of Gmsh's element types: their kind, and their number of nodes.
KINDS = {1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4), 5: ("hexahedron", 8), 6: ("wedge", 6)}
KINDS |= {7: ("pyramid", 5), 8: ("line3", 3), 9: ("triangle6", 6), 10: ("quad9", 9), 11: ("tetra10", 10)}
KINDS |= {12: ("hexahedron27", 27), 13: ("wedge18", 18), 14: ("pyramid14", 14), 15: ("vertex", 1), 16: ("quad8", 8)}
KINDS |= {17: ("hexahedron20", 20), 18: ("wedge15", 15), 19: ("pyramid13", 13)}
KINDS |= {26: ("line4", 4), 27: ("line5", 5), 28: ("line6", 6), 62: ("line7", 7), 29: ("tetra20", 20)}
KINDS |= {30: ("tetra35", 35), 31: ("tetra56", 56), 71: ("tetra84", 84), 92: ("hexahedron64", 64)}
KINDS |= {93: ("hexahedron125", 125), 94: ("hexahedron216", 216), 95: ("hexahedron343", 343), 90: ("wedge40", 40)}
KINDS |= {91: ("wedge75", 75), 118: ("pyramid30", 30), 119: ("pyramid55", 55), 20: ("triangle9", 9)}
KINDS |= {21: ("triangle10", 10), 22: ("triangle12", 12), 23: ("triangle15", 15), 25: ("triangle21", 21)}
KINDS |= {42: ("triangle28", 28), 36: ("quad16", 16), 37: ("quad25", 25), 38: ("quad36", 36), 39: ("quad12", 12)}
KINDS |= {47: ("quad49", 49), 99: ("hexahedron32", 32), 137: ("tetra16", 16)}
VERSIONS = ("2", "2.0", "2.1", "2.2", "4", "4.0", "4.1")
BEGIN = re.compile(rb"^[ \t]*\$(\w+)[ \t]*\r?\n?", re.MULTILINE)
FORMAT = re.compile(rb"\s*(\S+)\s+([01])\s+(\d+)[ \t]*(?:\r?\n|$)")

Found = tuple[IntArray, Array]  # numbers (n,) and places (n, 3) of nodes
# Gmsh's type of elements, their nodes (k, nodes), entity or physical group (k,), and numbers (k,).
Block = tuple[int, IntArray, IntArray, IntArray]


@dataclass(frozen=True, eq=False)
class GmshFile:
    """What a file holds: numbers (n,) and places (n, 3) of nodes, blocks of elements, and what groups are made of."""

    numbers: IntArray
    places: Array
    blocks: list[Block]
    physical: Physical | None
    names: Mapping[tuple[int, int], str]

    @property
    def cells(self) -> list[tuple[str, IntArray]]:
        """Return the kind of each block, and the rows of its elements' nodes."""
        return _renumbered([(KINDS[number][0], rows) for number, rows, _, _ in self.blocks], self.numbers)


def read_gmsh(file: SurfaceFile) -> Content:
    """Read nodes and elements; nodes may be numbered in any way."""
    found = opened(file.data)
    cells = found.cells
    owners = [(kind, owner) for (kind, _), (_, _, owner, _) in zip(cells, found.blocks, strict=True)]
    held: list[tuple[str, Rows]] = [*cells]
    return from_cells(found.places, held, groups=groups_of(owners, found.physical, found.names))


def opened(data: bytes) -> GmshFile:
    """Return what a file of these bytes holds. Raises MeshError, without the file's name, for a bad one."""
    sections = dict(_sections(data))
    form = FORMAT.match(sections.get(b"MeshFormat", b""))
    if not form:
        if re.search(rb"^\$NOD\b", data, re.MULTILINE):
            raise MeshError("Gmsh format 1 is not supported: save as Gmsh 4.1 or 2.2")
        raise MeshError("not a .msh: no $MeshFormat; save as Gmsh 4.1")
    version = form[1].decode("latin-1")
    if version not in VERSIONS:
        raise MeshError(f"Gmsh format {version[:20]!r} is not supported: save as Gmsh 4.1 or 2.2")
    for name in (b"Nodes", b"Elements"):
        if name not in sections:
            raise MeshError(f"the section ${name.decode()} of the .msh is missing or cut off: export it again")
    read_nodes, read_elements = READERS[version if version == "4.1" else version[0]]
    nodes, elements = (_opened(sections, form, name) for name in (b"Nodes", b"Elements"))
    numbers, places = read_nodes(nodes)
    physical: Physical | None = None
    if version[0] == "4":
        given = b"Entities" in sections
        physical = physical_of_entities(_opened(sections, form, b"Entities"), version) if given else {}
    names = physical_names(sections.get(b"PhysicalNames", b""))
    return GmshFile(numbers, places, list(read_elements(elements)), physical, names)


def _opened(sections: dict[bytes, bytes], form: re.Match[bytes], name: bytes) -> Source:
    """Return the numbers of a section; in a binary file the number 1 shows the order of bytes."""
    what = f"${name.decode()} of the .msh"
    if form[2] == b"0":
        return Text(sections[name], what)
    if form[3] != b"8":
        raise MeshError(f"numbers of {form[3].decode()[:20]} bytes in the .msh, expected 8: save as Gmsh 4.1 or 2.2")
    is_big = sections[b"MeshFormat"][form.end() :][:4] == b"\0\0\0\1"
    return Binary(sections[name], ">" if is_big else "<", what)


def _sections(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield name and content of each section, from $Name to $EndName; a section that is cut off ends the file."""
    at = 0
    while begin := BEGIN.search(data, at):
        stop = data.find(b"$End" + begin[1], begin.end())
        if stop < 0:
            return
        yield begin[1], data[begin.end() : stop]
        at = stop + len(b"$End" + begin[1])


def _renumbered(cells: list[tuple[str, IntArray]], numbers: IntArray) -> list[tuple[str, IntArray]]:
    """Return cells with the rows of their nodes in place of their numbers."""
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    if np.any(ordered[1:] == ordered[:-1]):
        twice = ordered[1:][ordered[1:] == ordered[:-1]]
        raise MeshError(f"node {twice[0]} is given twice in the .msh; {DAMAGED}")
    found: list[tuple[str, IntArray]] = []
    for kind, rows in cells:
        place = np.minimum(np.searchsorted(ordered, rows), len(numbers) - 1)
        absent = rows[ordered[place] != rows] if len(numbers) else rows.ravel()
        if len(absent):
            raise MeshError(f"an element has node {absent[0]}, which the .msh does not hold; {DAMAGED}")
        found.append((kind, order[place]))
    return found


def _kind(number: int) -> tuple[str, int]:
    if number not in KINDS:
        raise MeshError(f"holds elements of Gmsh type {number}: save linear tetrahedra or triangles")
    return KINDS[number]


def _nodes_2(source: Source) -> Found:
    """Read the count, then rows `number x y z`."""
    table = source.table(source.count(), [("i4", 1), ("f8", 3)])
    return table[0].ravel(), table[1]


def _elements_2(source: Source) -> Iterator[Block]:
    """Read the count; in text then rows `number type tags ... nodes`, in binary blocks of rows of the same kind.

    Tags are counted where they begin; the first is the physical group.
    """
    left = source.count()
    if isinstance(source, Text):
        yield from _text_elements_2(source, left)
        return
    while left > 0:
        number, count, tags = source.whole(3)
        _check_tags(tags)
        if not 0 < count <= left:
            raise MeshError(f"a block of {count} elements where {left} are left; {DAMAGED}")
        marks, nodes = source.table(count, [("i4", 1 + tags), ("i4", _kind(number)[1])])
        yield number, nodes, marks[:, 1] if tags else np.zeros(count, dtype=np.int64), marks[:, 0]
        left -= count


def _text_elements_2(source: Text, count: int) -> Iterator[Block]:
    """Read rows `number type tags ... nodes`."""
    rows: dict[int, list[list[int]]] = {}
    physical: dict[int, list[int]] = {}
    own: dict[int, list[int]] = {}
    numbers, at = source.whole(source.left), 0
    for _ in range(count):
        if at + 3 > len(numbers):
            raise MeshError(f"$Elements of the .msh ends before the last of {count} elements; {DAMAGED}")
        first, number, tags = numbers[at : at + 3]
        _check_tags(tags)
        start, at = at + 3 + tags, at + 3 + tags + _kind(number)[1]
        marks = numbers[start - tags : start]
        rows.setdefault(number, []).append(numbers[start:at])
        physical.setdefault(number, []).append(marks[0] if marks else 0)
        own.setdefault(number, []).append(first)
    if at > len(numbers):
        raise MeshError(f"$Elements of the .msh ends within its last element; {DAMAGED}")
    for number, found in rows.items():
        nodes, groups, named = (np.array(rows, dtype=np.int64) for rows in (found, physical[number], own[number]))
        yield number, nodes, groups, named


def _check_tags(count: int) -> None:
    if count < 0:
        raise MeshError(f"an element with {count} tags in the .msh; {DAMAGED}")


def _nodes_4(source: Source) -> Found:
    """Read of version 4.0 the counts, then blocks `entity dimension parametric count` of rows `number x y z`."""
    blocks, _ = source.large(2)
    found = [(np.empty(0, dtype=np.int64), np.empty((0, 3)))]
    for _ in range(blocks):
        _, dimension, parametric = source.whole(3)
        extra = _parameters(dimension, parametric)
        table = source.table(source.large(1)[0], [("i4", 1), ("f8", 3 + extra)])
        found.append((table[0].ravel(), table[1][:, :3]))
    return _together(found)


def _elements_4(source: Source) -> Iterator[Block]:
    """Read of version 4.0 the counts, then blocks `entity dimension type count` of rows `number nodes`."""
    for _ in range(source.large(2)[0]):
        entity, _, number = source.whole(3)
        own, nodes = source.table(source.large(1)[0], [("i4", 1), ("i4", _kind(number)[1])])
        yield number, nodes, np.full(len(nodes), entity), own.ravel()


def _nodes_41(source: Source) -> Found:
    """Read the counts, then blocks `dimension entity parametric count`, their node numbers, their places.

    Behind the place of a parametric node stand its parameters, one for each dimension of its entity.
    """
    found = [(np.empty(0, dtype=np.int64), np.empty((0, 3)))]
    for _ in range(source.large(4)[0]):
        dimension, _, parametric = source.whole(3)
        count = source.large(1)[0]
        extra = _parameters(dimension, parametric)
        numbers = source.table(count, [("i8", 1)])[0].ravel()
        found.append((numbers, source.table(count, [("f8", 3 + extra)])[0][:, :3]))
    return _together(found)


def _elements_41(source: Source) -> Iterator[Block]:
    """Read the counts, then blocks `dimension entity type count` of rows `number nodes`."""
    for _ in range(source.large(4)[0]):
        _, entity, number = source.whole(3)
        rows = source.table(source.large(1)[0], [("i8", 1 + _kind(number)[1])])[0]
        yield number, rows[:, 1:], np.full(len(rows), entity), rows[:, 0]


def _parameters(dimension: int, parametric: int) -> int:
    """Return how many parameters follow the place of a node."""
    if not 0 <= dimension <= 3:
        raise MeshError(f"nodes on an entity of dimension {dimension} in the .msh; {DAMAGED}")
    return dimension if parametric else 0


def _together(found: list[Found]) -> Found:
    return np.concatenate([numbers for numbers, _ in found]), np.concatenate([places for _, places in found])


READERS = {"2": (_nodes_2, _elements_2), "4": (_nodes_4, _elements_4), "4.1": (_nodes_41, _elements_41)}
