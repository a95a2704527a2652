"""A model part of a 3MF: its unit, its objects and the items that are built, from its XML.

(3MF Consortium, "Core Specification" 1.3, 3 and 4; "Production Extension" 1.2; "Slice Extension" 1.0.)
"""

from dataclasses import dataclass, field
from typing import NamedTuple

from ...arrays import Array
from ..errors import MeshError
from .common import DAMAGED, NUMBERS, number_array
from .threemf_extensions import (
    ALTERNATIVES,
    CORE,
    PRODUCTION,
    READ,
    SLICE,
    TRIANGLE_SETS,
    check_required,
    makes_another_body,
    name_of,
)
from .threemf_package import Xml, parse

IDENTITY = "1 0 0 0 1 0 0 0 1 0 0 0"
FULL = "fullres"  # of a mesh that is the body, rather than an image of it


class Reference(NamedTuple):
    """An item or a component: an object, and its place (4, 3), rows of an affine map.

    path: the part that has the object, "" for the same part.
    """

    path: str
    number: int
    place: Array


@dataclass
class Object:
    """An object of a model.

    content: "mesh", "components", or "" where it has neither. foreign: elements and attributes "{namespace}name" inside
    of it that are not read. resolution: of its mesh, by its name in the extension on slices or on alternatives. sets:
    numbers of triangles by name.
    """

    number: int
    name: str
    kind: str
    resolution: str
    content: str = ""
    points: list[list[float]] = field(default_factory=list)
    faces: list[list[int]] = field(default_factory=list)
    components: list[Reference] = field(default_factory=list)
    foreign: set[str] = field(default_factory=set)
    sets: list[tuple[str, list[int]]] = field(default_factory=list)


@dataclass
class ModelPart:
    """What is read of a model part.

    skipped: number of items that a slicer does not print. foreign: elements in the list of items that are not read.
    """

    unit: str = "millimeter"
    objects: dict[int, Object] = field(default_factory=dict)
    items: list[Reference] = field(default_factory=list)
    skipped: int = 0
    foreign: set[str] = field(default_factory=set)
    notices: list[str] = field(default_factory=list)


def read_model(data: bytes) -> ModelPart:
    """Return the model of a part. Raises MeshError for one that is damaged, or requires extensions not read."""
    target = _Target()
    parse(data, target)
    return target.model


