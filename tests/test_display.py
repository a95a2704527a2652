"""What results show in notebooks, draw and turn into objects of pyvista and splinepy."""

from __future__ import annotations

import re

import numpy as np
import pytest
from blocks import outer_surface
from conftest import formula_parameterization
from matplotlib.image import imread
from patches import cells as boxes
from rational_shapes import quarter_ring

import iga_nn
from iga_nn.figures.map import draw_distortion
from iga_nn.figures.render import can_draw
from iga_nn.report.notebook import as_html
from parameterize.certificate.boundary import check_boundary
from parameterize.quality.quality import measure
from parameterize.surface.surface import surface_from_arrays
from solve import Convergence, Poisson, convergence, solve_problem
from solve.study import benchmark_volume

PROBLEM = Poisson(exact="exp(x)*sin(y)+z")


@pytest.fixture(scope="module")
def solution():
    return solve_problem(benchmark_volume(2), PROBLEM)


def cells(html):
    return re.findall(r"<t[dh]>(.*?)</t[dh]>", html)


def test_a_surface_shows_what_the_gate_found():
    cube = iga_nn.sample("cube")
    found = surface_from_arrays(cube.vertices, cube.faces[:, ::-1], "<cube>")._repr_html_()
    assert "Surface &lt;cube&gt;, accepted" in found and "<cube>" not in found
    assert cells(found)[:6] == ["vertices", "1,538", "faces", "3,072", "volume", "1"]
    assert any("inverted orientation flipped" in text for text in cells(found))


def test_a_volume_shows_its_spline():
    found = cells(benchmark_volume(4, amplitude=0.0)._repr_html_())
    assert found == [
        "control points", "7 × 7 × 7", "degrees", "3, 3, 3", "knot spans", "4 × 4 × 4", "lies within",
        "(0, 0, 0) to (1, 1, 1)",
    ]  # fmt: skip


def test_a_rational_volume_shows_its_weights():
    found = cells(quarter_ring()._repr_html_())
    assert found[found.index("weights") + 1] == "0.707107 to 1"


def test_a_certificate_and_a_quality_say_what_is_proved():
    good, folded = formula_parameterization(), formula_parameterization(0.4)
    assert "det J &gt; 0: certified" in good.certificate._repr_html_()
    assert f"{good.certificate.lower_bound:.3g} of its mean" in cells(good.certificate._repr_html_())
    shown = folded.certificate._repr_html_()
    assert "det J &gt; 0: folded" in shown and "folded at u, v, w" in cells(shown) and "not proved" in cells(shown)
    quality = good.quality._repr_html_()
    assert "certified; one-to-one: yes" in quality and "one-to-one: no" in folded.quality._repr_html_()
    arap = good.quality.arap
    assert f"{arap.unit_volume.mean:.4g}, {arap.unit_volume.max:.4g}" in cells(quality)


def test_a_certificate_of_several_patches_lists_its_defects():
    good = iga_nn.Body((benchmark_volume(2), benchmark_volume(3)))
    shown = iga_nn.certify(good)._repr_html_()
    assert "2 patches: certified" in shown and "<ul>" not in shown
    folded = iga_nn.certify(iga_nn.Body((benchmark_volume(2), benchmark_volume(4, amplitude=0.4))))
    assert "2 patches: folded" in folded._repr_html_() and "<li>p1: folded at (" in folded._repr_html_()


def test_a_body_and_a_solution_on_it_have_tables():
    body = iga_nn.Body.from_patches(boxes([(0, 0, 0), (1, 0, 0)], 3, 2))
    found = cells(body._repr_html_())
    assert found == [
        "patches", "2", "interfaces", "1", "outer faces", "10", "control points", "45", "lies within",
        "(0, 0, 0) to (2, 1, 1)",
    ]  # fmt: skip
    solution = iga_nn.solve(body, Poisson(exact="x"))
    assert f"{solution.report.dofs}" in cells(solution._repr_html_())


def test_the_quality_of_several_patches_has_a_row_for_each():
    body = iga_nn.Body.from_patches(boxes([(0, 0, 0), (1, 0, 0)], 4, 3))
    outer = outer_surface(body)
    quality = measure(body, outer.vertices, outer.faces, 0.5, outer, iga_nn.certify(body), check_boundary(body))
    shown = quality._repr_html_()
    assert "det J &gt; 0: certified; one-to-one: yes" in shown and "Patches, as given" in shown
    found = cells(shown)
    assert found[found.index("p1") + 1] == "1 × 1 × 1" and found[-1] == "1"


def test_a_solution_shows_relative_errors_before_absolute_ones(solution):
    titles, numbers = np.reshape(cells(solution._repr_html_()), (2, -1)).tolist()
    named = dict(zip(titles, numbers, strict=True))
    report = solution.report
    assert titles.index("relative L2 error") + 1 == titles.index("L2 error")
    assert titles.index("relative H1 error") + 1 == titles.index("H1 error")
    assert named["relative H1 error"] == f"{report.h1_relative:.3e}" and named["unknowns"] == f"{report.dofs:,}"


