import numpy as np
import pytest
from block_bodies import rod

from parameterize.quality.own_box import box_lengths
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume


def test_lengths_of_an_affine_block_are_those_of_the_columns_of_its_matrix():
    knots = tuple(open_uniform_knots(n, 3) for n in (5, 6, 8))
    places = np.stack(np.meshgrid(*(greville(row, 3) for row in knots), indexing="ij"), axis=-1)
    matrix = np.array([[2.0, 0.3, 0.0], [0.0, 0.5, 0.4], [0.0, 0.1, 3.0]])
    lengths = box_lengths(BSplineVolume((3, 3, 3), knots, places @ matrix.T + 7.0))
    assert lengths == pytest.approx(np.linalg.norm(matrix, axis=0)[None], rel=1e-12)


def test_lengths_follow_the_directions_of_turned_blocks():
    lengths = box_lengths(rod(7, lengths=(1.0, 2.0, 0.7)).body)
    assert lengths.shape == (3, 3)
    assert lengths[0] == pytest.approx([1.0, 0.5, 0.8])
    assert not np.allclose(lengths[1], [2.0, 0.5, 0.8])  # a direction of the block is another one in space
    assert np.sort(lengths[1]) == pytest.approx([0.5, 0.8, 2.0])
    assert np.sort(lengths[2]) == pytest.approx([0.5, 0.7, 0.8])


def test_the_mean_of_a_derivative_that_varies():
    volume = BSplineVolume.from_function(lambda u, v, w: (u + u**2, v, w * (1.0 + v)), 6)
    assert box_lengths(volume)[0, 0] == pytest.approx(2.0, rel=1e-12)
    assert box_lengths(volume)[0, 2] == pytest.approx(1.5, rel=1e-12)
