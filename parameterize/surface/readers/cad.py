"""STEP and IGES by OpenCASCADE, in the package cadquery-ocp-novtk: faces of the B-rep become groups face1, face2, ...

Bores, fillets and the like are groups, too (`named_faces.py`).

It runs in a process of its own (`opencascade.py`): on a damaged file the library may end it, and it prints as it likes.
It works in millimetres, or in the file's unit where that is smaller; lengths are brought back to the file's unit.
Of a STEP file, annotations and geometry of which it makes no shape are found in its text: representations and their
items by ISO 10303-43, shapes by ISO 10303-42, annotations by ISO 10303-46.
"""

import json
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Array, IntArray
from ..errors import MeshError, check_face_count
from ..groups import MOST_GROUPS, gathered
from .cad_units import Unit, iges_unit, step_unit
from .common import DAMAGED, Brep, Content, SolidPart, SurfaceFile
from .named_faces import described, named

INSTALL = "pip install cadquery-ocp-novtk"
PROGRAM = Path(__file__).with_name("opencascade.py")
PATIENCE = 300.0  # seconds
ANGLE = 0.1  # radians between neighbouring triangles of a curved face: some 63 around a full turn
SHARE = 2e-4  # of the box's diagonal: the deflection where none is given
LISTED = 8  # names in a message
SMALLEST = 1e-4  # of OpenCASCADE's unit: a thousand of its tolerances
MESH = "the solid is a mesh in the file, not a B-rep: its triangles are taken, and deflection does not change them"
SAID = {
    "healed": "OpenCASCADE found a fault in the solid and healed it",
    "invalid": "OpenCASCADE finds a fault in the solid and cannot heal it: compare its volume",
}
OTHER = "other entity"  # of which nothing is known; OpenCASCADE counts what holds nothing but a curve, too
PLURALS = {OTHER: "other entities", "surface without an outline": "surfaces without an outline"}
# Of whose items shapes are made.
SHAPES = re.compile(
    rb"\b(?:\w*SHAPE_REPRESENTATION|CONSTRUCTIVE_GEOMETRY_REPRESENTATION)\s*\(\s*(?:'[^']{0,400}+')+\s*,\s*\(([^()]*+)\)"
)
NO_NUMBER = re.compile(rb"[(,]\s*[-+]?(?:nan|inf|infinity)\s*[,)]", re.IGNORECASE)  # OpenCASCADE never ends on it
NUMBER = re.compile(rb"#(\d{1,18})")
TYPE = re.compile(rb"#(\d{1,18})\s*=\s*\(?\s*(\w{1,80}+)\s*\(")  # of a complex entity, the first of its types
ANNOTATION = re.compile(rb"=\s*\(?\s*(?:DRAUGHTING_|TESSELLATED_)?ANNOTATION_(?:\w{1,40}_)?OCCURRENCE\s*\(")
KINDS = (
    (re.compile(r"\w*_CURVE(_WITH_KNOTS)?|LINE|POLYLINE|CIRCLE|ELLIPSE|PARABOLA|HYPERBOLA"), "curve"),
    (re.compile(r"\w*_SURFACE(_WITH_KNOTS)?|PLANE"), "surface without an outline"),
    (re.compile(r"CARTESIAN_POINT|POINT_ON_CURVE|POINT_ON_SURFACE"), "point"),
    (re.compile(r"OPEN_SHELL|CLOSED_SHELL|ADVANCED_FACE|FACE_SURFACE"), "loose shell"),
)


def read_step(file: SurfaceFile) -> Content:
    """Read the solids of a .step, or its faces where it has none. Lengths are in the file's unit."""
    if b"ISO-10303-21" not in file.data[:4096]:
        raise MeshError(f"not a STEP file: it does not begin with ISO-10303-21; {DAMAGED}")
    if NO_NUMBER.search(file.data):
        raise MeshError(f"holds a coordinate that is no number; {DAMAGED}")
    return _read(file, "step", step_unit(file.data))