class _Target(Xml):
    """The target of an XML parser that keeps objects and items, and no tree."""

    def __init__(self) -> None:
        self.model = ModelPart()
        self._prefixes: dict[str, str] = {}
        self._depth = 0
        self._skip_from = 0  # depth of the element that is skipped with all in it, 0 for none
        self._open: Object | None = None
        self._is_build = False
        self._taken = {
            f"{{{CORE}}}object": self._object,
            f"{{{CORE}}}mesh": self._content,
            f"{{{CORE}}}components": self._content,
            f"{{{CORE}}}vertex": self._vertex,
            f"{{{CORE}}}triangle": self._triangle,
            f"{{{CORE}}}component": self._component,
            f"{{{CORE}}}build": self._build,
            f"{{{CORE}}}item": self._item,
            f"{{{TRIANGLE_SETS}}}triangleset": self._set,
            f"{{{TRIANGLE_SETS}}}ref": self._set_member,
            f"{{{TRIANGLE_SETS}}}refrange": self._set_range,
        }

    def start_ns(self, prefix: str, namespace: str) -> None:
        """Take the declaration of a prefix, which comes before its element: those of the root before all others."""
        self._prefixes[prefix] = namespace

    def start(self, tag: str, given: dict[str, str]) -> None:
        """Take an element of a namespace that is read; any other is skipped with all that is in it."""
        self._depth += 1
        if self._skip_from:
            return
        if self._depth == 1:
            self._root(tag, given)
        elif tag in self._taken:
            self._taken[tag](tag, given)
        elif not _is_passed_over(tag):
            self._skip_from = self._depth
            if self._open or self._is_build:
                (self._open or self.model).foreign.add(tag)

    def end(self, tag: str) -> None:
        """Close an element."""
        if self._skip_from == self._depth:
            self._skip_from = 0
        elif not self._skip_from and tag == f"{{{CORE}}}object" and self._open:
            self.model.objects[self._open.number] = self._open
            self._open = None
        self._depth -= 1

    def _root(self, tag: str, given: dict[str, str]) -> None:
        if tag != f"{{{CORE}}}model":
            raise MeshError(f"the root element of the 3MF is {tag[:80]!r}, not a model of {CORE}: export it again")
        check_required(given.get("requiredextensions", ""), self._prefixes)
        self.model.unit = given.get("unit", self.model.unit).strip()
        recommended = [self._prefixes.get(word, word) for word in given.get("recommendedextensions", "").split()]
        self.model.notices += [
            f"the 3MF recommends an extension that is not read, {name_of(namespace)}"
            for namespace in recommended
            if namespace not in READ
        ]

    def _object(self, tag: str, given: dict[str, str]) -> None:
        number = _whole(given, "id", "an object")
        if self._open or number in self.model.objects:
            raise MeshError(f"object {number} of the 3MF is there twice, or inside of another one; {DAMAGED}")
        resolution = given.get(f"{{{SLICE}}}meshresolution", given.get(f"{{{ALTERNATIVES}}}modelresolution", FULL))
        self._open = Object(number, given.get("name", ""), given.get("type", "model").strip(), resolution.strip())

    def _content(self, tag: str, given: dict[str, str]) -> None:
        made = self._inside()
        if made.content:
            raise MeshError(f"object {made.number} of the 3MF has more than one mesh or list of components; {DAMAGED}")
        made.content = tag.rpartition("}")[2]

    def _vertex(self, tag: str, given: dict[str, str]) -> None:
        points = self._inside().points
        place = " ".join(given.get(axis, "").strip() for axis in "xyz")
        if place.count(" ") != 2 or not NUMBERS.fullmatch(place):
            raise MeshError(f"vertex {len(points)} of a 3MF's mesh needs three numbers, got {place[:40]!r}; {DAMAGED}")
        points.append([float(word) for word in place.split()])

    def _triangle(self, tag: str, given: dict[str, str]) -> None:
        made = self._inside()
        made.faces.append([_whole(given, corner, "a triangle") for corner in ("v1", "v2", "v3")])
        if len(given) > 3:
            made.foreign.update(name for name in given if name[0] == "{" and makes_another_body(name))

    def _component(self, tag: str, given: dict[str, str]) -> None:
        made, component = self._inside(), _reference(given, "a component")
        if not component.path and component.number not in self.model.objects:
            raise MeshError(
                f"object {made.number} of the 3MF is made of object {component.number}, which is not there before it: "
                "export it again"
            )
        made.components.append(component)

    def _build(self, tag: str, given: dict[str, str]) -> None:
        self._is_build = True  # it is the last element

    def _item(self, tag: str, given: dict[str, str]) -> None:
        if given.get("printable", "1").strip().lower() in ("0", "false"):  # of PrusaSlicer and Bambu Studio
            self.model.skipped += 1
        else:
            self.model.items.append(_reference(given, "an item"))

    def _set(self, tag: str, given: dict[str, str]) -> None:
        self._inside().sets.append((given.get("name", "") or given.get("identifier", ""), []))

    def _set_member(self, tag: str, given: dict[str, str]) -> None:
        self._add(_whole(given, "index", "a triangle set"), 1)

    def _set_range(self, tag: str, given: dict[str, str]) -> None:
        first = _whole(given, "startindex", "a triangle set")
        self._add(first, _whole(given, "endindex", "a triangle set") - first + 1)

    def _add(self, first: int, count: int) -> None:
        """Put triangles into the set that is open; it stands after the triangles."""
        made = self._inside()
        if not made.sets or first + count > len(made.faces):
            raise MeshError(f"a triangle set of the 3MF names triangles that object {made.number} lacks; {DAMAGED}")
        made.sets[-1][1].extend(range(first, first + count))

    def _inside(self) -> Object:
        if not self._open:
            raise MeshError(f"the 3MF has a mesh or components outside of an object; {DAMAGED}")
        return self._open


def _is_passed_over(tag: str) -> bool:
    """Return whether an element is one around those that are read, or beside them, without a body of its own."""
    namespace, _, name = tag[1:].rpartition("}")
    if namespace == CORE:
        return name in ("resources", "vertices", "triangles", "metadata", "metadatagroup", "basematerials", "base")
    return namespace == TRIANGLE_SETS and name == "trianglesets"


def _whole(given: dict[str, str], name: str, what: str) -> int:
    word = given.get(name, "").strip()
    if not (word.isascii() and word.isdigit()) or len(word) > 18:
        raise MeshError(f"{what} of the 3MF needs a whole number as {name}, got {word[:20]!r}; {DAMAGED}")
    return int(word)


def _reference(given: dict[str, str], what: str) -> Reference:
    place = number_array(given.get("transform", IDENTITY).split(), f"the transform of {what} of the 3MF")
    if len(place) != 12:
        raise MeshError(f"the transform of {what} of the 3MF has {len(place)} numbers, it needs 12; {DAMAGED}")
    if "path" in given:  # readers take it for the extension's, or pass it over
        raise MeshError(f"{what} of the 3MF has a path that is not of the production extension: export it again")
    path = given.get(f"{{{PRODUCTION}}}path", "").strip()
    return Reference(path, _whole(given, "objectid", what), place.reshape(4, 3))
