"""Makes the blocks of a body that planes bound: the best of its decompositions into hexahedra that is proved."""

from collections.abc import Iterator

import numpy as np

from ...arrays import Array, IntArray
from ...spline.interface import face_layer
from ...spline.volume import FACE_NAMES
from ...surface.geometry import normals_and_areas, signed_volume
from ..complex import MOST_BLOCKS, Complex, is_proved
from .arrangement import arrangement_of
from .cell_merging import merged_cells
from .hexahedra import along_axes, cost, cubes, quality, subdivided
from .polyhedron import Polyhedron, polyhedron_of
from .prisms import prisms

LEAST_QUALITY = 0.1  # of a block: a corner is six degrees from flat, or det J a thousandth of that at another corner
BOX = 1.0 + 1e-9  # the cost of a box, below which there is none
_SAME = 1e-5  # relative: the volume and the area of blocks that fill a body are those of its surface


def exact_blocks(vertices: Array, faces: IntArray, most: int | None = None) -> Complex | None:
    """Return trilinear hexahedra that fill a body whose surface is planes, and are proved one-to-one; None if none.

    vertices: (n, 3), faces: (m, 3), of a closed surface. most: hexahedra, at most. The proof holds for any spans.
    """
    body = polyhedron_of(vertices, faces)
    if body is None:
        return None
    limit = MOST_BLOCKS if most is None else min(most, MOST_BLOCKS)
    good: list[Complex] = []
    for one in filter(len, _decompositions(body, limit)):  # a body may be too thin for any
        if cost(one) <= BOX and _serves(turned := along_axes(one), body):
            return turned
        if quality(one) >= LEAST_QUALITY:
            good.append(one)
    return next((one for one in map(along_axes, sorted(good, key=cost)) if _serves(one, body)), None)


def _serves(blocks: Complex, body: Polyhedron) -> bool:
    """Return whether blocks fill a body, and are proved one-to-one."""
    return _fills(blocks, body) and is_proved(blocks.body)


def _decompositions(body: Polyhedron, most: int) -> Iterator[Complex]:
    """Yield decompositions of a body into `most` hexahedra or fewer: prisms, cells between its planes, parts of them.

    Cells that have the faces of cubes are not divided any more.
    """
    yield from (one for one in prisms(body) if len(one) <= most)
    for beside in (None, "upright", "waist_planes"):
        if (cells := arrangement_of(body, beside)) is None:
            continue
        merged = merged_cells(cells)
        if merged is None or len(merged) > most:
            continue
        if (whole := cubes(cells.points, merged)) is not None:
            yield whole
            continue
        parts = subdivided(cells.points, merged) if sum(len(cell.corners) for cell in merged) <= most else None
        if parts is not None:
            yield parts


def _fills(blocks: Complex, body: Polyhedron) -> bool:
    """Return whether the volume and the outer area of blocks are those of a body, so that no faces are left unglued."""
    volume = signed_volume(body.vertices, body.triangles)
    area = float(normals_and_areas(body.vertices, body.triangles)[1].sum())
    corners = blocks.points[blocks.hexahedra]
    free = [face_layer(corners[k], FACE_NAMES[face]) for k, face in np.argwhere(blocks.exposed)]
    others = sum(_volume(blocks, k) for k in range(len(blocks))), sum(map(_area, free))
    return abs(others[0] - volume) <= _SAME * volume and abs(others[1] - area) <= _SAME * area


def _area(face: Array) -> float:
    """Return the area of a plane quadrangle, corners (2, 2, 3): half of the product of its diagonals."""
    return float(0.5 * np.linalg.norm(np.cross(face[1, 1] - face[0, 0], face[0, 1] - face[1, 0])))


def _volume(blocks: Complex, number: int) -> float:
    """Return the volume of a trilinear hexahedron: the integral of det J, of degree 2 in each direction."""
    places = 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0)
    return float(np.linalg.det(blocks.straight(number).grid_jacobian(places, places, places)).mean())
