import numpy as np
import pytest

from solve.forms.trigonometry import LARGEST, sine_and_cosine


def units(found, wanted):
    """Return the largest difference in units in the last place."""
    return (np.abs(found - wanted) / np.spacing(np.abs(wanted))).max()


@pytest.mark.parametrize("most", [3.0, 1e4, LARGEST])
def test_as_exact_as_the_c_library(most):
    """Also beside the zeros, at multiples of pi / 2, where little is left of the angle."""
    angles = np.random.default_rng(0).uniform(-most, most, (50, 2000))
    angles[0] = np.arange(-1000, 1000) * (np.pi / 2.0)
    sine, cosine = sine_and_cosine(angles[:, ::2])
    assert sine.shape == (50, 1000)
    assert units(sine, np.sin(angles[:, ::2])) <= 2.0 and units(cosine, np.cos(angles[:, ::2])) <= 2.0


def test_signs_in_the_four_quarters_and_angles_that_are_almost_zero():
    sine, cosine = sine_and_cosine(np.array([1e-300, 0.5, 2.0, 4.0, 5.5, -0.5, -2.0, -4.0, -5.5]))
    assert sine[0] == 1e-300 and cosine[0] == 1.0
    assert np.sign(sine).tolist() == [1, 1, 1, -1, -1, -1, -1, 1, 1]
    assert np.sign(cosine).tolist() == [1, 1, -1, -1, 1, 1, -1, -1, 1]


@pytest.mark.parametrize("angle", [np.nan, np.inf, -1e300, 1e22])
def test_what_cannot_be_reduced_is_left_to_numpy(angle):
    angles = np.array([0.3, angle])
    with np.errstate(invalid="ignore"):
        wanted = np.sin(angles), np.cos(angles)
        assert np.array_equal(sine_and_cosine(angles), wanted, equal_nan=True)


def test_numbers_and_empty_arrays():
    assert sine_and_cosine(np.float64(0.25)) == (np.sin(0.25), np.cos(0.25))
    assert [part.shape for part in sine_and_cosine(np.empty((3, 0)))] == [(3, 0), (3, 0)]
