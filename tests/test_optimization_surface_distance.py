import numpy as np
import pytest
from shapes import ball, rounded_cube
from wavy import NETS, as_volume, on_the_cube, wavy_control

from iga_nn.samples import sample
from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.surface_distance import Correspondence
from parameterize.surface.geometry import vertex_quadrics, vertex_weights


def make_fit(points, parameters, tangential=0.02):
    rng = np.random.default_rng(1)
    normals = rng.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    quadrics = normals[:, :, None] * normals[:, None, :] + tangential * np.eye(3)
    weights = rng.uniform(0.5, 1.5, len(points))
    places = SlidingParameters(NETS, parameters, triangles=np.array([[0, 1, 2]]))
    weights /= weights.sum()
    return Correspondence(places, points, quadrics, weights), quadrics * weights[:, None, None]


def test_residuals_are_those_of_the_volume():
    parameters, _ = on_the_cube(200)
    points = np.random.default_rng(2).normal(size=(200, 3))
    control = wavy_control()
    fit, metric = make_fit(points, parameters)
    expected = as_volume(control)(parameters) - points
    assert fit.residuals(control) == pytest.approx(expected)
    energy, _ = fit.energy_and_gradient(control)
    assert energy == pytest.approx(np.einsum("ni,nij,nj->", expected, metric, expected))


def test_points_that_are_held_count_in_all_directions():
    parameters, _ = on_the_cube(200)
    points = np.random.default_rng(2).normal(size=(200, 3))
    control = wavy_control()
    fit, metric = make_fit(points, parameters)
    held = np.arange(200) < 80
    fit.hold(held)
    residual = fit.residuals(control)
    plain, along = fit.weights * (residual**2).sum(axis=1), np.einsum("ni,nij,nj->n", residual, metric, residual)
    each = np.where(held, plain, along)
    assert fit.energy_and_gradient(control)[0] == pytest.approx(each.sum())
    fit.hold(np.zeros(200, dtype=bool))
    assert fit.energy_and_gradient(control)[0] == pytest.approx(along.sum())


def test_energy_is_quadratic_with_the_given_gradient_and_hessian():
    parameters, _ = on_the_cube(200)
    fit, _ = make_fit(parameters + 0.1, parameters)
    control = wavy_control()
    direction = np.random.default_rng(0).normal(size=control.shape)
    energy, gradient = fit.energy_and_gradient(control)
    slope = float((gradient * direction).sum())
    curvature = float((direction * fit.curvature(control)(direction.astype(np.float32))).sum())
    for h in (0.5, -0.3):  # the curvature is in single precision
        moved, _ = fit.energy_and_gradient(control + h * direction)
        assert moved == pytest.approx(energy + h * slope + 0.5 * h**2 * curvature, rel=1e-6)


def test_quadrics_measure_along_the_normal_of_a_sphere():
    vertices, faces = ball(1500)
    quadrics = vertex_quadrics(vertices, faces, 0.02)
    along = np.einsum("ni,nij,nj->n", vertices, quadrics, vertices)
    assert along == pytest.approx(1.02, abs=0.01)
    assert np.linalg.eigvalsh(quadrics)[:, :2] == pytest.approx(0.02, abs=0.01)  # nearly free along the surface


@pytest.mark.parametrize("angle", [20.0, 40.0])
def test_quadrics_hold_across_an_edge(angle):
    rise = np.tan(np.radians(0.5 * angle))
    vertices = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.5, -rise], [1.0, 0.5, -rise]])
    quadrics = vertex_quadrics(vertices, np.array([[0, 1, 2], [1, 0, 3]]), 0.0)
    assert np.linalg.eigvalsh(quadrics[0])[1] == pytest.approx(np.sin(np.radians(0.5 * angle)) ** 2, abs=1e-12)


def test_quadrics_at_the_corner_of_a_cube_hold_in_all_directions():
    cube = sample("cube")
    quadrics = vertex_quadrics(cube.vertices, cube.faces, 0.0)
    corner = np.flatnonzero((cube.vertices == cube.vertices.min(axis=0)).all(axis=1))
    assert np.linalg.eigvalsh(quadrics[corner[0]]).min() > 0.2
    middle = np.linalg.norm(cube.vertices - cube.vertices.mean(axis=0) - [0.0, 0.0, 0.5], axis=1).argmin()
    assert quadrics[middle] == pytest.approx(np.diag([0.0, 0.0, 1.0]), abs=1e-12)


def test_weights_sum_to_one_and_follow_the_area():
    vertices, faces = rounded_cube(400)
    weights = vertex_weights(vertices, faces, 400)
    assert weights.sum() == pytest.approx(1.0) and weights.min() >= 0.5 / 400
    needle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1e-9, 1e-9, 1e-9]])
    weights = vertex_weights(needle, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), 4)
    area = np.array([0.5, 1.0, 1.0, 0.5])  # two large triangles, 1-2-0 and 1-2-3, share an edge
    assert weights == pytest.approx(0.125 + 0.5 * area / area.sum(), abs=1e-6)
    weights = vertex_weights(needle, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), n_own=3)
    assert weights == pytest.approx([1 / 6, 1 / 6, 1 / 6, 0] + 0.5 * area / area.sum(), abs=1e-6)
