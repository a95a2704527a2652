"""Reads and writes MFEM NURBS meshes of one patch or several, and writes solutions on them, without MFEM.

"MFEM NURBS mesh v1.0" and v1.1: hexahedra, one a patch, whose edges name a knot vector each and so the neighbours; then
knot vectors, weights and control points in the order of `mfem_layout`, or, under `patches`, each patch with its own.
Knots run from 0 to 1 when written. Elements are the non-empty knot spans, patch after patch, u fastest, each with the
reference coordinates (0, 1)^3 of its span. An element's attribute is 1 more than the number p of its patch; boundary
attributes 6 p + 1 to 6 p + 6 are w0, w1, v0, u1, v1, u0. With a solution the map is written on the solution's knots,
and the solution's coefficients in the same order in a grid function beside it: one per row, three for displacements
(VDim: 3, Ordering: 1). A left-handed patch, whose det J is negative, is written with w reversed, so that w0 and w1
change places: MFEM would take det J for the weight of its integrals.
"""

import logging
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from parameterize.arrays import Array, Floats, IntArray
from parameterize.spline.interface import Face
from parameterize.spline.multipatch import MultiPatch, as_multipatch, shared_numbers
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume
from solve.field import SplineField

from ..errors import InputError
from .mfem_layout import CORNERS, FACES, Layout, edges_along
from .patches import as_text, patch_of
from .words import Words

log = logging.getLogger(__name__)

HEADS = ("MFEM NURBS mesh v1.0", "MFEM NURBS mesh v1.1")
CUBE, SQUARE = 5, 3  # MFEM's geometries
ATTRIBUTES = ("w0", "w1", "v0", "u1", "v1", "u0")  # the faces by their boundary attributes, from 1

KnotVector = tuple[int, Array]  # degree and knots


def read_mfem(text: str) -> tuple[list[BSplineVolume], list[tuple[Face, Face]]]:
    """Return the patches, and the pairs of faces that have the same vertices. Raises ValueError with the line."""
    words = Words(text)
    head = " ".join(words.row("its first line"))
    if head not in HEADS:
        raise ValueError(f"is a {head[:40]!r}; {' and '.join(HEADS)} are read")
    layout = _read_layout(words)
    declared = list(layout.shared_faces())
    section = words.word("knotvectors or patches")
    if section == "patches":
        return [_read_patch(words, f"patch {number}") for number in range(len(layout.hexahedra))], declared
    if section != "knotvectors":
        raise words.fault(f"knotvectors or patches must follow, got {section[:40]!r}")
    vectors = [_read_knots(words) for _ in range(words.whole("the number of knot vectors"))]
    if layout.edges[:, 0].max(initial=0) >= len(vectors):
        raise ValueError(f"names knot vector {layout.edges[:, 0].max()}, and there are {len(vectors)}, counted from 0")
    counts = [len(row) - degree - 1 for degree, row in vectors]
    size = layout.size(counts)
    weights = _read_weights(words, size)
    rows = _read_nodes(words, size)
    patches = []
    for number, (axes, places) in enumerate(zip(layout.axes, layout.numbers(counts), strict=True)):
        chosen = places.ravel(order="F")
        degrees, knots = [vectors[k][0] for k, _ in axes], [_turned(vectors[k][1], back) for k, back in axes]
        try:
            patches.append(patch_of(degrees, knots, rows[chosen], weights[chosen]))
        except ValueError as error:
            raise ValueError(f"patch {number}: {error}") from None
    return patches, declared


def _read_layout(words: Words) -> Layout:
    """Return the hexahedra, edges and vertices of the mesh."""
    _expect(words, "dimension")
    if (dimension := words.whole("the dimension")) != 3:
        raise words.fault(f"maps {dimension} parameters; a volume maps 3")
    _expect(words, "elements")
    count = words.whole("the number of elements")
    hexahedra = [_read_cell(words, "an element", CUBE, 8) for _ in range(count)]
    if not hexahedra:
        raise words.fault("has no elements")
    _expect(words, "boundary")
    for _ in range(words.whole("the number of boundary elements")):
        _read_cell(words, "a boundary element", SQUARE, 4)
    _expect(words, "edges")
    edges = words.wholes(3 * words.whole("the number of edges"), "an edge")
    _expect(words, "vertices")
    vertices = words.whole("the number of vertices")
    return Layout(vertices, np.array(hexahedra), np.array(edges, dtype=np.int64).reshape(-1, 3))


