"""Reads the solid elements of input files of Abaqus and CalculiX (.inp), with their numbers and sets.

Source: the Abaqus manuals, "Input syntax rules" and "Three-dimensional solid element library". The nodes of C3D4, C3D8,
C3D10 and C3D20 are in VTK's order; C3D27 has its inner node first, then those of the faces.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.meshes.kinds import ElementKind, kind_named
from parameterize.meshes.mesh import Block, VolumeMesh

SOLID = re.compile(r"(?:D?C|AC)3D(\d+)[A-Z]*")  # stress, heat and acoustic elements
KINDS = {4: "tetra", 10: "tetra10", 8: "hexahedron", 20: "hexahedron20", 27: "hexahedron27"}
OTHERS = {6: "wedge", 15: "wedge15", 5: "pyramid", 13: "pyramid13"}
C3D27 = np.array([*range(20), 26, 24, 23, 25, 21, 22, 20])  # of VTK's nodes -x, x, -y, y, -z, z and the inner one
REFUSED = {
    "INCLUDE": "names another file: put its lines in the place of *INCLUDE",
    "NGEN": "generates nodes: write them out, as programs for meshes do",
    "ELGEN": "generates elements: write them out, as programs for meshes do",
    "NCOPY": "copies nodes: write them out, as programs for meshes do",
    "ELCOPY": "copies elements: write them out, as programs for meshes do",
    "SYSTEM": "has coordinates in a system of its own: write them in the global one",
}
MAX_NUMBER = 2**53  # numbers are read as floating-point ones

Parameters = dict[str, str]


@dataclass(eq=False)
class _Part:
    """What is read of a part: its nodes, its elements by kind, and its sets."""

    numbers: list[IntArray] = field(default_factory=list)
    places: list[Array] = field(default_factory=list)
    elements: list[tuple[str, IntArray]] = field(default_factory=list)  # meshio's name, rows number, nodes ...


def read_abaqus_mesh(text: str) -> VolumeMesh | None:
    """Return the solid elements of a text, None where there are none. Raises ValueError for a bad one."""
    parts, unchecked = [_Part()], dict[str, int]()
    sets: dict[str, list[IntArray]] = {}
    placed: dict[str, int] = {}
    for keyword, given, lines in _sections(text):
        if keyword in REFUSED:
            raise ValueError(f"*{keyword} {REFUSED[keyword]}")
        if keyword == "PART":
            parts.append(_Part())
        elif keyword == "INSTANCE":
            name = given.get("PART", "")
            placed[name] = placed.get(name, 0) + 1
            moved = any(float(word) != 0.0 for line in lines for word in line.split(",") if word.strip())
            if moved or placed[name] > 1:
                raise ValueError(f"*INSTANCE moves or repeats the part {name!r}: save the mesh without parts")
        elif keyword == "NODE":
            numbers, places = _nodes(lines)
            parts[-1].numbers.append(numbers)
            parts[-1].places.append(places)
        elif keyword == "ELEMENT":
            kind = SOLID.fullmatch(given.get("TYPE", "").upper())
            count = int(kind[1]) if kind else 0
            if count in KINDS:
                rows = _elements(lines, given["TYPE"], count)
                parts[-1].elements.append((KINDS[count], rows))
                if "ELSET" in given:
                    sets.setdefault(given["ELSET"], []).append(rows[:, 0])
            elif count:
                name = OTHERS.get(count, given["TYPE"])
                unchecked[name] = unchecked.get(name, 0) + len(_elements(lines, given["TYPE"], count))
        elif keyword == "ELSET" and "ELSET" in given:
            sets.setdefault(given["ELSET"], []).append(_set(lines, "GENERATE" in given))
    blocks, points = _blocks(parts)
    if not blocks and not unchecked:
        return None
    mesh = VolumeMesh(points, tuple(blocks), unchecked)
    rows_of = {name: np.flatnonzero(np.isin(mesh.numbers, np.concatenate(own))) for name, own in sets.items()}
    return VolumeMesh(points, mesh.blocks, unchecked, {name: rows for name, rows in rows_of.items() if len(rows)})


def _sections(text: str) -> Iterator[tuple[str, Parameters, list[str]]]:
    """Yield each keyword in capitals, its parameters by their names in capitals, and its lines of data."""
    keyword, given, lines = "", "", list[str]()
    continued = False
    for line in text.splitlines():
        stripped = line.strip()
        if not stripped or stripped.startswith("**"):
            continue
        if continued:
            given += stripped
        elif stripped.startswith("*"):
            if keyword:
                yield keyword, _parameters(given), lines
            keyword, _, given = stripped[1:].partition(",")
            keyword, lines = " ".join(keyword.upper().split()), []
        else:
            lines.append(stripped)
            continue
        continued = stripped.endswith(",")
    if keyword:
        yield keyword, _parameters(given), lines


def _parameters(text: str) -> Parameters:
    found = {}
    for part in text.split(","):
        name, _, value = part.partition("=")
        if name.strip():
            found[name.strip().upper()] = value.strip().strip('"')
    return found


def _numbers(lines: list[str], what: str) -> Array:
    """Return all numbers of lines, between commas; a comma at a line's end changes nothing."""
    text = ",".join(line.rstrip(",").rstrip() for line in lines)
    try:
        return np.array(text.split(","), dtype=np.float64) if text else np.empty(0)
    except ValueError:
        raise ValueError(f"*{what} has a word that is no number: the file is damaged, export it again") from None


