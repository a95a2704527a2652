"""What comes after a map takes knots that are uneven, and other ones in each direction, as `auto` chooses them."""

import logging

import numpy as np
import pytest

from iga_nn.io.export import export
from iga_nn.io.formats import load_volume
from iga_nn.report.viewer import scene_of
from iga_nn.workflow.verdict import certified_facts
from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.quality.distortion import arap_grid
from parameterize.spline.bspline import breakpoints, greville
from parameterize.spline.volume import BSplineVolume
from solve import Elasticity, Poisson, benchmark_volume, solve_problem

INSERTED = ([0.0125, 0.025, 0.05, 0.1, 0.9], [0.45, 0.5, 0.55], [])  # into spans of a fifth: halved up to four times
WAVE = Poisson(exact="exp(x+z)*sin(y)")


def uneven(move=2e-3):
    """The benchmark map on uneven knots, where its control points then move in proportion to the knots."""
    smooth = benchmark_volume(5)
    finer = smooth.on_knots(
        tuple(np.sort(np.concatenate([row, more])) for row, more in zip(smooth.knots, INSERTED, strict=True))
    )
    u, v, w = (greville(row, 3) for row in finer.knots)
    wave = np.einsum("i,j,k->ijk", np.sin(40.0 * u) * u * (1.0 - u), np.cos(30.0 * v), np.cos(9.0 * w))
    return BSplineVolume((3, 3, 3), finer.knots, finer.control_points + move * wave[..., None])


@pytest.fixture(scope="module")
def volume():
    return uneven()


def test_the_spans_differ(volume):
    assert volume.shape == (13, 11, 8)
    widths = np.diff(breakpoints(volume.knots[0]))
    assert widths.max() == pytest.approx(16.0 * widths.min())


def test_finer_knots_leave_the_map_as_it_is():
    smooth, finer, x = benchmark_volume(5), uneven(move=0.0), np.random.default_rng(0).random((50, 3))
    np.testing.assert_allclose(finer(x), smooth(x), atol=1e-14)
    np.testing.assert_allclose(finer.jacobian(x), smooth.jacobian(x), atol=1e-12)
    with pytest.raises(ValueError, match="must hold every knot"):
        finer.on_knots(smooth.knots)


def test_the_certificate_is_that_of_the_same_map_with_all_spans_halved(volume):
    found, halved = certify(volume), certify(volume.refined())
    assert found.verdict == halved.verdict == "certified"
    assert found.mean_det == pytest.approx(halved.mean_det, rel=1e-12)
    assert 0.0 < found.lower_bound <= halved.lower_bound + 1e-12
    assert check_boundary(volume).injective is True


def test_a_fold_in_the_narrowest_span_is_found_there(volume):
    points = volume.control_points.copy()
    points[1, 5, 4, 0] -= 0.05
    facts = certified_facts(BSplineVolume(volume.degrees, volume.knots, points))
    assert facts["bijective"] == "folded"
    assert facts["witness"][0] < 0.1 and 0.2 < facts["witness"][1] < 0.8
    for place, where in zip(facts["unproved"]["places"], facts["unproved"]["parameters"], strict=True):
        assert np.allclose(place, BSplineVolume(volume.degrees, volume.knots, points)([where])[0])


def test_the_mean_distortion_weighs_spans_by_their_size():
    even, finer = (arap_grid(each) for each in (benchmark_volume(5), uneven(move=0.0)))
    assert np.sum(finer[1][0] * finer[2]) == pytest.approx(np.sum(even[1][0] * even[2]), rel=1e-4)


def test_errors_of_a_solve_fall_at_their_rate(volume, caplog):
    with caplog.at_level(logging.WARNING):
        coarse, fine = (solve_problem(volume, WAVE, refine=level).report for level in (0, 1))
        even = solve_problem(benchmark_volume(8), WAVE).report
    assert coarse.dofs == 13 * 11 * 8 and fine.l2 < coarse.l2 / 10.0
    assert coarse.converged and fine.converged and coarse.iterations <= 2 * even.iterations
    assert not caplog.records  # the quadrature of the splines is found for these knots, too


def test_linear_displacements_are_found_on_it(volume):
    report = solve_problem(volume, Elasticity(exact=["x+y", "2*y-z", "x+z"]), tolerance=1e-12).report
    assert report.l2_relative < 1e-6


@pytest.mark.parametrize("to", ["gismo", "mfem", "json"])
def test_it_is_exported_and_read_again(to, volume, in_folder):
    pytest.importorskip("splinepy")
    volume.save("volume.npz")
    again = load_volume(export("volume.npz", to))
    assert all(np.array_equal(a, b) for a, b in zip(again.knots, volume.knots, strict=True))
    assert np.array_equal(again.control_points, volume.control_points)


def test_paraview_and_the_page_are_given_it(volume, in_folder):
    volume.save("volume.npz")
    for to in ("vtk", "view"):
        assert export("volume.npz", to).stat().st_size > 10_000
    assert scene_of(volume) is not None
