import warnings

import numpy as np
import pytest
from volumes import mapped

from parameterize.spline.volume import BSplineVolume
from solve.discretization.roughness import Measured, roughness
from solve.discretization.space import trial_space
from solve.study import benchmark_volume

IDENTITY = np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])


def rough(volume, factor=lambda x: np.ones(x.shape[1:]), refine=0, tensor=IDENTITY):
    return roughness([Measured(volume, trial_space(volume, refine), lambda x: np.multiply.outer(tensor, factor(x)))])[0]


def test_a_smooth_map_is_rough_only_on_few_spans():
    assert rough(benchmark_volume(4))
    assert not rough(benchmark_volume(16))
    assert not rough(benchmark_volume(4), refine=2)


def test_two_spans_tell_too_little():
    assert rough(mapped(lambda u, v, w: (u, v, w), (6, 5, 6)))
    assert not rough(mapped(lambda u, v, w: (u, v, w), (6, 6, 6)))


def test_noise_on_the_control_points_is_rough():
    smooth = benchmark_volume(16)
    noise = 0.004 * np.random.default_rng(0).standard_normal(smooth.control_points.shape)
    assert rough(BSplineVolume(smooth.degrees, smooth.knots, smooth.control_points + noise))


def test_a_coefficient_that_varies_along_one_direction_is_rough():
    box = mapped(lambda u, v, w: (w, 2.0 * u, v), (19, 19, 19))
    for axis in range(3):
        assert rough(box, lambda x, axis=axis: np.exp(np.sin(20.0 * x[axis])))
    assert not rough(box, lambda x: np.exp(np.sin(x[0])))


def test_of_a_tensor_only_its_variation_counts():
    box = mapped(lambda u, v, w: (u, v, w))
    entries = np.array([100.0, 0.0, 1.0, 1.0, 0.1, 3.0])
    assert not rough(box, tensor=entries)
    assert rough(box, lambda x: np.exp(20.0 * x[1]), tensor=entries)


@pytest.mark.parametrize("scale", [0.0, -1.0])
def test_maps_without_an_inverse_pass_in_silence(scale):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert rough(mapped(lambda u, v, w: (u, v, scale * w))) == (scale == 0.0)
