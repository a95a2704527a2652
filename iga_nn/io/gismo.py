"""Reads and writes G+Smo XML: volumes of one patch or several, without G+Smo.

A patch is a `Geometry` of type TensorBSpline3, or TensorNurbs3 with weights: three knot vectors with their degrees,
and control points, u fastest. A `MultiPatch` names the patches by their ids, and lists interfaces, pairs of patch and
side, and boundary sides; the sides 1 to 6 are u0, u1, v0, v1, w0, w1. Without it all volumes of the file are the body.
Numbers may be fractions such as 1/3. Written patches have the ids 100, 101, .. and the `MultiPatch` 0.
"""

import logging
import re
from collections.abc import Iterator, Sequence
from operator import itemgetter
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from parameterize.arrays import Array
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.interface import Face, Interface, axis_side
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve.field import FieldOnBody, SplineField

from .patches_of_files import as_text, fastest_first, patch_of
from .words import faults_of, finite_numbers

log = logging.getLogger(__name__)

VOLUMES = ("TensorBSpline3", "TensorNurbs3")
FIRST_ID = 100  # of the patches that are written: G+Smo counts all objects of a file, the MultiPatch is 0
DIRECTIONS = 3  # of the map of directions in a row of an interface, as many as flags of their orientation
ROW = 4 + 2 * DIRECTIONS  # numbers of an interface


Geometries = list[tuple[int, Element]]  # with their ids


def read_gismo(text: str) -> tuple[list[BSplineVolume], list[tuple[Face, Face]]]:
    """Return the patches, and the pairs of faces that the file declares glued. Raises ValueError with the place."""
    root = _parsed(text)
    geometries = [(_id_of(node, place), node) for place, node in enumerate(root.findall("Geometry"))]
    if not geometries and (named := root.find("xmlfile")) is not None:
        raise ValueError(f"holds no Geometry, but names the file {(named.text or '').strip()[:80]}: read that one")
    bodies = [node for node in root.findall("MultiPatch") if node.get("parDim") in (None, "3")]
    if len(bodies) > 1:
        raise ValueError(f"holds {len(bodies)} MultiPatches of volumes: save the one you mean in a file of its own")
    chosen = _named(bodies[0], geometries) if bodies else _volumes(geometries)
    patches = [_read_patch(node, f"Geometry {number}") for number, node in chosen]
    _tell_left_out(root, [node for _, node in chosen], bodies[:1])
    return patches, list(_declared(bodies[0], [number for number, _ in chosen])) if bodies else []


def _parsed(text: str) -> Element:
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ValueError("declares a document type: entities are not expanded here, remove the declaration")
    declaration = re.search(r"<\?xml[^>]*\?>", text)  # G+Smo's own files have comments before it, which XML forbids
    text = text[declaration.end() :] if declaration else text
    try:
        return ElementTree.fromstring(text)  # noqa: S314 - entities, the danger, are refused above
    except (ElementTree.ParseError, ValueError) as error:  # the latter for characters that XML does not have
        raise ValueError(f"is not well-formed XML ({error})") from None


def _id_of(node: Element, place: int) -> int:
    """Return the id of a geometry, its place in the file where it has none."""
    return _wholes(node.get("id") or str(place), "the id of a Geometry")[0]


def _named(body: Element, geometries: Geometries) -> Geometries:
    """Return the patches of a MultiPatch."""
    patches = body.find("patches")
    if patches is None:
        raise ValueError("its MultiPatch has no patches")
    ids = _wholes(patches.text, "the patches of a MultiPatch")
    if patches.get("type") == "id_range":
        if len(ids) != 2:
            raise ValueError(f"the patches of its MultiPatch must be a first and a last id, got {len(ids)} numbers")
        found = [pair for pair in sorted(geometries, key=itemgetter(0)) if ids[0] <= pair[0] <= ids[1]]
        if not found or len(found) != ids[1] - ids[0] + 1:
            raise ValueError(f"its MultiPatch names Geometry {ids[0]} to {ids[1]}; the file holds {len(found)} of them")
        return found
    held = dict(reversed(geometries))  # of those with the same id G+Smo takes the first
    missing = [number for number in ids if number not in held]
    if missing:
        raise ValueError(f"its MultiPatch names Geometry {missing[0]}, which the file does not hold")
    return [(number, held[number]) for number in ids]