def _nodes(lines: list[str]) -> tuple[IntArray, Array]:
    """Return the numbers (n,) and places (n, 3) of rows `number, x, y, z`; missing coordinates are zero."""
    widths = {line.rstrip(", ").count(",") for line in lines}
    if len(widths) <= 1:
        rows = _numbers(lines, "NODE").reshape(len(lines), -1)
    else:
        ragged = [_numbers([line], "NODE") for line in lines]
        rows = np.zeros((len(lines), 4))
        for row, own in zip(rows, ragged, strict=True):
            row[: min(4, len(own))] = own[:4]
    if rows.shape[1] < 2:
        raise ValueError("*NODE has a row without coordinates: the file is damaged, export it again")
    places = np.zeros((len(rows), 3))
    places[:, : min(3, rows.shape[1] - 1)] = rows[:, 1:4]
    return _whole(rows[:, 0], "NODE"), places


def _elements(lines: list[str], kind: str, count: int) -> IntArray:
    """Return rows (k, 1 + count) of the numbers of elements and of their nodes."""
    numbers = _whole(_numbers(lines, "ELEMENT"), "ELEMENT")
    if len(numbers) % (count + 1):
        raise ValueError(f"*ELEMENT, TYPE={kind} has not {count} nodes for each: the file is damaged, export it again")
    return numbers.reshape(-1, count + 1)


def _set(lines: list[str], generated: bool) -> IntArray:
    """Return the numbers of a set; names of other sets are left out."""
    if not generated:
        words = [word.strip() for line in lines for word in line.split(",")]
        return np.array([int(word) for word in words if word.isdecimal()], dtype=np.int64)
    found = [np.empty(0, dtype=np.int64)]
    for line in lines:
        first, last, *step = _whole(_numbers([line], "ELSET"), "ELSET").tolist()
        found.append(np.arange(first, last + 1, *[s for s in step if s > 0]))
    return np.concatenate(found)


def _whole(numbers: Array, what: str) -> IntArray:
    if not np.all((numbers == np.floor(numbers)) & (np.abs(numbers) < MAX_NUMBER)):
        raise ValueError(f"*{what} has a number that is not whole: the file is damaged, export it again")
    return numbers.astype(np.int64)


def _blocks(parts: list[_Part]) -> tuple[list[Block], Array]:
    """Return the elements of all parts, one block a kind, and all points."""
    rows: dict[ElementKind, list[tuple[IntArray, IntArray]]] = {}
    points, first = [np.empty((0, 3))], 0
    for part in parts:
        numbers = np.concatenate([np.empty(0, dtype=np.int64), *part.numbers])
        places = np.concatenate([np.empty((0, 3)), *part.places])
        order = np.argsort(numbers, kind="stable")
        ordered = numbers[order]
        for name, own in part.elements:
            at = np.searchsorted(ordered, own[:, 1:], side="right") - 1  # a node given twice: the last one counts
            found = ordered[np.maximum(at, 0)] == own[:, 1:] if len(ordered) else np.zeros(own[:, 1:].shape, dtype=bool)
            if not found.all():
                missing = int(own[:, 1:][~found][0])
                raise ValueError(f"an element has node {missing}, which the file does not hold: export it again")
            nodes = first + order[at]
            kind = kind_named(name)
            if name == "hexahedron27":
                nodes = nodes[:, C3D27]
                _demand_order(kind, np.concatenate([*points, places])[nodes])
            rows.setdefault(kind, []).append((nodes, own[:, 0]))
        points.append(places)
        first += len(places)
    blocks = [Block(kind, *(np.concatenate(arrays) for arrays in zip(*own, strict=True))) for kind, own in rows.items()]
    return blocks, np.concatenate(points)


def _demand_order(kind: ElementKind, nodes: Array) -> None:
    """Raise ValueError where nodes (k, 27, 3) of faces do not lie nearest to the middles of their faces' corners.

    Some programs write the inner node last; the file does not say so.
    """
    corners = kind.lattice[:8] / 2.0
    at = kind.lattice[20:] / 2.0
    weights = np.prod(np.where(corners, at[:, None], 1.0 - at[:, None]), axis=2)  # (7, 8), trilinear
    middles = np.einsum("mc,kcx->kmx", weights, nodes[:, :8])
    distances = np.linalg.norm(nodes[:, 20:, None] - middles[:, None], axis=3)
    if np.mean((distances.argmin(axis=2) == np.arange(7)).all(axis=1)) < 0.5:
        raise ValueError("the last seven nodes of C3D27 are not in the order of Abaqus: the inner one, then the faces")
