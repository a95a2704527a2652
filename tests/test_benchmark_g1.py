from __future__ import annotations

import csv
import io
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import formula_parameterization
from example_files import cells, load
from shapes import rounded_cube

import iga_nn
from iga_nn.options import MapOptions
from iga_nn.samples import write_obj
from parameterize.surface.surface import surface_from_arrays

g1 = load("benchmarks/g1")

DUCK = g1.Row(
    "duck",
    verdict="certified",
    det_lower_bound=0.0123,
    arap_mean_unit_volume=0.341,  # exactly the paper's
    arap_max_unit_volume=13.27,  # just above
    arap_mean_as_given=99.0,
    arap_max_as_given=99.0,
    boundary_rms_unit_volume=0.0004,
    boundary_rms_as_given=99.0,
    spline_to_mesh_rms=0.00123,
    flipped_triangles=2,
    seconds=120.0,
    t_cal=8.0,
    seconds_in_t_cal=15.0,
    l2_refine_1=2.5e-5,
    iterations_refine_1=21,
)
CONCH = replace(
    DUCK, model="conch", verdict="folded", det_lower_bound=None, arap_mean_as_given=1.4, arap_mean_unit_volume=99.0
)


def options(folder, **given):
    values = {"names": tuple(g1.PAPER), "mapping": MapOptions(device="cpu"), "jobs": 1, "out": Path(folder)}
    return g1.Options(models=Path(folder), **(values | given))


def table(folder):
    return {row["model"]: row for row in csv.DictReader(io.StringIO((folder / "g1.csv").read_text()))}


