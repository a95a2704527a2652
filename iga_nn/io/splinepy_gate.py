"""Checks a spline file before splinepy reads it: its kind by content, its size, that it is one trivariate patch.

splinepy checks degrees, knots and numbers of control points against each other, but trusts the counts in a file,
resolves XML entities, evaluates MFEM's rows as Python literals and assumes one numbering of a patch's edges.
Each function raises ValueError with the reason.
"""

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from xml.etree import ElementTree

MAX_BYTES = 128 << 20

# MFEM's usual patch: u along the edge 0-1, v along 0-3, w along 0-4; an edge is its knot vector and two vertices
_CUBE = "5 0 1 2 3 4 5 6 7"
_EDGES = ["0 0 1", "0 3 2", "0 4 5", "0 7 6", "1 0 3", "1 1 2", "1 4 7", "1 5 6", "2 0 4", "2 1 5", "2 2 6", "2 3 7"]


def kind_of(path: Path) -> str | None:
    """Return the kind of a file by its beginning: "gismo", "mfem", "json", "npz", or None. Raises OSError."""
    with path.open("rb") as stream:
        head = stream.read(4096).lstrip(b"\xef\xbb\xbf \t\r\n")
    if head.startswith(b"<") and re.search(rb"<xml\b", head):
        return "gismo"
    marks = {b"MFEM NURBS mesh": "mfem", b"{": "json", b"PK": "npz"}
    return next((kind for mark, kind in marks.items() if head.startswith(mark)), None)


def checked_text(path: Path, kind: str) -> str:
    """Return the text of the file, reduced to the parts that splinepy should read."""
    size = path.stat().st_size
    if size > MAX_BYTES:
        raise ValueError(f"has {size} bytes, more than {MAX_BYTES}")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError("is not a text file in UTF-8") from None
    return CHECKS[kind](text)


def _check_gismo(text: str) -> str:
    """Return the one geometry without the topology, which says nothing of one patch."""
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("declares a document type: entities are not expanded here, remove the declaration")
    try:
        root = ElementTree.fromstring(text)  # noqa: S314 - entities, the danger, are refused above
    except ElementTree.ParseError as error:
        raise ValueError(f"is not well-formed XML ({error})") from None
    geometries = root.findall("Geometry")
    _check_one(geometries)
    if geometries[0].get("type") not in ("TensorBSpline3", "TensorNurbs3"):
        raise ValueError(f"holds a {geometries[0].get('type')}; a volume is a TensorBSpline3")
    for basis in geometries[0].iter("Basis"):
        if basis.get("type") not in ("TensorBSplineBasis3", "TensorNurbsBasis3", "BSplineBasis"):
            raise ValueError(f"has a basis of type {basis.get('type')}; a volume has a TensorBSplineBasis3")
    reduced = ElementTree.Element("xml")
    reduced.append(geometries[0])
    return ElementTree.tostring(reduced, encoding="unicode")


def _check_mfem(text: str) -> str:
    """Return knot vectors, weights and control points only, under the plain headings that splinepy knows."""
    sections = _mfem_sections(text)
    if "patches" in sections:
        raise ValueError("lists its patches; save it with MFEM's Mesh.Print, which writes knotvectors and weights")
    elements = sections.get("elements", [])
    _check_one(elements[1:])
    if elements[1].split(maxsplit=1)[1:] != [_CUBE] or sections.get("edges", [])[1:] != _EDGES:
        raise ValueError("numbers the vertices or edges of its patch differently from MFEM's own cube-nurbs.mesh")
    if sections.get("VDim") != ["3"] or sections.get("Ordering", [])[:1] != ["1"]:
        raise ValueError("must hold control points of 3 coordinates (VDim: 3), one a row (Ordering: 1)")
    kept = ["MFEM NURBS mesh v1.0", "knotvectors", *sections.get("knotvectors", [])]
    kept += ["weights", *sections.get("weights", []), "FiniteElementSpace", "Ordering: 1", *sections["Ordering"][1:]]
    return "\n".join(kept) + "\n"


def _mfem_sections(text: str) -> dict[str, list[str]]:
    """Return the rows below each heading; the text behind a heading's colon is the first row."""
    sections: dict[str, list[str]] = {}
    rows: list[str] = []
    for line in map(str.strip, text.splitlines()):
        if line[:1].isalpha():
            name, _, value = line.partition(":")
            if name == "End":
                continue
            rows = sections.setdefault(name, [value.strip()] if value else [])
        elif line and not line.startswith("#"):
            try:
                [float(word) for word in line.split()]  # numbers alone: splinepy would evaluate any literal
            except ValueError:
                raise ValueError(f"has a row that is not made of numbers: {line[:40]!r}") from None
            rows.append(line)
    return sections


def _check_json(text: str) -> str:
    try:
        content = json.loads(text)
        splines = content["SplineList"]
        _check_one(splines)
        if splines[0]["para_dim"] != 3 or splines[0]["dim"] != 3:
            raise ValueError("holds no map from 3 parameters to 3 coordinates")
        splines[0]["show_options"] = {}
        return json.dumps(content)
    except (KeyError, TypeError, RecursionError, json.JSONDecodeError):
        raise ValueError("is not a list of splines as splinepy writes it") from None


def _check_one(patches: Sequence[object]) -> None:
    if len(patches) != 1:
        raise ValueError(f"holds {len(patches)} patches; a volume is one: save the one you mean in a file of its own")


CHECKS: dict[str, Callable[[str], str]] = {"gismo": _check_gismo, "mfem": _check_mfem, "json": _check_json}
