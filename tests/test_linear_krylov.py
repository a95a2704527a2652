import numpy as np
import pytest

from parameterize.conjugate_gradients import NO_DIRECTION, NO_PRODUCT, conjugate_gradients
from solve.linear.krylov import generalized_residuals


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