def _read_cell(words: Words, what: str, geometry: int, corners: int) -> list[int]:
    _, found = words.wholes(2, what)
    if found != geometry:
        raise words.fault(f"{what} has the geometry {found}; of volumes it is {geometry}")
    return words.wholes(corners, what)


def _expect(words: Words, *names: str) -> str:
    """Take the next word, which must be one of the names."""
    if (word := words.word(names[0])) not in names:
        raise words.fault(f"{' or '.join(names)} must follow, got {word[:40]!r}")
    return word


def _read_knots(words: Words) -> KnotVector:
    degree, count = words.wholes(2, "degree and number of control points of a knot vector")
    if not 1 <= degree < count:
        raise words.fault(
            f"a knot vector of degree {degree} has {count} control points; the degree must be 1 to {count - 1}"
        )
    return degree, words.reals(degree + count + 1, "knots")


def _turned(knots: Array, back: bool) -> Array:
    """Return a knot vector, where `back` the other way."""
    return knots[0] + (knots[-1] - knots[::-1]) if back else knots


def _read_patch(words: Words, name: str) -> BSplineVolume:
    """Return a patch that is listed with its own knot vectors and control points, homogeneous ones or not."""
    _expect(words, "knotvectors")
    if words.whole("the number of knot vectors") != 3:
        raise words.fault(f"{name} must have three knot vectors")
    vectors = [_read_knots(words) for _ in range(3)]
    _expect(words, "dimension")
    if words.whole("the dimension") != 3:
        raise words.fault(f"{name} must have control points of 3 coordinates")
    kind = _expect(words, "controlpoints", "controlpoints_homogeneous", "controlpoints_cartesian")
    counts = [len(row) - degree - 1 for degree, row in vectors]
    rows = words.reals(4 * int(np.prod(counts, dtype=object)), f"the control points of {name}").reshape(-1, 4)
    if not np.all(rows[:, 3] > 0.0):
        raise words.fault(f"the weights of {name} must be positive")
    points = rows[:, :3] if kind == "controlpoints_cartesian" else rows[:, :3] / rows[:, 3:]
    try:
        return patch_of([degree for degree, _ in vectors], [row for _, row in vectors], points, rows[:, 3])
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def _read_weights(words: Words, size: int) -> Array:
    """Return the weights of all control points; pass over rules for a later refinement, which v1.1 has before them."""
    section = words.word("weights")
    if section == "spacing":
        for _ in range(words.whole("the number of spacings")):
            *_, wholes, reals = words.wholes(4, "a spacing")
            words.take(wholes + reals, "a spacing")
        section = words.word("weights")
    if section in ("unitweights", "autoweights"):
        return np.ones(size)
    if section != "weights":
        raise words.fault(f"weights must follow, got {section[:40]!r}, which is not read")
    return words.reals(size, "weights")


def _read_nodes(words: Words, size: int) -> Array:
    """Return the control points (size, 3)."""
    heading = " ".join(words.row("FiniteElementSpace"))
    if heading.removeprefix("MFEM ").removesuffix(" v1.0") != "FiniteElementSpace":
        raise words.fault(f"FiniteElementSpace must follow, got {heading[:40]!r}")
    held = {}
    while (words.peek() or "0")[0].isalpha():
        name, _, value = " ".join(words.row("a property")).partition(":")
        held[name] = value.strip()
    if not held.get("FiniteElementCollection", "").startswith("NURBS"):
        raise words.fault("its control points must be those of a FiniteElementCollection NURBS")
    if held.get("VDim") != "3" or held.get("Ordering") not in ("0", "1"):
        raise words.fault("must hold control points of 3 coordinates (VDim: 3), with an Ordering of 0 or 1")
    if unknown := sorted(set(held) - {"FiniteElementCollection", "VDim", "Ordering", "End"}):
        raise words.fault(f"its control points have a property that is not read: {unknown[0][:40]}")
    numbers = words.reals(3 * size, "control points")
    return numbers.reshape(size, 3) if held["Ordering"] == "1" else numbers.reshape(3, size).T


