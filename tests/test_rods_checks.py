"""Pieces that are folded."""

import numpy as np
import pytest

from parameterize.layouts.rods.rods import folded

SQUARE = np.array([[[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]])  # corners [u][v]
UP = np.array([0.0, 0.0, 1.0])


def test_straight_and_tapered_pieces_are_not_folded_and_mirrored_ones_are():
    sections = np.array([SQUARE, SQUARE + UP, 0.5 * SQUARE + 2 * UP])
    assert folded(sections).tolist() == [False, False]
    assert folded(sections[::-1]).tolist() == [True, True]


@pytest.mark.parametrize(("tilt", "expected"), [(0.8, False), (1.2, True)])
def test_a_section_that_is_tilted_through_its_neighbour_is_folded(tilt, expected):
    tilted = SQUARE + UP + tilt * (SQUARE - 0.5)[..., :1] * 2 * UP
    assert folded(np.array([SQUARE, tilted])).tolist() == [expected]


def test_a_piece_that_is_positive_at_its_corners_may_be_folded_inside():
    turned = (SQUARE - 0.5) @ np.array([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]])  # by half a turn
    assert folded(np.array([SQUARE - 0.5, turned + UP])).tolist() == [True]
