import numpy as np
import pytest

from parameterize.conjugate_gradients import INDEFINITE, NO_DIRECTION, NO_PRODUCT, conjugate_gradients


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


def test_starts_where_it_is_told_to():
    d = np.geomspace(1.0, 1e3, 100)
    b = np.ones(100)
    near = b / d * (1.0 + 1e-6)
    result = conjugate_gradients(lambda p: d * p, b, identity, 1e-10, start=near)
    assert result.residuals[0] == pytest.approx(1e-6, rel=1e-6)
    assert result.iterations < conjugate_gradients(lambda p: d * p, b, identity, 1e-10).iterations
    assert np.allclose(result.x, b / d, rtol=1e-6)
    assert near[0] == 1.0 + 1e-6


def test_single_precision_stays_single():
    d = np.linspace(1.0, 10.0, 50, dtype=np.float32)
    result = conjugate_gradients(lambda p: d * p, np.ones(50, dtype=np.float32), identity, 1e-3)
    assert result.converged and result.x.dtype == np.float32
