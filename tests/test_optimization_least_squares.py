import numpy as np
import pytest

from parameterize.optimization.least_squares import fit_pairs
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume

DEGREE = 3
KNOTS = (open_uniform_knots(5, DEGREE), open_uniform_knots(6, DEGREE), open_uniform_knots(4, DEGREE))


def identity_points():
    rows = [greville(k, DEGREE) for k in KNOTS]
    return np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)


def wavy_volume():
    points = identity_points()
    return BSplineVolume((DEGREE,) * 3, KNOTS, points + 0.05 * np.random.default_rng(0).normal(size=points.shape))


def samples(count):
    return np.random.default_rng(1).uniform(size=(count, 3))


def fit(parameters, points, fairness, weights=None):
    weights = np.full(len(points), 1.0 / len(points)) if weights is None else weights
    found = fit_pairs(parameters, points, weights, KNOTS, DEGREE, fairness=fairness)
    assert found.control.flags.c_contiguous
    return found.volume


def test_a_spline_is_found_again_from_its_samples():
    volume, where = wavy_volume(), samples(6000)
    found = fit(where, volume(where), fairness=0.0)
    assert found.control_points == pytest.approx(volume.control_points, abs=1e-2)  # solved to 1e-5
    assert found(where) == pytest.approx(volume(where), abs=5e-4)


def test_affine_maps_survive_any_smoothing():
    where = samples(3000)
    matrix = np.array([[1.2, 0.1, 0.0], [0.0, 0.9, 0.3], [0.2, 0.0, 1.0]])
    found = fit(where, where @ matrix.T + 0.5, fairness=10.0)
    assert found.control_points == pytest.approx(identity_points() @ matrix.T + 0.5, abs=1e-3)


def test_smoothing_decides_where_no_sample_lies():
    where = samples(4000)
    where = where[where[:, 0] < 0.7]
    found = fit(where, where, fairness=1e-5)
    assert found.control_points == pytest.approx(identity_points(), abs=0.05)


def test_more_smoothing_bends_less_and_misses_more():
    volume, where = wavy_volume(), samples(3000)
    loose, tight = (fit(where, volume(where), fairness) for fairness in (1e-6, 1e-2))

    def bending(v):
        return (v.hessian(samples(2000)) ** 2).sum()

    assert bending(tight) < 0.5 * bending(loose)
    assert np.abs(tight(where) - volume(where)).mean() > 2.0 * np.abs(loose(where) - volume(where)).mean()


def test_weights_count():
    where = np.repeat(samples(1500), 2, axis=0)
    points = where + np.tile([[0.0], [1.0]], (1500, 1))  # every place has two samples, one unit apart
    weights = np.tile([0.75, 0.25], 1500) / 1500
    assert fit(where, points, 1e-6, weights)(samples(50)) - samples(50) == pytest.approx(0.25, abs=1e-3)
