import numpy as np
import pytest

from solve.linear.krylov import (
    INDEFINITE,
    NO_DIRECTION,
    NO_PRODUCT,
    conjugate_gradients,
    generalized_residuals,
)


def identity(r):
    return r


def test_diagonal_with_three_eigenvalues_takes_three_iterations():
    d = np.repeat([1.0, 2.0, 5.0], 10)
    b = np.linspace(1.0, 2.0, 30)
    result = conjugate_gradients(lambda p: d * p, b, identity, 1e-12)
    assert result.converged
    assert result.iterations == 3
    assert np.allclose(result.x, b / d, atol=1e-12)


def test_exact_preconditioner_takes_one_iteration():
    d = np.linspace(1.0, 100.0, 50)
    result = conjugate_gradients(lambda p: d * p, np.ones(50), lambda r: r / d, 1e-12)
    assert result.iterations == 1


def test_history_holds_the_true_residuals():
    rng = np.random.default_rng(0)
    q = np.linalg.qr(rng.standard_normal((20, 20)))[0]
    matrix = q @ np.diag(np.geomspace(1.0, 1e3, 20)) @ q.T
    b = rng.standard_normal(20)
    result = conjugate_gradients(lambda p: matrix @ p, b, identity, 1e-10, 7)
    assert len(result.residuals) == 8
    assert result.residuals[0] == 1.0
    true = np.linalg.norm(b - matrix @ result.x) / np.linalg.norm(b)
    assert result.residuals[-1] == pytest.approx(true, rel=1e-8)


def test_iteration_limit_is_reported():
    d = np.geomspace(1.0, 1e6, 100)
    result = conjugate_gradients(lambda p: d * p, np.ones(100), identity, 1e-10, 5)
    assert not result.converged
    assert result.iterations == 5


def test_zero_right_hand_side_needs_no_iteration():
    result = conjugate_gradients(identity, np.zeros(4), identity)
    assert result.converged
    assert result.iterations == 0


@pytest.mark.parametrize(
    ("matrix", "inverse", "breakdown"),
    [
        (-1.0, 1.0, INDEFINITE),
        (0.0, 1.0, INDEFINITE),
        (1.0, -1.0, INDEFINITE),
        (np.nan, 1.0, NO_PRODUCT),
        (np.inf, 1.0, NO_PRODUCT),
        (1.0, np.nan, NO_DIRECTION),
        (1.0, np.inf, NO_DIRECTION),
        (1.0, 0.0, NO_DIRECTION),
    ],
)
def test_what_breaks_down_is_named(matrix, inverse, breakdown):
    result = conjugate_gradients(lambda p: matrix * p, np.ones(4), lambda r: inverse * r)
    assert not result.converged and result.iterations == 0
    assert result.breakdown == breakdown
    assert np.all(result.x == 0.0)


@pytest.mark.parametrize("method", [conjugate_gradients, generalized_residuals])
def test_a_right_hand_side_or_a_start_that_is_not_finite_is_named(method):
    b = np.ones((2, 2))
    for result in (method(np.copy, b * np.nan, np.copy), method(np.copy, b, np.copy, start=b * np.nan)):
        assert not result.converged and result.iterations == 0 and result.breakdown == NO_PRODUCT


@pytest.mark.parametrize(
    ("matrix", "inverse", "breakdown"), [(np.nan, 1.0, NO_PRODUCT), (1.0, np.nan, NO_DIRECTION), (1.0, 1.0, "")]
)
def test_what_breaks_gmres_down_is_named(matrix, inverse, breakdown):
    result = generalized_residuals(lambda x: matrix * x, np.ones((2, 2)), lambda r: inverse * r)
    assert result.breakdown == breakdown and result.converged == (not breakdown)
    assert np.array_equal(result.x, np.full((2, 2), 0.0 if breakdown else 1.0))


