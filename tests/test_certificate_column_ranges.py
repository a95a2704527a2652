"""Bounds of det J by the ranges of its columns, against Bernstein coefficients of the same spans."""

from dataclasses import replace

import numpy as np
import pytest

import parameterize.certificate.jacobian as jacobian
from parameterize.certificate.certify import certify
from parameterize.certificate.column_ranges import bounds_by_ranges
from parameterize.certificate.determinant import DeterminantForm
from parameterize.spline.bspline import open_uniform_knots
from parameterize.spline.orientation import mirrored
from parameterize.spline.patch_groups import PatchGroup, group_of
from parameterize.spline.volume import BSplineVolume
from solve import benchmark_volume

MIXED = np.array([0.0, 0.0, 0.0, 0.1, 0.4, 0.4, 0.7, 1.0, 1.0, 1.0])


def disturbed(amplitude, degrees=(2, 3, 1), scale=(1.0, 1.0, 1.0)):
    """The identity with moved control points, of three degrees, with repeated and uneven knots."""
    knots = (MIXED, open_uniform_knots(6, degrees[1]), open_uniform_knots(5, degrees[2]))
    greville = [
        np.array([k[i + 1 : i + 1 + p].mean() for i in range(len(k) - p - 1)])
        for k, p in zip(knots, degrees, strict=True)
    ]
    points = np.stack(np.meshgrid(*greville, indexing="ij"), axis=-1)
    points += amplitude * np.random.default_rng(1).uniform(-1.0, 1.0, points.shape)
    return BSplineVolume(degrees, knots, points * scale)


@pytest.mark.parametrize("amplitude", [0.0, 0.003, 0.01, 0.3])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (1e-6, 1.0, 1e3), (1.0, -1.0, 1.0)])
def test_no_coefficient_is_beyond_its_bound(amplitude, scale):
    group = group_of(disturbed(amplitude, scale=scale))
    form = DeterminantForm(group)
    bounds = bounds_by_ranges(group, form.nets)[0]
    values, permanents = form.coefficients(form.numbers(np.arange(form.span_count)))
    room = form.errors(permanents)
    least, most = values.min(axis=(0, 1, 2)) + room, values.max(axis=(0, 1, 2)) - room
    assert np.all(least[bounds > 0.0] >= bounds[bounds > 0.0])
    assert np.all(most[bounds < 0.0] <= bounds[bounds < 0.0])
    hand = np.sign(np.prod(scale))
    assert np.all(hand * bounds >= 0.0) or amplitude == 0.3
    if amplitude == 0.0:
        np.testing.assert_allclose(bounds, hand * np.min(hand * values, axis=(0, 1, 2)), rtol=1e-12)
    assert np.any(bounds == 0.0) == (amplitude == 0.3)


def test_a_span_in_a_plane_has_no_bound():
    flat = disturbed(0.01, scale=(1.0, 1.0, 0.0))
    group = group_of(flat)
    assert not bounds_by_ranges(group, DeterminantForm(group).nets).any()


@pytest.mark.parametrize("volume", [benchmark_volume(9, amplitude=a) for a in (0.05, 0.1, 0.14, 0.2)], ids=str)
@pytest.mark.parametrize("turned", [replace, mirrored])
def test_the_certificate_is_that_of_all_coefficients(volume, turned, monkeypatch):
    body = turned(volume)
    found = certify(body).only
    monkeypatch.setattr(jacobian, "bounds_by_ranges", lambda group, _: np.zeros((len(group), 6**3)))
    known = certify(body).only
    assert found.verdict == known.verdict
    assert found.left_handed == known.left_handed == (turned is mirrored)
    np.testing.assert_array_equal(found.unproved, known.unproved)
    assert found.lower_bound == pytest.approx(known.lower_bound, rel=2e-6)
    assert found.mean_det == pytest.approx(known.mean_det, rel=1e-12)


def test_groups_of_patches_keep_their_own_bounds():
    """One of two patches is far from folding, and the other one folds."""
    parts = [benchmark_volume(9, amplitude=a) for a in (0.02, 0.4)]
    group = PatchGroup(np.arange(2), parts[0].degrees, parts[0].knots, np.stack([p.control_points for p in parts]))
    together = bounds_by_ranges(group, DeterminantForm(group).nets)
    assert (together[0] > 0.0).all()
    assert (together[1] == 0.0).any()
    for part, verdict, found in zip(
        parts, ("certified", "folded"), jacobian.certify_patches(parts, group, 6), strict=True
    ):
        alone = certify(part).only
        assert found.verdict == alone.verdict == verdict
        assert found.lower_bound == pytest.approx(alone.lower_bound, rel=2e-6)
