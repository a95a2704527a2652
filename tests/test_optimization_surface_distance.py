import numpy as np
import pytest
import torch
from shapes import ball, rounded_cube

from iga_nn.samples import sample
from parameterize.cube.cube import snap
from parameterize.cube.flips import flipped
from parameterize.optimization.surface_distance import SurfaceFit, fold_over_edges
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.geometry import vertex_quadrics, vertex_weights
from parameterize.training.target_shapes import nearest_on_cube

CPU = torch.device("cpu")
DEGREE = 3
KNOTS = (open_uniform_knots(6, DEGREE), open_uniform_knots(5, DEGREE), open_uniform_knots(7, DEGREE))


def wavy_control(amplitude=0.02):
    rows = [greville(k, DEGREE) for k in KNOTS]
    points = np.stack(np.meshgrid(*rows, indexing="ij"))
    return torch.as_tensor(points + amplitude * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape))


def as_volume(control):
    return BSplineVolume((DEGREE,) * 3, KNOTS, control.permute(1, 2, 3, 0).numpy())


def faces_of(parameters):
    on = np.stack([parameters == 0.0, parameters == 1.0], axis=-1).reshape(-1, 6)
    return on.argmax(axis=1)


def on_the_cube(count, seed=0):
    points = torch.as_tensor(np.random.default_rng(seed).uniform(-0.2, 1.2, (count, 3)))
    parameters = nearest_on_cube(points).numpy()
    return parameters, faces_of(parameters)


def make_fit(points, parameters, cube_faces, tangential=0.02, triangles=((0, 1, 2),)):
    rng = np.random.default_rng(1)
    normals = rng.normal(size=points.shape)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    quadrics = normals[:, :, None] * normals[:, None, :] + tangential * np.eye(3)
    weights = rng.uniform(0.5, 1.5, len(points))
    return SurfaceFit(
        KNOTS,
        DEGREE,
        points,
        quadrics,
        weights / weights.sum(),
        parameters,
        cube_faces,
        np.array(triangles),
        device=CPU,
    ), quadrics * (weights / weights.sum())[:, None, None]


def test_residuals_are_those_of_the_volume():
    parameters, cube_faces = on_the_cube(200)
    points = np.random.default_rng(2).normal(size=(200, 3))
    control = wavy_control()
    fit, metric = make_fit(points, parameters, cube_faces)
    expected = as_volume(control)(parameters) - points
    assert fit.residuals(control) == pytest.approx(expected)
    energy, _ = fit.energy_and_gradient(control)
    assert energy == pytest.approx(np.einsum("ni,nij,nj->", expected, metric, expected))


