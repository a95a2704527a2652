"""3MF: the triangles of all items that are built, in their places. Objects are groups by their names.

(3MF Consortium, "3D Manufacturing Format, Core Specification" 1.3; components in other parts of the archive follow the
production extension.)
"""

import posixpath
from dataclasses import dataclass, field
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...arrays import Array
from ..errors import MeshError, check_face_count
from ..groups import gathered
from .archive import Archive
from .common import DAMAGED, Content, coordinates, most_bytes

UNITS = {"micron": "micron", "millimeter": "mm", "centimeter": "cm", "inch": "in", "foot": "ft", "meter": "m"}
DEEPEST = 20  # components in components
MOST_OBJECTS = 10_000  # each counted as often as it is built
START = "3D/3dmodel.model"
SUPPORTS = ("support", "solidsupport")


@dataclass
class _Object:
    """An object of a model: a mesh, or components, each a part's name, an object and its place."""

    name: str
    kind: str
    points: list[list[float]] = field(default_factory=list)
    faces: list[list[int]] = field(default_factory=list)
    components: list[tuple[str, str, Array]] = field(default_factory=list)


@dataclass
class _Model:
    """The target of an XML parser that keeps objects and items, and no tree."""

    unit: str = "millimeter"
    objects: dict[str, _Object] = field(default_factory=dict)
    items: list[tuple[str, str, Array]] = field(default_factory=list)
    _open: _Object | None = None

    def start(self, tag: str, given: dict[str, str]) -> None:
        """Take an element by its name without the namespace."""
        name = tag.rpartition("}")[2]
        if name == "vertex" and self._open:
            self._open.points.append(coordinates([given.get(axis, "") for axis in "xyz"], len(self._open.points)))
        elif name == "triangle" and self._open:
            self._open.faces.append([_whole(given.get(corner, "")) for corner in ("v1", "v2", "v3")])
        elif name == "object":
            self._open = _Object(given.get("name", ""), given.get("type", "model"))
            self.objects[given.get("id", "")] = self._open
        elif name == "component" and self._open:
            self._open.components.append(_reference(given))
        elif name == "item":
            self.items.append(_reference(given))
        elif name == "model":
            self.unit = given.get("unit", self.unit)

    def end(self, tag: str) -> None:
        """Close an object."""
        if tag.rpartition("}")[2] == "object":
            self._open = None

    def close(self) -> "_Model":
        """Return the model."""
        return self


def _whole(word: str) -> int:
    if not (word.isascii() and word.isdigit()) or len(word) > 18:
        raise MeshError(f"a triangle of the 3MF needs vertex numbers, got {word[:20]!r}; {DAMAGED}")
    return int(word)


def _reference(given: dict[str, str]) -> tuple[str, str, Array]:
    """Return the part, the object's number and the place (4, 3), rows of an affine map, of a component or an item."""
    words = given.get("transform", "1 0 0 0 1 0 0 0 1 0 0 0").split()
    rows = [coordinates(words[i : i + 3], 0) for i in range(0, 12, 3)]
    path = next((value for name, value in given.items() if name.rpartition("}")[2] == "path"), "")
    return path.lstrip("/"), given.get("objectid", ""), np.array(rows)


class _Reader:
    """The models of an archive, and what is built of them."""

    def __init__(self, archive: Archive, max_faces: int) -> None:
        self._archive, self._max_faces, self._models = archive, max_faces, dict[str, _Model]()
        self.points, self.faces = [np.empty((0, 3))], list[list[int]]()
        self.named: list[tuple[str, Any]] = []
        self.supports = self._built = 0

    def model(self, part: str) -> _Model:
        """Return the model of a part of the archive."""
        if part not in self._models:
            data = self._archive.read(part)
            if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
                raise MeshError("the 3MF declares a document type, whose entities are not expanded: export it again")
            try:
                self._models[part] = _parsed(data)
            except (ElementTree.ParseError, ValueError, LookupError) as error:
                if isinstance(error, MeshError):
                    raise
                raise MeshError(f"not readable as 3MF ({error}); {DAMAGED}") from None
        return self._models[part]

    def build(self, part: str, number: str, place: Array, depth: int) -> None:
        """Take the mesh of an object and those of its components. place: (4, 3)."""
        found = self.model(part).objects.get(number)
        self._built += 1
        if self._built > MOST_OBJECTS:
            raise MeshError(f"the 3MF builds more than {MOST_OBJECTS} objects: export the one to compute with")
        if found is None or depth > DEEPEST:
            raise MeshError(f"the 3MF builds an object {number[:20]!r} that it does not have; {DAMAGED}")
        if found.kind in SUPPORTS:
            self.supports += 1
            return
        first, below = len(self.faces), sum(map(len, self.points))
        check_face_count(first + len(found.faces), self._max_faces)
        if found.points:
            with np.errstate(all="ignore"):  # what is not finite is refused later
                self.points.append(np.array(found.points) @ place[:3] + place[3])
                inverted = np.linalg.det(place[:3]) < 0
            rows = (row[::-1] if inverted else row for row in found.faces)
            for row in rows:
                if max(row) >= len(found.points):
                    raise MeshError(f"vertex number {max(row)} where there are {len(found.points)} vertices; {DAMAGED}")
                self.faces.append([corner + below for corner in row])
        for path, inner, where in found.components:
            with np.errstate(all="ignore"):
                there = np.concatenate([where[:3] @ place[:3], where[3:] @ place[:3] + place[3]])
            self.build(path or part, inner, there, depth + 1)
        if found.name or found.points:
            self.named.append((found.name or f"object {number}", np.arange(first, len(self.faces))))


def _parsed(data: bytes) -> _Model:
    model = _Model()
    parser = ElementTree.XMLParser(target=model)  # noqa: S314 - it has no entities
    parser.feed(data)
    parser.close()
    return model


def read_3mf(data: bytes, max_faces: int) -> Content:
    """Read a .3mf."""
    archive = Archive(data, most_bytes(max_faces))
    known = {name.lower(): name for name in archive.names}
    start = known.get(START.lower()) or next((known[name] for name in known if name.endswith(".model")), None)
    if start is None:
        raise MeshError("the archive has no 3D model: export it as 3MF again")
    reader = _Reader(archive, max_faces)
    model = reader.model(start)
    if model.unit not in UNITS:
        raise MeshError(f"the unit {model.unit[:20]!r} is none of {', '.join(UNITS)}: export it again")
    for path, number, place in model.items:
        reader.build(posixpath.normpath(path) if path else start, number, place, 0)
    if not reader.faces:
        raise MeshError("the 3MF builds no triangles: export the surface again")
    notices = (f"left out {reader.supports} supports",) * bool(reader.supports)
    return Content(np.concatenate(reader.points), reader.faces, notices, gathered(reader.named), UNITS[model.unit])
