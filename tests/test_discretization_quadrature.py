import logging

import numpy as np
import pytest

from parameterize.spline.bspline import collocation, gauss_points, insert_knots, midpoints, open_uniform_knots
from solve.discretization import quadrature
from solve.discretization.quadrature import gauss_rule, operator_rule, spline_rule
from solve.discretization.space import same_smoothness, trial_space
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
    for first, values, functions in gauss_rule(space).tabulate(space.degrees, space.knots):
        assert np.allclose(values[0].sum(axis=1), 1.0, atol=1e-14)
        assert np.allclose(values[1].sum(axis=1), 0.0, atol=1e-12)
        assert np.all(first >= 0) and len(functions) == 4


def test_plane_weights_add_up_to_the_cube(space):
    rule = gauss_rule(space, (2, 3, 4))
    assert rule.plane_weights(0).shape == rule.plane_shape == (16, 12)
    assert sum(rule.plane_weights(q).sum() for q in range(rule.shape[0])) == pytest.approx(1.0)


@pytest.mark.parametrize(("rough", "points"), [(False, 2 * 4 + 1), (True, 11)])
def test_the_operators_rule_has_half_the_dimension_of_the_splines_it_integrates(space, rough, points):
    """Dimension 2 p + (p + 1) (n - 1) of S^(2p-1)_(p-2), and 2 p + 1 + (p + 2) (n - 1) of S^(2p)_(p-2), n = 4 spans."""
    assert operator_rule(space, "spline", rough).shape == (points, points, points)


def test_other_rules_of_the_operator_have_gauss_points(space):
    assert operator_rule(space, "gauss").shape == (12, 12, 12)
    assert operator_rule(space, "gauss+1").shape == (16, 16, 16)
    with pytest.raises(ValueError, match=r"spline, gauss, gauss\+1, got 'simpson'"):
        operator_rule(space, "simpson")


@pytest.mark.parametrize("degree", [1, 2])
def test_directions_that_are_only_continuous_keep_one_gauss_point_more(degree):
    space = trial_space(benchmark_volume(4, degree=1), degree=degree)
    assert operator_rule(space, "spline").shape == gauss_rule(space).shape == (4 * (degree + 1),) * 3


def knots_on(breaks, degree, inner=1):
    repeats = np.full(len(breaks), inner)
    repeats[[0, -1]] = degree + 1
    return np.repeat(breaks, repeats)


def breaks_of(name, spans):
    even = np.linspace(0.0, 1.0, spans + 1)
    sizes = {"uneven": np.random.default_rng(spans).uniform(0.1, 1.0, spans), "jump": np.where(even[1:] > 0.5, 1, 30.0)}
    if name in sizes:
        return np.concatenate([[0.0], np.cumsum(sizes[name])]) / sizes[name].sum()
    return even**3 if name == "graded" else even


def errors(knots, degree, exact, rule):
    """Of the rule in the integrals of all B-splines of degree `exact`, one derivative less smooth than on the knots."""
    fine, (points, weights) = same_smoothness(knots, degree - 1, exact), rule
    return collocation(fine, exact, points).T @ weights - (fine[exact + 1 :] - fine[: -exact - 1]) / (exact + 1)


@pytest.mark.parametrize("degree", range(2, 7))
@pytest.mark.parametrize("raised", [-1, 0, 1])
@pytest.mark.parametrize("spans", [1, 2, 3, 4, 5, 14])
@pytest.mark.parametrize("kind", ["even", "uneven", "jump"])
def test_the_rule_is_exact_with_positive_weights_and_half_the_points(kind, spans, degree, raised):
    knots, exact = knots_on(breaks_of(kind, spans), degree), 2 * degree + raised
    points, weights = spline_rule(knots, degree, exact)
    assert np.abs(errors(knots, degree, exact, (points, weights))).max() < 1e-13
    assert weights.min() > 0.0
    assert points[0] > 0.0 and points[-1] < 1.0 and np.all(np.diff(points) > 0.0)
    dimension = len(same_smoothness(knots, degree - 1, exact)) - exact - 1
    assert dimension <= 2 * len(points) <= dimension + 7


