import numpy as np
import pytest

from parameterize.quality.rotations import closest_rotations


def batch(matrices, dtype=np.float64):
    """(m, 3, 3) -> (3, 3, m)."""
    return np.moveaxis(matrices, 0, -1).astype(dtype)


def with_singular_values(rng, sigma, sign, count=200):
    """Random matrices with these singular values and this sign of the determinant."""
    u, v = (np.linalg.qr(rng.normal(size=(count, 3, 3)))[0] for _ in range(2))
    flip = np.linalg.det(u) * np.linalg.det(v) * sign < 0.0
    u[flip, :, 2] *= -1.0
    return (u * np.array(sigma)) @ v


def rotation_by_svd(matrices):
    u, _, vh = np.linalg.svd(matrices)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vh))[:, None]
    return u @ vh


SIGMAS = [(1.0, 1.0, 1.0), (2.0, 1.0, 0.5), (1.0, 0.9, 0.01), (1e-6, 5e-7, 1e-7), (1e4, 1e3, 1e2), (1.0, 0.5, 1e-5)]


@pytest.mark.parametrize("sigma", SIGMAS)
def test_positive_determinant_gives_the_polar_factor(sigma):
    j = with_singular_values(np.random.default_rng(0), sigma, 1.0)
    found = np.moveaxis(closest_rotations(batch(j)), -1, 0)
    assert np.abs(found @ found.transpose(0, 2, 1) - np.eye(3)).max() < 1e-12
    assert found == pytest.approx(rotation_by_svd(j), abs=1e-6)  # single precision but for the last step


@pytest.mark.parametrize("sigma", [(2.0, 1.0, 0.5), (1.0, 0.9, 0.01), (1.0, 0.5, 1e-5)])
def test_reflections_give_the_closest_rotations(sigma):
    j = with_singular_values(np.random.default_rng(1), sigma, -1.0)
    found = np.moveaxis(closest_rotations(batch(j)), -1, 0)
    assert np.linalg.det(found) == pytest.approx(1.0)
    assert found == pytest.approx(rotation_by_svd(j), abs=1e-9)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_singular_matrices_still_give_rotations(dtype):
    j = np.zeros((4, 3, 3))
    j[1] = np.diag([1.0, 0.0, 0.0])
    j[2] = np.diag([1.0, 1.0, 0.0])
    j[3] = -np.eye(3)
    found = np.moveaxis(closest_rotations(batch(j, dtype)).astype(np.float64), -1, 0)
    assert found @ found.transpose(0, 2, 1) == pytest.approx(np.stack([np.eye(3)] * 4), abs=1e-6)
    assert np.linalg.det(found) == pytest.approx(1.0)


def test_matrices_that_are_not_finite_leave_the_others_alone():
    j = with_singular_values(np.random.default_rng(2), (2.0, 1.0, 0.5), 1.0, count=3)
    expected = rotation_by_svd(j)
    j[1, 0, 0], j[2, 1, 1] = np.nan, np.inf
    found = closest_rotations(batch(j))
    assert found[:, :, 0] == pytest.approx(expected[0], abs=1e-6)
    assert np.isfinite(found).all()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_distortion_needs_no_singular_values(sign):
    j = with_singular_values(np.random.default_rng(3), (1.7, 1.1, 0.4), sign)
    expected = (1.7 - 1.0) ** 2 + (1.1 - 1.0) ** 2 + (sign * 0.4 - 1.0) ** 2
    columns = batch(j)
    assert ((columns - closest_rotations(columns)) ** 2).sum(axis=(0, 1)) == pytest.approx(expected)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gradient_with_the_rotation_held_is_the_gradient(sign):
    rng = np.random.default_rng(4)
    j = with_singular_values(rng, (1.7, 1.1, 0.4), sign, count=5)
    gradient = 2.0 * (j - np.moveaxis(closest_rotations(batch(j)), -1, 0))

    def energy(matrices):
        s = np.linalg.svd(matrices, compute_uv=False)
        s[:, 2] *= sign
        return ((s - 1.0) ** 2).sum(axis=1)

    direction, h = rng.normal(size=j.shape), 1e-5
    slope = (energy(j + h * direction) - energy(j - h * direction)) / (2.0 * h)
    assert (gradient * direction).sum(axis=(1, 2)) == pytest.approx(slope, abs=1e-6)
