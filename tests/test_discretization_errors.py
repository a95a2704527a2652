import numpy as np
import pytest
from rational_shapes import octant

from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume
from solve import benchmark_volume
from solve.discretization.error_norms import Compared, error_norms
from solve.discretization.space import trial_space


def cube(size, n=3, degree=2):
    points = size * greville(open_uniform_knots(n + degree, degree), degree)
    return BSplineVolume.uniform(np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1), degree)


def test_norms_of_a_linear_function_against_zero_by_hand():
    """On [0, 2]^3 the square of 3 x integrates to 9 * 8/3 * 4 = 96, and that of its gradient to 9 * 8 = 72."""
    volume = cube(2.0)
    space = trial_space(volume)

    def exact(points):
        x = points[0]
        return 3.0 * x[None], np.stack([3.0 + 0 * x, 0 * x, 0 * x])[None]

    errors = error_norms([Compared(volume, space, np.zeros((1, *space.shape)), exact)])
    assert errors.l2 == pytest.approx(np.sqrt(96.0))
    assert errors.l2_relative == pytest.approx(1.0)
    assert errors.h1_seminorm == pytest.approx(np.sqrt(72.0))
    assert errors.h1_relative == pytest.approx(1.0)


def test_a_spline_has_no_distance_from_itself():
    """y is a spline on the curved map, with gradient (0, 1, 0): pulls the physical gradient back through J."""
    volume = benchmark_volume(4)
    part = Compared(
        volume,
        trial_space(volume),
        volume.control_points[None, ..., 1],
        lambda x: (x[1:2], np.stack([0 * x[0], 1 + 0 * x[0], 0 * x[0]])[None]),
    )
    errors = error_norms([part])
    assert errors.l2 < 1e-14
    assert errors.h1_seminorm < 1e-12


def test_without_gradient_the_seminorm_is_unknown():
    volume = cube(1.0)
    space = trial_space(volume)
    errors = error_norms([Compared(volume, space, np.zeros((1, *space.shape)), lambda x: (x[:1], None))])
    assert errors.h1_seminorm is None
    assert errors.l2 == pytest.approx(np.sqrt(1.0 / 3.0))


def test_degree_plus_two_points_integrate_the_square_of_one_degree_more_exactly():
    volume = cube(1.0)
    space = trial_space(volume)
    errors = error_norms([Compared(volume, space, np.zeros((1, *space.shape)), lambda x: (x[:1] ** 3, None))])
    assert errors.l2 == pytest.approx(np.sqrt(1.0 / 7.0), rel=1e-14)


@pytest.mark.parametrize("threads", [1, 3])
def test_strips_of_a_plane_and_threads_change_nothing_but_rounding(monkeypatch, threads):
    """On the octant of a rational shell, with two components; a strip is one row of points."""
    volume = octant()
    space = trial_space(volume, 1)
    coefficients = np.random.default_rng(0).uniform(0.5, 1.5, (2, *space.shape))

    def exact(x):
        values = np.stack([np.sin(x[0] * x[1]), x[2]])
        slopes = [x[1] * np.cos(x[0] * x[1]), x[0] * np.cos(x[0] * x[1]), 0 * x[0], 0 * x[0], 0 * x[0], 1 + 0 * x[0]]
        return values, np.stack(slopes).reshape(2, 3, *x.shape[1:])

    whole = error_norms([Compared(volume, space, coefficients, exact)])
    monkeypatch.setattr("solve.discretization.error_norms.POINTS", 1)
    strips = error_norms([Compared(volume, space, coefficients, exact)], threads)
    assert (strips.l2, strips.h1_seminorm) == pytest.approx((whole.l2, whole.h1_seminorm), rel=1e-14)
