"""No figure ends a run: one that fails costs itself and a line; fields of one value have a colour bar that says so."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import iga_nn
import solve
from iga_nn.cli.commands import main
from iga_nn.figures import render as rendering
from iga_nn.figures.colors import error_range, even_range
from iga_nn.figures.line_plots import draw_study
from iga_nn.figures.solution import draw_error, draw_values
from iga_nn.options import ModesOptions, PoissonOptions, StudyOptions
from iga_nn.report import html as page
from iga_nn.report.artifacts import ARTIFACTS
from iga_nn.workflow import pipeline
from solve.study import benchmark_volume

DEFECTS = ("folds.png", "meeting.png")
DRAW = {figure.file: f"iga_nn.figures.{figure.draw}" for figure in ARTIFACTS if figure.draw}  # file -> function
OTHERS = ("blocks.png", "named_faces.png", "regions.png", "study.png", "modes.png", "load.png")
TWO_LEVELS = PoissonOptions(refine=(0, 1))  # of the usual three
MAP = [file for file in DRAW if file not in (*DEFECTS, *OTHERS)]


@pytest.fixture
def all_drawn(in_folder, monkeypatch):
    """Every figure but those that a test breaks is drawn at once, as an empty file; needs no graphics library."""
    monkeypatch.setattr(rendering, "can_draw", lambda: True)
    for draw in DRAW.values():
        monkeypatch.setattr(draw, lambda path, *given: path.write_bytes(b""))


def broken(path, *given, **named):
    raise ValueError("Invalid vmin or vmax")


def look(folder):
    """report.json, and the page's text."""
    text = (folder / "report.html").read_text(encoding="utf-8")
    return json.loads((folder / "report.json").read_text(encoding="utf-8")), text


@pytest.mark.parametrize("file", MAP)
def test_a_figure_that_fails_costs_itself_alone(file, all_drawn, formula_training, in_folder, monkeypatch, caplog):
    formula_training()
    monkeypatch.setattr(DRAW[file], broken)
    outcome = iga_nn.run("poisson", "cube", "out", poisson=TWO_LEVELS)
    report, text = look(outcome.folder)
    reason = "Invalid vmin or vmax"
    assert report["not_drawn"] == {file: reason}
    assert caplog.messages.count(f"{file} could not be drawn: {reason}") == 1
    assert f"{file} could not be drawn: {reason}" in text
    assert {drawn.name for drawn in outcome.folder.glob("*.png")} == set(MAP) - {file}
    assert report["seconds"]["total"] > 0.0 and (outcome.folder / "solution.npz").is_file()


@pytest.mark.parametrize("file", DEFECTS)
def test_a_figure_of_a_defect_that_fails_costs_itself_alone(file, all_drawn, formula_training, in_folder, monkeypatch):
    formula_training(amplitude=0.38)  # folds, and its boundary meets itself
    monkeypatch.setattr(DRAW[file], broken)
    report, _ = look(pipeline.parameterize_to("cube", "out").folder)
    assert report["not_drawn"] == {file: "Invalid vmin or vmax"}


def test_the_figures_of_a_solve_and_of_a_study_cost_themselves_alone(all_drawn, in_folder, monkeypatch):
    benchmark_volume(2).save("map.npz")
    monkeypatch.setattr(DRAW["study.png"], broken)
    monkeypatch.setattr(DRAW["named_faces.png"], broken)
    report, _ = look(pipeline.solve_to("map.npz", "out", problem_options=replace(TWO_LEVELS, neumann=("u1",))).folder)
    assert set(report["not_drawn"]) == {"convergence.png", "named_faces.png"}
    outcome, _ = pipeline.study_to("map.npz", "study", study_options=StudyOptions(refine=("0", "1")))
    assert set(look(outcome.folder)[0]["not_drawn"]) == {"study.png"}


def test_the_figure_of_modes_costs_itself_alone(all_drawn, in_folder, monkeypatch):
    benchmark_volume(2).save("map.npz")
    monkeypatch.setattr(DRAW["modes.png"], broken)
    outcome, _ = pipeline.modes_to("map.npz", "modes", modes_options=ModesOptions(number=1, fix=("u0",)))
    report, _ = look(outcome.folder)
    assert set(report["not_drawn"]) == {"modes.png"} and len(report["modes"]["frequencies"]) == 1


def test_without_the_interactive_view_the_page_is_whole(in_folder, monkeypatch, chromium, tmp_path):
    from browser import browse

    monkeypatch.setattr("iga_nn.report.viewer.scene_of", broken)
    benchmark_volume(2).save("map.npz")
    report, text = look(pipeline.solve_to("map.npz", "out", problem_options=TWO_LEVELS).folder)
    assert report["not_drawn"]["interactive view"] == "Invalid vmin or vmax"
    assert "interactive view could not be drawn" in text and "Convergence" in text
    _, console, _ = browse(chromium, tmp_path, (in_folder / "out/report.html").as_uri(), 700)
    assert console == ""


