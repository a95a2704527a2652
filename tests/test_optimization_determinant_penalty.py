import tracemalloc

import numpy as np
import pytest
from bernstein import bernstein_coefficients

from parameterize.optimization.determinant_penalty import DeterminantPenalty
from parameterize.optimization.spans import in_blocks
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.spline_map import ControlNets, SplineMap
from parameterize.spline.volume import BSplineVolume


def setting(degree, amplitude, seed=0, n=(6, 5, 7)):
    knots = tuple(open_uniform_knots(m, degree) for m in n)
    rows = [greville(k, degree) for k in knots]
    points = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)
    points = points + amplitude * np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape)
    return (
        ControlNets(degree, (knots,)),
        np.moveaxis(points, -1, 0).reshape(3, -1),
        BSplineVolume((degree,) * 3, knots, points),
    )


def all_spans(volume):
    return in_blocks([np.indices([len(np.unique(k)) - 1 for k in volume.knots]).reshape(3, -1).T])


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_energy_is_the_shortfall_of_the_certificates_coefficients(degree):
    nets, control, volume = setting(degree, 0.1)
    penalty = DeterminantPenalty(nets, nets.knots, 0.8)
    spans = all_spans(volume)
    chosen = spans[::3]
    penalty.activate(chosen)
    energy, _ = penalty.energy_and_gradient(control)
    coefficients = bernstein_coefficients(volume, chosen[:, 1:])
    expected = (np.maximum(0.8 - coefficients, 0.0) ** 2).mean(axis=(1, 2, 3)).sum() / len(spans)
    assert expected > 1e-4
    assert energy == pytest.approx(expected, rel=1e-9)


def test_a_shortfall_counts_in_shares_of_a_lowered_floor():
    nets, control, volume = setting(3, 0.1)
    penalty, spans = DeterminantPenalty(nets, nets.knots, 0.8), all_spans(volume)
    shares = np.random.default_rng(1).uniform(0.2, 1.0, penalty.weights.shape)
    penalty.lower_floors(shares)
    penalty.activate(spans)
    floors = shares[:, None, None, None]
    short = np.maximum(0.8 * floors - bernstein_coefficients(volume, spans[:, 1:]), 0.0) / floors
    expected = (short**2).mean()
    assert expected > 1e-4
    assert penalty.energy_and_gradient(control)[0] == pytest.approx(expected, rel=1e-9)


def test_gradient_against_finite_differences():
    nets, control, volume = setting(3, 0.08)
    penalty = DeterminantPenalty(nets, nets.knots, 0.8)
    penalty.activate(all_spans(volume))
    _, gradient = penalty.energy_and_gradient(control)
    for seed in range(3):
        direction = np.random.default_rng(seed).normal(size=control.shape)
        h = 1e-6
        ahead, behind = (penalty.energy_and_gradient(control + s * h * direction)[0] for s in (1.0, -1.0))
        assert float((gradient * direction).sum()) == pytest.approx((ahead - behind) / (2.0 * h), rel=1e-5)


def test_nothing_to_pay_above_the_floor_or_without_spans():
    nets, control, volume = setting(3, 0.0)
    penalty = DeterminantPenalty(nets, nets.knots, 0.5)
    for spans in (np.zeros((0, 4), dtype=np.int64), all_spans(volume)):
        penalty.activate(spans)
        energy, gradient = penalty.energy_and_gradient(control)
        assert energy == 0.0 and not gradient.any()


def test_activating_twice_counts_once():
    nets, control, volume = setting(3, 0.1)
    once, twice = (DeterminantPenalty(nets, nets.knots, 0.8) for _ in range(2))
    spans = all_spans(volume)
    once.activate(spans)
    twice.activate(spans[:30])
    twice.activate(spans[10:])
    twice.activate(np.zeros((0, 4), dtype=np.int64))
    assert np.array_equal(once.weights, twice.weights) and set(once.weights) == {1.0}
    assert once.energy_and_gradient(control)[0] == twice.energy_and_gradient(control)[0]


def test_stubborn_spans_and_their_neighbours_weigh_more_up_to_a_limit():
    nets, control, volume = setting(3, 0.1)
    penalty, spans = DeterminantPenalty(nets, nets.knots, 0.8), all_spans(volume)
    penalty.activate(spans[::2])
    corner = np.array([[0, 0, 0, 0]])
    grid = nets.spans[0]
    for weight in (5.0, 20.0, 20.0):
        penalty.stiffen(corner, 5.0, 20.0)
        assert np.all(penalty.weights.reshape(grid)[:2, :2, :2] == weight)
    assert set(penalty.weights.reshape(grid)[2:].ravel()) == {0.0, 1.0}
    penalty.activate(spans)  # what weighs more already keeps its weight
    assert np.all(penalty.weights.reshape(grid)[:2, :2, :2] == 20.0) and penalty.weights.reshape(grid)[2:].max() == 1.0
    shortfall = (np.maximum(0.8 - bernstein_coefficients(volume, spans[:, 1:]), 0.0) ** 2).mean(axis=(1, 2, 3))
    expected = (penalty.weights * shortfall).sum() / len(spans)
    assert penalty.energy_and_gradient(control)[0] == pytest.approx(expected, rel=1e-9)


def test_curvature_is_gauss_newton():
    nets, control, volume = setting(3, 0.1)
    penalty = DeterminantPenalty(nets, nets.knots, 0.8)
    spans = all_spans(volume)
    penalty.activate(spans)
    step = np.random.default_rng(1).normal(size=control.shape)

    def coefficients(x):
        return bernstein_coefficients(SplineMap(nets, x).volume, spans[:, 1:])

    change = (coefficients(control + 1e-6 * step) - coefficients(control - 1e-6 * step)) / 2e-6
    change = np.where(coefficients(control) < 0.8, change, 0.0)
    expected = 2.0 * (change**2).mean(axis=(1, 2, 3)).sum() / len(spans)
    found = float((step * penalty.curvature(control)(step.astype(np.float32))).sum())
    assert found == pytest.approx(expected, rel=3e-3)


def test_rows_that_are_not_kept_are_made_anew_with_the_same_result(monkeypatch):
    nets, control, volume = setting(3, 0.2, n=(8, 8, 8))
    penalty = DeterminantPenalty(nets, nets.knots, 0.8)
    penalty.activate(all_spans(volume))
    step = np.random.default_rng(0).normal(size=control.shape)
    products, held = [], []
    for most in (1e9, 1e6, 0.0):
        monkeypatch.setattr("parameterize.optimization.determinant_penalty._MOST_KEPT", most)
        tracemalloc.start()
        curvature = penalty.curvature(control)
        held.append(tracemalloc.get_traced_memory()[0])
        tracemalloc.stop()
        products.append(curvature(step))
    assert np.array_equal(products[0], products[1]) and np.array_equal(products[0], products[2])
    assert held[0] > 5e6 and held[1] < held[0] - 3e6 and held[2] < 1e6
