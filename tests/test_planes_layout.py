"""Exact blocks of bodies that planes bound."""

import numpy as np
import pytest
from plane_bodies import BODIES, arrays, box, exact_layout, prism, ring
from shapes import rounded_cube

from parameterize.spline.volume import FACE_NAMES
from parameterize.surface.nearest import distance_to_mesh

FACES = {(axis, side): 2 * axis + side for axis in range(3) for side in (0, 1)}
EVEN = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 5)] * 2), axis=-1).reshape(-1, 2)


def outside(layout):
    """Points on the faces of blocks that are not glued, (n, 3)."""
    found = []
    for block, free in zip(layout.blocks, layout.exposed, strict=True):
        for (axis, side), number in FACES.items():
            if free[number]:
                found.append(block.points(np.insert(EVEN, axis, float(side), axis=1)))
    return np.concatenate(found)


def edges_of(layout):
    """The edges of all blocks, as pairs of ends rounded to 9 digits."""
    found = set()
    for block in layout.blocks:
        corners = np.moveaxis(block.sections, 0, 2).round(9)
        for axis in range(3):
            for one, other in np.moveaxis(corners, axis, 0).reshape(2, 4, 3).swapaxes(0, 1):
                found.add(frozenset((tuple(one), tuple(other))))
    return found


@pytest.mark.parametrize("name", BODIES)
def test_the_blocks_of_a_body_lie_on_its_faces(name):
    vertices, faces = arrays(name)
    layout = exact_layout(vertices, faces)
    assert len(layout) == BODIES[name][1]
    points = outside(layout)
    assert distance_to_mesh(points, vertices, faces).max() < 1e-13 * np.linalg.norm(np.ptp(vertices, axis=0))
    corners = np.unique(layout.corners.round(9), axis=0)
    gaps = np.linalg.norm(vertices[:, None] - corners[None], axis=2).min(axis=1)
    assert gaps.max() < 1e-9  # each corner of the body is one of a block


def test_the_edges_of_one_block_are_the_edges_of_the_body():
    vertices, faces = arrays(box((0, 0, 0), (1, 2, 3)))
    (block,) = exact_layout(vertices, faces, most=1).blocks
    sides = np.linalg.norm(block.face("w0")[1, 0] - block.face("w0")[0, 0]), block.spans
    assert sides == (1.0, (3, 7, 10))  # spans are about equally long
    assert len(edges_of(exact_layout(vertices, faces))) == 12
    assert [block.face(name)[0, 0].tolist() for name in FACE_NAMES[::2]] == [[0.0, 0.0, 0.0]] * 3  # u, v, w are x, y, z


def test_a_finely_meshed_surface_has_the_same_blocks(monkeypatch):
    vertices, faces = arrays(BODIES["L"][0]().refine(6))
    assert len(faces) > 500 and len(exact_layout(vertices, faces)) == 3


def test_numbers_in_single_precision_do():
    vertices, faces = arrays(BODIES["L"][0]().rotate((20.0, 35.0, 50.0)).refine(3))
    rounded = vertices.astype(np.float32).astype(np.float64)
    layout = exact_layout(rounded, faces)
    assert len(layout) == 3 and distance_to_mesh(outside(layout), vertices, faces).max() < 1e-6


def test_a_block_below_a_pyramid_is_cut_upright():
    layout = exact_layout(*arrays("flat pyramid on a block"))
    boxes = [np.moveaxis(block.sections, 0, 2).reshape(8, 3) for block in layout.blocks]
    assert sum(len(np.unique(corners.round(9), axis=0)) == 8 and np.ptp(corners[:, 2]) == 1.0 for corners in boxes) == 9
    assert {tuple(np.unique(corners[:, 0].round(9))) for corners in boxes} >= {(-1.0, -0.6), (-0.6, 0.6), (0.6, 1.0)}


def test_bodies_without_exact_blocks_have_none():
    shaft = prism(ring(80, 1.0), 1.0)  # too round
    assert exact_layout(*arrays(shaft)) is None
    assert exact_layout(*rounded_cube(200)) is None


def test_no_more_blocks_than_are_allowed():
    vertices, faces = arrays("U")
    assert len(exact_layout(vertices, faces, most=3)) == 3  # with two mitres
    assert exact_layout(vertices, faces, most=2) is None
