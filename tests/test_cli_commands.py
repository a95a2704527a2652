from __future__ import annotations

import csv
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mesh_files import CUBE, ball, obj

import iga_nn
import solve
from iga_nn.__main__ import run_and_exit
from iga_nn.cli.commands import main
from iga_nn.figures.render import can_draw
from iga_nn.report import document as reports
from iga_nn.workflow.output_folder import open_folder
from parameterize.checkpoint import CheckpointError
from parameterize.spline.volume import FACE_NAMES
from solve.study import benchmark_volume

FILES = (
    "volume.npz", "boundary.npz", "history.npz", "solution.npz", "report.json", "report.html", "history.png",
    "convergence.png", "solution.vtu",
)  # fmt: skip
PICTURES = {"faces.png", "lines.png", "cut.png", "distortion.png", "solution.png", "error.png"}


def one_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.startswith("iga-nn:")]
    assert len(lines) == 1, text
    assert "Traceback" not in text
    return lines[0]


def python(*arguments: str, path: str = "", stdout: int = subprocess.PIPE) -> subprocess.CompletedProcess[str]:
    """A fresh interpreter with the packages, and `path`, to import from."""
    places = os.pathsep.join(filter(None, (path, str(Path(iga_nn.__file__).resolve().parents[1]))))
    command = [sys.executable, *arguments]
    return subprocess.run(
        command, stdout=stdout, stderr=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": places}
    )


@pytest.mark.pictures
def test_run_poisson_writes_the_whole_folder(formula_training, in_folder, capsys):
    formula_training()
    assert main(["run", "poisson", "cube", "--out", "deep/result", "--exact", "x*y", "--refine", "0", "1"]) == 0
    folder = Path("deep/result")
    drawn = PICTURES if can_draw() else set()
    assert {file.name for file in folder.iterdir()} == set(FILES) | drawn
    assert (folder / "report.html").read_text().count('src="data:image/png') == 2 + len(drawn)
    assert not [file for file in folder.iterdir() if file.name.startswith(".")]  # no temporary file left
    report = json.loads((folder / "report.json").read_text())
    assert list(report) == [
        "schema", "command", "identity", "input", "config", "estimate", "files", "seed", "device", "versions",
        "parameterization", "poisson", "seconds",
    ]  # fmt: skip
    described = (Path(iga_nn.__file__).resolve().parents[1] / "docs" / "output.md").read_text(encoding="utf-8")
    assert all(f"`{field}`" in described for field in [*report, *report["parameterization"]])
    assert report["poisson"]["exact"] == "x*y"
    assert [level["elements"] for level in report["poisson"]["levels"]] == [4**3, 8**3]
    assert set(report["seconds"]) == {"load", "train", "fit", "optimize", "certify", "solve", "report", "total"}
    assert set(report["versions"]) == {"python", "numpy", "scipy", "torch", "iga-nn"}
    out, err = capsys.readouterr()
    assert "certified" in out and "deep/result" in out
    assert "S(2)" in err and "0 folds, 0:01 of the training left" in err


def test_json_is_the_verdict_alone(formula_training, in_folder, capsys):
    formula_training()
    assert main(["parameterize", "cube", "--json", "--quiet"]) == 0
    out, err = capsys.readouterr()
    verdict = json.loads(out)
    assert verdict["bijective"] == "certified" and verdict["folder"] == "cube"
    assert set(verdict["arap"]) == set(verdict["boundary_rms"]) == {"unit_volume", "as_given"}
    assert "step" not in err
    assert "poisson" not in json.loads(Path("cube/report.json").read_text())


def test_finished_output_is_left_alone_unless_forced(formula_training, in_folder, capsys):
    formula_training()
    assert main(["parameterize", "cube"]) == 0
    before = Path("cube/volume.npz").stat().st_mtime_ns
    assert main(["parameterize", "cube"]) == 2
    assert "--force" in one_line(capsys.readouterr().err)
    assert main(["parameterize", "cube", "--resume"]) == 0  # the answer is there already
    assert Path("cube/volume.npz").stat().st_mtime_ns == before
    assert main(["run", "poisson", "cube", "--resume"]) == 2  # a volume, but no solution
    assert "iga-nn solve poisson cube/volume.npz" in one_line(capsys.readouterr().err)
    assert main(["parameterize", "cube", "--force"]) == 0
    assert Path("cube/volume.npz").stat().st_mtime_ns > before


def test_a_folded_map_is_solved_if_asked_alone_with_a_warning_and_exit_code_3(formula_training, in_folder, capsys):
    formula_training(amplitude=0.35)
    assert main(["run", "poisson", "cube", "--refine", "0"]) == 3
    out, err = capsys.readouterr()
    assert out.startswith("NOT SOLVED       the map folds; --solve-anyway --force solves on it all the same\n")
    assert err.count("nothing is solved: the map folds") == 1 and not Path("cube/solution.npz").exists()
    assert main(["run", "poisson", "cube", "--refine", "0", "--resume"]) == 3  # finished so
    assert main(["run", "poisson", "cube", "--refine", "0", "--solve-anyway", "--force"]) == 3
    report = json.loads(Path("cube/report.json").read_text())
    assert report["parameterization"]["bijective"] == "folded" and "not_solved" not in report
    assert "not certified" in report["poisson"]["notices"][0]
    assert report["poisson"]["levels"][0]["l2"] > 0.0
    assert Path("cube/solution.npz").exists()
    out, err = capsys.readouterr()
    assert err.count("not certified") == err.count("det J < 0 at") == 1
    assert "warning" not in out