def read_iges(file: SurfaceFile) -> Content:
    """Read a .iges as `read_step` reads a .step."""
    return _read(file, "iges", iges_unit(file.data))


def _read(file: SurfaceFile, kind: str, unit: Unit) -> Content:
    """Return the bodies of a file in its unit. Raises MeshError where there are none."""
    arrays, facts = _run(file.data, kind, file.deflection, unit)
    left_out = Counter(facts["left_out"]) + (passed_over(file.data) if kind == "step" else Counter())
    _check(facts, len(arrays["faces"]), left_out)
    check_face_count(len(arrays["faces"]), file.max_faces)
    faces, owners, own, together = arrays["labels"].T
    groups, shapes = _groups(faces, facts)
    names = facts["names"]
    rows = [np.flatnonzero(owners == k) for k in range(1, len(names) + 1)]
    solids = (SolidPart(names[k], row, _brep(arrays, k + 1, own[row])) for k, row in enumerate(rows))
    vertices, triangles = _joined(arrays["vertices"], arrays["faces"], owners)
    return Content(
        vertices / unit.factor,
        triangles.tolist(),
        (*unit.notices, *_notices(facts, left_out)),
        groups,
        unit=unit.name,
        solids=tuple(solids),
        brep=_brep(arrays, 0, together),
        conflict=_conflict(facts),
        shapes=shapes,
    )


