"""3MF: the triangles of all items that are built, in their places. Objects and sets of triangles are groups.

(3MF Consortium, "Core Specification" 1.3, 3.4.3 and 4; components in other parts: "Production Extension" 1.2.)
"""

from collections import Counter

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ..errors import MeshError, check_face_count
from ..groups import gathered
from .common import DAMAGED, Content, SurfaceFile, most_bytes
from .threemf_extensions import makes_another_body, name_of
from .threemf_model import FULL, ModelPart, Object, Reference, read_model
from .threemf_package import Package, check_notes
from .zip_file import Archive

UNITS = {"micron": "micron", "millimeter": "mm", "centimeter": "cm", "inch": "in", "foot": "ft", "meter": "m"}
DEEPEST = 20  # components in components
MOST_OBJECTS = 10_000  # each counted as often as it is built
POINT_BYTES = 24
SOLID = "model"
# No part of the body: scaffolds, and sheets that the specification forbids to fill.
LEFT_OUT = ("support", "solidsupport", "surface")
SHOWN = 3  # elements in a notice


def read_3mf(file: SurfaceFile) -> Content:
    """Read a .3mf."""
    package = Package(Archive(file.data, most_bytes(file.max_faces)))
    root, notices = package.model()
    check_notes(package)
    built = _Built(package, root, file.max_faces)
    built.take_items()
    notices += tuple(built.notices())
    if not built.faces:
        why = f" ({'; '.join(notices)})" if notices else ""
        raise MeshError(f"the 3MF builds no triangles{why:.300}: export the surface again")
    return Content(np.concatenate(built.points), built.faces, notices, gathered(built.named), built.unit)


class _Built:
    """The triangles of the items of a package's model, and what was left out of them."""

    def __init__(self, package: Package, root: str, max_faces: int) -> None:
        self._package, self._root, self._max_faces = package, root, max_faces
        self._models: dict[str, ModelPart] = {}
        self._count = self._point_count = 0
        self._left_out = Counter[str]()
        self._foreign = set[str]()
        self.points, self.faces = [np.empty((0, 3))], list[list[int]]()
        self.named: list[tuple[str, ArrayLike]] = []

    @property
    def unit(self) -> str:
        """Return the unit of all points, that of the root model."""
        return UNITS[self._models[self._root].unit]

    def take_items(self) -> None:
        """Take the items of the root model; those of other models are not built."""
        root = self._model(self._root)
        self._foreign |= root.foreign
        for item in root.items:
            self._take(self._root, item, np.eye(4, 3), 0)

    def notices(self) -> list[str]:
        """Return one line each on what was left out or changed."""
        root = self._models[self._root]
        lines = [line for model in self._models.values() for line in model.notices]
        lines += [f"left out {count} objects of type {kind}" for kind, count in self._left_out.items()]
        if root.skipped:
            lines.append(f"left out {root.skipped} items that a slicer marked as not printable")
        if self._foreign:
            shown = ", ".join(tag[:100] for tag in sorted(self._foreign)[:SHOWN])
            lines.append(f"left out {len(self._foreign)} kinds of elements that are not read: {shown}")
        return lines

    def _model(self, part: str) -> ModelPart:
        """Return the model of a part, which has the unit of the root: of another one readers think differently."""
        if part not in self._models:
            model = read_model(self._package.read(part))
            if model.unit not in UNITS:
                raise MeshError(f"the unit {model.unit[:20]!r} is none of {', '.join(UNITS)}: export it again")
            unit = self._models.get(self._root, model).unit
            if model.unit != unit:
                raise MeshError(f"{part!r:.80} is in {model.unit}, its model in {unit}: export the 3MF in one unit")
            self._models[part] = model
        return self._models[part]

    def _take(self, part: str, reference: Reference, outer: Array, depth: int) -> None:
        """Take the object that an item or a component of a part refers to. outer: (4, 3), of what it stands in."""
        self._count += 1
        if self._count > MOST_OBJECTS:
            raise MeshError(f"the 3MF builds more than {MOST_OBJECTS} objects: export the one to compute with")
        if depth > DEEPEST:
            raise MeshError(f"components of the 3MF are more than {DEEPEST} deep, or a part of themselves; {DAMAGED}")
        if reference.path and part != self._root:
            raise MeshError(
                f"the part {part!r:.80} refers to another part, which only the model may do: export it again"
            )
        place = _combined(reference.place, outer)
        there = self._package.find(reference.path) if reference.path else part
        made = self._model(there).objects.get(reference.number)
        if made is None:
            raise MeshError(
                f"the 3MF builds object {reference.number} of {there!r:.80}, which it does not have; {DAMAGED}"
            )
        if made.content == "mesh" and made.kind in LEFT_OUT:
            self._left_out[made.kind] += 1
            return
        _check_shape(made)
        first = len(self.faces)
        for component in made.components:
            self._take(there, component, place, depth + 1)
        self._take_mesh(made, place)
        self._foreign |= made.foreign
        if made.name or made.content == "mesh":
            self.named.append((made.name or f"object {made.number}", np.arange(first, len(self.faces))))

    def _take_mesh(self, made: Object, place: Array) -> None:
        """Take a mesh at its place (4, 3). A mirrored body keeps its volume's sign (Core Specification, 3.3)."""
        check_face_count(len(self.faces) + len(made.faces), self._max_faces)
        most = most_bytes(self._max_faces) // POINT_BYTES
        first_point, first_face = self._point_count, len(self.faces)
        self._point_count += len(made.points)
        if self._point_count > most:
            raise MeshError(f"the 3MF builds more than {most} vertices: export the one object to compute with")
        rows = np.array(made.faces, dtype=np.int64).reshape(-1, 3)
        if rows.max(initial=-1) >= len(made.points):
            raise MeshError(f"vertex number {rows.max()} where there are {len(made.points)} vertices; {DAMAGED}")
        with np.errstate(all="ignore"):  # what is not finite is refused later
            self.points.append(np.array(made.points).reshape(-1, 3) @ place[:3] + place[3])
            if np.linalg.det(place[:3]) < 0:
                rows = rows[:, ::-1]
        self.faces += (rows + first_point).tolist()
        self.named += [(name, first_face + np.array(numbers, dtype=np.int64)) for name, numbers in made.sets]


def _combined(inner: Array, outer: Array) -> Array:
    """Return the place (4, 3) of what stands at `inner` in what stands at `outer`."""
    with np.errstate(all="ignore"):
        return np.concatenate([inner[:3] @ outer[:3], inner[3:] @ outer[:3] + outer[3]])


def _check_shape(made: Object) -> None:
    """Raise MeshError for an object that is built and whose shape is not that of its mesh or components."""
    for tag in sorted(made.foreign):
        if makes_another_body(tag):
            namespace = tag[1:].rpartition("}")[0]
            raise MeshError(
                f"object {made.number} of the 3MF has a shape that is not read, {name_of(namespace)}: "
                "export it as a mesh"
            )
    if not made.content:
        held = ", ".join(sorted(made.foreign))[:200] or "nothing"
        raise MeshError(f"object {made.number} of the 3MF has no mesh, it holds {held}: export it as a mesh")
    if made.content == "mesh" and made.kind != SOLID:
        raise MeshError(
            f"the 3MF builds object {made.number} of type {made.kind[:20]!r}, which is no part of a body: "
            "leave it out, or export it as a model"
        )
    if made.resolution != FULL:
        raise MeshError(
            f"the mesh of object {made.number} of the 3MF is an image of the body ({made.resolution[:20]!r}): "
            "export it in full resolution"
        )
