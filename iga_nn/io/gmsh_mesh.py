"""Reads the solid elements of Gmsh's .msh, of any degree, with their numbers and physical groups.

Source of the order of nodes: the Gmsh reference manual, "Node ordering". Inside of faces and elements nodes are those
of an element of a lower degree, whose order is the same again.
"""

import re
from functools import cache

import numpy as np

from parameterize.arrays import IntArray
from parameterize.meshes.kinds import ElementKind, kind_named
from parameterize.meshes.mesh import Block, VolumeMesh
from parameterize.surface.readers.gmsh import GmshFile, opened
from parameterize.surface.readers.gmsh_groups import groups_of

Place = tuple[int, ...]

_SOLIDS = ("tetra", "hexahedron", "wedge", "pyramid")
_HEX_CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
_HEX_EDGES = [(0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)]
_HEX_FACES = [(0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7)]
_TETRA_EDGES = [(0, 1), (1, 2), (2, 0), (3, 0), (3, 2), (3, 1)]
_TETRA_FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (3, 1, 2)]


def read_gmsh_mesh(data: bytes) -> VolumeMesh | None:
    """Return the solid elements of a file of these bytes, None where there are none. Raises MeshError for a bad one."""
    found = opened(data)
    blocks, owners = list[Block](), list[tuple[str, IntArray]]()
    unchecked: dict[str, int] = {}
    for (name, rows), (_, _, owner, numbers) in zip(found.cells, found.blocks, strict=True):
        shape = re.sub(r"\d+$", "", name)
        if shape not in _SOLIDS:
            continue
        try:
            kind = kind_named(name)
        except ValueError:
            unchecked[name] = unchecked.get(name, 0) + len(rows)
            continue
        blocks.append(Block(kind, rows[:, order_of(kind)], numbers))
        owners.append((shape, owner))
    if not blocks and not unchecked:
        return None
    return VolumeMesh(found.places, _joined(blocks), unchecked, _groups(found, blocks, owners))


def _joined(blocks: list[Block]) -> tuple[Block, ...]:
    """Return one block for each kind: a file has one for each entity of the geometry."""
    kinds = dict.fromkeys(block.kind for block in blocks)
    parts = ([block for block in blocks if block.kind == kind] for kind in kinds)
    return tuple(
        Block(own[0].kind, *(np.concatenate(rows) for rows in zip(*((b.nodes, b.numbers) for b in own), strict=True)))
        for own in parts
    )


def _groups(found: GmshFile, blocks: list[Block], owners: list[tuple[str, IntArray]]) -> dict[str, IntArray]:
    """Return the elements of each physical group of volumes, by their rows in the mesh."""
    kinds = list(dict.fromkeys(block.kind for block in blocks))
    order = sorted(range(len(blocks)), key=lambda k: kinds.index(blocks[k].kind))  # that of the joined blocks
    groups = groups_of([owners[k] for k in order], found.physical, found.names)
    return dict(groups)


@cache
def order_of(kind: ElementKind) -> IntArray:
    """Return where the nodes of a kind, which are in VTK's order, stand among Gmsh's."""
    degree = kind.degrees[0]
    if kind.shape == "tetra":
        places = [place[1:] for place in tetra_places(degree)]
    else:
        places = list(hexahedron_places(degree))
        if kind.is_serendipity:
            places = places[:20]
    return np.array([places.index(row) for row in map(tuple, kind.lattice.tolist())])


def _between(first: Place, last: Place, degree: int) -> list[Place]:
    """Return the places of the inner nodes of an edge, from its first end on."""
    steps = [(b - a) // degree for a, b in zip(first, last, strict=True)]
    return [tuple(a + k * step for a, step in zip(first, steps, strict=True)) for k in range(1, degree)]


def hexahedron_places(degree: int) -> list[Place]:
    """Return the places (3,), in edges / degree, of Gmsh's nodes of a hexahedron."""
    if degree == 0:
        return [(0, 0, 0)]
    corners: list[Place] = [tuple(degree * x for x in row) for row in _HEX_CORNERS]
    places = list(corners)
    for first, last in _HEX_EDGES:
        places += _between(corners[first], corners[last], degree)
    for face in _HEX_FACES if degree > 1 else ():
        a, b, _, d = (corners[k] for k in face)
        for i, j in _quadrilateral_places(degree - 2):
            steps = zip(a, b, d, strict=True)
            places.append(tuple(x + (i + 1) * (y - x) // degree + (j + 1) * (z - x) // degree for x, y, z in steps))
    if degree > 1:
        places += [tuple(x + 1 for x in row) for row in hexahedron_places(degree - 2)]
    return places


def _quadrilateral_places(degree: int) -> list[Place]:
    if degree == 0:
        return [(0, 0)]
    corners: list[Place] = [(0, 0), (degree, 0), (degree, degree), (0, degree)]
    places = list(corners)
    for k in range(4):
        places += _between(corners[k], corners[(k + 1) % 4], degree)
    if degree > 1:
        places += [tuple(x + 1 for x in row) for row in _quadrilateral_places(degree - 2)]
    return places


def tetra_places(degree: int) -> list[Place]:
    """Return the barycentric places (4,), times the degree, of Gmsh's nodes of a tetrahedron."""
    return _simplex_places(degree, _TETRA_EDGES, _TETRA_FACES)


def _simplex_places(degree: int, edges: list[tuple[int, int]], faces: list[tuple[int, int, int]]) -> list[Place]:
    """Return the barycentric places of the nodes of a triangle (without faces) or a tetrahedron."""
    count = 4 if faces else 3
    if degree == 0:
        return [(0,) * count]
    corners: list[Place] = [tuple(degree * (k == c) for c in range(count)) for k in range(count)]
    places = list(corners)
    for first, last in edges:
        places += _between(corners[first], corners[last], degree)
    inside = [(k, (k + 1) % 3) for k in range(3)]
    for face in faces if degree > 2 else ():
        for row in _simplex_places(degree - 3, inside, []):
            place = [0] * 4
            for corner, x in zip(face, row, strict=True):
                place[corner] = x + 1
            places.append(tuple(place))
    if degree >= count:
        places += [tuple(x + 1 for x in row) for row in _simplex_places(degree - count, edges, faces)]
    return places
