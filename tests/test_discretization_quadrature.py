import numpy as np
import pytest

from solve.discretization.quadrature import gauss_rule
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