def test_solve_that_does_not_converge_is_exit_code_4(monkeypatch, in_folder):
    unlimited = solve.solve_with

    def stopped(volume, problem, options):
        return unlimited(volume, problem, replace(options, max_iterations=1))

    monkeypatch.setattr("solve.solve_with", stopped)
    benchmark_volume(6).save("volume.npz")
    assert main(["solve", "poisson", "volume.npz", "--refine", "0", "--out", "out"]) == 4
    section = json.loads(Path("out/report.json").read_text())["poisson"]
    assert section["levels"][0]["converged"] is False and section["levels"][0]["iterations"] == 1
    assert "after 1 iterations" in section["notices"][0] and "the map is worst at u=" in section["notices"][0]
    assert Path("out/solution.npz").exists()


def test_solve_poisson_on_a_saved_volume(in_folder, capsys):
    benchmark_volume(4).save("map.npz")
    assert main(["solve", "poisson", "map.npz", "--refine", "0", "1", "--degree", "2"]) == 0
    report = json.loads(Path("map/report.json").read_text())
    assert report["poisson"]["exact"] == "exp(X+Z)*sin(Y)"
    assert report["parameterization"]["bijective"] == "certified"
    assert "config" not in report
    with np.load("map/solution.npz") as data:
        assert data["coefficients"].shape == (10, 10, 10)  # 8 spans of degree 2


@pytest.mark.pictures
def test_source_without_exact_reports_estimates(in_folder, capsys):
    benchmark_volume(4).save("map.npz")
    assert (
        main(
            [
                "solve",
                "poisson",
                "map.npz",
                "--source",
                "1",
                "--boundary",
                "0",
                "--refine",
                "0",
                "--quiet",
                "--quadrature",
                "gauss",
            ]
        )
        == 0
    )
    section = json.loads(Path("map/report.json").read_text())["poisson"]
    assert "exact" not in section and "l2" not in section["levels"][0]
    assert 0.0 < section["levels"][0]["error_estimate_relative"] < 0.1
    assert "estimated L2 error" in capsys.readouterr().out
    assert section["source"] == "1" and not Path("map/error.png").exists()


def test_every_term_and_face_of_a_scalar_problem(in_folder):
    benchmark_volume(3).save("map.npz")
    terms = [
        "--kappa",
        "2,0.1,0,1,0,1+z*z",
        "--reaction",
        "x*x",
        "--neumann",
        "u1",
        "v0",
        "--robin",
        "w0=2",
        "w1=1+x*x",
    ]
    assert main(["solve", "poisson", "map.npz", "--refine", "1", "--quiet", *terms]) == 0
    section = json.loads(Path("map/report.json").read_text())["poisson"]
    assert section["neumann"] == ["u1", "v0"] and section["kappa"] == "2,0.1,0,1,0,1+z*z"
    assert section["levels"][0]["l2_relative"] < 1e-4
    given = ["--source", "0", "--neumann", "u1=-y", "--robin", "u0=3:-1"]
    assert main(["solve", "poisson", "map.npz", "--refine", "0", "--quiet", "--out", "given", *given]) == 0
    assert "l2" not in json.loads(Path("given/report.json").read_text())["poisson"]["levels"][0]


def test_elasticity_on_a_saved_volume(in_folder, capsys):
    benchmark_volume(3).save("map.npz")
    body = ["--exact", "x*y;sin(z);x", "--traction", "u1", "--young", "200", "--poisson-ratio", "0.25"]
    assert main(["solve", "elasticity", "map.npz", "--refine", "0", "1", *body]) == 0
    report = json.loads(Path("map/report.json").read_text())
    assert report["elasticity"]["exact"] == "x*y;sin(z);x" and report["elasticity"]["young"] == 200.0
    assert report["elasticity"]["rates"]["l2"][0] > 3.0
    assert "2,187 unknowns" in capsys.readouterr().out
    with np.load("map/solution.npz") as data:
        assert data["coefficients"].shape == (9, 9, 9, 3)


def test_elasticity_under_a_body_force(in_folder):
    benchmark_volume(2).save("map.npz")
    assert main(["solve", "elasticity", "map.npz", "--refine", "0", "--body-force", "0;0;-1", "--quiet"]) == 0
    assert json.loads(Path("map/report.json").read_text())["elasticity"]["body_force"] == "0;0;-1"
    assert "--body-force" in Path("map/report.html").read_text()


