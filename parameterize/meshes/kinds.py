"""Defines the kinds of elements: hexahedra and tetrahedra of any degree, and the places of their nodes in VTK's order.

VTK's order of nodes is that of its quadratic and its Lagrange cells (vtkHigherOrderHexahedron, vtkHigherOrderTetra):
corners, edges, faces, inside. meshio has the same; other programs' orders are in their readers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Literal

import numpy as np

from ..arrays import IntArray

Shape = Literal["hexahedron", "tetra"]
Triple = tuple[int, int, int]

MOST = {"hexahedron": 6, "tetra": 6}  # largest degrees: beyond them the exact matrices take seconds

_HEX_CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
_HEX_EDGES = [(0, 1), (1, 2), (3, 2), (0, 3), (4, 5), (5, 6), (7, 6), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)]
_TETRA_CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
_TETRA_EDGES = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]
_TETRA_FACES = [(0, 1, 3), (2, 3, 1), (0, 3, 2), (0, 2, 1)]  # each with the direction in which its nodes go around


@dataclass(frozen=True)
class ElementKind:
    """A kind of elements: a polynomial map of the unit cube, or of the unit tetrahedron, given by its nodes.

    Attributes
    ----------
    shape : str
        "hexahedron" or "tetra".
    degrees : three int
        In the three directions; of tetrahedra all are the same.
    is_serendipity : bool
        Whether a hexahedron of degree 2 has nodes at its corners and edges alone, 20 of them.
    is_bezier : bool
        Whether the nodes are control points rather than points of the element.

    Examples
    --------
    >>> from parameterize.meshes.kinds import kind_named
    >>> kind_named("tetra10").degrees
    (2, 2, 2)
    """

    shape: Shape
    degrees: Triple
    is_serendipity: bool = False
    is_bezier: bool = False

    def __str__(self) -> str:
        name = f"{self.shape}{len(self.lattice)}"
        return f"Bezier {name}" if self.is_bezier else name

    @cached_property
    def lattice(self) -> IntArray:
        """Return the places (nodes, 3) of the nodes: parameters times the degrees, in VTK's order."""
        if self.shape == "tetra":
            return np.array(_tetra_places(self.degrees[0]))[:, 1:]
        places = _hexahedron_places(self.degrees)
        return np.array(places[:20] if self.is_serendipity else places)

    @property
    def corner_count(self) -> int:
        """Return the number of corners, whose nodes come first."""
        return 8 if self.shape == "hexahedron" else 4


def hexahedron(*degrees: int, is_bezier: bool = False) -> ElementKind:
    """Return the hexahedra of one degree, or of three. Raises ValueError for a degree that is not supported."""
    p, q, r = degrees if len(degrees) == 3 else degrees * 3
    _check("hexahedron", (p, q, r))
    return ElementKind("hexahedron", (p, q, r), is_bezier=is_bezier)


def tetra(degree: int, is_bezier: bool = False) -> ElementKind:
    """Return the tetrahedra of a degree. Raises ValueError for a degree that is not supported."""
    _check("tetra", (degree,))
    return ElementKind("tetra", (degree, degree, degree), is_bezier=is_bezier)


def _check(shape: Shape, degrees: Sequence[int]) -> None:
    if not all(1 <= degree <= MOST[shape] for degree in degrees):
        raise ValueError(f"{shape} of degree {max(degrees)}: degrees are 1 to {MOST[shape]}")


SERENDIPITY = ElementKind("hexahedron", (2, 2, 2), is_serendipity=True)


def kind_named(name: str) -> ElementKind:
    """Return a kind by meshio's name, such as "hexahedron20" or "tetra"; raise ValueError for another name."""
    if name == "hexahedron20":
        return SERENDIPITY
    for shape, make in (("hexahedron", hexahedron), ("tetra", tetra)):
        count = name.removeprefix(shape) if name.startswith(shape) else "none"
        for degree in range(1, MOST[shape] + 1):
            if count == str(node_count(shape, degree)) or (count == "" and degree == 1):
                return make(degree)
    raise ValueError(f"{name}: is no hexahedron or tetrahedron that is supported")


def node_count(shape: str, degree: int) -> int:
    """Return how many nodes an element of a degree has."""
    if shape == "hexahedron":
        return (degree + 1) ** 3
    return (degree + 1) * (degree + 2) * (degree + 3) // 6


def _hexahedron_places(degrees: Triple) -> list[Triple]:
    """Return the places of the nodes of a hexahedron: corners, edges, faces, inside, the first direction fastest."""
    inner = [range(1, p) for p in degrees]
    corners = [tuple(a * p for a, p in zip(row, degrees, strict=True)) for row in _HEX_CORNERS]
    places = list(corners)
    for first, last in _HEX_EDGES:
        axis = next(a for a in range(3) if corners[first][a] != corners[last][a])
        places += [tuple(k if a == axis else corners[first][a] for a in range(3)) for k in inner[axis]]
    for axis in range(3):
        a, b = (other for other in range(3) if other != axis)
        for end in (0, degrees[axis]):
            for j, i in product(inner[b], inner[a]):
                row = {axis: end, a: i, b: j}
                places.append((row[0], row[1], row[2]))
    places += [(i, j, k) for k, j, i in product(*reversed(inner))]
    return [(row[0], row[1], row[2]) for row in places]


def _tetra_places(degree: int) -> list[tuple[int, ...]]:
    """Return barycentric places (4,), which sum to the degree, of the nodes of a tetrahedron, layer within layer."""
    if degree == 0:
        return [(0, 0, 0, 0)]
    units = np.eye(4, dtype=int)
    places = [degree * units[k] for k in range(4)]
    for first, last in _TETRA_EDGES:
        places += [(degree - k) * units[first] + k * units[last] for k in range(1, degree)]
    for face in _TETRA_FACES:
        inside = _triangle_places(degree - 3) if degree >= 3 else []
        places += [sum((k + 1) * units[corner] for k, corner in zip(row, face, strict=True)) for row in inside]
    if degree >= 4:
        places += [np.array(row) + 1 for row in _tetra_places(degree - 4)]
    return [tuple(np.asarray(row).tolist()) for row in places]


def _triangle_places(degree: int) -> list[Triple]:
    """Return barycentric places of the nodes of a triangle, layer within layer."""
    if degree == 0:
        return [(0, 0, 0)]
    units = np.eye(3, dtype=int)
    places = [degree * units[k] for k in range(3)]
    for first in range(3):
        places += [(degree - k) * units[first] + k * units[(first + 1) % 3] for k in range(1, degree)]
    if degree >= 3:
        places += [np.array(row) + 1 for row in _triangle_places(degree - 3)]
    return [(int(row[0]), int(row[1]), int(row[2])) for row in places]
