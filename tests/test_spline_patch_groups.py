"""Tests of parameterize.spline.patch_groups."""

from dataclasses import replace

import numpy as np

from iga_nn import Body, BSplineVolume


def shifted(offset, degree=2, control_points=4):
    return BSplineVolume.from_function(lambda u, v, w: (u + offset, v, w), control_points, degree)


def test_patches_of_equal_degrees_and_knots_are_one_group():
    rational = replace(shifted(8), weights=np.linspace(1.0, 2.0, 64).reshape(4, 4, 4))
    other_knots = replace(shifted(10), knots=(np.array([0, 0, 0, 0.25, 1, 1, 1]), *shifted(10).knots[1:]))
    body = Body((shifted(0), shifted(2, 3), shifted(4), rational, shifted(6, 2, 5), other_knots, shifted(12)))
    assert [group.numbers.tolist() for group in body.groups] == [[0, 2, 6], [1], [3], [4], [5]]
    for group in body.groups:
        for row, number in enumerate(group.numbers):
            patch = body.patches[number]
            assert group.degrees == patch.degrees and group.shape == patch.shape
            np.testing.assert_array_equal(group.control_points[row], patch.control_points)
            if patch.weights is None:
                assert group.weights is None
            else:
                np.testing.assert_array_equal(group.weights[row], patch.weights)


def test_groups_are_made_once():
    body = Body((shifted(0),))
    assert body.groups is body.groups
    assert len(body.groups[0]) == 1
