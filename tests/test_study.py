import numpy as np
import pytest

from parameterize.spline.body import as_body
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume
from solve import Poisson, SolveReport, benchmark_volume, convergence, rates
from solve.discretization.error_norms import Errors
from solve.discretization.space import TrialSpace
from solve.options import SolveOptions
from solve.patch_system import PatchProblem
from solve.system import build

WAVE = Poisson(exact="exp(x+z)*sin(y)")


def report(elements, l2, h1):
    return SolveReport(elements, 0, 0.0, 0, True, 0.0, {}, Errors(l2, 0.0, h1, 0.0))


def test_rates_by_hand():
    found = rates([report(8, 1.0, 4.0), report(64, 0.25, 2.0), report(4096, 0.25 / 256, None)])
    assert found["l2"] == pytest.approx([2.0, 4.0])
    assert "h1" not in found
    assert rates([report(8, 1.0, 4.0), report(64, 0.25, 2.0)])["h1"] == pytest.approx([1.0])


def test_no_rate_between_equal_meshes_or_next_to_a_zero_error():
    assert rates([report(8, 1.0, 0.0), report(8, 0.5, 1.0), report(64, 0.0, 0.5)]) == {
        "l2": [None, None],
        "h1": [None, pytest.approx(1.0)],
    }


def test_rates_without_exact_solution_are_absent():
    assert rates([SolveReport(8, 0, 0.0, 0, True, 0.0, {})] * 2) == {}


@pytest.mark.parametrize("degree", [2, 3])
def test_full_order_on_the_cube(degree):
    points = greville(open_uniform_knots(4 + degree, degree), degree)
    cube = BSplineVolume.uniform(np.stack(np.meshgrid(points, points, points, indexing="ij"), axis=-1), degree)
    rows = convergence(cube, WAVE, refine=(0, 1, 2))
    assert rows[0].rate_l2 is None
    assert rows[2].rate_l2 == pytest.approx(degree + 1, abs=0.1)
    assert rows[2].rate_h1 == pytest.approx(degree, abs=0.1)


@pytest.mark.parametrize("refine", [[], 2])
def test_a_study_without_levels_is_refused(refine):
    with pytest.raises(ValueError, match="refine must be levels such as"):
        convergence(benchmark_volume(2), WAVE, refine=refine)


@pytest.mark.parametrize(("degree", "tolerance"), [(2, 0.1), (3, 0.1), (4, 0.1)])
def test_full_order_on_the_twisted_map(degree, tolerance):
    """The n = 4 tricubic map refined exactly to 8, 16, 32 elements; degree 4 keeps it C^2 at its own knots."""
    rows = convergence(benchmark_volume(4), WAVE, refine=(1, 2, 3) if degree < 4 else (1, 2), degree=degree)
    assert rows[-1].rate_l2 == pytest.approx(degree + 1, abs=tolerance)
    assert rows[-1].rate_h1 == pytest.approx(degree, abs=tolerance)


@pytest.mark.parametrize("degree", [2, 3, 4, 5])
def test_full_order_on_the_map_of_the_same_degree(degree):
    """From 8 to 16 elements, on the map that is as smooth as the trial space."""
    rows = convergence(benchmark_volume(4, degree), WAVE, refine=(1, 2))
    assert rows[-1].rate_l2 > degree + 0.9
    assert rows[-1].rate_h1 > degree - 0.1


def test_a_map_that_is_less_smooth_caps_the_rate_of_a_smoother_space():
    """Why raised spaces keep the map's own smoothness: degree 4, C^3 at the knots of the C^2 map, loses its order."""
    volume = benchmark_volume(4)
    kept = convergence(volume, WAVE, refine=(1, 2), degree=4)
    knots, body = [open_uniform_knots(n + 4, 4) for n in (8, 16)], as_body(volume)
    smoother = [
        build(
            body,
            WAVE,
            [PatchProblem(volume, WAVE, TrialSpace((4, 4, 4), (k, k, k)))],
            SolveOptions(threads=1),
        )
        .solve(tolerance=1e-12)
        .report
        for k in knots
    ]
    assert kept[-1].rate_l2 > 4.9
    assert rates(smoother)["l2"][-1] < 4.6


def test_rows_print_their_rates():
    rows = convergence(benchmark_volume(3), WAVE, refine=(0, 1))
    assert "rate" not in str(rows[0])
    assert f"L2 rate {rows[1].rate_l2:.2f}" in str(rows[1])


def test_benchmark_map_by_hand():
    """Middle control point: g = 1/2, so every sine is sin(pi) = 0; corner (0, 0, 0): sin 0; (1, 0, 0): (0, 0, 0)."""
    volume = benchmark_volume(1, degree=2, amplitude=0.1)
    assert np.allclose(volume.control_points[1, 1, 1], 0.5)
    assert np.allclose(volume.control_points[1, 0, 0], [0.5, 0.1, 0.1])