def write_mfem(path: Path, volume: BSplineVolume | MultiPatch, solution: SplineField | None = None, *_: object) -> None:
    """Write a volume or a body as an MFEM NURBS mesh, on the knots of the solution where there is one.

    Raises InputError where the degrees of the solution differ, or MFEM has no way to tell the edges of a body apart.
    """
    body = as_multipatch(volume)
    if solution is not None:
        body = MultiPatch((_on_knots_of(solution, body.patches[0]),))
    mirrored = _left_handed(body)
    if any(mirrored):
        log.warning("the volume is left-handed, which MFEM does not take: written with w reversed, w0 and w1 exchanged")
    layout, knots = _layout_of(body, mirrored)
    counts = [len(row) - degree - 1 for degree, row in knots]
    places = layout.numbers(counts)
    _demand_same(body, mirrored, places)
    rows, weights = np.empty((layout.size(counts), 3)), np.empty(layout.size(counts))
    for place, patch, back in zip(places, body, mirrored, strict=True):
        rows[place] = _reversed(patch.control_points, back)
        weights[place] = 1.0 if patch.weights is None else _reversed(patch.weights, back)
    _demand_one_weight(body, mirrored, [weights[place] for place in places])
    outer = [
        f"{6 * number + ATTRIBUTES.index(face) + 1} {SQUARE} {_joined(layout.hexahedra[number, FACES[face]])}"
        for number, (faces, back) in enumerate(zip(body.outer, mirrored, strict=True))
        for face in (_seen(face, back) for face in faces)
    ]
    cells = [f"{number + 1} {CUBE} {_joined(row)}" for number, row in enumerate(layout.hexahedra)]
    vectors = [f"{degree} {count} {_joined(row)}" for (degree, row), count in zip(knots, counts, strict=True)]
    lines = [HEADS[0], "", "dimension", "3", "", "elements", str(len(cells)), *cells, "", "boundary", str(len(outer))]
    lines += [*outer, "", "edges", str(len(layout.edges)), *map(_joined, layout.edges), "", "vertices"]
    lines += [
        str(layout.vertices),
        "",
        "knotvectors",
        str(len(vectors)),
        *vectors,
        "",
        "weights",
        *map(repr, weights.tolist()),
    ]
    path.write_text("\n".join([*lines, "", *_space(3), as_text(rows)]) + "\n", encoding="utf-8")


def write_mfem_field(path: Path, field: SplineField, volume: BSplineVolume) -> None:
    """Write a solution as an MFEM grid function on the mesh that `write_mfem` makes of it and its volume."""
    body = MultiPatch((_on_knots_of(field, volume),))
    (back,) = mirrored = _left_handed(body)
    layout, knots = _layout_of(body, mirrored)
    (place,) = layout.numbers([len(row) - degree - 1 for degree, row in knots])
    coefficients = _reversed(field.coefficients, back).reshape(*place.shape, -1)
    values = np.empty((place.size, coefficients.shape[3]))
    values[place] = coefficients
    path.write_text("\n".join([*_space(values.shape[1]), as_text(values)]) + "\n", encoding="utf-8")


def _on_knots_of(field: SplineField, volume: BSplineVolume) -> BSplineVolume:
    """Return the same map with the knots of a solution on it inserted. Raises InputError where the degrees differ."""
    if field.degrees != volume.degrees:
        raise InputError(
            f"an MFEM mesh takes only solutions of its own degrees {volume.degrees}, this one has {field.degrees}: "
            "export it --to vtk"
        )
    return volume.on_knots(field.knots)


def _left_handed(body: MultiPatch) -> list[bool]:
    return [orientation(patch) < 0 for patch in body]


def _reversed(net: Floats, back: bool) -> Floats:
    """Return coefficients (n_u, n_v, n_w, ...), where `back` with w reversed."""
    return net[:, :, ::-1] if back else net


def _seen(face: str, back: bool) -> str:
    """Return the name that a face has in the file."""
    return {"w0": "w1", "w1": "w0"}.get(face, face) if back else face


def _joined(row: Array | IntArray) -> str:
    return " ".join(map(repr, row.tolist()))


def _space(components: int) -> list[str]:
    """Return the heading of control points or of a grid function."""
    return ["FiniteElementSpace", "FiniteElementCollection: NURBS", f"VDim: {components}", "Ordering: 1", ""]


