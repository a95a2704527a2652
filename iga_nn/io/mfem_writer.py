"""Writes MFEM NURBS meshes of one patch or several, and solutions on them, without MFEM.

Knots run from 0 to 1. Elements are the non-empty knot spans, patch after patch, u fastest, each with the reference
coordinates (0, 1)^3 of its span. An element's attribute is 1 more than the number p of its patch; boundary attributes
6 p + 1 to 6 p + 6 are w0, w1, v0, u1, v1, u0. With a solution the map is written on the solution's knots, and the
solution's coefficients in the same order in a grid function beside it: one per row, three for displacements (VDim: 3,
Ordering: 1). A left-handed patch, whose det J is negative, is written with w reversed, so that w0 and w1 change places:
MFEM would take det J for the weight of its integrals.
"""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from parameterize.arrays import Array, Floats, IntArray
from parameterize.spline.body import Body, BodyLike, as_body, merged, shared_numbers
from parameterize.spline.interface import Interface, axis_side
from parameterize.spline.orientation import hands_of
from parameterize.spline.volume import BSplineVolume
from solve.field import FieldOnBody, SplineField

from ..errors import InputError
from .mfem import CUBE, HEADS, SQUARE, KnotVector
from .mfem_layout import CORNERS, FACES, Layout, bundles, edges_along, leading_edge, turned_knots
from .patches_of_files import as_text

log = logging.getLogger(__name__)

ATTRIBUTES = ("w0", "w1", "v0", "u1", "v1", "u0")  # the faces by their boundary attributes, from 1


def write_mfem(path: Path, volume: BodyLike, solution: FieldOnBody | None = None, *_: object) -> None:
    """Write a volume or a body as an MFEM NURBS mesh, on the knots of the solution where there is one.

    Raises InputError where the degrees of the solution differ, or MFEM has no way to tell the edges of a body apart.
    """
    given = as_body(volume)
    if solution is not None:
        given = _on_knots_of_all(solution, given)
    body = right_handed(given)
    if any(patch is not other for patch, other in zip(body, given, strict=True)):
        log.warning("the volume is left-handed, which MFEM does not take: written with w reversed, w0 and w1 exchanged")
    layout, knots = _layout_of(body)
    counts = [len(row) - degree - 1 for degree, row in knots]
    places = layout.numbers(counts)
    _demand_same(body, places)
    rows, weights = np.empty((layout.size(counts), 3)), np.empty(layout.size(counts))
    own = [np.ones(patch.shape) if patch.weights is None else patch.weights for patch in body]
    for patch, place, row in zip(body, places, own, strict=True):
        rows[place], weights[place] = patch.control_points, row
    _demand_one_weight([weights[place] for place in places], own)
    owners = body.solids.numbers if body.solids.are_several else np.arange(len(body))
    boundary = [(6 * number + ATTRIBUTES.index(face) + 1, number, face) for number, face in body.outer_faces]
    sections = {
        "dimension": ["3"],
        "elements": _counted(
            f"{owner + 1} {CUBE} {_joined(row)}" for owner, row in zip(owners.tolist(), layout.hexahedra, strict=True)
        ),
        "boundary": _counted(f"{a} {SQUARE} {_joined(layout.hexahedra[p, FACES[face]])}" for a, p, face in boundary),
        "edges": _counted(map(_joined, layout.edges)),
        "vertices": [str(layout.vertices)],
        "knotvectors": _counted(f"{p} {n} {_joined(row)}" for n, (p, row) in zip(counts, knots, strict=True)),
        "weights": list(map(repr, weights.tolist())),
    }
    lines = [line for name, held in sections.items() for line in ("", name, *held)]
    path.write_text("\n".join([HEADS[0], *lines, "", *_space(3), as_text(rows)]) + "\n", encoding="utf-8")


def write_mfem_field(path: Path, field: FieldOnBody, volume: BodyLike) -> None:
    """Write a solution as an MFEM grid function on the mesh that `write_mfem` makes of it and its volume."""
    given = _on_knots_of_all(field, as_body(volume))
    layout, knots = _layout_of(right_handed(given))
    counts = [len(row) - degree - 1 for degree, row in knots]
    own = [one.coefficients for one in field.patches]
    values = np.empty((layout.size(counts), int(np.prod(own[0].shape[3:]))))
    for coefficients, place, hand in zip(own, layout.numbers(counts), hands_of(given.groups), strict=True):
        values[place] = (_backwards(coefficients) if hand < 0 else coefficients).reshape(*place.shape, -1)
    path.write_text("\n".join([*_space(values.shape[1]), as_text(values)]) + "\n", encoding="utf-8")


def _on_knots_of_all(field: FieldOnBody, body: Body) -> Body:
    """Return the same body with the knots of a solution on it. Raises InputError where the degrees differ."""
    patches = merged(list(map(_on_knots_of, field.patches, body)), body.interfaces)  # knots are inserted with rounding
    return Body(patches, body.interfaces, body.solids)


def _on_knots_of(field: SplineField, volume: BSplineVolume) -> BSplineVolume:
    """Return the same map with the knots of a solution on it inserted. Raises InputError where the degrees differ."""
    if field.degrees != volume.degrees:
        raise InputError(
            f"an MFEM mesh takes only solutions of its own degrees {volume.degrees}, this one has {field.degrees}: "
            "export it --to vtk"
        )
    return volume.on_knots(field.knots)


