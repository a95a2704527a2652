"""Spans that interfaces make one."""

import numpy as np
from block_bodies import uniform_nets

from parameterize.spline.interface import Interface
from parameterize.spline.spline_map import tied_spans


def classes(*spans, interfaces=()):
    return [row.tolist() for row in tied_spans(uniform_nets(*spans, interfaces=interfaces))]


def test_each_span_of_a_cube_is_alone():
    assert classes((2, 1, 3)) == [[0, 1], [2], [3, 4, 5]]


def test_directions_along_an_interface_are_one_and_the_one_across_is_not():
    found = classes((2, 2, 3), (2, 2, 1), interfaces=[Interface((0, "w1"), (1, "w0"))])
    assert found == [[0, 1], [2, 3], [4, 5, 6], [0, 1], [2, 3], [7]]


def test_faces_that_are_swapped_and_flipped_tie_other_spans():
    found = classes((2, 3, 1), (3, 2, 1), interfaces=[Interface((0, "w1"), (1, "w0"), True, (True, False))])
    assert found == [[0, 1], [2, 3, 4], [5], [2, 3, 4], [1, 0], [6]]


def test_a_ring_with_a_half_turn_ties_a_span_to_its_mirror_image():
    ring = [Interface((0, "w1"), (1, "w0")), Interface((1, "w1"), (0, "w0"), flipped=(True, True))]
    assert classes((3, 3, 1), (3, 3, 1), interfaces=ring)[:2] == [[0, 1, 0], [2, 3, 2]]


def test_a_ring_with_a_quarter_turn_ties_both_directions_across():
    ring = [Interface((0, "w1"), (1, "w0")), Interface((1, "w1"), (0, "w0"), True, (True, False))]
    found = classes((2, 2, 1), (2, 2, 2), interfaces=ring)
    assert len(set(np.concatenate([found[0], found[1], found[3], found[4]]).tolist())) == 1
    assert len({*found[2], *found[5]}) == 3
