"""Blocks glued by whole faces: what a layout says of itself, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest
from block_starts import double_torus, torus

from parameterize.layouts.rods.along_skeleton import Block, BlockLayout
from parameterize.spline.interface import Interface

CUBE = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1).transpose(2, 0, 1, 3)  # [w][u][v]


def test_a_block_is_bilinear_across_and_linear_between_its_sections():
    bent = np.concatenate([CUBE, CUBE[1:] + [0.5, 0.0, 1.0]])
    block = Block("rod", bent, (2, 3, 4))
    places = np.array([[0.25, 0.75, 0.0], [0.5, 0.5, 0.5], [0.5, 0.5, 0.75], [1.0, 1.0, 1.0]])
    expected = [[0.25, 0.75, 0.0], [0.5, 0.5, 1.0], [0.75, 0.5, 1.5], [1.5, 1.0, 2.0]]
    assert np.allclose(block.points(places), expected, atol=1e-15)
    assert block.face("u1").shape == (2, 3, 3) and block.face("w0").shape == (2, 2, 3)
    assert np.array_equal(block.face("v0")[1, 2], bent[2, 1, 0])


def test_faces_with_the_same_corners_are_glued_in_any_turn():
    beside = np.rot90(CUBE + [1.0, 0.0, 0.0], axes=(1, 2))  # u along -y, v along x
    layout = BlockLayout.from_blocks([Block("first", CUBE, (2, 2, 2)), Block("second", beside, (2, 2, 2))])
    (interface,) = layout.interfaces
    assert (interface.first, interface.second) == ((0, "u1"), (1, "v0")) and interface.flipped == (True, False)
    assert layout.exposed.sum() == 10 and not layout.exposed[0, 1] and not layout.exposed[1, 2]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"spans": (2, 3, 2)}, "the spans along the two faces differ"),
        ({"sections": CUBE + [1.0, 1e-15, 0.0]}, "the corners of the two faces differ"),
    ],
)
def test_glued_faces_have_the_same_corners_and_spans(change, message):
    first, second = Block("first", CUBE, (2, 2, 2)), Block("second", CUBE + [1.0, 0.0, 0.0], (2, 2, 2))
    glued = (Interface((0, "u1"), (1, "u0")),)
    BlockLayout((first, second), glued)
    with pytest.raises(ValueError, match=message):
        BlockLayout((first, replace(second, **change)), glued)
    with pytest.raises(ValueError, match="p0_u1 is glued twice"):
        BlockLayout((first, second), glued * 2)


def test_sections_and_spans_are_refused():
    with pytest.raises(ValueError, match=r"block rod: sections must be \(m >= 2, 2, 2, 3\)"):
        Block("rod", CUBE[:1], (2, 2, 2))
    with pytest.raises(ValueError, match="one span or more"):
        Block("rod", CUBE, (2, 0, 2))


def test_starts_by_hand_leave_a_surface_of_their_genus():
    ring, *_ = torus()
    assert len(ring) == 4 and len(ring.interfaces) == 4 and ring.exposed.sum() == 16
    pair, *_ = double_torus()
    assert [block.name for block in pair.blocks] == ["left", "junction", "right"]
    assert pair.exposed.sum(axis=1).tolist() == [4, 2, 4]