def right_handed(body: Body) -> Body:
    """Return the same body with w reversed in its left-handed patches; the others stay the same objects."""
    left = (hands_of(body.groups) < 0).tolist()
    if not any(left):
        return body
    patches = [_with_w_reversed(patch) if back else patch for patch, back in zip(body, left, strict=True)]
    return Body(tuple(patches), tuple(_between(interface, left) for interface in body.interfaces), body.solids)


def _with_w_reversed(patch: BSplineVolume) -> BSplineVolume:
    u, v, w = patch.knots
    weights = None if patch.weights is None else _backwards(patch.weights)
    return BSplineVolume(patch.degrees, (u, v, 1.0 - w[::-1]), _backwards(patch.control_points), weights)


def _backwards(net: Floats) -> Floats:
    """Return coefficients (n_u, n_v, n_w, ...) with w reversed."""
    return net[:, :, ::-1]


def _between(interface: Interface, left: Sequence[bool]) -> Interface:
    """Return an interface after w has been reversed in the patches that are left-handed."""
    flipped = list(interface.flipped)
    ends = []
    for (patch, face), along in ((interface.first, 1), (interface.second, 0 if interface.swapped else 1)):
        if left[patch] and axis_side(face)[0] == 2:
            face = {"w0": "w1", "w1": "w0"}[face]
        elif left[patch]:
            flipped[along] = not flipped[along]  # w is the second direction along its other faces
        ends.append((patch, face))
    return replace(interface, first=ends[0], second=ends[1], flipped=(flipped[0], flipped[1]))


def _joined(row: Array | IntArray) -> str:
    return " ".join(map(repr, row.tolist()))


def _counted(rows: Iterable[str]) -> list[str]:
    """Return rows after their number."""
    listed = list(rows)
    return [str(len(listed)), *listed]


def _space(components: int) -> list[str]:
    """Return the heading of control points or of a grid function."""
    return ["FiniteElementSpace", "FiniteElementCollection: NURBS", f"VDim: {components}", "Ordering: 1", ""]


def _layout_of(body: Body) -> tuple[Layout, list[KnotVector]]:
    """Return the hexahedra of a body, and its knot vectors. Raises InputError where MFEM cannot hold the body."""
    cubes = np.array(shared_numbers([(2, 2, 2)] * len(body), body.interfaces)[0])
    rows = np.stack([cubes[:, i, j, k] for i, j, k in CORNERS], axis=1)
    _, first, places = np.unique(rows, return_index=True, return_inverse=True)
    hexahedra = np.argsort(np.argsort(first))[places].reshape(rows.shape)  # vertices count as they come
    for place, (i, j, k) in enumerate(CORNERS):
        cubes[:, i, j, k] = hexahedra[:, place]
    edges, knots = _edges(body, cubes)
    try:
        return Layout(len(first), hexahedra, edges), knots
    except ValueError:
        raise _cannot_hold() from None


def _edges(body: Body, cubes: IntArray) -> tuple[IntArray, list[KnotVector]]:
    """Return the edges (m, 3) of a body, each with its knot vector, start and end, and the knot vectors.

    Edges that lie opposite each other in a patch have the same knot vector. It runs from the lower to the higher vertex
    of their leading edge, and all edges are listed from their lower vertices, as MFEM writes them: MFEM 4.10 reads
    knots the wrong way where an edge is listed otherwise. cubes: the vertices (n, 2, 2, 2) of the patches.
    """
    listed: dict[frozenset[int], list[int]] = {}
    knots: list[KnotVector] = []
    for bundle in bundles(cubes):
        last, axis, is_back = max(bundle)
        start, end = leading_edge(cubes[last], axis)
        knots.append((body.patches[last].degrees[axis], turned_knots(body.patches[last].knots[axis], start > end)))
        for number, own_axis, back in bundle:
            way = -1 if (back != is_back) != (start > end) else 1
            for pair in (ends[::way] for ends in edges_along(cubes[number], own_axis)):
                if listed.setdefault(frozenset(pair), [len(knots) - 1, *pair])[1:] != pair:
                    raise InputError(
                        "an MFEM mesh cannot hold this body: a direction of its patches comes back the other way "
                        "round, as on a Moebius strip; export it --to gismo"
                    )
    return np.array([[number, *sorted(pair)] for number, *pair in listed.values()]), knots


def _demand_same(body: Body, places: Sequence[IntArray]) -> None:
    """Raise InputError where MFEM would take other control points for one than the interfaces do."""
    labels, count = body.numbering
    ours, theirs = (np.concatenate([row.ravel() for row in rows]) for rows in (labels, places))
    if len(np.unique(np.stack([ours, theirs]), axis=1).T) != count or len(np.unique(theirs)) != count:
        raise _cannot_hold()


def _demand_one_weight(entered: Sequence[Array], own: Sequence[Array]) -> None:
    """Raise InputError where patches give a control point that they share other weights."""
    for number, (one, other) in enumerate(zip(entered, own, strict=True)):
        if not np.array_equal(one, other):
            raise InputError(
                f"an MFEM mesh has one weight for a control point: patch {number} and a neighbour have weights in "
                "proportion alone; multiply the weights of one by their ratio, which does not change it"
            )


def _cannot_hold() -> InputError:
    return InputError(
        "an MFEM mesh cannot hold this body: MFEM knows an edge by its two ends, and two have the same ends here, "
        "or one ends where it began, as in a ring of two patches or one: divide its patches, or export it --to gismo"
    )
