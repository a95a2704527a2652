import numpy as np
import pytest

from solve.discretization.quadrature import gauss_rule, operator_rule
from solve.discretization.space import trial_space
from solve.study import benchmark_volume


@pytest.fixture(scope="module")
def space():
    return trial_space(benchmark_volume(4))


def test_rule_integrates_polynomials_of_degree_2g_minus_1(space):
    rule = gauss_rule(space, (2, 3, 4))
    for points, weights, count in zip(rule.points, rule.weights, (2, 3, 4), strict=True):
        for power in range(2 * count):
            assert weights @ points**power == pytest.approx(1.0 / (power + 1), abs=1e-14)


def test_rule_is_not_exact_beyond(space):
    rule = gauss_rule(space, (2, 2, 2))
    assert abs(rule.weights[0] @ rule.points[0] ** 4 - 0.2) > 1e-6


def test_tables_sum_to_one_and_their_derivatives_to_zero(space):
    for table in gauss_rule(space).tabulate(space.degrees, space.knots):
        assert np.allclose(table.values[0].sum(axis=1), 1.0, atol=1e-14)
        assert np.allclose(table.values[1].sum(axis=1), 0.0, atol=1e-12)
        assert np.all(table.first >= 0)


def test_plane_weights_add_up_to_the_cube(space):
    rule = gauss_rule(space, (2, 3, 4))
    assert rule.plane_weights(0).shape == rule.plane_shape == (16, 12)
    assert sum(rule.plane_weights(q).sum() for q in range(rule.shape[0])) == pytest.approx(1.0)


@pytest.mark.parametrize(("rough", "points"), [(False, 2 * 4 + 1), (True, 11)])
def test_the_operators_rule_has_half_the_dimension_of_the_splines_it_integrates(space, rough, points):
    """Dimension 2 p + (p + 1) (n - 1) of S^(2p-1)_(p-2), and 2 p + 1 + (p + 2) (n - 1) of S^(2p)_(p-2), n = 4 spans."""
    assert operator_rule(space, rough=rough).shape == (points, points, points)


def test_other_rules_of_the_operator_have_gauss_points(space):
    assert operator_rule(space, "gauss").shape == (12, 12, 12)
    assert operator_rule(space, "gauss+1").shape == (16, 16, 16)
    with pytest.raises(ValueError, match=r"spline, gauss, gauss\+1, got 'simpson'"):
        operator_rule(space, "simpson")


@pytest.mark.parametrize("degree", [1, 2])
def test_directions_that_are_only_continuous_keep_one_gauss_point_more(degree):
    space = trial_space(benchmark_volume(4, degree=1), degree=degree)
    assert operator_rule(space).shape == gauss_rule(space).shape == (4 * (degree + 1),) * 3


def test_groups_hold_the_points_between_two_breakpoints_in_order(space):
    table = operator_rule(space).tabulate(space.degrees, space.knots)[0]
    groups = table.grouped()
    assert len(groups.points) == 3 and len(groups.functions) == 4
    seen = [np.arange(start, start + length) for start, length in zip(groups.start, groups.length, strict=True)]
    assert np.array_equal(np.concatenate(seen), np.arange(len(table.first)))
    for group, points in enumerate(seen):
        assert np.all(table.first[points] == groups.first[group])
        assert np.array_equal(groups.values[group, : len(points)], table.values[:, points].transpose(1, 0, 2))
        assert not groups.values[group, len(points) :].any()
