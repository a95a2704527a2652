"""ARAP distortion and scaled Jacobians, of matrices and of volumes, on maps whose values can be worked out by hand."""

import numpy as np
import pytest
from block_bodies import rod
from patches import SYMMETRIES, turned

from parameterize.quality import distortion as module
from parameterize.quality.distortion import (
    arap,
    arap_grid,
    arap_on,
    in_own_box,
    own_boxes,
    scaled_jacobian,
)
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume


def bent():
    """A map whose Jacobian differs from place to place."""
    return BSplineVolume.from_function(lambda u, v, w: (u + 0.3 * v * w, v + 0.2 * u**2, w - 0.1 * u * v), 8)


def rotations(n, seed=0):
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, 3, 3)))
    return q * np.sign(np.linalg.det(q))[:, None, None]


def test_distortion_agrees_with_the_singular_values_of_lapack():
    matrices = np.random.default_rng(0).standard_normal((4, 500, 3, 3))
    sigma = np.linalg.svd(matrices, compute_uv=False)
    sigma[..., 2] *= np.sign(np.linalg.det(matrices))
    np.testing.assert_allclose(arap(matrices), np.sum((sigma - 1.0) ** 2, axis=-1), rtol=1e-12)
    graded = rotations(100) @ np.diag([1.0, 1e-3, 1e-10]) @ rotations(100, 2)
    np.testing.assert_allclose(arap(graded), (1.0 - 1e-3) ** 2 + (1.0 - 1e-10) ** 2, rtol=1e-14)


@pytest.mark.parametrize("size", [1e-200, 1e100])
def test_distortion_is_right_in_any_unit(size):
    assert arap(size * np.diag([3.0, 2.0, 1.0])) == pytest.approx(np.sum((size * np.array([3.0, 2.0, 1.0]) - 1.0) ** 2))
    assert arap(np.zeros((3, 3))) == 3.0


@pytest.mark.parametrize(
    ("bad", "message"), [(np.zeros((3, 2)), r"shape \(..., 3, 3\)"), (np.full((3, 3), np.nan), "finite")]
)
def test_bad_jacobians_are_refused(bad, message):
    with pytest.raises(ValueError, match=message):
        arap(bad)


def test_arap_by_hand():
    assert arap(np.diag([2.0, 1.0, 0.5])) == pytest.approx(1.25)  # 1 + 0 + 1/4
    assert arap(np.diag([0.5, 3.0, -1.0])) == pytest.approx(0.0 + 4.0 + 2.25)  # the smallest, 0.5, takes the sign
    np.testing.assert_allclose(arap(rotations(20)), 0.0, atol=1e-28)
    np.testing.assert_allclose(arap(-rotations(20)), 4.0, rtol=1e-14)  # mirrored: (-1 - 1)^2


def test_arap_agrees_with_the_polar_rotation():
    rng = np.random.default_rng(3)
    matrices = rng.standard_normal((200, 3, 3))
    u, _, vt = np.linalg.svd(matrices)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    closest = u @ vt  # rotation closest to J: ARAP is the squared distance to it
    np.testing.assert_allclose(arap(matrices), np.sum((matrices - closest) ** 2, axis=(1, 2)), rtol=1e-9)


def test_scaled_jacobian():
    assert scaled_jacobian(np.diag([2.0, 5.0, 0.1])) == pytest.approx(1.0)
    assert scaled_jacobian(np.diag([2.0, 5.0, -0.1])) == pytest.approx(-1.0)
    assert scaled_jacobian(np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])) == pytest.approx(0.5**0.5)
    assert scaled_jacobian(np.diag([1.0, 1.0, 0.0])) == 0.0


def test_arap_grid_integrates_over_the_cube():
    row = greville(open_uniform_knots(5, 3), 3)
    points = np.stack(np.meshgrid(row, row, row, indexing="ij"), axis=-1)
    points[..., 0] += 0.5 * np.linspace(0.0, 1.0, 5)[:, None, None] ** 2  # x = x(u): ARAP is (x' - 1)^2
    (u, v, w), (values,), weights = arap_grid(BSplineVolume.uniform(points), n_gauss=4)
    assert values.shape == weights.shape == (8, 8, 8) == (len(u), len(v), len(w))
    assert weights.sum() == pytest.approx(1.0, rel=1e-14)
    rate = BSplineVolume.uniform(points).grid_jacobian(u, [0.5], [0.5])[:, 0, 0, 0, 0]
    np.testing.assert_allclose(values, np.broadcast_to((rate[:, None, None] - 1.0) ** 2, values.shape), atol=1e-13)
    _, (plain, scaled), _ = arap_grid(BSplineVolume.uniform(points), n_gauss=1, scales=(1.0, 3.0))
    np.testing.assert_allclose(plain, arap_grid(BSplineVolume.uniform(points), n_gauss=1)[1][0], rtol=1e-12)
    np.testing.assert_allclose(scaled, arap_grid(BSplineVolume.uniform(3.0 * points), n_gauss=1)[1][0], rtol=1e-12)