def _volumes(geometries: Geometries) -> Geometries:
    """Return the volumes. Raises ValueError where there is none."""
    found = [(number, node) for number, node in geometries if node.get("type") in VOLUMES]
    if not found:
        others = sorted({str(node.get("type")) for _, node in geometries})
        held = f"holds a {others[0]}" if others else "holds no Geometry"
        raise ValueError(f"{held}; a volume is a TensorBSpline3 or a TensorNurbs3")
    return found


def _tell_left_out(root: Element, *taken: Sequence[Element]) -> None:
    """Tell what a file holds beside the volumes: other geometries by their types, all else by its tags."""
    names = [
        str(node.get("type")) if node.tag == "Geometry" else node.tag
        for node in root
        if not any(node in nodes for nodes in taken)
    ]
    if names:
        log.warning("only the volumes of the body are taken; left out: %s", ", ".join(sorted(set(names))))


def _read_patch(node: Element, name: str) -> BSplineVolume:
    kind = node.get("type")
    if kind not in VOLUMES:
        raise ValueError(f"{name} is a {kind}; a volume is a TensorBSpline3 or a TensorNurbs3")
    for basis in node.iter("Basis"):
        if basis.get("type") not in ("TensorBSplineBasis3", "TensorNurbsBasis3", "BSplineBasis"):
            raise ValueError(f"{name} has a basis of type {basis.get('type')}; a volume has a TensorBSplineBasis3")
    if node.find("transform") is not None:
        raise ValueError(f"{name} has a transform, which is not applied: move its control points, and remove it")
    if kind == "TensorNurbs3" and node.find(".//weights") is None:
        raise ValueError(f"{name} is a TensorNurbs3 without weights")
    rows = list(node.iter("KnotVector"))
    coefficients = node.find("coefs")
    if len(rows) != 3 or coefficients is None or coefficients.get("geoDim") != "3":
        raise ValueError(f"{name} must have three KnotVectors, and coefs of geoDim 3")
    degrees = [_wholes(row.get("degree"), f"{name}: the degree of a KnotVector")[0] for row in rows]
    knots = [_numbers(row, f"{name}: the knots") for row in rows]
    points = _numbers(coefficients, f"{name}: the control points")
    held = node.find(".//weights")
    weights = None if held is None else _numbers(held, f"{name}: the weights")
    if points.size % 3 or (weights is not None and 3 * weights.size != points.size):
        raise ValueError(f"{name}: control points are three numbers each, with a weight each or none")
    with faults_of(name):
        return patch_of(degrees, knots, points.reshape(-1, 3), weights)


def _declared(body: Element, ids: Sequence[int]) -> Iterator[tuple[Face, Face]]:
    """Yield the interfaces of a MultiPatch: rows of patch, side, patch, side, and how the sides lie on each other."""
    places = {number: place for place, number in enumerate(ids)}
    for node in body.findall("interfaces"):
        for line in filter(str.strip, (node.text or "").splitlines()):
            row = _wholes(line, "an interface of its MultiPatch")
            for start in range(0, len(row), ROW if len(row) % ROW == 0 else len(row)):
                yield _face(places, row[start : start + 2]), _face(places, row[start + 2 : start + 4])


def _face(places: dict[int, int], pair: Sequence[int]) -> Face:
    if len(pair) != 2 or pair[0] not in places or not 1 <= pair[1] <= len(FACE_NAMES):
        raise ValueError(f"an interface of its MultiPatch names no patch and side: {' '.join(map(str, pair))}")
    return places[pair[0]], FACE_NAMES[pair[1] - 1]


