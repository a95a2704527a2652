"""Rational volumes: exact circles and spheres, derivatives, refinement, the file, refused weights."""

from dataclasses import replace

import numpy as np
import pytest
from rational_shapes import bent_bar, octant, quarter_ring

from parameterize.spline.body import Body
from parameterize.spline.orientation import mirrored
from parameterize.spline.volume import BSplineVolume


def points_inside(n=50):
    return np.random.default_rng(5).uniform(0.02, 0.98, (n, 3))


def test_a_ring_has_exact_circles():
    x, places = quarter_ring(1.0, 3.0)(points_inside()).T, points_inside()
    np.testing.assert_allclose(np.hypot(x[0], x[1]), 1.0 + 2.0 * places[:, 0], rtol=1e-14)
    np.testing.assert_allclose(x[2], places[:, 2], rtol=1e-14)


def test_an_octant_has_exact_spheres():
    places = points_inside()
    np.testing.assert_allclose(np.linalg.norm(octant()(places), axis=1), 1.0 + places[:, 0], rtol=1e-14)


def test_first_and_second_derivatives_agree_with_differences():
    volume, x, step = bent_bar(), points_inside(), 1e-5
    x = np.delete(x, np.flatnonzero(np.abs(x[:, 1] - 0.5) < 2 * step), axis=0)
    jacobian, hessian = volume.jacobian(x), volume.hessian(x)
    for b in range(3):
        shift = step * np.eye(3)[b]
        np.testing.assert_allclose(jacobian[:, :, b], (volume(x + shift) - volume(x - shift)) / (2 * step), atol=1e-7)
        slope = (volume.jacobian(x + shift) - volume.jacobian(x - shift)) / (2 * step)
        np.testing.assert_allclose(hessian[..., b], slope, atol=1e-5)
    np.testing.assert_allclose(hessian, np.swapaxes(hessian, 2, 3), atol=1e-12)


def test_derivatives_of_the_angle_are_those_of_the_formula():
    """With t = v (1 - v), x = (1 - v^2 + (root 2 - 2) t) / W and W = 1 + (root 2 - 2) t on the inner circle."""
    v = np.linspace(0.0, 1.0, 7)
    k = np.sqrt(2.0) - 2.0
    t = np.polynomial.Polynomial([0.0, 1.0, -1.0])
    top, below = np.polynomial.Polynomial([1.0, 0.0, -1.0]) + k * t, 1.0 + k * t
    slope = (top.deriv() * below - top * below.deriv())(v) / below(v) ** 2
    numerator = top.deriv() * below - top * below.deriv()
    bend = (numerator.deriv() * below - 2.0 * numerator * below.deriv())(v) / below(v) ** 3
    places = np.stack([0.0 * v, v, 0.0 * v], axis=1)
    np.testing.assert_allclose(quarter_ring()(places)[:, 0], (top / 1.0)(v) / below(v), atol=1e-15)
    np.testing.assert_allclose(quarter_ring().jacobian(places)[:, 0, 1], slope, atol=1e-13)
    np.testing.assert_allclose(quarter_ring().hessian(places)[:, 0, 1, 1], bend, atol=1e-12)


def test_grid_agrees_with_points():
    volume = bent_bar()
    u, v, w = np.linspace(0, 1, 4), np.array([0.3]), np.linspace(0.1, 0.9, 3)
    x = np.stack(np.meshgrid(u, v, w, indexing="ij"), axis=-1).reshape(-1, 3)
    np.testing.assert_allclose(volume.grid(u, v, w).reshape(-1, 3), volume(x), atol=1e-14)
    np.testing.assert_allclose(volume.grid_jacobian(u, v, w).reshape(-1, 3, 3), volume.jacobian(x), atol=1e-12)
    bend = volume.grid(u, v, w, (1, 1, 0)).reshape(-1, 3)
    np.testing.assert_allclose(bend, volume.hessian(x)[:, :, 0, 1], atol=1e-11)