def test_a_traction_needs_no_body_force_and_0_is_a_free_face(in_folder):
    benchmark_volume(2).save("map.npz")
    loads = ["u1=0;0;-2", "v0=0", "v1=0", "w0=0", "w1=0"]
    long = [load.replace("=0", "=0;0;0") if load.endswith("=0") else load for load in loads]
    for out, body in (("a", ["--traction", *loads]), ("b", ["--traction", *long, "--body-force", "0;0;0"])):
        assert main(["solve", "elasticity", "map.npz", *body, "--refine", "0", "--out", out, "--quiet"]) == 0
    with np.load("a/solution.npz") as one, np.load("b/solution.npz") as other:
        assert np.array_equal(one["coefficients"], other["coefficients"]) and one["coefficients"].any()


def test_a_solver_that_cannot_begin_writes_no_solution(in_folder, monkeypatch, capsys):
    benchmark_volume(2).save("map.npz")
    monkeypatch.setattr("solve.linear.low_order.LowOrder.__call__", lambda _, r: r * np.nan)
    assert main(["solve", "elasticity", "map.npz", "--traction", "u1=0;0;-2", "--refine", "0", "--quiet"]) == 4
    assert "does not give finite numbers" in capsys.readouterr().err
    assert not Path("map/solution.npz").exists()
    report = json.loads(Path("map/report.json").read_text())
    assert "no convergence" in report["not_solved"] and "elasticity" not in report


def test_run_elasticity_and_the_faces_by_name(formula_training, in_folder, capsys):
    formula_training()
    body = ["--body-force", "0;0;-1", "--traction", "u1=0;0;0", "v0=0;0;0", "--refine", "0"]
    assert main(["run", "elasticity", "cube", "--out", "out", *body, "--quiet"]) == 0
    report = json.loads(Path("out/report.json").read_text())
    with np.load("out/solution.npz") as data:
        assert data["coefficients"].shape[3] == 3
        assert report["elasticity"]["levels"][0]["dofs"] == data["coefficients"].size
    assert Path("out/named_faces.png").exists() or "named_faces.png" in report["not_drawn"]
    assert main(["run", "elasticity", "cube", "--out", "other", "--exact", "x;y;log(0-9-x)", "--quiet"]) == 2
    assert "not finite" in capsys.readouterr().err


