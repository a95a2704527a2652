import pytest
import torch

from parameterize.optimization.acceleration import Acceleration


def linear_iteration(size, seed=0):
    """Return g(x) = A x + b with eigenvalues of A between 0 and 0.95, and its fixed point."""
    generator = torch.Generator().manual_seed(seed)
    basis, _ = torch.linalg.qr(torch.randn(size, size, generator=generator, dtype=torch.float64))
    matrix = basis @ torch.diag(torch.linspace(0.0, 0.95, size, dtype=torch.float64)) @ basis.T
    shift = torch.randn(size, generator=generator, dtype=torch.float64)
    return lambda x: matrix @ x + shift, torch.linalg.solve(torch.eye(size, dtype=torch.float64) - matrix, shift)


def test_one_step_is_no_guess():
    kept = Acceleration(4)
    assert kept.guess() is None
    kept.add(torch.zeros(3), torch.ones(3))
    assert kept.guess() is None


def test_as_many_differences_as_unknowns_find_the_fixed_point_of_a_linear_iteration():
    step, fixed = linear_iteration(4)
    kept, x = Acceleration(4), torch.zeros(4, dtype=torch.float64)
    for _ in range(5):
        kept.add(x, step(x))
        x = step(x)
    torch.testing.assert_close(kept.guess(), fixed, rtol=1e-3, atol=1e-3)


def test_it_needs_a_fraction_of_the_steps():
    step, fixed = linear_iteration(40)
    kept, x, plain = Acceleration(4), torch.zeros(40, dtype=torch.float64), torch.zeros(40, dtype=torch.float64)
    for _ in range(30):
        kept.add(x, step(x))
        guess = kept.guess()
        x, plain = step(x) if guess is None else guess, step(plain)
    assert (x - fixed).norm() < 0.05 * (plain - fixed).norm()


@pytest.mark.parametrize("shape", [(3, 2, 2, 2), (5,)])
def test_guesses_keep_the_shape(shape):
    kept = Acceleration(2)
    for k in range(6):
        kept.add(torch.full(shape, 1.0 - 0.5**k), torch.full(shape, 1.0 - 0.5 ** (k + 1)))
    torch.testing.assert_close(kept.guess(), torch.ones(shape), rtol=1e-3, atol=1e-3)


def test_what_is_forgotten_counts_no_more():
    step, _ = linear_iteration(3)
    kept, x = Acceleration(4), torch.zeros(3, dtype=torch.float64)
    kept.add(x + 7.0, x - 9.0)
    kept.add(x + 1.0, step(x + 1.0))
    kept.forget(keep=1)
    assert kept.guess() is None
    kept.add(x, step(x))
    alone = Acceleration(4)
    alone.add(x + 1.0, step(x + 1.0))
    alone.add(x, step(x))
    assert torch.equal(kept.guess(), alone.guess())
    kept.forget()
    assert kept.guess() is None