def _layout_of(body: MultiPatch, mirrored: Sequence[bool]) -> tuple[Layout, list[KnotVector]]:
    """Return the hexahedra of a body, and its knot vectors.

    mirrored: the patches whose w is reversed. Raises InputError where MFEM cannot hold the body.
    """
    labels, _ = shared_numbers([(2, 2, 2)] * len(body), body.interfaces)
    cubes = np.array([_reversed(label, back) for label, back in zip(labels, mirrored, strict=True)])
    rows = np.stack([cubes[:, i, j, k] for i, j, k in CORNERS], axis=1)
    _, first, places = np.unique(rows, return_index=True, return_inverse=True)
    hexahedra = np.argsort(np.argsort(first))[places].reshape(rows.shape)  # vertices count as they come
    for place, (i, j, k) in enumerate(CORNERS):
        cubes[:, i, j, k] = hexahedra[:, place]
    edges, knots = _edges(body, mirrored, cubes)
    try:
        return Layout(len(first), hexahedra, edges), knots
    except ValueError:
        raise _cannot_hold() from None


def _edges(body: MultiPatch, mirrored: Sequence[bool], cubes: IntArray) -> tuple[IntArray, list[KnotVector]]:
    """Return the edges (m, 3) of a body, each with its knot vector, start and end, and the knot vectors.

    Edges that lie opposite each other in a patch have the same knot vector. cubes: the vertices (n, 2, 2, 2) of the
    patches.
    """
    axes = [(number, axis, edges_along(cubes[number], axis)) for number in range(len(body)) for axis in range(3)]
    meeting: dict[frozenset[int], list[int]] = {}
    for place, (_, _, ends) in enumerate(axes):
        for pair in ends:
            meeting.setdefault(frozenset(pair), []).append(place)
    listed: dict[frozenset[int], list[int]] = {}
    knots: list[KnotVector] = []
    for first, (number, axis, _) in enumerate(axes):
        if all(frozenset(pair) in listed for pair in axes[first][2]):
            continue
        row = body.patches[number].knots[axis]
        knots.append((body.patches[number].degrees[axis], 1.0 - row[::-1] if mirrored[number] and axis == 2 else row))
        for pair in _parallel(first, [ends for _, _, ends in axes], meeting):
            if listed.setdefault(frozenset(pair), [len(knots) - 1, *pair])[1:] != pair:
                raise InputError(
                    "an MFEM mesh cannot hold this body: a direction of its patches comes back the other way round, as "
                    "on a Moebius strip; export it --to gismo"
                )
    return np.array(list(listed.values())), knots


def _parallel(
    first: int, axes: Sequence[list[list[int]]], meeting: dict[frozenset[int], list[int]]
) -> Iterator[list[int]]:
    """Yield start and end of the edges that run along with those of one direction of a patch, through all patches.

    axes: the four edges of each direction of each patch. meeting: the directions that have an edge.
    """
    seen, waiting = {first}, [(first, False)]
    while waiting:
        place, back = waiting.pop()
        for start, end in axes[place]:
            pair = [end, start] if back else [start, end]
            yield pair
            for other in meeting[frozenset(pair)]:
                if other not in seen:
                    seen.add(other)
                    waiting.append((other, pair not in axes[other]))


def _demand_same(body: MultiPatch, mirrored: Sequence[bool], places: Sequence[IntArray]) -> None:
    """Raise InputError where MFEM would take other control points for one than the interfaces do."""
    labels, count = shared_numbers([patch.shape for patch in body], body.interfaces)
    ours = np.concatenate([_reversed(label, back).ravel() for label, back in zip(labels, mirrored, strict=True)])
    theirs = np.concatenate([place.ravel() for place in places])
    if len(np.unique(np.stack([ours, theirs]), axis=1).T) != count or len(np.unique(theirs)) != count:
        raise _cannot_hold()


def _demand_one_weight(body: MultiPatch, mirrored: Sequence[bool], weights: Sequence[Array]) -> None:
    """Raise InputError where patches give a control point that they share other weights."""
    for number, (patch, back, entered) in enumerate(zip(body, mirrored, weights, strict=True)):
        if not np.array_equal(
            entered, np.ones(patch.shape) if patch.weights is None else _reversed(patch.weights, back)
        ):
            raise InputError(
                f"an MFEM mesh has one weight for a control point: patch {number} and a neighbour have weights in "
                "proportion alone; multiply the weights of one by their ratio, which does not change it"
            )


def _cannot_hold() -> InputError:
    return InputError(
        "an MFEM mesh cannot hold this body: MFEM knows an edge by its two ends, and two have the same ends here, "
        "or one ends where it began, as in a ring of two patches or one: divide its patches, or export it --to gismo"
    )
