import numpy as np
import pytest

import iga_nn
from parameterize.spline.bspline import collocation, greville
from solve.discretization.space import trial_space
from solve.options import SolveOptions
from solve.preparation import discretized
from solve.refinement.indicators import along_directions, beyond, directional_energies, energies


def cube(spans=(1, 1, 1)):
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), tuple(n + 1 for n in spans), 1)


def spline_of(space, function):
    """Return the coefficients (1, n_u, n_v, n_w) of the spline with a function's values at the Greville points."""
    rows = [greville(row, p) for row, p in zip(space.knots, space.degrees, strict=True)]
    found = function(*np.meshgrid(*rows, indexing="ij"))
    for axis, (row, degree, points) in enumerate(zip(space.knots, space.degrees, rows, strict=True)):
        matrix = np.linalg.inv(collocation(row, degree, points).toarray())
        found = np.moveaxis(np.tensordot(matrix, np.moveaxis(found, axis, 0), axes=1), 0, axis)
    return found[None]


def missed(volume, degree, function):
    problem = iga_nn.Poisson(source="1", boundary="0")
    system = discretized(volume, problem, SolveOptions(degree=degree))
    raised = trial_space(volume, 0, degree + 1)
    return directional_energies(system.stated, [raised], [spline_of(raised, function)])


@pytest.mark.parametrize("degree", [2, 3])
def test_what_the_space_holds_is_not_missed(degree):
    (found,) = missed(cube((3, 2, 1)), degree, lambda x, y, z: x**degree + y * z**2 + x * y)
    assert found.shape == (3, 3, 2, 1)
    assert np.abs(found).max() < 1e-24


def test_one_direction_misses_a_cubic():
    """3 x^2 minus its best line on (0, 1) is half of a Legendre polynomial: squared, it has the integral 1/20."""
    (found,) = missed(cube(), 2, lambda x, y, z: x**3 + z)
    assert found[0].sum() == pytest.approx(1 / 20)
    assert np.abs(found[1:]).max() < 1e-24


def test_a_halved_span_misses_a_quarter_to_the_degree():
    energy = [missed(cube((n, 1, 1)), 2, lambda x, y, z: x**3)[0][0].sum() for n in (8, 16)]
    assert energy[1] / energy[0] == pytest.approx(2.0**-4, rel=0.05)


def test_slabs_are_sums_over_the_spans_of_their_own_direction():
    (found,) = missed(cube((2, 3, 1)), 2, lambda x, y, z: x**3 * y**3)
    ((u, v, w),) = along_directions([found])
    assert u.shape == (2,) and v.shape == (3,) and w.shape == (1,)
    assert u == pytest.approx(found[0].sum(axis=(1, 2))) and v == pytest.approx(found[1].sum(axis=(0, 2)))


def test_finer_breakpoints_of_the_raised_space_add_up_to_elements():
    low, high = (0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0), (0.0, 0.0, 0.0, 0.0, 0.25, 0.5, 1.0, 1.0, 1.0, 1.0)
    row, matrix = beyond(low, 2, high, 3)
    assert row.tolist() == [0.0] * 4 + [0.25, 0.5, 0.5] + [1.0] * 4
    assert matrix.shape == (7, 6)
    assert np.abs(matrix[[0, -1]]).max() < 1e-12  # values at the ends are kept


def test_energy_of_a_line_is_its_slope_squared_times_the_volume():
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (2 * u, v, w), 2, 1)
    system = discretized(volume, iga_nn.Poisson(source="1", kappa="3", boundary="0"), SolveOptions(degree=2))
    space = system.stated[0].space
    (found,) = energies(system.stated, [space], [spline_of(space, lambda u, v, w: 2 * u)])
    assert found.sum() == pytest.approx(6.0)