def error_of(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        g1.main(list(arguments))
    assert stop.value.code == 2
    captured = capsys.readouterr()
    assert not captured.out and captured.err.count("\n") == 1
    return captured.err


def test_the_csv_has_every_figure_with_all_digits_beside_the_papers():
    (row,) = csv.DictReader(io.StringIO(g1.as_csv([replace(DUCK, seconds=1.0 / 3.0, status="a, b")])))
    assert float(row["seconds"]) == 1.0 / 3.0 and row["status"] == "a, b"
    assert row["l2_refine_0"] == "" and row["iterations_refine_1"] == "21"
    paper = {name.removeprefix("paper_"): value for name, value in row.items() if name.startswith("paper_")}
    assert paper == {"arap_mean": "0.341", "arap_max": "13.269", "boundary": "0.000846", "table": "B.6"}


def test_figures_at_or_below_the_papers_are_bold_at_the_papers_scale(tmp_path):
    text = g1.as_markdown([CONCH, DUCK], options(tmp_path))
    duck = ["duck", "certified", "0.0123", "**0.341**", "0.341", "13.270", "13.269", "**0.000400**", "0.000846"]
    conch = ["conch", "folded", "", "**1.400**", "1.468", "99.000", "50.818", "99.000000", "0.001690"]
    assert cells(text, "duck")[0] == duck and cells(text, "conch")[0] == conch
    assert cells(text, "duck")[1:] == [
        ["duck", "0.00123", "", "", "", "2"],
        ["duck", "120.0", "", "", "", "", "8.00", "15.0"],
        ["duck", "", "", "", "", "2.50e-05", "", "21"],
    ]


def test_a_failure_keeps_its_row_and_says_why(tmp_path):
    rows = [g1.Row("bird", "no | surface"), replace(DUCK, status="cannot be solved"), g1.Row("santa4", g1.ABSENT)]
    text = g1.as_markdown(rows, options(tmp_path))
    assert cells(text, "bird") == [["bird", "no \\| surface", "", "", "2.744", "", "37.446", "", "0.000961"]]
    assert cells(text, "duck")[0][1] == "certified; cannot be solved"
    assert cells(text, "santa4") == [["santa4", "model not public", "", "", "3.936", "", "95.842", "", "0.005270"]]


def test_the_markdown_ends_with_the_counts_and_the_machine(tmp_path):
    bird = g1.Row("bird", "not found")
    rows = [CONCH, DUCK, bird, g1.Row("santa4", g1.ABSENT)]
    *_, counts, machine = g1.as_markdown(rows, options(tmp_path)).split("\n\n")
    assert counts.startswith(
        "Certified 1 of 3; of G1, ARAP mean at or below the paper's 1 of 2, boundary rms at or below"
    )
    assert counts.endswith("the paper's 1 of 2.")
    assert f"{g1.processes.cores()} cores, 1 at a time" in machine and machine.endswith("preset fast, seed 0.\n")
    assert all(f"{name} " in machine for name in ("python", "torch", "numpy", "iga-nn"))


def test_what_is_no_benchmark_says_so(tmp_path):
    quick = MapOptions(device="cpu", steps_factor=0.1, control_points=8)
    text = g1.as_markdown([DUCK], options(tmp_path, mapping=quick, names=("duck", "pig")))
    assert "Not finished yet: pig." in text and "times 0.1" in text and "8 control points" in text
    assert "Not finished" not in g1.as_markdown([DUCK], options(tmp_path, names=("duck",)))


def test_tables_are_in_the_papers_order_and_nothing_is_left_beside_them(tmp_path):
    g1.write_tables([DUCK, CONCH], options(tmp_path))
    assert list(table(tmp_path)) == ["conch", "duck"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["g1.csv", "g1.md"]


def test_models_that_are_not_there_have_their_rows(tmp_path, capsys):
    (tmp_path / "models").mkdir()
    assert g1.main(["--models", str(tmp_path / "models"), "--out", str(tmp_path / "new" / "out")]) == 1
    found = table(tmp_path / "new" / "out")
    assert list(found) == list(g1.PAPER)
    assert found["santa4"]["status"] == "model not public"
    assert found["pig"]["status"] == f"{tmp_path}/models/pig.obj: not found; there, `iga-nn fetch pig` gets it"
    assert "Certified 0 of 12; of G1, ARAP mean at or below the paper's 0 of 11" in capsys.readouterr().out
    assert g1.main(["--models", str(tmp_path / "models"), "--out", str(tmp_path), "--only", "santa4"]) == 0


def test_models_are_looked_for_in_the_folder_of_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("IGA_NN_DATA", str(tmp_path))
    chosen, child = g1._options(["--out", str(tmp_path / "out"), "--only", "pig", "conch"])
    assert chosen.models == tmp_path and chosen.names == ("conch", "pig") and child is None
    (tmp_path / "pig.mesh").touch()
    (tmp_path / "santa4.obj").touch()
    assert g1._file("pig", tmp_path).name == "pig.mesh"
    assert g1._absence("pig", tmp_path) is None and g1._absence("santa4", tmp_path) is None
    (tmp_path / "pig.obj").touch()
    assert g1._file("pig", tmp_path).name == "pig.obj"


def test_bad_arguments_are_one_line(tmp_path, capsys):
    here = ("--models", str(tmp_path), "--out", str(tmp_path / "out"))
    assert "horse: no such model" in error_of(capsys, *here, "--only", "duck", "horse")
    assert "--jobs 0" in error_of(capsys, *here, "--jobs", "0")
    assert "seed -1" in error_of(capsys, *here, "--seed", "-1")
    assert "steps factor nan" in error_of(capsys, *here, "--steps-factor", "nan")
    assert "--preset" in error_of(capsys, *here, "--preset", "slow")
    assert "nowhere: no such folder" in error_of(capsys, "--models", "nowhere")
    (tmp_path / "file").touch()
    assert "file: cannot be written" in error_of(capsys, *here, "--out", str(tmp_path / "file"))


@pytest.fixture(scope="module")
def given_by_formula():
    return formula_parameterization()


@pytest.fixture
def formula(given_by_formula, tmp_path, monkeypatch):
    """A duck whose parameterization is given by formula, in this process."""
    write_obj(iga_nn.sample("cube"), tmp_path / "duck.obj")
    monkeypatch.setattr(iga_nn, "parameterize", lambda *_, **__: given_by_formula)
    return options(tmp_path, mapping=MapOptions(device="cpu", steps_factor=0.001))


def test_a_row_holds_what_was_measured(formula):
    row = g1.run_model("duck", formula)
    assert row.status == "done" and row.verdict == "certified" and None not in vars(row).values()
    assert row.flipped_triangles == 0 and row.seconds_train == 1.0 and row.boundary_rms_as_given < 1e-12
    assert row.arap_mean == row.arap_mean_unit_volume
    assert row.seconds_in_t_cal == row.seconds / row.t_cal
    assert row.l2_refine_1 < row.l2_refine_0 < 1e-2


def test_after_an_error_the_figures_known_before_stay(formula, monkeypatch, capsys):
    def fail(*_, **__):
        raise RuntimeError("no memory\nleft")

    monkeypatch.setattr(iga_nn, "solve", fail)
    row = g1.run_model("duck", formula)
    assert row.status == "no memory left" and row.verdict == "certified" and row.l2_refine_0 is None
    assert "Traceback" in capsys.readouterr().err


def test_a_solve_that_does_not_converge_is_a_status(formula, monkeypatch):
    def solve(*arguments, **given):
        from solve import solve_problem

        return solve_problem(*arguments, **given, max_iterations=1)

    monkeypatch.setattr(iga_nn, "solve", solve)
    row = g1.run_model("duck", formula)
    assert "did not converge" in row.status and row.iterations_refine_0 == 1


def test_a_process_that_dies_is_a_row(formula, monkeypatch):
    monkeypatch.setattr(g1, "_command", lambda *_: [sys.executable, "-c", "import os; os.abort()"])
    (row,) = g1._results(replace(formula, names=("duck",)))
    assert row == g1.Row("duck", "its process ended with code -6, without a result")


def test_models_run_in_processes_of_their_own(tmp_path):
    write_obj(surface_from_arrays(*rounded_cube(200, power=5.0)), tmp_path / "duck.obj")
    (tmp_path / "pig.obj").write_text("no surface\n")
    quick = ["--steps-factor", "0.003", "--control-points", "6", "--jobs", str(g1.processes.cores())]
    arguments = ["--models", str(tmp_path), "--out", str(tmp_path), "--only", "pig", "duck", *quick]
    assert g1.main(arguments) == 1
    found = table(tmp_path)
    assert list(found) == ["duck", "pig"]
    assert "pig.obj" in found["pig"]["status"] and found["pig"]["verdict"] == ""
    assert found["duck"]["verdict"] in ("certified", "folded", "undecided") and found["duck"]["threads"] == "1"
    assert float(found["duck"]["seconds"]) > 0.0 and float(found["duck"]["t_cal"]) > 0.0


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (KeyboardInterrupt(), 130, "bench: interrupted after 2 rows; they stay\n"),
        (OSError(28, "No space left on device", "g1.csv"), 2, "bench: g1.csv: No space left on device\n"),
    ],
)
def test_rows_before_an_interruption_are_kept(error, code, said, capsys):
    kept = []

    def rows():
        yield from (1, 2)
        raise error

    found = g1.processes.collect("bench", rows(), lambda rows: kept.append(list(rows)), str, "they stay")
    assert found == ([1, 2], code) and kept == [[1], [1, 2]]
    assert capsys.readouterr() == ("1\n2\n", said)