def test_study_of_elasticity_shows_its_rates(in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    body = ["--exact", "x*y;sin(z);x", "--traction", "u1", "--young", "200", "--poisson-ratio", "0.25"]
    assert main(["study", "elasticity", "map.npz", *body, "--refine", "0..2", "--quiet"]) == 0
    study = json.loads(Path("map-study/report.json").read_text())["study"]
    assert study["exact"] == "x*y;sin(z);x" and study["levels"][-1]["dofs"] == 3 * 11**3
    assert study["levels"][-1]["rate_l2"] > 3.5
    assert main(["study", "elasticity", "map.npz", "--out", "none"]) == 2
    assert "exact" in capsys.readouterr().err


def test_modes_writes_frequencies_and_shapes(in_folder, capsys):
    """Those of `iga_nn.modes`, in order; a body that nothing holds leaves out its six rigid motions."""
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (3 * u, v, w), control_points=(6, 4, 4))
    volume.save("bar.npz")
    steel = ["--young", "100", "--poisson-ratio", "0", "--density", "4", "--number", "3", "--quiet"]
    assert main(["modes", "bar.npz", *steel, "--fix", "u0"]) == 0
    table = capsys.readouterr().out.splitlines()
    assert table[0].split() == ["mode", "frequency"] and table[-1] == "results in bar-modes"
    section = json.loads(Path("bar-modes/report.json").read_text())["modes"]
    assert [float(row.split()[1]) for row in table[1:4]] == pytest.approx(section["frequencies"], rel=1e-3)
    nothing = ["0"] * 3
    body = iga_nn.Elasticity(
        traction=dict.fromkeys(("u1", "v0", "v1", "w0", "w1"), nothing), young=100.0, poisson_ratio=0.0
    )
    found = iga_nn.modes(volume, body, 4.0, 3)
    assert section["frequencies"] == pytest.approx(found.frequencies, rel=1e-9) and section["rigid"] == 0
    with np.load("bar-modes/modes.npz") as data:
        assert data["coefficients"].shape == (3, 6, 4, 4, 3)
        assert np.allclose(data["coefficients"][0], found.shapes[0].coefficients, atol=1e-6)
    assert "Mode 3" in Path("bar-modes/report.html").read_text()
    assert main(["modes", "bar.npz", *steel, "--out", "free", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["modes"]["rigid"] == 6
    assert main(["modes", "bar.npz", *steel, "--fix", "top", "--out", "none"]) == 2
    assert (
        "region 'top': expression, column 1, 'top': unknown name" in capsys.readouterr().err
        and not Path("none").exists()
    )


def test_study_writes_table_csv_and_plot(in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    assert main(["study", "map.npz", "--degree", "3", "2", "--refine", "0..2"]) == 0
    table = capsys.readouterr().out.splitlines()
    assert table[0].split()[:3] == ["degree", "elements", "unknowns"] and len(table) == 8
    assert {file.name for file in Path("map-study").iterdir()} == {
        "report.html",
        "report.json",
        "study.csv",
        "study.png",
    }
    with Path("map-study/study.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert [(row["degree"], row["elements"]) for row in rows[:4]] == [("2", "8"), ("2", "64"), ("2", "512"), ("3", "8")]
    assert rows[0]["rate_l2"] == "" and float(rows[5]["rate_l2"]) > 3.5
    assert main(["study", "map.npz", "--refine", "0", "1", "--exact", "x*y*z", "--out", "other", "--json"]) == 0
    assert [row["degree"] for row in json.loads(capsys.readouterr().out)["levels"]] == [3, 3]


def test_check_surface_and_volume(in_folder, capsys):
    assert main(["check", "bean"]) == 0
    assert "vertices" in capsys.readouterr().out
    benchmark_volume(4).save("good.npz")
    benchmark_volume(4, amplitude=0.4).save("bad.npz")
    assert main(["check", "good.npz", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bijective"] == "certified"
    assert main(["check", "bad.npz"]) == 3
    assert "folded" in capsys.readouterr().out


def test_sample_writes_a_file_the_gate_accepts(in_folder, capsys):
    assert main(["sample", "bean"]) == 0
    assert capsys.readouterr().out.strip() == "bean.obj"
    assert main(["sample", "bean", "--out", "other.obj"]) == 0
    assert iga_nn.load_surface("bean.obj").volume == pytest.approx(iga_nn.sample("bean").volume)
    assert Path("other.obj").read_bytes() == Path("bean.obj").read_bytes()
    Path("other.obj").write_text("mine\n")
    assert main(["sample", "bean"]) == 0  # the same is there already
    assert main(["sample", "bean", "--out", "other.obj"]) == 2
    assert Path("other.obj").read_text() == "mine\n"
    assert main(["sample", "bean", "--out", "other.obj", "--force"]) == 0
    assert Path("other.obj").read_bytes() == Path("bean.obj").read_bytes()


def test_fetch_takes_the_model_from_the_data_folder(in_folder, monkeypatch):
    Path("models").mkdir()
    assert main(["sample", "bean", "--out", "models/conch.obj"]) == 0
    monkeypatch.setenv("IGA_NN_DATA", "models")
    assert main(["fetch", "conch", "--out", "here.obj"]) == 0
    assert Path("here.obj").read_bytes() == Path("models/conch.obj").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["run", "poisson", "missing.obj"], "missing.obj"),
        (["run", "poisson", "cube", "--exact", "exp(x"], "exact"),
        (["run", "poisson", "cube", "--exact", "__import__('os')"], "exact"),
        (["run", "poisson", "cube", "--boundary", "x"], "source"),
        (["run", "poisson", "cube", "--refine", "0", "0"], "refine"),
        (["run", "poisson", "cube", "--refine", "9"], "at most 6"),
        (["run", "poisson", "cube", "--refine", "999999999999"], "at most 6"),
        (["run", "poisson", "cube", "--refine", "6"], "unknowns, more than 20,000,000"),
        (["run", "poisson", "cube", "--exact", "log(x-0.5)"], "exact is not finite at x="),
        (["run", "poisson", "cube", "--source", "1e300"], "source exceeds 1e+100"),
        (["run", "poisson", "cube", "--exact", "-x"], "--exact=-x"),
        (["run", "poisson", "cube", "--exact", "x^2"], "x**2"),
        (["run", "poisson", "cube", "--exact", "2x"], "2*x"),
        (["run", "poisson", "cube", "--degree", "0"], "degree"),
        (["run", "poisson", "cube", "--quadrature", "simpson"], "quadrature"),
        (["run", "poisson", "cube", "--preset", "slow"], "preset"),
        (["run", "poisson", "cube", "--seed", "-1"], "seed"),
        (["run", "poisson", "cube", "--seed", "1.5"], "seed: must be a whole number, got 1.5"),
        (["run", "poisson", "cube", "--blocks", "two"], "--blocks: must be a whole number or auto, got two"),
        (["run", "poisson", "cube", "--refine", "a"], "--refine: must be a whole number, got a"),
        (["run", "poisson", "cube", "--kappa", "1", "--deflection", "x"], "--deflection: must be a number, got x"),
        (["run", "poisson", "cube", "--control-points", "6.4"], "control-points: must be a whole number"),
        (["solve", "poisson", "good.npz", "--refine", "0", "1.5"], "refine: must be a whole number, got 1.5"),
        (["run", "poisson", "cube", "--control-points", "3"], "control points"),
        (["run", "poisson", "cube", "--control-points", "100000"], "at most 100"),
        (["run", "poisson", "cube", "--steps-factor", "0"], "factor"),
        (["run", "poisson", "cube", "--steps-factor", "inf"], "factor"),
        (["run", "poisson", "cube", "--steps-factor", "nan"], "factor"),
        (["run", "poisson", "cube", "--out", ""], "out is empty"),
        (["run", "poisson", "cube", "--kappa", "1,2"], "kappa has 2 entries"),
        (["run", "poisson", "cube", "--kappa", "-x"], "--kappa=-x"),
        (["run", "poisson", "cube", "--kappa", ""], "kappa: the expression is empty"),
        (["study", "good.npz", "--out", ""], "out is empty"),
        (["run", "poisson", "cube", "--reaction", "q"], "reaction: expression"),
        (["run", "poisson", "cube", "--kappa", "x-0.5"], "kappa must be positive"),
        (["run", "poisson", "cube", "--neumann", "top"], "'top' is no face of the cube; the faces are u0, u1"),
        (["run", "poisson", "cube", "--neumann", "u0", "u0=x"], "u0 is given twice"),
        (["run", "poisson", "cube", "--source", "1", "--neumann", "u0"], "neumann u0 has no data"),
        (["run", "poisson", "cube", "--robin", "u0"], "write u0=ALPHA"),
        (["run", "poisson", "cube", "--neumann"], "--neumann requires at least 1 element"),
        (["run", "poisson", "cube", "--robin", "u0=1", "--neumann", "u0"], "face u0 has both"),
        (["study", "good.npz", "--refine", "0..9"], "at most 6"),
        (["study", "good.npz", "--refine", "2..0"], "ends before it begins; write 0..2"),
        (["study", "poisson", "good.npz", "other.npz"], "unknown arguments: other.npz; --help"),
        (["study", "elasticity", "good.npz", "--fix", "u0", "--load", "u1=1;0;0"], "no solution to compare with"),
        (["solve", "elasticity", "good.npz", "--source", "1"], "Unknown option: --source. --help lists the options."),
        (["solve", "poisson", "good.npz", "--refin", "1"], "Unknown option: --refin. Did you mean --refine?"),
        (["check", "cube", "--max-faces", "-4"], "max_faces must be a whole number, at least 4, got -4"),
        (["study", "good.npz", "--refine", "a"], "write levels such as 0 1 2"),
        (["study", "good.npz", "--refine", "0..1", "1"], "distinct levels"),
        (["study", "good.npz", "--degree", "2", "2"], "distinct degrees"),
        (["study", "good.npz", "--exact", "-x"], "--exact=-x"),
        (["study", "missing.npz"], "missing.npz"),
        (["study", "elasticity", "missing.npz"], "missing.npz: no such file"),
        (["solve", "elasticity", "good.npz"], "no load is given: --total-force"),
        (["solve", "elasticity", "good.npz", "--exact", "x;y"], "--exact 'x;y': write three formulas"),
        (["solve", "elasticity", "good.npz", "--body-force", "1"], "--body-force '1': write three formulas"),
        (["solve", "elasticity", "good.npz", "--exact", "x;y;z", "--poisson-ratio", "0.5"], "poisson_ratio"),
        (["solve", "elasticity", "good.npz", "--exact", "x;y;log(0-2-x)"], "not finite at x="),
        (["solve", "poisson", "good.npz", "--kappa", "0-1"], "kappa must be positive"),
        (
            ["solve", "poisson", "good.npz", "--source", "1", "--neumann", *(f"{f}=0" for f in FACE_NAMES)],
            "incompatible Neumann data",
        ),
        (["check", "bean", "--component", "3"], "component 3"),
        (["check", "bean", "--max-faces", "10"], "--max-faces"),
        (["check", "x" * 300], "x: File name too long"),
        (["run", "poisson"], "requires an argument"),
        (["run", "heat", "cube"], "heat"),
        (["parameterize", "cube", "--corners", "missing.txt"], "missing.txt"),
        (["parameterize", "cube", "--corners", "words.txt"], "eight points"),
        (["parameterize", "cube", "--corners", "seven.json"], "shape (7, 3)"),
        (["parameterize", "cube", "--corners", "numbers.json"], "vertex numbers"),
        (["parameterize", "cube", "--corners", "same.json"], "same vertex"),
        (
            ["parameterize", "cube", "--corners", "same.json", "--blocks", "5"],
            "several blocks are asked for: leave them",
        ),
        (["parameterize", "cube", "--corners", "scaled.json"], "XYZ must hold eight points"),
        (["parameterize", "cube", "--corners", "yes.json"], "eight points"),
        (["check", ""], "no surface is named"),
        (["check", "good.npz", "--strict"], "good.npz: is a volume; --component"),
        (["check", "."], "is a directory: name the surface file in it"),
        (["parameterize", "cube", "--max-faces", "10"], "face"),
        (["parameterize", "cube", "--out", "words.txt/deeper"], "cannot be written"),
        (["solve", "poisson", "missing.npz"], "missing.npz"),
        (["solve", "poisson", "words.txt"], "words.txt"),
        (["check", "missing.npz"], "missing.npz"),
        (["check", "missing.obj"], "missing.obj"),
        (["sample", "teapot"], "seashell"),
        (["sample", "bean", "--out", "no/such/folder/bean.obj"], "bean.obj"),
        (["sample", "bean", "--out", "bean.stl"], "files end in .obj"),
        (["sample", "bean", "--out", ""], "name the file"),
        (["fetch", "teapot"], "conch"),
        (["nonsense"], "nonsense"),
        (["check", "bean", "--nonsense"], "nonsense"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(arguments, says, in_folder, capsys, monkeypatch):
    monkeypatch.setattr("parameterize.run.parameterize", lambda *_, **__: pytest.fail("training must not start"))
    benchmark_volume(3).save("good.npz")
    Path("words.txt").write_text("once upon a time\n")
    Path("seven.json").write_text(json.dumps([[0, 0, 0]] * 7))
    Path("numbers.json").write_text(json.dumps([99999999] * 8))
    Path("scaled.json").write_text('{"XYZ": [0, 1, 2, 3, 4, 5, 6, 7]}')
    Path("same.json").write_text(json.dumps([[0, 0, 0]] * 8))
    Path("yes.json").write_text(json.dumps([True] * 8))
    if "--max-faces" in arguments:
        main(["sample", "cube", "--out", "cube.obj"])
        arguments = ["cube.obj" if word == "cube" else word for word in arguments]
        capsys.readouterr()
    before = set(Path().iterdir())
    assert main(arguments) == 2
    line = one_line(capsys.readouterr().err)
    assert says in line and "Errno" not in line
    assert set(Path().iterdir()) == before


@pytest.mark.pictures
def test_bad_data_leave_an_earlier_solution_alone(in_folder, capsys):
    benchmark_volume(3).save("map.npz")
    assert main(["solve", "poisson", "map.npz", "--refine", "0"]) == 0
    before = {file.name: file.read_bytes() for file in Path("map").iterdir()}
    assert main(["solve", "poisson", "map.npz", "--refine", "0", "--force", "--exact", "log(x)"]) == 2
    assert {file.name: file.read_bytes() for file in Path("map").iterdir()} == before
    assert main(["solve", "poisson", "map.npz", "--refine", "0", "--force", "--source", "1"]) == 0
    assert not Path("map/error.png").exists()  # nothing of the older problem stays


@contextmanager
def small_disk(size):
    """No file may grow beyond `size` bytes; exceeding it is reported as a full disk is."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
@pytest.mark.parametrize("size", [100, 1500, 4000])
def test_a_full_disk_is_one_line_and_leaves_no_half_file(size, formula_training, in_folder, capsys, monkeypatch):
    monkeypatch.setattr(
        "iga_nn.workflow.output_folder.RunFolder.draw", lambda *_, **__: None
    )  # figures come last and take longest
    formula_training()
    benchmark_volume(6).save("map.npz")
    for arguments in (["solve", "poisson", "map.npz", "--refine", "0"], ["parameterize", "cube"]):
        with small_disk(size):
            assert main([*arguments, "--out", "out"]) == 2
        assert "File too large" in one_line(capsys.readouterr().err)
        for path in Path("out").iterdir() if Path("out").exists() else []:
            assert ".part" not in path.name
            if path.suffix == ".npz":
                np.load(path, allow_pickle=False).close()
            else:
                assert not reports.is_finished(json.loads(path.read_text()))
        assert main([*arguments, "--out", "out", "--quiet"]) == 0  # there is room again: nothing is in the way
        shutil.rmtree("out")


def test_what_a_killed_run_left_half_written_goes(formula_training, in_folder, monkeypatch):
    monkeypatch.setattr("iga_nn.workflow.output_folder.RunFolder.draw", lambda *_, **__: None)
    formula_training()
    Path("cube").mkdir()
    Path("cube/.volume.1.part.npz").write_bytes(b"half")
    Path("cube/.volume.npz").write_bytes(b"somebody's")
    assert main(["parameterize", "cube", "--quiet"]) == 0
    assert not Path("cube/.volume.1.part.npz").exists() and Path("cube/.volume.npz").exists()


def test_second_run_in_the_same_folder_is_refused(in_folder, capsys):
    with open_folder("cube", "out", force=False) as state:
        state.begin("map")
        assert main(["parameterize", "cube", "--out", "out"]) == 2
        assert "in use by another run" in one_line(capsys.readouterr().err)


@pytest.mark.skipif(os.name != "posix", reason="signals and pipes of POSIX")
def test_ctrl_c_while_the_program_loads_is_one_line(in_folder):
    Path("sitecustomize.py").write_text(
        "import sys, signal\n"
        "class Interrupt:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == 'cyclopts': signal.raise_signal(signal.SIGINT)\n"
        "sys.meta_path.insert(0, Interrupt())\n"
    )
    done = python("-m", "iga_nn", "sample", "bean", path=".")
    assert done.returncode == 130 and "interrupted" in one_line(done.stderr)


@pytest.mark.skipif(os.name != "posix", reason="signals and pipes of POSIX")
def test_reader_that_has_gone_is_no_error(in_folder):
    read, write = os.pipe()
    os.close(read)
    done = python("-m", "iga_nn", "check", "bean", stdout=write)
    os.close(write)
    assert done.returncode == 0 and done.stderr == ""


def test_a_finished_result_answers_the_same_command_alone(formula_training, in_folder, capsys):
    formula_training()
    assert main(["parameterize", "cube", "--out", "out"]) == 0
    capsys.readouterr()
    assert main(["parameterize", "bean", "--out", "out", "--resume"]) == 2
    refusal = "holds the result of `iga-nn parameterize cube --out out` (different: surface)"
    assert refusal in one_line(capsys.readouterr().err)
    assert main(["parameterize", "cube", "--seed", "7", "--out", "out", "--resume"]) == 2
    assert "(different: seed)" in one_line(capsys.readouterr().err)
    assert main(["parameterize", "cube", "--out", "./out", "--resume"]) == 0


def test_a_finished_result_belongs_to_the_content_of_its_surface_not_to_the_name(formula_training, in_folder, capsys):
    formula_training()
    Path("part.obj").write_text(obj())
    assert main(["run", "poisson", "part.obj", "--refine", "0", "--out", "out"]) == 0
    Path("part.obj").rename("renamed.obj")
    assert main(["run", "poisson", "renamed.obj", "--refine", "0", "--out", "out", "--resume"]) == 0
    capsys.readouterr()
    assert main(["run", "poisson", "renamed.obj", "--refine", "1", "--out", "out", "--resume"]) == 2
    assert "(different: poisson.refine)" in one_line(capsys.readouterr().err)
    Path("renamed.obj").write_text(obj(2.0 * CUBE))
    assert main(["run", "poisson", "renamed.obj", "--refine", "0", "--out", "out", "--resume"]) == 2
    assert "(different: surface)" in one_line(capsys.readouterr().err)


def test_the_device_of_a_finished_result_may_be_that_of_another_machine(formula_training, in_folder, capsys):
    formula_training()
    assert main(["parameterize", "cube", "--out", "out"]) == 0
    report = Path("out/report.json")
    known = json.loads(report.read_text())
    known["device"] = known["identity"]["device"] = "cuda"
    report.write_text(json.dumps(known))
    assert main(["parameterize", "cube", "--out", "out", "--resume"]) == 0
    assert main(["parameterize", "cube", "--device", "cuda", "--out", "out", "--resume"]) == 0
    capsys.readouterr()
    assert main(["parameterize", "cube", "--device", "cpu", "--out", "out", "--resume"]) == 2
    assert "(different: device)" in one_line(capsys.readouterr().err)


def test_a_finished_result_whose_options_are_not_known_is_not_taken_for_the_same(formula_training, in_folder, capsys):
    formula_training()
    assert main(["parameterize", "cube", "--out", "out"]) == 0
    report = Path("out/report.json")
    known = json.loads(report.read_text())
    del known["identity"]  # as older versions wrote it
    report.write_text(json.dumps(known))
    capsys.readouterr()
    assert main(["parameterize", "cube", "--out", "out", "--resume"]) == 2
    assert "whose report has no identity; --force replaces it" in one_line(capsys.readouterr().err)


def test_an_interrupted_run_is_not_started_over_unasked(formula_training, in_folder, capsys):
    formula_training()
    Path("cube/checkpoint").mkdir(parents=True)
    Path("cube/checkpoint/training.safetensors").touch()
    assert main(["parameterize", "cube"]) == 2
    assert "--resume continues it, --force starts anew" in one_line(capsys.readouterr().err)
    assert Path("cube/checkpoint/training.safetensors").exists()
    assert main(["parameterize", "cube", "--force"]) == 0


@pytest.mark.parametrize("data", [["--robin", "w0=-3"], ["--neumann", "u0=1/0"], ["--robin", "w0=1:1/0"]])
def test_data_of_faces_are_refused_before_the_training(formula_training, in_folder, data, capsys):
    formula_training(error=AssertionError("trained"))
    assert main(["run", "poisson", "cube", *data]) == 2
    one_line(capsys.readouterr().err)


def test_data_that_are_good_on_their_own_face_are_taken(formula_training, in_folder):
    """x - 1/2 is negative on half of the surface, but not on the face."""
    formula_training()
    assert main(["run", "poisson", "cube", "--robin", "u1=x-0.5:1", "--refine", "0"]) == 0


def test_interruption_is_130_and_names_the_way_on(formula_training, in_folder, capsys):
    formula_training(error=KeyboardInterrupt())
    assert main(["parameterize", "cube", "--resume"]) == 130
    err = capsys.readouterr().err
    assert "no checkpoint, starting anew" in err and "nothing was computed yet" in one_line(err)
    Path("cube/checkpoint").mkdir(parents=True)
    Path("cube/checkpoint/training.safetensors").touch()
    assert main(["parameterize", "cube", "--resume"]) == 130
    err = capsys.readouterr().err
    assert "no checkpoint" not in err and "--resume continues" in one_line(err)
    assert not Path("cube/report.json").exists()  # not finished: the next run may use the folder


def test_bug_of_ours_is_not_dressed_up_as_bad_input(formula_training, in_folder):
    formula_training(error=ValueError("a bug"))
    with pytest.raises(ValueError, match="a bug"):
        main(["parameterize", "cube"])


def test_corners_reach_the_training(in_folder, monkeypatch):
    seen = {}

    def parameterize(surface, config=None, *, corners=None, **_):
        seen["corners"] = corners
        raise KeyboardInterrupt

    monkeypatch.setattr("parameterize.run.parameterize", parameterize)
    points = np.indices((2, 2, 2)).reshape(3, 8).T.astype(float)
    Path("corners.json").write_text(json.dumps(points.tolist()))
    main(["parameterize", "cube", "--corners", "corners.json"])
    assert np.array_equal(seen["corners"], points)
    Path("numbers.json").write_text("[0, 1, 2, 3, 4, 5, 6, 7]")
    main(["parameterize", "cube", "--corners", "numbers.json"])
    assert np.array_equal(seen["corners"], np.arange(8)) and seen["corners"].dtype.kind == "i"
    Path("scaled.json").write_text(json.dumps({"XYZ": (points - 0.5).tolist()}))
    main(["parameterize", "cube", "--corners", "scaled.json"])
    cube = iga_nn.sample("cube")
    assert seen["corners"] == pytest.approx(
        points - 0.5 + np.mean(cube.bbox, axis=0), abs=1e-6 + abs(cube.volume - 1.0)
    )


def test_checkpoint_of_another_run_is_said(formula_training, in_folder, capsys):
    formula_training(error=CheckpointError("belongs to another run"))
    assert main(["parameterize", "cube", "--resume"]) == 2
    assert "another run" in one_line(capsys.readouterr().err)


def test_a_refused_checkpoint_costs_no_file(formula_training, in_folder, capsys, monkeypatch):
    formula_training()
    with monkeypatch.context() as patched:
        patched.setattr("solve.solve_with", lambda *_, **__: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            main(["run", "poisson", "cube"])
    before = sorted(Path("cube").iterdir())
    Path("cube/checkpoint").mkdir()
    Path("cube/checkpoint/spline.safetensors").touch()
    formula_training(error=CheckpointError("belongs to another run"))
    assert main(["run", "poisson", "cube", "--seed", "3", "--resume"]) == 2
    assert sorted(Path("cube").iterdir()) == sorted([*before, Path("cube/checkpoint")])
    assert Path("cube/volume.npz") in before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interruption_in_the_middle_of_a_training_leaves_a_checkpoint(
    number, in_folder, short_training, capsys, monkeypatch
):
    train, steps = iga_nn.parameterize, []

    def parameterize(surface, config=None, *, progress, **options):
        def interrupted(now):
            progress(now)
            steps.append(now)
            if len(steps) == 8:
                signal.raise_signal(number)

        return train(surface, config, progress=interrupted, **options)

    monkeypatch.setattr("parameterize.run.parameterize", parameterize)
    monkeypatch.setattr(sys, "argv", ["iga-nn", "parameterize", "bean"])
    monkeypatch.setattr("atexit.register", lambda *_: None)  # what it does at the end of the process
    before = [(each, signal.getsignal(each)) for each in (signal.SIGINT, signal.SIGTERM)]
    signal.signal(signal.SIGINT, signal.default_int_handler)  # where pytest itself was started to ignore it
    try:
        with pytest.raises(SystemExit) as ended:
            run_and_exit()
    finally:
        for each, handler in before:
            signal.signal(each, handler)
    assert ended.value.code == 130 and len(steps) == 8
    assert "--resume" in one_line(capsys.readouterr().err)
    assert any(Path("bean/checkpoint").iterdir())


@pytest.mark.parametrize("words", [["--close", "open.obj"], ["open.obj", "--close"], ["open.obj", "--close", "all"]])
def test_close_may_stand_before_the_name_and_takes_all(words, in_folder, capsys):
    vertices, faces = ball(subdivisions=3)
    Path("open.obj").write_text(obj(vertices, faces[1:]))
    assert main(["check", *words]) == 0
    assert "closed 1 boundary loop" in capsys.readouterr().out


HERE = os.environ | {"PYTHONPATH": str(Path(iga_nn.__file__).parents[1])}
LAST_WORDS = """
import os, sys
class Library:
    def __del__(self, write=os.write):
        write(2, b"leaked")
kept = Library()
sys.argv = ["iga-nn", "--version"]
from iga_nn.__main__ import run_and_exit
run_and_exit()
"""


def test_libraries_say_nothing_once_python_ends():
    done = subprocess.run([sys.executable, "-c", LAST_WORDS], capture_output=True, text=True, env=HERE)
    assert (done.returncode, done.stderr) == (0, "")
    loud = LAST_WORDS.replace("run_and_exit()", "sys.exit()")
    assert "leaked" in subprocess.run([sys.executable, "-c", loud], capture_output=True, text=True, env=HERE).stderr