def test_gmres_that_breaks_down_keeps_what_it_had(case, monkeypatch):
    monkeypatch.setattr("solve.linear.krylov.RESTART", 5)
    matrix, _, b = case
    products = []

    def operator(x):
        products.append(x)
        return (matrix @ x.ravel()).reshape(b.shape) * (np.nan if len(products) > 9 else 1.0)

    result = generalized_residuals(operator, b, np.copy, tolerance=1e-12)
    left = np.linalg.norm(b.ravel() - matrix @ result.x.ravel()) / np.linalg.norm(b)
    assert result.breakdown == NO_PRODUCT and not result.converged and result.iterations == 5
    assert result.residuals[-1] == pytest.approx(left, rel=1e-6) and left < 1.0


def test_starts_where_it_is_told_to():
    d = np.geomspace(1.0, 1e3, 100)
    b = np.ones(100)
    near = b / d * (1.0 + 1e-6)
    result = conjugate_gradients(lambda p: d * p, b, identity, 1e-10, start=near)
    assert result.residuals[0] == pytest.approx(1e-6, rel=1e-6)
    assert result.iterations < conjugate_gradients(lambda p: d * p, b, identity, 1e-10).iterations
    assert np.allclose(result.x, b / d, rtol=1e-6)
    assert near[0] == 1.0 + 1e-6


@pytest.fixture
def case():
    """A matrix far from symmetric, and an approximate inverse."""
    rng = np.random.default_rng(0)
    matrix = np.diag(np.arange(1.0, 61.0)) + 2.0 * np.triu(rng.standard_normal((60, 60)), 1)
    inverse = np.linalg.inv(np.tril(matrix) + 0.8 * np.triu(matrix, 1))
    return matrix, inverse, rng.standard_normal((3, 4, 5))


def test_solution_and_residuals_are_those_of_the_system(case):
    matrix, inverse, b = case
    result = generalized_residuals(
        lambda x: (matrix @ x.ravel()).reshape(b.shape), b, lambda r: (inverse @ r.ravel()).reshape(b.shape), 1e-9
    )
    assert result.converged and result.x.shape == b.shape and result.iterations < 40
    assert np.allclose(result.x.ravel(), np.linalg.solve(matrix, b.ravel()), atol=1e-6)
    left = np.linalg.norm(b.ravel() - matrix @ result.x.ravel()) / np.linalg.norm(b)
    assert result.residuals[0] == 1.0 and result.residuals[-1] == pytest.approx(left, rel=1e-3)
    assert all(after <= before for before, after in zip(result.residuals, result.residuals[1:], strict=False))


def test_a_good_start_saves_iterations_and_a_limit_ends_them(case):
    matrix, _, b = case

    def solve(**arguments):
        return generalized_residuals(lambda x: (matrix @ x.ravel()).reshape(b.shape), b, np.copy, **arguments)

    exact = np.linalg.solve(matrix, b.ravel()).reshape(b.shape)
    near = solve(start=exact + 1e-6 * np.ones(b.shape), tolerance=1e-7)
    assert near.residuals[0] < 1e-3 and near.converged and np.allclose(near.x, exact, atol=1e-4)
    assert solve(start=exact, tolerance=1e-6).iterations == 0
    stopped = solve(max_iterations=7, tolerance=1e-12)
    assert not stopped.converged and stopped.iterations == 7 and stopped.residuals[-1] < 1.0


@pytest.mark.parametrize("limit", [3, 5, 12, 14])
def test_the_limit_of_iterations_holds_between_restarts(case, limit, monkeypatch):
    monkeypatch.setattr("solve.linear.krylov.RESTART", 5)
    matrix, _, b = case
    result = generalized_residuals(
        lambda x: (matrix @ x.ravel()).reshape(b.shape), b, np.copy, tolerance=1e-12, max_iterations=limit
    )
    assert not result.converged and result.iterations == limit
    left = np.linalg.norm(b.ravel() - matrix @ result.x.ravel()) / np.linalg.norm(b)
    assert result.residuals[-1] == pytest.approx(left, rel=1e-6)


def test_zero_is_the_answer_to_zero():
    result = generalized_residuals(lambda x: x, np.zeros((2, 2)), np.copy)
    assert result.converged and not result.x.any()