def _joined(vertices: Array, triangles: IntArray, owners: IntArray) -> tuple[Array, IntArray]:
    """Return vertices (n, 3) and triangles (m, 3) in which faces of one solid have common vertices.

    owners: (m,), the solid of each triangle. OpenCASCADE gives each face vertices of its own, at the same places.
    """
    owner = np.zeros(len(vertices))
    owner[triangles.ravel()] = np.repeat(owners, 3)
    _, first, joined = np.unique(np.column_stack([owner, vertices]), axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # vertices keep their order
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    return vertices[first[order]], place[joined.ravel()][triangles]


def _groups(faces: IntArray, facts: Mapping[str, Any]) -> tuple[dict[str, IntArray], dict[str, str]]:
    """Return the groups of triangles by face and by the names of faces, and in words the shapes of some of them.

    faces: (m,), the face of each triangle, counted from 1. Names are left out where they would be too many.
    """
    present, shapes = np.unique(faces).tolist(), facts["shapes"]
    names = named(shapes, facts["size"]) if len(present) <= MOST_GROUPS // 2 else {}
    if len(present) + len(names) > MOST_GROUPS:
        names = {}
    rows = [(f"face{value}", np.flatnonzero(faces == value)) for value in present]
    rows += [(name, np.flatnonzero(np.isin(faces, numbers))) for name, (numbers, _) in names.items()]
    words = {f"face{value}": described(shapes[value - 1]) for value in present} if shapes else {}
    return gathered(rows), words | {name: told for name, (_, told) in names.items() if told}


def _brep(arrays: Mapping[str, Any], number: int, faces: IntArray) -> Brep | None:
    """Return the B-rep of one of the solids, of all for number 0, whose triangles lie on `faces`; None without one."""
    found = arrays.get(f"brep{number}")
    return None if found is None else Brep(found.tobytes(), faces)


def _conflict(facts: Mapping[str, Any]) -> str:
    """Return why several solids cannot be taken together, "" where they can."""
    if facts["failed"]:
        return "OpenCASCADE does not find where they touch"
    names = [facts["names"][number] for number in facts["overlap"] or ()]
    told = " and ".join(f"{name!r:.40}" for name in names) if all(names) else "two of them"
    return f"{told} overlap" if names else ""


def _check(facts: Mapping[str, Any], count: int, left_out: Counter[str]) -> None:
    """Raise MeshError for a file without bodies, or with what OpenCASCADE does not read rightly."""
    if facts["changed"]:
        raise MeshError("places a shape by a mirror or a scale, which OpenCASCADE does not apply: export it in place")
    if missing := facts["missing"]:
        named = ", ".join(f"face{number}" for number in missing[:LISTED]) + ", ..." * (len(missing) > LISTED)
        raise MeshError(f"OpenCASCADE cannot divide {named} into triangles: repair it, or export triangles instead")
    if not count:
        known = Counter({what: number for what, number in left_out.items() if what != OTHER}) or left_out
        there = f", only {_counted(known)}" if known else ""
        raise MeshError(f"has no solid and no faces that bound a body{there}: export the solid")
    if facts["size"] < SMALLEST:
        raise MeshError(
            f"is {facts['size']:.1g} units of its file large, too small for OpenCASCADE: choose a smaller unit"
        )


def _notices(facts: Mapping[str, Any], left_out: Counter[str]) -> list[str]:
    """Return what was left out, and what is to be known of the solids."""
    what = "solid" if facts["what"] == "solid" else "body"
    notices = [f"left out beside the {what}: {_counted(left_out)}"] if left_out else []
    notices += [MESH] if facts["what"] == "mesh" else []
    return notices + [SAID[state] for state in SAID if facts["states"].get(state)]


def _counted(things: Counter[str]) -> str:
    """Return numbers of things in words, such as "3 loose faces, 1 curve"."""
    pairs = ((number, name if number == 1 else PLURALS.get(name, f"{name}s")) for name, number in things.items())
    return ", ".join(f"{number} {name}" for number, name in pairs)


def _run(data: bytes, kind: str, deflection: float | None, unit: Unit) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the arrays and the facts that OpenCASCADE finds in a file. Raises MeshError where it fails."""
    if deflection is not None and not 0.0 < deflection < np.inf:
        raise MeshError(f"deflection must be a positive length, got {deflection!r:.40}")
    if find_spec("OCP") is None:
        raise MeshError(f"reading .{kind} needs OpenCASCADE, which is not installed: {INSTALL}")
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "source"), Path(folder, "target.npz")
        source.write_bytes(data)
        numbers = (
            unit.working,
            0.0 if deflection is None else float(deflection) * unit.factor,
            SHARE,
            ANGLE,
            unit.factor,
        )
        command = [sys.executable, str(PROGRAM), str(source), str(target), kind, *map(repr, numbers)]
        try:
            ended = subprocess.run(
                command, capture_output=True, timeout=PATIENCE, check=False, stdin=subprocess.DEVNULL
            )
        except subprocess.TimeoutExpired:
            raise MeshError(f"OpenCASCADE takes more than {PATIENCE:.0f} s: export triangles instead") from None
        if ended.returncode > 0:  # of Python: the library itself ends it by a signal
            said = ended.stderr.decode(errors="replace").strip().splitlines()
            raise MeshError(f"OpenCASCADE failed on it ({''.join(said[-1:])[:120]}): export triangles instead")
        if not target.exists():
            raise MeshError(f"OpenCASCADE cannot read it as {kind.upper()}; {DAMAGED}")
        with np.load(target) as arrays:
            found = dict(arrays)
    facts = json.loads(str(found.pop("facts")))
    if "refused" in facts:
        raise MeshError(facts["refused"])
    return found, facts


def passed_over(data: bytes) -> Counter[str]:
    """Return the numbers of annotations, and of items by their kind, that OpenCASCADE passes over in a STEP file."""
    named = {int(number[1]) for items in SHAPES.finditer(data) for number in NUMBER.finditer(items[1])}
    types = {int(found[1]): found[2].decode() for found in TYPE.finditer(data) if int(found[1]) in named}
    found: Counter[str] = Counter()
    for name in types.values():
        found.update(kind for pattern, kind in KINDS if pattern.fullmatch(name))
    found["annotation"] = len(ANNOTATION.findall(data))
    return +found
