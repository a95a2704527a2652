"""Writes gmsh's mesh files, version 4.1: curved hexahedra of 27 or 64 nodes, regions and solids as physical groups.

Gmsh reference manual, "MSH file format". Through 64 nodes a span of a cubic map passes exactly. The elements are proved
to be unfolded (`element_proof`). A solution is the data `u` of the nodes. Faces on the boundary are elements, too: an
entity for all that belong to the same regions.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import BodyLike, as_body
from parameterize.surface.part import PartSurface
from solve.field import FieldOnBody
from solve.forms.boundary_value_problem import BoundaryValueProblem

from ..errors import InputError
from .element_proof import proved
from .element_shapes import GMSH_SHAPES
from .element_supports import faces_of_regions
from .elements import Elements, cut

REST = "rest of the boundary"  # the group of faces in no region: meshio takes no element without a group
TYPES = {"hex27": (12, 10), "hex64": (92, 36)}  # of the hexahedra, and of the faces


def write_gmsh(
    path: Path,
    body: BodyLike,
    solution: FieldOnBody | None = None,
    problem: BoundaryValueProblem | None = None,
    part: PartSurface | None = None,
    *,
    parts: int = 1,
    element: str = "hex64",
) -> Elements:
    """Write a mesh, and return its elements.

    parts: elements a span of the map and direction. element: one of GMSH_SHAPES. Raises InputError, OSError.
    """
    if element not in GMSH_SHAPES:
        raise InputError(f"element {element!r}: choose one of {', '.join(GMSH_SHAPES)}")
    whole, shape = as_body(body), GMSH_SHAPES[element]
    elements, _ = proved(Elements.of(whole, shape.degree, cut(whole, parts)), shape)
    regions = faces_of_regions(elements, None if problem is None else problem.on(whole), part)
    lines = [*_lines(elements, shape.chosen(elements.cells), TYPES[element], regions)]
    if solution is not None:
        lines += _data(values_at_nodes(elements, solution))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return elements


def values_at_nodes(elements: Elements, solution: FieldOnBody) -> Array:
    """Return the values (n, c) of a solution at the nodes of elements."""
    patches, places = elements.place_of_nodes
    first = solution.patches[0].coefficients
    found = np.empty((len(patches), int(np.prod(first.shape[3:]))))
    order = np.argsort(patches, kind="stable")
    for own in np.split(order, np.flatnonzero(np.diff(patches[order])) + 1):
        found[own] = solution.patches[patches[own[0]]](places[own]).reshape(len(own), -1)
    return found


def _lines(
    elements: Elements,
    cells: IntArray,
    types: tuple[int, int],
    regions: dict[str, tuple[IntArray, IntArray]],
) -> Iterator[str]:
    """Yield the lines of a mesh without data."""
    solids = elements.body.solids
    labels = [label or f"solid{place + 1}" for place, label in enumerate(solids.labels)]
    surfaces = _surfaces(elements, list(regions.values()))
    yield from ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(regions) + 1 + len(labels))]
    yield from (f'2 {tag} "{_plain(name)}"' for tag, name in enumerate((*regions, REST), 1))
    yield from (f'3 {tag} "{_plain(name)}"' for tag, name in enumerate(labels, 1))
    yield from ["$EndPhysicalNames", "$Entities", f"0 0 {len(surfaces)} {len(labels)}"]
    box = " ".join(map(repr, [*elements.points.min(axis=0).tolist(), *elements.points.max(axis=0).tolist()]))
    for tag, groups in enumerate(surfaces, 1):
        yield f"{tag} {box} {len(groups)} " + " ".join(str(group + 1) for group in groups) + " 0"
    for tag in range(1, len(labels) + 1):
        yield f"{tag} {box} 1 {tag} {len(surfaces)} " + " ".join(map(str, range(1, len(surfaces) + 1)))
    yield "$EndEntities"
    yield from _nodes(elements.points)
    owners, count = solids.numbers[elements.owners], len(elements)
    faces = sum(len(rows) for rows in surfaces.values())
    yield from ["$Elements", f"{len(surfaces) + len(labels)} {count + faces} 1 {count + faces}"]
    for tag in range(1, len(labels) + 1):
        own = np.flatnonzero(owners == tag - 1)
        yield f"3 {tag} {types[0]} {len(own)}"
        for element in own.tolist():
            yield f"{element + 1} " + " ".join(map(str, (cells[element] + 1).tolist()))
    number = count
    for tag, rows in enumerate(surfaces.values(), 1):
        yield f"2 {tag} {types[1]} {len(rows)}"
        for row in rows:
            number += 1
            yield f"{number} " + " ".join(map(str, (row + 1).tolist()))
    yield "$EndElements"


def _nodes(points: Array) -> Iterator[str]:
    yield from ["$Nodes", f"1 {len(points)} 1 {len(points)}", f"3 1 0 {len(points)}"]
    yield from (str(number) for number in range(1, len(points) + 1))
    yield from (" ".join(map(repr, point)) for point in points.tolist())
    yield "$EndNodes"


def _surfaces(
    elements: Elements, regions: Sequence[tuple[IntArray, IntArray]]
) -> dict[tuple[int, ...], list[IntArray]]:
    """Return the nodes of the faces on the boundary, in gmsh's order, by the numbers of the regions they belong to."""
    owners, faces = elements.outer
    own = elements.own_face(owners, faces)
    keys = 6 * owners + own
    groups: dict[int, list[int]] = {}
    for key in keys.tolist():
        groups[key] = [len(regions)]  # of faces in no region
    for number, (inside, sides) in enumerate(regions):
        for key in (6 * inside + sides).tolist():
            groups[key] = [*(one for one in groups[key] if one < len(regions)), number]
    nets = elements.nodes_of_faces(owners, faces)
    found = defaultdict[tuple[int, ...], list[IntArray]](list)
    order = _quadrangle(elements.degree)
    for key, face, net in zip(keys.tolist(), own.tolist(), nets, strict=True):
        axis, side = divmod(face, 2)
        net = net if bool(side) != (axis == 1) else net.T  # so that it looks outward
        found[tuple(groups[key])].append(net[order[:, 0], order[:, 1]])
    return found


def _quadrangle(degree: int) -> IntArray:
    """Return the places (k, 2) of the nodes of gmsh's quadrangle: corners, edges, and the inside."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    steps = np.arange(1, degree)[:, None]
    edges = [degree * a + steps * (b - a) for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)]
    inside = np.ones((1, 2), dtype=np.int64) if degree == 2 else 1 + corners
    return np.concatenate([degree * corners, *edges, inside])


def _data(values: Array) -> Iterator[str]:
    """Yield the lines of the data `u` at nodes, (n,) or three a node."""
    yield from ["$NodeData", "1", '"u"', "1", "0.0", "3", "0", str(values.shape[1]), str(len(values))]
    for number, row in enumerate(values.tolist(), 1):
        yield f"{number} " + " ".join(map(repr, row))
    yield "$EndNodeData"


def _plain(name: str) -> str:
    """Return a name as it may stand in quotes."""
    return "".join("'" if letter == '"' else letter for letter in name if letter.isprintable())[:127]
