"""Sheets: the directions of patches that interfaces tie, with their ways."""

import numpy as np
from bodies import ring, row_of
from cube_grids import box, plate, two

from parameterize.spline.body import as_body
from parameterize.spline.sheets import Sheets


def test_a_cube_has_three_sheets_and_two_cubes_have_four():
    assert len(Sheets.of(as_body(box((0, 0, 0))))) == 3
    sheets = Sheets.of(two())
    assert sheets.numbers.tolist() == [[0, 1, 2], [3, 1, 2]]
    assert sheets.first.tolist() == [0, 1, 2, 3]
    assert not sheets.flipped.any() and not sheets.mirrored.any()


def test_a_plate_with_a_hole_has_a_sheet_for_each_row_of_cubes():
    assert len(Sheets.of(plate())) == 3 + 3 + 3 - 0 - 2 + 2  # rows beside the hole are two sheets each; w is one


def test_a_direction_that_runs_the_other_way_is_flipped():
    body = row_of([(0, 0, 0), (1, 0, 0)], [((0, 1, 2), (False,) * 3), ((1, 0, 2), (True, False, False))])
    sheets = Sheets.of(body)
    assert sheets.numbers[1, 0] == sheets.numbers[0, 1] and sheets.flipped[1, 0]  # y of the first, reversed
    assert sheets.numbers[1, 2] == sheets.numbers[0, 2] and not sheets.flipped[1, 2]
    assert not sheets.flipped[0].any() and not sheets.mirrored.any()


def test_a_ring_with_half_a_turn_ties_two_sheets_to_themselves_in_reverse():
    assert Sheets.of(ring(3)).mirrored.sum() == 0
    sheets = Sheets.of(ring(3, twist=1.0))
    assert sorted(np.flatnonzero(sheets.mirrored)) == [1, 2]
