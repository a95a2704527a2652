"""Makes the blocks of a body that planes bound: the best of its divisions into hexahedra that is proved."""

from collections.abc import Iterator
from weakref import WeakKeyDictionary

import numpy as np

from ...arrays import Array, IntArray
from ...certificate.body import certify
from ...certificate.boundary import check_boundary
from ...spline.body import Body
from ...spline.bspline import open_uniform_knots
from ...spline.spline_map import ControlNets, tied_spans
from ...spline.volume import FACE_NAMES
from ...surface.geometry import normals_and_areas, signed_volume
from ...surface.surface import Surface
from ...threads import one_blas_thread
from ..rods.along_skeleton import Block, BlockLayout
from .arrangement import arrangement_of
from .hexahedra import Hexahedra, cubes, subdivided
from .polyhedron import Polyhedron, polyhedron_of
from .prisms import columns
from .sheets import merged_cells

MOST_BLOCKS = 150  # a body that needs more is not made of blocks
LEAST_QUALITY = 0.1  # of a block: a corner is six degrees from flat, or det J a thousandth of that at another corner
_SAME = 1e-5  # relative: the volume and the area of blocks that fill a body are those of its surface
FEWEST_SPANS = 2  # along an edge of a block
_known: WeakKeyDictionary[Surface, dict[int | None, Hexahedra | None]] = WeakKeyDictionary()  # by most blocks
_LONGEST = 4  # times the spans of a block that is a cube: those along one direction, at most


def division_of(surface: Surface, most: int | None = None) -> Hexahedra | None:
    """Return the hexahedra that fill the body of a surface at volume 1, as `hexahedra_of` does; None if none.

    They are found once for a surface: the estimate of a run asks for them, too.
    """
    known = _known.setdefault(surface, {})
    if most not in known:
        with one_blas_thread():
            points = surface.to_unit(surface.vertices)
            known[most] = None if len(surface.crossings) else hexahedra_of(points, surface.faces, most)
    return known[most]


def hexahedra_of(vertices: Array, faces: IntArray, most: int | None = None) -> Hexahedra | None:
    """Return trilinear hexahedra that fill a body whose surface is planes, and are proved one-to-one; None if none.

    vertices: (n, 3), faces: (m, 3), of a closed surface. most: hexahedra, at most. The proof holds for any spans.
    """
    body = polyhedron_of(vertices, faces)
    if body is None:
        return None
    limit = MOST_BLOCKS if most is None else min(most, MOST_BLOCKS)
    found = [one for one in _divisions(body, limit) if one.quality >= LEAST_QUALITY]
    for one in sorted(found, key=lambda one: one.cost):
        layout = layout_of(one, FEWEST_SPANS)
        if _fills(layout, body) and _is_proved(layout):
            return one
    return None


def _divisions(body: Polyhedron, most: int) -> Iterator[Hexahedra]:
    """Yield the divisions of a body into `most` hexahedra or fewer: columns, cells between its planes, parts of them.

    Cells that have the faces of cubes are not divided any more.
    """
    yield from (found for found in columns(body) if len(found) <= most)
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


def layout_of(found: Hexahedra, spans: int) -> BlockLayout:
    """Return hexahedra as blocks, with spans along their edges that are about equally long.

    spans: across a block that is a cube.
    """
    rows = found.points[found.turned().corners]  # (k, 2, 2, 2, 3)
    plain = BlockLayout.from_blocks([_block(k, one, (1, 1, 1)) for k, one in enumerate(rows)])
    lengths = np.stack([np.linalg.norm(np.diff(rows, axis=1 + a), axis=-1).mean(axis=(1, 2, 3)) for a in range(3)], 1)
    counts = balanced_spans(plain, lengths, spans, np.full(lengths.shape, FEWEST_SPANS))
    pairs = zip(rows, counts.tolist(), strict=True)
    blocks = [_block(k, one, (u, v, w)) for k, (one, (u, v, w)) in enumerate(pairs)]
    return BlockLayout(tuple(blocks), plain.interfaces)


def balanced_spans(plain: BlockLayout, lengths: Array, spans: int, fewest: IntArray) -> IntArray:
    """Return the spans (k, 3) of blocks that are glued, in proportion to the mean lengths (k, 3) of their edges.

    plain: the blocks with one span a direction. spans: of a cube as large as the mean block; along one direction there
    are at most _LONGEST times as many. fewest: in each direction of each block (k, 3), where these are not more.
    """
    knots = (open_uniform_knots(2, 1),) * 3
    classes = np.concatenate(tied_spans(ControlNets(1, (knots,) * len(plain), plain.interfaces)))
    means = np.bincount(classes, lengths.ravel()) / np.bincount(classes)
    least = np.zeros(len(means), dtype=int)
    np.maximum.at(least, classes, fewest.ravel())
    counts = np.clip(np.round(means / (_mean_edge(lengths) / spans)), least, _LONGEST * spans).astype(int)
    return np.asarray(counts[classes].reshape(-1, 3))


def _mean_edge(lengths: Array) -> float:
    """Return the edge of a cube as large as the mean block, from the mean lengths (k, 3) of its edges."""
    return float(np.cbrt(lengths.prod(axis=1).mean()))


def _block(number: int, corners: Array, spans: tuple[int, int, int]) -> Block:
    """Return a hexahedron (2, 2, 2, 3), [u][v][w], as a block."""
    return Block(f"piece {number}", np.moveaxis(corners, 2, 0), spans)


def _fills(layout: BlockLayout, body: Polyhedron) -> bool:
    """Return whether the volume and the outer area of blocks are those of a body, so that no faces are left unglued."""
    volume = signed_volume(body.vertices, body.triangles)
    area = float(normals_and_areas(body.vertices, body.triangles)[1].sum())
    free = [
        block.face(name)
        for block, row in zip(layout.blocks, layout.exposed, strict=True)
        for name in np.array(FACE_NAMES)[row].tolist()
    ]
    others = sum(_volume(block) for block in layout.blocks), sum(map(_area, free))
    return abs(others[0] - volume) <= _SAME * volume and abs(others[1] - area) <= _SAME * area


def _area(face: Array) -> float:
    """Return the area of a plane quadrangle, corners (2, 2, 3): half of the product of its diagonals."""
    return float(0.5 * np.linalg.norm(np.cross(face[1, 1] - face[0, 0], face[0, 1] - face[1, 0])))


def _volume(block: Block) -> float:
    """Return the volume of a trilinear block: the integral of det J, of degree 2 in each direction."""
    places = 0.5 + np.array([-1.0, 1.0]) / np.sqrt(12.0)
    return float(np.linalg.det(block.spline.grid_jacobian(places, places, places)).mean())


def _is_proved(layout: BlockLayout) -> bool:
    """Return whether blocks are certified and their boundary is proved not to meet itself."""
    splines = tuple(block.spline for block in layout.blocks)
    body = Body(splines, layout.interfaces)
    return certify(body).verdict == "certified" and check_boundary(body).injective is True
