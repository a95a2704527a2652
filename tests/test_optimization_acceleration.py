import numpy as np
import pytest

from parameterize.optimization.newton import Acceleration


def linear_iteration(size, seed=0):
    """Return g(x) = A x + b with eigenvalues of A between 0 and 0.95, and its fixed point."""
    rng = np.random.default_rng(seed)
    basis, _ = np.linalg.qr(rng.normal(size=(size, size)))
    matrix = basis @ np.diag(np.linspace(0.0, 0.95, size)) @ basis.T
    shift = rng.normal(size=size)
    return lambda x: matrix @ x + shift, np.linalg.solve(np.eye(size) - matrix, shift)


def test_one_step_is_no_guess():
    kept = Acceleration(4)
    assert kept.guess() is None
    kept.add(np.zeros(3), np.ones(3))
    assert kept.guess() is None


def test_as_many_differences_as_unknowns_find_the_fixed_point_of_a_linear_iteration():
    step, fixed = linear_iteration(4)
    kept, x = Acceleration(4), np.zeros(4)
    for _ in range(5):
        kept.add(x, step(x))
        x = step(x)
    np.testing.assert_allclose(kept.guess(), fixed, atol=2e-2)  # the least squares are damped


def test_it_needs_a_fraction_of_the_steps():
    step, fixed = linear_iteration(40)
    kept, x, plain = Acceleration(4), np.zeros(40), np.zeros(40)
    for _ in range(30):
        kept.add(x, step(x))
        guess = kept.guess()
        x, plain = step(x) if guess is None else guess, step(plain)
    assert np.linalg.norm(x - fixed) < 0.05 * np.linalg.norm(plain - fixed)


@pytest.mark.parametrize("shape", [(3, 2, 2, 2), (5,)])
def test_guesses_keep_the_shape(shape):
    kept = Acceleration(2)
    for k in range(6):
        kept.add(np.full(shape, 1.0 - 0.5**k), np.full(shape, 1.0 - 0.5 ** (k + 1)))
    np.testing.assert_allclose(kept.guess(), np.ones(shape), rtol=1e-3, atol=1e-3)


def test_what_is_forgotten_counts_no_more():
    step, _ = linear_iteration(3)
    kept, x = Acceleration(4), np.zeros(3)
    kept.add(x + 7.0, x - 9.0)
    kept.add(x + 1.0, step(x + 1.0))
    kept.forget(keep=1)
    assert kept.guess() is None
    kept.add(x, step(x))
    alone = Acceleration(4)
    alone.add(x + 1.0, step(x + 1.0))
    alone.add(x, step(x))
    assert np.array_equal(kept.guess(), alone.guess())
    kept.forget()
    assert kept.guess() is None
