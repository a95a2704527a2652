import logging

import numpy as np
import pytest

from parameterize.spline.bspline import collocation, gauss_points, insert_knots, midpoints, open_uniform_knots
from solve.discretization import spline_quadrature
from solve.discretization.spline_quadrature import integrated_knots, spline_rule


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
    fine, (points, weights) = integrated_knots(knots, degree, exact), rule
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
    dimension = len(integrated_knots(knots, degree, exact)) - exact - 1
    assert dimension <= 2 * len(points) <= dimension + 7


@pytest.mark.parametrize(("degree", "exact"), [(2, 4), (3, 5), (3, 6), (6, 13)])
def test_many_spans_take_no_more_points_than_needed(degree, exact):
    knots = knots_on(breaks_of("uneven", 400), degree)
    rule = spline_rule(knots, degree, exact)
    assert np.abs(errors(knots, degree, exact, rule)).max() < 1e-13
    assert 2 * len(rule[0]) <= len(integrated_knots(knots, degree, exact)) - exact - 1 + 3


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
    monkeypatch.setattr(spline_quadrature, "MAX_STEPS", 2)
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