def test_a_study_shows_its_rates_and_notices_once(solution):
    study = convergence(benchmark_volume(1), PROBLEM, refine=range(2))
    assert isinstance(study, Convergence) and str(study).splitlines() == [str(row) for row in study]
    rows = np.reshape(cells(study._repr_html_()), (3, -1)).tolist()
    assert rows[2][rows[0].index("rate")] == f"{study[1].rate_l2:.2f}" and rows[1][rows[0].index("rate")] == "–"
    assert "<table>" in Convergence()._repr_html_()
    folded = convergence(benchmark_volume(1), Poisson(exact="1e-200*x"), refine=range(2))
    notices = {line for row in folded for line in row.report.notices}
    assert notices and len(re.findall("<li>", folded._repr_html_())) == len(notices)


def test_python_prints_the_shapes_of_arrays(solution):
    knots = "(array(9,), array(9,), array(9,))"
    volume = f"BSplineVolume(degrees=(3, 3, 3), knots={knots}, control_points=array(5, 5, 5, 3), weights=None)"
    assert repr(solution.geometry) == volume
    assert repr(solution).startswith(
        f"Solution(patches=(PatchSolution(degrees=(3, 3, 3), knots={knots}, coefficients=array(5, 5, 5), geometry"
    )
    assert "'step': array" in repr(formula_parameterization())


def test_other_objects_have_no_table():
    with pytest.raises(TypeError, match="no table of a int"):
        as_html(3)


@pytest.mark.pictures
def test_plots_are_the_figures_of_the_report(solution, tmp_path, small_views):
    if not can_draw():
        pytest.skip("VTK cannot draw on this machine")
    volume = solution.geometry
    shown = volume.plot("distortion", tmp_path / "shown.png")
    draw_distortion(tmp_path / "report.png", volume)
    assert np.array_equal(imread(tmp_path / "shown.png"), imread(tmp_path / "report.png"))
    assert shown._repr_png_().startswith(b"\x89PNG")
    assert [axes.get_title() for axes in solution.plot("error").axes][3:6] == ["u = 1/2", "v = 1/2", "w = 1/2"]
    assert solution.plot().axes[-1].get_ylabel() == "u"


def test_plots_that_cannot_be_are_refused(solution, monkeypatch):
    with pytest.raises(ValueError, match="no figure 'face': choose one of faces, lines, cut, distortion"):
        solution.geometry.plot("face")
    monkeypatch.setattr("iga_nn.figures.render.can_draw", lambda: True)
    unknown = solve_problem(benchmark_volume(1), Poisson(source="1", boundary="0"))
    with pytest.raises(ValueError, match="no exact solution"):
        unknown.plot("error")
    monkeypatch.setattr("iga_nn.figures.render.can_draw", lambda: False)
    with pytest.raises(RuntimeError, match="cannot draw on this machine; remedy: "):
        solution.plot()


def test_a_grid_of_pyvista_is_what_the_file_holds(solution, in_folder):
    import pyvista

    solution.geometry.save("volume.npz")
    solution.save("solution.npz")
    for to, samples in (("vtk", None), ("view", 3)):
        read = pyvista.read(iga_nn.export("volume.npz", to, solution="solution.npz"))
        grid = solution.to_pyvista(samples)
        assert np.array_equal(grid.cells, read.cells) and np.array_equal(grid.points, read.points)
        assert np.array_equal(grid["u"], read["u"])
        assert np.array_equal(solution.geometry.to_pyvista(samples).points.shape, grid.points.shape)


def test_linear_cells_can_be_measured_and_hold_the_error(solution):
    grid = solution.to_pyvista(samples=8)
    assert grid.volume == pytest.approx(iga_nn.certify(solution.geometry).mean_det, rel=2e-3)
    x, y, z = grid.points.T
    assert np.allclose(grid["error"], np.abs(np.exp(x) * np.sin(y) + z - grid["u"]), atol=1e-12)
    assert "error" not in solution.geometry.to_pyvista(samples=1).point_data
    with pytest.raises(ValueError, match="samples 0: must be 1 or larger"):
        solution.to_pyvista(samples=0)


def test_the_error_of_a_field_as_exact_solution_is_known_too(solution):
    volume = solution.geometry
    again = solve_problem(
        volume, Poisson(exact=solution.field, source=lambda x, y, z: 0.0 * x, boundary=solution.field)
    )
    grid = again.to_pyvista(samples=2)
    assert np.allclose(grid["error"], np.abs(solution.to_pyvista(samples=2)["u"] - grid["u"]), atol=1e-14)


def test_a_solution_goes_to_splinepy(solution):
    pytest.importorskip("splinepy")
    points = np.random.default_rng(2).random((20, 3))
    assert np.allclose(solution.to_splinepy().evaluate(points)[:, 0], solution(points), atol=1e-14)


def test_a_volume_goes_to_splinepy_and_back():
    splinepy = pytest.importorskip("splinepy")
    volume = benchmark_volume(3, degree=2)
    spline = volume.to_splinepy()
    points = np.random.default_rng(1).random((20, 3))
    assert np.allclose(spline.evaluate(points), volume(points), atol=1e-14)
    back = iga_nn.BSplineVolume.from_splinepy(spline)
    assert back.degrees == volume.degrees and np.array_equal(back.control_points, volume.control_points)
    assert all(np.array_equal(a, b) for a, b in zip(back.knots, volume.knots, strict=True))
    with pytest.raises(ValueError, match="maps 2 parameters to 2 coordinates"):
        iga_nn.BSplineVolume.from_splinepy(splinepy.helpme.create.box(1, 1))
    with pytest.raises(TypeError, match="one of splinepy's, got BSplineVolume"):
        iga_nn.BSplineVolume.from_splinepy(volume)
