import warnings

import numpy as np
import pytest
from volumes import mapped

from parameterize.spline.volume import BSplineVolume
from solve.discretization.roughness import rough_directions
from solve.discretization.space import trial_space
from solve.study import benchmark_volume

SMOOTH, ROUGH = (False, False, False), (True, True, True)


def roughness(volume, tensor=lambda x: None, refine=0):
    return rough_directions(volume, trial_space(volume, refine), tensor)


def test_a_smooth_map_is_rough_only_on_few_spans():
    assert roughness(benchmark_volume(4)) == ROUGH
    assert roughness(benchmark_volume(16)) == SMOOTH
    assert roughness(benchmark_volume(4), refine=2) == SMOOTH


def test_two_spans_tell_too_little():
    assert roughness(mapped(lambda u, v, w: (u, v, w), (5, 6, 5))) == (True, False, True)


def test_noise_on_the_control_points_is_rough():
    smooth = benchmark_volume(16)
    noise = 0.004 * np.random.default_rng(0).standard_normal(smooth.control_points.shape)
    assert roughness(BSplineVolume(smooth.degrees, smooth.knots, smooth.control_points + noise)) == ROUGH


def test_a_direction_along_which_the_coefficient_varies_is_rough():
    box = mapped(lambda u, v, w: (w, 2.0 * u, v), (19, 19, 19))  # x runs along w
    assert roughness(box, lambda x: np.exp(np.sin(20.0 * x[0]))) == (False, False, True)
    assert roughness(box, lambda x: np.exp(np.sin(x[0]))) == SMOOTH


def test_of_a_tensor_only_its_variation_counts():
    box = mapped(lambda u, v, w: (u, v, w))
    entries = np.array([100.0, 0.0, 1.0, 1.0, 0.1, 3.0])
    assert roughness(box, lambda x: np.broadcast_to(entries[:, None, None], (6, *x.shape[1:]))) == SMOOTH
    assert roughness(box, lambda x: np.stack([entry * np.exp(20.0 * x[1]) for entry in entries])) == (
        False,
        True,
        False,
    )


@pytest.mark.parametrize("scale", [0.0, -1.0])
def test_maps_without_an_inverse_pass_in_silence(scale):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = roughness(mapped(lambda u, v, w: (u, v, scale * w)))
    assert found == (ROUGH if scale == 0.0 else SMOOTH)