def test_slabs_do_not_show(monkeypatch):
    volume = bent()
    whole = arap_grid(volume)[1]
    monkeypatch.setattr("parameterize.quality.distortion._SLAB_POINTS", 500)
    np.testing.assert_allclose(arap_grid(volume)[1], whole, rtol=1e-13)


def test_a_long_straight_block_does_not_distort_its_own_box():
    rod = BSplineVolume.from_function(lambda u, v, w: (2.0 * u, 0.5 * v, 30.0 * w), 5)
    found = in_own_box(rod)
    assert found.box == pytest.approx((2.0, 0.5, 30.0), rel=1e-12) and found.volume == pytest.approx(30.0, rel=1e-12)
    assert found.arap.max < 1e-20 and found.scaled_jacobian == pytest.approx(1.0)
    assert found.points == 2**3 * 3**3


def test_own_box_by_hand():
    """x = u + u^2 / 2 has |F_u| = 1 + u, so the box is 3/2 long and the stretch in it (1 + u) / (3/2)."""
    volume = BSplineVolume.from_function(lambda u, v, w: (u + u**2 / 2.0, v, w + v), 5)
    found = in_own_box(volume)
    assert found.box == pytest.approx((1.5, 2.0**0.5, 1.0), rel=1e-12)
    assert found.scaled_jacobian == pytest.approx(2.0**-0.5)
    sheared = np.array([[2.0**-0.5, 0.0], [2.0**-0.5, 1.0]])
    rest = np.sum((np.linalg.svd(sheared, compute_uv=False) - 1.0) ** 2)
    assert found.arap.mean == pytest.approx(1.0 / 27.0 + rest)  # the integral of ((1 + u) / 1.5 - 1)^2 is 1/27
    values = arap_on(volume, [0.5], [0.1, 0.9], [0.3], own_boxes(volume)[0])
    assert values == pytest.approx(rest, abs=1e-14) and values.shape == (1, 2, 1)


@pytest.mark.parametrize("symmetry", SYMMETRIES[::7])
def test_own_box_does_not_depend_on_how_parameters_run(symmetry, monkeypatch):
    volume = bent()
    found, other = in_own_box(volume), in_own_box(turned(volume, symmetry))
    assert sorted(other.box) == pytest.approx(sorted(found.box), rel=1e-12)
    for name in ("volume", "scaled_jacobian"):
        assert getattr(other, name) == pytest.approx(getattr(found, name), rel=1e-12)
    assert (other.arap.mean, other.arap.max) == pytest.approx((found.arap.mean, found.arap.max), rel=1e-9)
    monkeypatch.setattr(module, "_SLAB_POINTS", 500)
    assert in_own_box(volume).arap.mean == pytest.approx(found.arap.mean, rel=1e-12)


def test_lengths_of_an_affine_block_are_those_of_the_columns_of_its_matrix():
    knots = tuple(open_uniform_knots(n, 3) for n in (5, 6, 8))
    places = np.stack(np.meshgrid(*(greville(row, 3) for row in knots), indexing="ij"), axis=-1)
    matrix = np.array([[2.0, 0.3, 0.0], [0.0, 0.5, 0.4], [0.0, 0.1, 3.0]])
    lengths = own_boxes(BSplineVolume((3, 3, 3), knots, places @ matrix.T + 7.0))
    assert lengths == pytest.approx(np.linalg.norm(matrix, axis=0)[None], rel=1e-12)


def test_lengths_follow_the_directions_of_turned_blocks():
    lengths = own_boxes(rod(7, lengths=(1.0, 2.0, 0.7)).body)
    assert lengths.shape == (3, 3)
    assert lengths[0] == pytest.approx([1.0, 0.5, 0.8])
    assert not np.allclose(lengths[1], [2.0, 0.5, 0.8])  # a direction of the block is another one in space
    assert np.sort(lengths[1]) == pytest.approx([0.5, 0.8, 2.0])
    assert np.sort(lengths[2]) == pytest.approx([0.5, 0.7, 0.8])


def test_the_mean_of_a_derivative_that_varies():
    volume = BSplineVolume.from_function(lambda u, v, w: (u + u**2, v, w * (1.0 + v)), 6)
    assert own_boxes(volume)[0, 0] == pytest.approx(2.0, rel=1e-12)
    assert own_boxes(volume)[0, 2] == pytest.approx(1.5, rel=1e-12)
