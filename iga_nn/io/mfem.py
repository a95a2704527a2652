"""Reads MFEM NURBS meshes of one patch or several, without MFEM.

"MFEM NURBS mesh v1.0" and v1.1: hexahedra, one a patch, whose edges name a knot vector each and so the neighbours; then
knot vectors, weights and control points in the order of `mfem_layout`, or, under `patches`, each patch with its own.
"""

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.interface import Face
from parameterize.spline.volume import BSplineVolume

from .mfem_layout import Layout, turned_knots
from .patches_of_files import patch_of, projected
from .words import Words, faults_of

HEADS = ("MFEM NURBS mesh v1.0", "MFEM NURBS mesh v1.1")
CUBE, SQUARE = 5, 3  # MFEM's geometries

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
        degrees, knots = [vectors[k][0] for k, _ in axes], [turned_knots(vectors[k][1], back) for k, back in axes]
        with faults_of(f"patch {number}"):
            patches.append(patch_of(degrees, knots, rows[chosen], weights[chosen]))
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
    points, weights = rows[:, :3], rows[:, 3]
    with faults_of(name):
        if kind != "controlpoints_cartesian":
            points = projected(points, weights)
        return patch_of([degree for degree, _ in vectors], [row for _, row in vectors], points, weights)


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
        raise words.fault(
            f"weights must follow, got {section[:40]!r}, which is not read: save the mesh without it, with all its "
            "elements and both sides of a periodic boundary"
        )
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
