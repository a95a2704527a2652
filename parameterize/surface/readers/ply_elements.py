"""The elements that the header of a PLY names, and their rows in binary."""

import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import MeshError
from .common import DAMAGED, header_count

TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
TYPES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q"}
TYPES |= {"uint64": "Q", "float32": "f", "float64": "d"}
SIZES = {kind: struct.calcsize(f"<{kind}") for kind in TYPES.values()}


@dataclass(frozen=True)
class Element:
    """An element that the header names.

    properties: name and types of each in order, as the module struct calls them: one type for a number, those of the
    length and the items for a list.
    """

    name: str
    count: int
    properties: list[tuple[str, str]]

    @property
    def least(self) -> int:
        """Return the bytes of all rows where every list is empty."""
        return self.count * sum(SIZES[types[0]] for _, types in self.properties)


def elements_of(header: list[list[str]]) -> list[Element]:
    """Return the elements that the words of the header's lines name; raise MeshError for a type that is unknown."""
    elements: list[Element] = []
    for words in header:
        if words[:1] == ["element"] and len(words) == 3:
            elements.append(Element(words[1], header_count(words[2]), []))
        elif words[:1] == ["property"] and len(words) > 2 and elements:
            types = words[2:4] if words[1] == "list" and len(words) > 4 else words[1:2]
            if not set(types) <= TYPES.keys():
                raise MeshError(
                    f"the PLY's property {words[-1][:20]!r} has the type {' '.join(types)[:40]!r}; {DAMAGED}"
                )
            elements[-1].properties.append((words[-1], "".join(TYPES[kind] for kind in types)))
    return elements


def binary_rows(data: bytes, at: int, element: Element, order: str, wanted: list[int]) -> tuple[list[Any], int]:
    """Return the properties with the numbers `wanted`, one sequence of rows each, and where the next element begins.

    data: the rows begin at `at`. order: "<" or ">". Rows whose lists have the lengths of the first are read at once.
    """
    if not element.count or not element.properties:
        return [[] for _ in wanted], at
    lengths = _lengths(data, at, element, order)
    fields: list[Any] = []
    for k, ((_, types), length) in enumerate(zip(element.properties, lengths, strict=True)):
        if len(types) == 2:
            fields.append((f"n{k}", f"{order}{types[0]}"))
        fields.append((f"p{k}", f"{order}{types[-1]}", () if len(types) == 1 else (length,)))
    table = np.dtype(fields)
    if at + element.count * table.itemsize <= len(data):
        rows = np.frombuffer(data, table, element.count, at)
        if all(
            np.all(rows[f"n{k}"] == length) for k, length in enumerate(lengths) if len(element.properties[k][1]) == 2
        ):
            return [rows[f"p{k}"] for k in wanted], at + element.count * table.itemsize
    return _rows_one_by_one(data, at, element, order, wanted)


def _lengths(data: bytes, at: int, element: Element, order: str) -> list[int]:
    """Return the lengths of the lists in the row at `at`, 1 for a number."""
    lengths = []
    for _, types in element.properties:
        length = 1
        if len(types) == 2:
            length = _length(data, at, element, order + types[0])
            at += SIZES[types[0]]
        lengths.append(length)
        at += length * SIZES[types[-1]]
    return lengths


def _rows_one_by_one(
    data: bytes, at: int, element: Element, order: str, wanted: list[int]
) -> tuple[list[list[Any]], int]:
    found: dict[int, list[Any]] = {k: [] for k in wanted}
    for _ in range(element.count):
        for k, (_, types) in enumerate(element.properties):
            length = 1
            if len(types) == 2:
                length = _length(data, at, element, order + types[0])
                at += SIZES[types[0]]
            if k in found:
                values = _unpack(f"{order}{length}{types[-1]}", data, at, element)
                found[k].append(values if len(types) == 2 else values[0])
            at += length * SIZES[types[-1]]
    if at > len(data):
        raise _ends(element)
    return list(found.values()), at


def _length(data: bytes, at: int, element: Element, form: str) -> int:
    length = _unpack(form, data, at, element)[0]
    if not 0 <= length <= len(data) or length != int(length):
        raise MeshError(f"a list of {length:g} items in an element {element.name!r:.40} of the PLY; {DAMAGED}")
    return int(length)


def _unpack(form: str, data: bytes, at: int, element: Element) -> tuple[Any, ...]:
    try:
        return struct.unpack_from(form, data, at)
    except struct.error:
        raise _ends(element) from None


def _ends(element: Element) -> MeshError:
    return MeshError(f"the PLY ends before the last of {element.count} elements {element.name!r:.40}; {DAMAGED}")
