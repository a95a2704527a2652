import numpy as np
import pytest

from parameterize.spline.bspline import collocation
from solve.discretization.face_data import boundary_coefficients
from solve.discretization.quadrature import spline_rule
from solve.discretization.space import trial_space
from solve.study import benchmark_volume


@pytest.fixture(scope="module")
def volume():
    return benchmark_volume(5)


def smooth(x, y, z):
    return np.exp(x + z) * np.sin(y)


def values(points, face):
    return smooth(*points)[None]


@pytest.mark.parametrize("component", [0, 1, 2])
def test_data_in_the_space_are_reproduced(volume, component):
    """x, y and z are splines on the map: their coefficients are its control points."""
    found = boundary_coefficients(volume, trial_space(volume), lambda x, face: x[component][None])[0]
    expected = volume.control_points[..., component].copy()
    expected[1:-1, 1:-1, 1:-1] = 0.0
    assert np.allclose(found, expected, atol=1e-12)


def test_corners_are_interpolated_and_the_inside_is_zero(volume):
    found = boundary_coefficients(volume, trial_space(volume), values)[0]
    corners = np.ix_((0, -1), (0, -1), (0, -1))
    assert np.allclose(found[corners], smooth(*np.moveaxis(volume.control_points[corners], -1, 0)), atol=1e-14)
    assert np.all(found[1:-1, 1:-1, 1:-1] == 0.0)


def test_errors_are_orthogonal_to_the_functions_inside_an_edge_and_a_face(volume):
    space = trial_space(volume)
    found = boundary_coefficients(volume, space, values)[0]
    points, weights = spline_rule(space.knots[0], 3, 6)
    basis = collocation(space.knots[0], 3, points).toarray()  # the same in the three directions
    inner = weights[:, None] * basis[:, 1:-1]
    edge = smooth(*np.moveaxis(volume.grid(points, [1.0], [0.0])[:, 0, 0], -1, 0)) - basis @ found[:, -1, 0]
    assert np.abs(edge).max() > 1e-6  # not interpolated everywhere, so the next line says something
    assert np.abs(inner.T @ edge).max() < 1e-15
    face = smooth(*np.moveaxis(volume.grid(points, points, [1.0])[:, :, 0], -1, 0)) - basis @ found[:, :, -1] @ basis.T
    assert np.abs(inner.T @ face @ inner).max() < 1e-15


def test_data_on_some_faces_leave_the_others_free(volume):
    """A face with data keeps its edges; what lies on the other faces alone stays zero."""
    space = trial_space(volume)
    found = boundary_coefficients(volume, trial_space(volume, dirichlet=("u0", "w1")), values)[0]
    everywhere = boundary_coefficients(volume, space, values)[0]
    assert np.array_equal(found[0], everywhere[0]) and np.array_equal(found[:, :, -1], everywhere[:, :, -1])
    assert np.all(found[1:, :, :-1] == 0.0)