@pytest.mark.parametrize(("degree", "exact"), [(2, 4), (3, 5), (3, 6), (6, 13)])
def test_many_spans_take_no_more_points_than_needed(degree, exact):
    knots = knots_on(breaks_of("uneven", 400), degree)
    rule = spline_rule(knots, degree, exact)
    assert np.abs(errors(knots, degree, exact, rule)).max() < 1e-13
    assert 2 * len(rule[0]) <= len(same_smoothness(knots, degree - 1, exact)) - exact - 1 + 3


@pytest.mark.parametrize(("degree", "exact"), [(2, 4), (3, 5), (3, 6), (6, 13)])
def test_strongly_graded_repeated_and_halved_knots(degree, exact):
    graded = knots_on(breaks_of("graded", 14), degree)
    repeated = knots_on(np.linspace(0.0, 1.0, 6), degree, inner=degree - 1)
    halved, _ = insert_knots(repeated, degree, midpoints(repeated))
    for knots in (graded, repeated, halved):
        assert np.abs(errors(knots, degree, exact, spline_rule(knots, degree, exact))).max() < 1e-13


@pytest.mark.parametrize("degree", range(2, 7))
@pytest.mark.parametrize("spans", [1, 2, 3, 4, 6, 7, 8, 12])
@pytest.mark.parametrize("raised", [-1, 0])
def test_equal_spans_give_a_symmetric_rule(spans, degree, raised):
    points, weights = spline_rule(open_uniform_knots(spans + degree, degree), degree, 2 * degree + raised)
    np.testing.assert_allclose(points, 1.0 - points[::-1], rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(weights, weights[::-1], rtol=0.0, atol=1e-11)


def test_a_single_span_has_the_rule_of_gauss():
    points, weights = gauss_points(open_uniform_knots(4, 3), 3)
    for found, wanted in zip(spline_rule(open_uniform_knots(4, 3), 3, 5), (points, weights), strict=True):
        np.testing.assert_allclose(found, wanted.ravel(), rtol=0.0, atol=1e-14)


def test_the_rule_lies_on_the_interval_of_the_knots():
    knots = open_uniform_knots(9, 3)
    points, weights = spline_rule(knots, 3, 5)
    moved, scaled = spline_rule(2.0 + 5.0 * knots, 3, 5)
    np.testing.assert_allclose(moved, 2.0 + 5.0 * points, rtol=1e-13)
    np.testing.assert_allclose(scaled, 5.0 * weights, rtol=1e-11)


def test_without_convergence_every_span_has_the_rule_of_gauss(monkeypatch, caplog):
    monkeypatch.setattr(quadrature, "MAX_STEPS", 2)
    knots = knots_on(breaks_of("uneven", 7), 3)
    knots[4] *= 0.99  # a knot vector that no other test has left in the cache
    with caplog.at_level(logging.WARNING):
        points, weights = spline_rule(knots, 3, 6)
    assert "Gauss on every span" in caplog.text
    wanted = gauss_points(knots, 4)
    np.testing.assert_array_equal(points, wanted[0].ravel())
    np.testing.assert_array_equal(weights, wanted[1].ravel())
    assert np.abs(errors(knots, 3, 6, (points, weights))).max() < 1e-15


@pytest.mark.parametrize("knots", [knots_on(np.linspace(0.0, 1.0, 5), 1), np.array([0, 0, 0, 0.2, 0.5, 0.5, 1, 1, 1])])
def test_where_splines_are_only_continuous_every_span_has_one_point_more_than_the_degree(knots):
    degree = int(np.sum(knots == 0.0)) - 1
    points, weights = gauss_points(knots, degree + 1)
    for exact in (2 * degree - 1, 2 * degree):
        assert np.array_equal(spline_rule(knots, degree, exact)[0], points.ravel())
        assert np.array_equal(spline_rule(knots, degree, exact)[1], weights.ravel())


def test_a_rule_is_computed_once():
    knots = open_uniform_knots(12, 3)
    assert spline_rule(knots, 3, 5)[0] is spline_rule(knots.copy(), 3, 5)[0]
