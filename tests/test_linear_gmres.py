import numpy as np
import pytest

from solve.linear.gmres import generalized_residuals


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


def test_zero_is_the_answer_to_zero():
    result = generalized_residuals(lambda x: x, np.zeros((2, 2)), np.copy)
    assert result.converged and not result.x.any()