def test_energy_is_quadratic_with_the_given_gradient_and_hessian():
    parameters, cube_faces = on_the_cube(200)
    fit, _ = make_fit(parameters + 0.1, parameters, cube_faces)
    control = wavy_control()
    direction = torch.randn(control.shape, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    energy, gradient = fit.energy_and_gradient(control)
    slope = float((gradient * direction).sum())
    curvature = float((direction * fit.hessian(torch.float64)(direction)).sum())
    for h in (0.5, -0.3):
        moved, _ = fit.energy_and_gradient(control + h * direction)
        assert moved == pytest.approx(energy + h * slope + 0.5 * h**2 * curvature, rel=1e-10)


def test_sliding_lowers_the_residuals():
    control = wavy_control()
    volume = as_volume(control)
    truth, cube_faces = on_the_cube(300)
    rng = np.random.default_rng(3)
    start = truth + 0.03 * rng.uniform(-1.0, 1.0, truth.shape)
    start = np.clip(start, 0.0, 1.0)
    start[np.arange(300), cube_faces // 2] = cube_faces % 2
    fit, _ = make_fit(volume(truth), start, cube_faces)
    before = np.linalg.norm(fit.residuals(control), axis=1)
    for _ in range(6):
        fit.slide(control, 0.1)
    after = np.linalg.norm(fit.residuals(control), axis=1)
    assert after.max() < 1e-4 * before.max()
    assert_on_the_cube(fit)


def test_a_slide_is_no_longer_than_told():
    control = wavy_control()
    start, cube_faces = on_the_cube(200)
    fit, _ = make_fit(start[::-1].copy(), start, cube_faces)  # far away
    fit.slide(control, 0.01)
    same = fit.cube_faces == cube_faces
    assert same.mean() > 0.8
    steps = np.linalg.norm(fit.parameters - start, axis=1)
    assert steps[same].max() <= 0.01 + 1e-12 and steps.max() > 0.009
    assert_on_the_cube(fit)


def test_no_slide_leads_away():
    control = wavy_control()
    start, cube_faces = on_the_cube(200)
    fit, _ = make_fit(start[::-1].copy(), start, cube_faces)
    before = np.linalg.norm(fit.residuals(control), axis=1)
    for _ in range(3):
        fit.slide(control, 0.3)
        after = np.linalg.norm(fit.residuals(control), axis=1)
        assert (after <= before + 1e-12).all()
        before = after
    assert_on_the_cube(fit)


def test_a_slide_that_keeps_the_layout_turns_no_triangle():
    places, triangles = rounded_cube(300, power=40.0)
    places = snap(places)
    control = wavy_control()
    targets = as_volume(control)(snap(places + 0.1 * np.random.default_rng(0).uniform(-1.0, 1.0, places.shape)))
    for keep_layout in (False, True):
        fit, _ = make_fit(targets, places, faces_of(places), triangles=triangles)
        before = np.linalg.norm(fit.residuals(control), axis=1)
        for _ in range(5):
            fit.slide(control, 0.1, keep_layout=keep_layout)
        assert flipped(fit.parameters, triangles).any() != keep_layout
        assert np.linalg.norm(fit.residuals(control), axis=1).mean() < 0.9 * before.mean()
        assert_on_the_cube(fit)


def test_relaxing_turns_flipped_triangles_back():
    places, triangles = rounded_cube(300, power=40.0)
    places = snap(places)
    assert not flipped(places, triangles).any()
    tangled = places.copy()
    a, b, c = triangles[0]
    tangled[a] = snap(places[[a]] + 1.5 * (places[[b]] + places[[c]] - 2.0 * places[[a]]) / 2.0)[0]  # past the edge bc
    assert flipped(tangled, triangles).any()
    fit, _ = make_fit(places, tangled, faces_of(tangled), triangles=triangles)
    fit.relax(100)
    assert not flipped(fit.parameters, triangles).any()
    assert np.abs(fit.parameters - tangled).max(axis=1).astype(bool).mean() < 0.2  # the others stay
    assert_on_the_cube(fit)


def assert_on_the_cube(fit):
    rows = np.arange(len(fit.parameters))
    assert np.array_equal(fit.parameters[rows, fit.cube_faces // 2], fit.cube_faces % 2)
    assert fit.parameters.min() >= 0.0 and fit.parameters.max() <= 1.0


@pytest.mark.parametrize(
    ("parameters", "face", "expected", "expected_face"),
    [
        ([1.0, 0.4, 0.6], 1, [1.0, 0.4, 0.6], 1),  # nothing to do
        ([1.0, 1.1, 0.6], 1, [0.9, 1.0, 0.6], 3),  # from u1 over the edge to v1
        ([0.0, 1.1, 0.6], 0, [0.1, 1.0, 0.6], 3),  # from u0 over the edge to v1
        ([0.3, 0.4, 0.0], 4, [0.3, 0.4, 0.0], 4),
        ([-0.2, 0.4, 0.0], 4, [0.0, 0.4, 0.2], 0),  # from w0 to u0
        ([-0.2, 1.1, 1.0], 5, [0.0, 1.0, 0.8], 0),  # over a corner: the farther side wins, the other is clipped
        ([0.2, 1.0, 1.0], 5, [0.2, 1.0, 1.0], 5),  # on an edge: stays
    ],
)
def test_folding_over_edges(parameters, face, expected, expected_face):
    found, faces = fold_over_edges(np.array([parameters]), np.array([face]))
    assert found[0].tolist() == pytest.approx(expected) and faces.tolist() == [expected_face]


def test_folding_leaves_its_arguments_alone():
    parameters, faces = np.array([[1.0, 1.1, 0.6]]), np.array([1])
    fold_over_edges(parameters, faces)
    assert parameters.tolist() == [[1.0, 1.1, 0.6]] and faces.tolist() == [1]


def test_quadrics_measure_along_the_normal_of_a_sphere():
    vertices, faces = ball(1500)
    quadrics = vertex_quadrics(vertices, faces, 0.02)
    along = np.einsum("ni,nij,nj->n", vertices, quadrics, vertices)
    assert along == pytest.approx(1.02, abs=0.01)
    assert np.trace(quadrics, axis1=1, axis2=2) == pytest.approx(1.06)


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
    weights = vertex_weights(needle, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]), own=3)
    assert weights == pytest.approx([1 / 6, 1 / 6, 1 / 6, 0] + 0.5 * area / area.sum(), abs=1e-6)
