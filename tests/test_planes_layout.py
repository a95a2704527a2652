"""Exact blocks of bodies that planes bound."""

import numpy as np
import pytest
from plane_bodies import BODIES, arrays, blocks_of, box, prism, ring
from shapes import rounded_cube

from parameterize.surface.nearest import distance_to_mesh

FACES = {(axis, side): 2 * axis + side for axis in range(3) for side in (0, 1)}
EVEN = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 5)] * 2), axis=-1).reshape(-1, 2)


def outside(blocks):
    """Points on the faces of blocks that are not glued, (n, 3)."""
    found = []
    for k, free in enumerate(blocks.exposed):
        for (axis, side), number in FACES.items():
            if free[number]:
                found.append(blocks.straight(k)(np.insert(EVEN, axis, float(side), axis=1)))
    return np.concatenate(found)


def edges_of(blocks):
    """The edges of all blocks, as pairs of ends rounded to 9 digits."""
    found = set()
    for corners in blocks.points[blocks.hexahedra].round(9):
        for axis in range(3):
            for one, other in np.moveaxis(corners, axis, 0).reshape(2, 4, 3).swapaxes(0, 1):
                found.add(frozenset((tuple(one), tuple(other))))
    return found


@pytest.mark.parametrize("name", BODIES)
def test_the_blocks_of_a_body_lie_on_its_faces(name):
    vertices, faces = arrays(name)
    blocks = blocks_of(vertices, faces)
    assert len(blocks) == BODIES[name][1]
    points = outside(blocks)
    assert distance_to_mesh(points, vertices, faces).max() < 1e-13 * np.linalg.norm(np.ptp(vertices, axis=0))
    corners = np.unique(blocks.points[blocks.hexahedra].reshape(-1, 3).round(9), axis=0)
    gaps = np.linalg.norm(vertices[:, None] - corners[None], axis=2).min(axis=1)
    assert gaps.max() < 1e-9  # each corner of the body is one of a block


def test_the_edges_of_one_block_are_the_edges_of_the_body():
    vertices, faces = arrays(box((0, 0, 0), (1, 2, 3)))
    block = blocks_of(vertices, faces, most=1)
    (corners,) = block.points[block.hexahedra]
    assert np.linalg.norm(corners[1, 0, 0] - corners[0, 0, 0]) == 1.0
    assert block.spans.tolist() == [[3, 7, 10]]  # spans are about equally long
    assert len(edges_of(blocks_of(vertices, faces))) == 12
    assert corners[0, 0, 0].tolist() == [0.0, 0.0, 0.0] and corners[1, 1, 1].tolist() == [1.0, 2.0, 3.0]  # as x, y, z


def test_a_finely_meshed_surface_has_the_same_blocks(monkeypatch):
    vertices, faces = arrays(BODIES["L"][0]().refine(6))
    assert len(faces) > 500 and len(blocks_of(vertices, faces)) == 3


def test_numbers_in_single_precision_do():
    vertices, faces = arrays(BODIES["L"][0]().rotate((20.0, 35.0, 50.0)).refine(3))
    rounded = vertices.astype(np.float32).astype(np.float64)
    blocks = blocks_of(rounded, faces)
    assert len(blocks) == 3 and distance_to_mesh(outside(blocks), vertices, faces).max() < 1e-6


def test_a_block_below_a_pyramid_is_cut_upright():
    blocks = blocks_of(*arrays("flat pyramid on a block"))
    boxes = blocks.points[blocks.hexahedra].reshape(-1, 8, 3)
    assert sum(len(np.unique(corners.round(9), axis=0)) == 8 and np.ptp(corners[:, 2]) == 1.0 for corners in boxes) == 9
    assert {tuple(np.unique(corners[:, 0].round(9))) for corners in boxes} >= {(-1.0, -0.6), (-0.6, 0.6), (0.6, 1.0)}


def test_bodies_without_exact_blocks_have_none():
    shaft = prism(ring(80, 1.0), 1.0)  # too round
    assert blocks_of(*arrays(shaft)) is None
    assert blocks_of(*rounded_cube(200)) is None


@pytest.mark.parametrize("height", [1e-6, 1e-3])
def test_a_thin_plate_over_a_triangle_is_no_crash(height):
    """Its cells may all be merged away."""
    blocks = blocks_of(*arrays(prism(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]), height)))
    assert blocks is None or len(blocks) == 3


def test_no_more_blocks_than_are_allowed():
    vertices, faces = arrays("U")
    assert len(blocks_of(vertices, faces, most=3)) == 3  # with two mitres
    assert blocks_of(vertices, faces, most=2) is None
