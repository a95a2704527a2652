import numpy as np
import pytest

from parameterize.cube.closest_point import damped_fit


def vectors(seed, scale=1.0):
    return scale * np.random.default_rng(seed).normal(size=(3, 50, 3))


@pytest.mark.parametrize("scale", [1.0, 1e-100, 1e100])
def test_fit_is_least_squares_in_any_unit(scale):
    first, second, right = vectors(0, scale)
    a, b = damped_fit(first, second, right, 0.0)
    for k in range(50):
        expected = np.linalg.lstsq(np.stack([first[k], second[k]], axis=1) / scale, right[k] / scale)[0]
        assert [a[k], b[k]] == pytest.approx(expected.tolist(), rel=1e-8)


def test_parallel_and_zero_vectors_have_a_finite_fit():
    first, second, right = vectors(1)
    second = 2.0 * first
    first[0] = second[0] = 0.0
    a, b = damped_fit(first, second, right, 1e-6)
    assert a[0] == b[0] == 0.0
    fitted = a[1:, None] * first[1:] + b[1:, None] * second[1:]
    along = (first[1:] * right[1:]).sum(1) / (first[1:] ** 2).sum(1)
    assert fitted == pytest.approx(along[:, None] * first[1:], rel=1e-4)
