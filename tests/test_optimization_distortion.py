import numpy as np
import pytest
from test_optimization_rounds import KNOTS, as_volume, gauss_mean, mean_arap, wavy_control

from parameterize.optimization.determinant_penalty import DeterminantPenalty
from parameterize.optimization.distortion import _MIN_DET, BlockDistortion, DistortionTerm
from parameterize.optimization.spans import in_blocks
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.spline_map import ControlNets
from parameterize.spline.volume import BSplineVolume


def test_distortion_is_the_quadrature_of_the_arap_energy():
    control = wavy_control(0.02)
    distortion = BlockDistortion(KNOTS, 3, gauss=(3, 3))
    energy, _ = distortion.energy_and_gradient(control)
    assert energy == pytest.approx(mean_arap(as_volume(control)), rel=1e-9)
    assert distortion.folded == 0


def test_folded_points_are_counted():
    control = wavy_control(0.0)
    control[0] *= -1.0
    distortion = BlockDistortion(KNOTS, 3, gauss=(3, 1))
    distortion.energy_and_gradient(control)
    assert distortion.folded == (2 * 3 + 2 * 1) ** 3  # four spans a direction


def energy(distortion, control, penalty):
    distortion.penalty = penalty
    return distortion.energy_and_gradient(control)[0]


def dumbbell():
    """Control points of a map on 20 spans a direction, 5 times thinner where w is near 1/2, and its knots."""
    knots = (open_uniform_knots(23, 3),) * 3
    points = np.stack(np.meshgrid(*(greville(row, 3) for row in knots), indexing="ij"))
    points[:2] *= np.where(np.abs(points[2] - 0.5) < 0.3, 0.2, 1.0)
    return points, knots


def test_less_det_is_asked_for_where_a_part_is_far_thinner():
    control, knots = dumbbell()
    distortion = BlockDistortion(knots, 3, gauss=(1, 1))
    before = [energy(distortion, control, penalty) for penalty in (0.0, 1.0)]
    shares = distortion.lower_floors(control, 0.05)
    assert shares[..., [0, -1]] == pytest.approx(1.0)
    assert shares[..., 8:12] == pytest.approx(0.5 * 0.2**2 / _MIN_DET)
    volume = BSplineVolume((3,) * 3, knots, np.moveaxis(control, 0, -1))
    det = np.linalg.det(volume.grid_jacobian(*[0.025 + 0.05 * np.arange(20)] * 3))
    after = [energy(distortion, control, penalty) for penalty in (0.0, 1.0)]
    assert before[0] == after[0]
    for share, (plain, penalised) in ((1.0, before), (shares, after)):
        short = np.maximum(share * _MIN_DET - det, 0.0) / share
        assert penalised - plain == pytest.approx(float((short**2).mean()), rel=1e-9)
    assert after[1] - after[0] < 0.3 * (before[1] - before[0])


def test_floors_that_are_lowered_keep_the_gradient_true():
    control, knots = dumbbell()
    control = 0.7 * control + 0.01 * np.random.default_rng(0).normal(size=control.shape)
    nets = ControlNets(3, (knots,))
    control = control.reshape(3, -1)
    distortion, determinants = DistortionTerm(nets, nets.knots), DeterminantPenalty(nets, nets.knots)
    distortion.terms[0].penalty = 1e3
    determinants.activate(in_blocks([2 * np.argwhere(np.ones((10, 10, 10)))]))  # every other span a direction
    determinants.lower_floors(distortion.lower_floors(control, 0.05))
    direction = np.random.default_rng(1).normal(size=control.shape)

    def energies(c):
        return np.array([distortion.energy_and_gradient(c)[0], determinants.energy_and_gradient(c)[0]])

    found = (energies(control + 1e-7 * direction) - energies(control - 1e-7 * direction)) / 2e-7
    gradients = distortion.energy_and_gradient(control)[1], determinants.energy_and_gradient(control)[1]
    assert [float((g * direction).sum()) for g in gradients] == pytest.approx(found.tolist(), rel=1e-4)


@pytest.mark.parametrize("limit", [100.0, 0.3])  # nothing above it; most points above it
def test_curvature_is_the_second_derivative_where_the_map_stretches(limit):
    distortion = BlockDistortion(KNOTS, 3)
    distortion.limit = limit
    control, step = 1.6 * wavy_control(0.02), wavy_control(0.5, seed=4) - wavy_control(0.0)
    ahead, behind = (distortion.energy_and_gradient(control + s * 1e-5 * step)[1] for s in (1.0, -1.0))
    expected = (ahead - behind) / 2e-5
    found = distortion.curvature(control)(step.astype(np.float32)).astype(np.float64)
    assert np.linalg.norm(found - expected) < 1e-3 * np.linalg.norm(expected)


def test_curvature_stays_positive_where_the_energy_bends_down():
    distortion, control = BlockDistortion(KNOTS, 3), 0.4 * wavy_control(0.05)
    distortion.penalty = 20.0
    for seed in range(5):
        step = (wavy_control(0.5, seed) - wavy_control(0.0)).astype(np.float32)
        assert float((step * distortion.curvature(control)(step)).sum()) > 0.0


def test_damping_costs_the_squared_change_of_the_jacobian():
    identity = wavy_control(0.0)
    distortion = BlockDistortion(KNOTS, 3, gauss=(3, 3))
    step = (wavy_control(0.5, seed=2) - identity).astype(np.float32)
    free = float((step * distortion.curvature(identity)(step)).sum())
    distortion.damping = 3.0
    damped = float((step * distortion.curvature(identity)(step)).sum())
    change = gauss_mean(as_volume(step.astype(np.float64)), lambda jacobians: (jacobians**2).sum(axis=(-2, -1)))
    assert damped - free == pytest.approx(2.0 * 3.0 * change, rel=1e-4)