def _wholes(text: str | None, what: str) -> list[int]:
    words = (text or "").split()
    if not words or not all(word.isascii() and word.isdigit() and len(word) < 19 for word in words):
        raise ValueError(f"{what} must be whole numbers, got {(text or '').strip()[:40]!r}")
    return [int(word) for word in words]


def _numbers(node: Element, what: str) -> Array:
    """Return the numbers of an element (n,)."""
    if node.get("format", "ASCII").upper() != "ASCII":
        raise ValueError(f"{what} have the format {node.get('format')}: save the file with the format ASCII")
    return finite_numbers((node.text or "").split(), what)


def write_gismo(path: Path, spline: BodyLike, *_: object) -> None:
    """Write a body as G+Smo XML, which has no place for more."""
    body = as_body(spline)
    root = _with_topology(body)
    for number, patch in enumerate(body):
        _add_patch(root, number, patch, patch.control_points, patch.weights)
    _save(path, root)


def write_gismo_field(path: Path, solution: FieldOnBody, spline: BodyLike) -> None:
    """Write a solution on a body as G+Smo XML."""
    root = _with_topology(as_body(spline))
    for number, field in enumerate(solution.patches):
        _add_patch(root, number, field, field.coefficients, None)
    _save(path, root)


def _save(path: Path, root: Element) -> None:
    ElementTree.indent(root, " ")
    text = ElementTree.tostring(root, encoding="unicode")
    path.write_text(f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n', encoding="utf-8")


def _with_topology(body: Body) -> Element:
    """Return a file's root with the numbers of the patches, their interfaces and their outer faces."""
    root = Element("xml")
    node = SubElement(root, "MultiPatch", parDim="3", id="0")
    SubElement(node, "patches", type="id_range").text = f"{FIRST_ID} {FIRST_ID + len(body) - 1}"
    SubElement(node, "interfaces").text = "\n".join(" ".join(map(str, _row(one))) for one in body.interfaces)
    sides = [f"{FIRST_ID + patch} {FACE_NAMES.index(face) + 1}" for patch, face in body.outer_faces]
    SubElement(node, "boundary").text = "\n".join(sides)
    return root


def _row(interface: Interface) -> list[int]:
    """Return the numbers of an interface.

    After the faces stand the direction of the second patch that runs along each direction of the first, and whether it
    runs the same way; for the direction through the interface, whether it runs on.
    """
    (p, face_p), (q, face_q) = interface.first, interface.second
    (axis_p, side_p), (axis_q, side_q) = axis_side(face_p), axis_side(face_q)
    along, same = [0] * DIRECTIONS, [0] * DIRECTIONS
    along[axis_p], same[axis_p] = axis_q, int(side_p != side_q)
    for axis, other, flipped in interface.directions:
        along[axis], same[axis] = other, int(not flipped)
    sides = FACE_NAMES.index(face_p) + 1, FACE_NAMES.index(face_q) + 1
    return [FIRST_ID + p, sides[0], FIRST_ID + q, sides[1], *along, *same]


def _add_patch(
    root: Element, number: int, spline: BSplineVolume | SplineField, net: Array, weights: Array | None
) -> None:
    rational = weights is not None
    node = SubElement(root, "Geometry", type=VOLUMES[rational], id=str(FIRST_ID + number))
    outer = SubElement(node, "Basis", type="TensorNurbsBasis3") if rational else node
    bases = SubElement(outer, "Basis", type="TensorBSplineBasis3")
    for axis, (degree, row) in enumerate(zip(spline.degrees, spline.knots, strict=True)):
        basis = SubElement(bases, "Basis", type="BSplineBasis", index=str(axis))
        SubElement(basis, "KnotVector", degree=str(degree)).text = " ".join(map(repr, row.tolist()))
    if weights is not None:
        SubElement(outer, "weights").text = as_text(fastest_first(weights))
    rows = fastest_first(net)
    SubElement(node, "coefs", geoDim=str(rows.shape[1])).text = as_text(rows)
