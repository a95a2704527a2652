import numpy as np
import pytest

from parameterize.spline.bspline import evaluate_at, greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume
from solve.discretization.space import embedded, longest_edges, trial_space
from solve.study import benchmark_volume


def box(sizes, n=4, degree=3):
    points = greville(open_uniform_knots(n + degree, degree), degree)
    grid = np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1)
    return BSplineVolume.uniform(grid * np.asarray(sizes), degree)


def volume_with(knots, degree):
    n = len(knots) - degree - 1
    return BSplineVolume((degree,) * 3, (np.asarray(knots, dtype=float),) * 3, np.zeros((n, n, n, 3)))


def test_thirty_control_points_give_27000_and_185193_unknowns():
    volume = BSplineVolume.uniform(np.zeros((30, 30, 30, 3)))
    assert trial_space(volume).dofs == 27_000
    assert trial_space(volume, refine=1).dofs == 185_193
    assert trial_space(volume, refine=1).elements == 54**3


def test_own_degree_keeps_the_knots():
    volume = box((1, 1, 1))
    assert np.array_equal(trial_space(volume).knots[0], volume.knots[0])


def test_higher_degree_keeps_the_smoothness_of_the_map():
    space = trial_space(volume_with([0, 0, 0, 0.5, 1, 1, 1], 2), degree=3)  # C^1 in the middle
    assert np.array_equal(space.knots[0], [0, 0, 0, 0, 0.5, 0.5, 1, 1, 1, 1])


def test_knots_added_by_halving_are_simple():
    space = trial_space(volume_with([0, 0, 0, 0.5, 1, 1, 1], 2), refine=1, degree=3)
    assert np.array_equal(space.knots[2], [0, 0, 0, 0, 0.25, 0.5, 0.5, 0.75, 1, 1, 1, 1])


def test_lower_degree_is_as_smooth_as_it_can_be_but_not_smoother_than_the_map():
    smooth = trial_space(volume_with([0, 0, 0, 0, 0.5, 1, 1, 1, 1], 3), degree=2)
    assert np.array_equal(smooth.knots[0], [0, 0, 0, 0.5, 1, 1, 1])
    kinked = trial_space(volume_with([0, 0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1, 1], 3), degree=2)  # only C^0
    assert np.array_equal(kinked.knots[0], [0, 0, 0, 0.5, 0.5, 1, 1, 1])


def test_one_gauss_point_more_where_the_space_is_only_continuous():
    assert trial_space(box((1, 1, 1))).gauss_points == (3, 3, 3)
    assert trial_space(box((1, 1, 1)), degree=1).gauss_points == (2, 2, 2)
    assert trial_space(volume_with([0, 0, 0, 0.5, 0.5, 1, 1, 1], 2)).gauss_points == (3, 3, 3)


def test_one_gauss_point_more_on_a_single_span():
    assert trial_space(box((1, 1, 1), n=1)).gauss_points == (4, 4, 4)


def test_h_is_the_longest_edge_over_the_mesh():
    volume = box((4.0, 1.0, 0.25))
    assert longest_edges([volume], [trial_space(volume)]) == pytest.approx(1.0)
    assert longest_edges([volume], [trial_space(volume, refine=1)]) == pytest.approx(0.5)


@pytest.mark.parametrize("arguments", [{"refine": -1}, {"degree": 0}])
def test_arguments_out_of_range_are_named(arguments):
    with pytest.raises(ValueError, match=next(iter(arguments))):
        trial_space(box((1, 1, 1)), **arguments)


def test_a_spline_is_the_same_in_a_finer_space():
    volume = benchmark_volume(3)
    coarse, fine = trial_space(volume, 0), trial_space(volume, 2)
    coefficients = np.random.default_rng(0).standard_normal(coarse.shape)
    points = np.random.default_rng(1).random((50, 3))
    same = embedded(coefficients, coarse.degrees, coarse.knots, fine)
    assert same.shape == fine.shape
    expected = evaluate_at(coarse.degrees, coarse.knots, coefficients, points)
    assert np.allclose(evaluate_at(fine.degrees, fine.knots, same, points), expected, atol=1e-13)
    with pytest.raises(ValueError, match="not contained"):
        embedded(same, fine.degrees, fine.knots, coarse)
    with pytest.raises(ValueError, match="not contained"):
        embedded(coefficients, coarse.degrees, coarse.knots, trial_space(volume, 1, degree=4))