def test_a_page_that_fails_is_written_bare(in_folder, monkeypatch):
    monkeypatch.setattr(page, "_facts", broken)
    benchmark_volume(2).save("map.npz")
    outcome = pipeline.solve_to("map.npz", "out", problem_options=TWO_LEVELS)
    _, text = look(outcome.folder)
    assert "could not be laid out" in text and "&quot;poisson&quot;" in text


def test_plotting_that_cannot_be_imported_costs_the_figures(in_folder, monkeypatch):
    monkeypatch.setattr(rendering, "can_draw", None)
    benchmark_volume(2).save("map.npz")
    report, _ = look(pipeline.solve_to("map.npz", "out", problem_options=TWO_LEVELS).folder)
    assert set(report["not_drawn"]) == {"figures"}


def test_a_model_in_millimetres_ends_with_a_word_and_a_page(in_folder):
    """exp(x+z) underflows to 0 where x = z = -500: fields of zeros are drawn, and the exit code is 4."""
    benchmark_volume(2).transformed(430.0, [-964.0, -300.0, -964.0]).save("scan.npz")
    assert main(["solve", "poisson", "scan.npz", "--exact", "exp(x+z)*sin(y)", "--out", "out", "--quiet"]) == 4
    report, text = look(Path("out"))
    assert (
        set(report["not_drawn"].values()) <= {rendering.CANNOT_DRAW}
        and "means nothing here" in text
        and "The errors mean nothing" in text
    )
    assert main(["solve", "poisson", "scan.npz", "--out", "default", "--quiet"]) == 0
    assert look(Path("default"))[0]["poisson"]["frame"]["length"] == pytest.approx(430.0, rel=0.1)


def test_a_study_whose_numbers_mean_nothing_says_so(in_folder):
    benchmark_volume(2).transformed(430.0, [-964.0, -300.0, -964.0]).save("scan.npz")
    command = ["study", "scan.npz", "--refine", "0", "1", "--out", "out", "--quiet"]
    assert main([*command, "--exact", "exp(x+z)*sin(y)"]) == 4
    assert "underflows" in look(Path("out"))[0]["study"]["notices"][0]
    assert main([*command, "--force"]) == 0


@pytest.mark.parametrize("size", [0.0, 1e-310, 1e-160, 1e300])
def test_errors_of_any_size_are_drawn(size, tmp_path, small_views):
    if not rendering.can_draw():
        pytest.skip(f"VTK cannot draw on this machine; remedy: {rendering.REMEDY}")
    volume = benchmark_volume(1)
    solution = solve.solve_problem(volume, solve.Poisson(source="0"))
    (patch,) = solution.patches
    field = replace(solution, patches=(replace(patch, coefficients=np.full(patch.coefficients.shape, size)),))
    zero = solve.Poisson(exact="0")
    draw_error(tmp_path / "error.png", volume, field, zero)
    draw_values(tmp_path / "values.png", volume, field, "u")
    from iga_nn.report.viewer import scene_of

    said = {entry["name"]: entry["remark"] for entry in scene_of(volume, field, zero)["fields"]}
    assert ("everywhere" in said["solution"]) and (("everywhere" in said["error"]) == (size < 1e-200))


def test_a_study_of_a_solution_that_is_zero_is_drawn(tmp_path):
    solution = solve.solve_problem(benchmark_volume(1), solve.Poisson(source="0"))
    draw_study(tmp_path / "study.png", {3: [solve.ConvergenceRow(solution.report, None, None)]})
    assert (tmp_path / "study.png").is_file()


def test_ranges_by_hand():
    assert even_range([np.zeros(3)]).remark == "0 everywhere"
    assert even_range([np.full(3, 2.5)]).remark == "2.5 everywhere"
    assert even_range([np.array([0.0, 1e-310])]).remark == "below 1e-310 everywhere"
    mixed = even_range([np.array([1.0, 2.0]), np.array([0.0])])
    assert (mixed.low, mixed.high, mixed.remark) == (0.0, 2.0, "")
    assert mixed.shares(np.array([0.5, 3.0])) == pytest.approx([0.25, 1.0])
    errors = error_range([[np.array([1e-3])], [np.zeros(2)], [np.array([1e-6, 1e-5])]])
    assert (errors.low, errors.high, errors.logarithmic) == (pytest.approx(1e-9), 1e-3, True)
    assert error_range([[np.zeros(2)]]).remark == "0 everywhere"
