"""B-splines against SciPy's, and by the identities that define them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from parameterize.spline.bspline import (
    apply_along,
    basis_derivatives,
    breakpoints,
    check_knots,
    collocation,
    divided_spans,
    evaluate_at,
    evaluate_grid,
    find_spans,
    gauss_points,
    greville,
    insert_knots,
    insertion_into,
    midpoints,
    open_uniform_knots,
)

UNEVEN = {p: np.concatenate([np.zeros(p + 1), [0.2, 0.5, 0.55], np.ones(p + 1)]) for p in (1, 2, 3, 4)}
REPEATED = np.array([0.0, 0.0, 0.0, 0.0, 0.3, 0.6, 0.6, 1.0, 1.0, 1.0, 1.0])  # cubic, C^1 at 0.6


def test_open_uniform_knots():
    np.testing.assert_allclose(open_uniform_knots(5, 3), [0, 0, 0, 0, 0.5, 1, 1, 1, 1])
    assert len(open_uniform_knots(30, 3)) == 34 and len(breakpoints(open_uniform_knots(30, 3))) == 28


@pytest.mark.parametrize(("n", "degree"), [(3, 3), (5, 0), (1, 1), (5, 2.0), (5, "3"), (5, None)])
def test_open_uniform_knots_needs_enough_control_points(n, degree):
    with pytest.raises(ValueError, match="degree"):
        open_uniform_knots(n, degree)


@pytest.mark.parametrize(
    ("knots", "degree", "message"),
    [
        ([0, 0, 1, 1], 0, "degree must be at least 1, got 0"),
        ([0, 0, 1], 1, "at least 4 knots"),
        ([[0, 0, 1, 1]], 1, "in one row"),
        ([0, 0, np.nan, 1, 1], 1, "finite"),
        ([0, 0, 0.6, 0.5, 1, 1], 1, "non-decreasing"),
        ([0, 0.1, 0.5, 1, 1], 1, "not open"),
        ([0, 0, 0.5, 0.9, 1], 1, "not open"),
        ([1, 1, 1, 1], 1, "not open"),
        ([0, 0, 0.5, 0.5, 1, 1], 1, "repeated more than 1 times"),
    ],
)
def test_bad_knots_are_refused(knots, degree, message):
    with pytest.raises(ValueError, match=message):
        check_knots(knots, degree)


def test_good_knots_are_returned_as_floats():
    assert check_knots([0, 0, 1, 1], 1).dtype == np.float64
    check_knots(REPEATED, 3)


def test_spans_are_half_open_and_the_last_is_closed():
    knots = open_uniform_knots(5, 3)  # breaks 0, 1/2, 1
    assert find_spans(knots, 3, [0.0, 0.49, 0.5, 0.99, 1.0]).tolist() == [3, 3, 4, 4, 4]
    assert find_spans(REPEATED, 3, [0.6, np.nextafter(0.6, 0.0)]).tolist() == [6, 4]


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_basis_and_derivatives_agree_with_scipy(degree, order):
    knots = UNEVEN[degree]
    x = np.concatenate([np.linspace(0.0, 1.0, 41), [0.2, 0.55]])
    n = len(knots) - degree - 1
    reference = BSpline(knots, np.eye(n), degree)(x, nu=order)
    inside = x < 1.0  # SciPy takes derivatives at the end from the right; compare values only there
    ours = collocation(knots, degree, x, order).toarray()
    np.testing.assert_allclose(ours[inside], reference[inside], rtol=1e-12, atol=1e-10)


def test_repeated_knots_agree_with_scipy():
    x = np.linspace(0.0, 0.999, 50)
    reference = BSpline(REPEATED, np.eye(7), 3)
    for order in range(3):
        ours = collocation(REPEATED, 3, x, order).toarray()
        np.testing.assert_allclose(ours, reference(x, nu=order), atol=1e-10)


def test_derivatives_above_the_degree_vanish():
    _, values = basis_derivatives(UNEVEN[2], 2, [0.1, 0.7], 4)
    assert values.shape == (5, 2, 3)
    assert np.all(values[3:] == 0.0) and np.any(values[2] != 0.0)


@settings(max_examples=50, deadline=None)
@given(st.integers(1, 4), st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_partition_of_unity(degree, x):
    _, values = basis_derivatives(UNEVEN[degree], degree, x, 2)
    assert np.all(values[0] >= 0.0)
    np.testing.assert_allclose(values[0].sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(values[1:].sum(axis=2), 0.0, atol=1e-10)


def test_outside_points_continue_the_last_polynomial():
    knots = open_uniform_knots(6, 3)
    first, values = basis_derivatives(knots, 3, [-0.25, 1.5])
    assert first.tolist() == [0, 2]
    points = greville(knots, 3)
    np.testing.assert_allclose([values[0, i] @ points[f : f + 4] for i, f in enumerate(first)], [-0.25, 1.5])


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_greville_points_give_the_identity(degree):
    knots = UNEVEN[degree]
    x = np.linspace(0.0, 1.0, 17)
    np.testing.assert_allclose(collocation(knots, degree, x) @ greville(knots, degree), x, atol=1e-14)
    np.testing.assert_allclose(collocation(knots, degree, x, 1) @ greville(knots, degree), 1.0, atol=1e-12)


def test_gauss_points_integrate_polynomials_exactly():
    points, weights = gauss_points(UNEVEN[3], 3)
    assert points.shape == weights.shape == (4, 3)
    for power in range(6):
        assert np.sum(weights * points**power) == pytest.approx(1.0 / (power + 1), rel=1e-14)
    assert np.sum(weights * points**6) != pytest.approx(1.0 / 7.0, rel=1e-10)


@pytest.mark.parametrize("new", [[0.1], [0.5, 0.5], [0.9, 0.1, 0.2], [0.1, 0.3, 0.52, 0.7]])
@pytest.mark.parametrize("degree", [2, 3])
def test_knot_insertion_leaves_the_spline_unchanged(degree, new):
    knots = UNEVEN[degree]
    coefficients = np.random.default_rng(0).standard_normal((len(knots) - degree - 1, 2))
    finer, matrix = insert_knots(knots, degree, new)
    np.testing.assert_array_equal(finer, np.sort(np.concatenate([knots, new])))
    x = np.linspace(0.0, 1.0, 60)
    np.testing.assert_allclose(
        collocation(finer, degree, x) @ (matrix @ coefficients),
        collocation(knots, degree, x) @ coefficients,
        atol=1e-13,
    )
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0, atol=1e-14)
    assert matrix.data.min() > 0.0


@pytest.mark.parametrize("t", [0.0, 1.0, -0.5, 2.0])
def test_knot_insertion_stays_inside(t):
    with pytest.raises(ValueError, match="outside the open interval"):
        insert_knots(UNEVEN[3], 3, [t])


def test_midpoints_halve_every_span():
    np.testing.assert_allclose(midpoints(UNEVEN[2]), [0.1, 0.35, 0.525, 0.775])


def test_apply_along_is_a_tensor_contraction():
    field = np.random.default_rng(1).standard_normal((7, 6, 5, 3))
    for axis, degree in ((0, 3), (1, 2), (2, 1)):
        matrix = collocation(UNEVEN[degree], degree, [0.1, 0.6, 0.61, 1.0])
        expected = np.moveaxis(np.tensordot(matrix.toarray(), field, axes=(1, axis)), 0, axis)
        np.testing.assert_allclose(apply_along(matrix, field, axis), expected, atol=1e-14)


def test_points_and_grid_agree_with_nested_scipy_splines():
    rng = np.random.default_rng(2)
    degrees, knots = (3, 2, 1), (UNEVEN[3], UNEVEN[2], UNEVEN[1])
    field = rng.standard_normal((7, 6, 5))
    rows = [rng.uniform(0.0, 1.0, m) for m in (4, 3, 5)]
    for derivative in ((0, 0, 0), (1, 0, 0), (0, 1, 1), (2, 1, 0)):
        expected = field
        for axis in range(3):
            spline = BSpline(knots[axis], np.moveaxis(expected, axis, 0), degrees[axis])
            expected = np.moveaxis(spline(rows[axis], nu=derivative[axis]), 0, axis)
        np.testing.assert_allclose(evaluate_grid(degrees, knots, field, rows, derivative), expected, atol=1e-11)
        points = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 3)
        at = evaluate_at(degrees, knots, field, points, derivative)
        np.testing.assert_allclose(at.reshape(4, 3, 5), expected, atol=1e-11)


def test_points_of_the_wrong_shape_are_refused():
    with pytest.raises(ValueError, match=r"shape \(m, 3\), got \(1, 2\)"):
        evaluate_at((1, 1, 1), (UNEVEN[1],) * 3, np.zeros((5, 5, 5)), [0.1, 0.2])


def test_insertion_into_a_finer_knot_vector_keeps_the_spline():
    knots = open_uniform_knots(6, 3)
    finer = np.sort(np.concatenate([knots, [0.1, knots[4], 0.5]]))  # one of them a second time
    matrix = insertion_into(knots, 3, finer)
    assert matrix.shape == (9, 6)
    points = np.random.default_rng(0).standard_normal((6, 2))
    t = np.linspace(0.0, 1.0, 31)
    np.testing.assert_allclose(BSpline(finer, matrix @ points, 3)(t), BSpline(knots, points, 3)(t), atol=1e-13)
    with pytest.raises(ValueError, match="must hold every knot"):
        insertion_into(finer, 3, knots)


def test_spans_are_divided_equally_between_their_own_ends():
    knots = np.array([0.0, 0.0, 0.2, 0.2, 1.0, 1.0])
    np.testing.assert_allclose(divided_spans(knots, 2), [0.0, 0.1, 0.2, 0.6, 1.0])