@pytest.mark.parametrize("volume", [quarter_ring(), octant(), bent_bar()])
def test_refinement_keeps_the_map(volume):
    fine, x = volume.refined(2), points_inside()
    assert fine.weights is not None and fine.weights.shape == fine.shape > volume.shape
    np.testing.assert_allclose(fine(x), volume(x), atol=1e-14)
    np.testing.assert_allclose(fine.jacobian(x), volume.jacobian(x), atol=1e-12)


def test_parts_of_a_ring_lie_on_its_circles_and_are_glued():
    parts = quarter_ring().divided(v=[0.3, 0.5])
    for part, (low, high) in zip(parts, ((0.0, 0.3), (0.3, 0.5), (0.5, 1.0)), strict=True):
        places = points_inside()
        whole = np.stack([places[:, 0], low + (high - low) * places[:, 1], places[:, 2]], axis=1)
        np.testing.assert_allclose(part(places), quarter_ring()(whole), atol=1e-14)
    assert len(Body.from_patches(parts).interfaces) == 2


def test_moved_and_mirrored():
    volume, x = bent_bar(), points_inside()
    moved = volume.transformed(2.5, [1.0, -2.0, 3.0])
    np.testing.assert_allclose(moved(x), 2.5 * volume(x) + np.array([1.0, -2.0, 3.0]), atol=1e-14)
    np.testing.assert_array_equal(mirrored(volume)(x), volume(x) * [-1.0, 1.0, 1.0])


def test_weights_times_a_number_are_the_same_map():
    volume, x = bent_bar(), points_inside()
    np.testing.assert_allclose(replace(volume, weights=1e-60 * volume.weights)(x), volume(x), atol=1e-14)


def test_equal_weights_are_none():
    volume = bent_bar()
    plain = replace(volume, weights=np.full(volume.shape, 0.3))
    assert plain.weights is None
    np.testing.assert_array_equal(plain(points_inside()), replace(volume, weights=None)(points_inside()))


def test_save_and_load(tmp_path):
    volume = bent_bar()
    volume.save(tmp_path / "volume.npz")
    loaded = BSplineVolume.load(tmp_path / "volume.npz")
    np.testing.assert_array_equal(loaded.weights, volume.weights)
    np.testing.assert_array_equal(loaded.control_points, volume.control_points)
    replace(volume, weights=None).save(tmp_path / "plain.npz")
    assert "weights" not in np.load(tmp_path / "plain.npz").files
    assert BSplineVolume.load(tmp_path / "plain.npz").weights is None


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (np.ones((6, 5)), r"weights must have shape \(6, 5, 4\), one for each control point, got \(6, 5\)"),
        (np.zeros((6, 5, 4)), "weights must be positive, from 1e-100 to 1e\\+100, got 0"),
        (-np.ones((6, 5, 4)), "got -1"),
        (np.full((6, 5, 4), np.nan), "got nan"),
        (np.full((6, 5, 4), np.inf), "got inf"),
        (np.ones((6, 5, 4), complex), "weights must be real numbers, got complex128"),
    ],
)
def test_other_weights_are_refused(tmp_path, weights, message):
    volume = bent_bar()
    with pytest.raises(ValueError, match=message):
        replace(volume, weights=weights)
    volume.save(tmp_path / "volume.npz")
    stored = dict(np.load(tmp_path / "volume.npz")) | {"weights": weights}
    np.savez(tmp_path / "volume.npz", **stored)
    with pytest.raises(ValueError, match=r"volume\.npz: weights"):
        BSplineVolume.load(tmp_path / "volume.npz")


def test_faces_are_glued_where_their_weights_agree_up_to_a_factor():
    inner, outer = quarter_ring(1.0, 2.0), quarter_ring(2.0, 3.0)
    body = Body.from_patches([inner, replace(outer, weights=3.0 * outer.weights)])
    assert [str(interface) for interface in body.interfaces] == ["p0_u1 = p1_u0"]
    np.testing.assert_array_equal(body.patches[1].weights, 3.0 * outer.weights)
    assert not Body.from_patches([inner, replace(outer, weights=outer.weights**2)]).interfaces  # no circle
    with pytest.raises(ValueError, match="the control points or weights of the two faces differ"):
        Body((inner, replace(outer, weights=None)), body.interfaces)
