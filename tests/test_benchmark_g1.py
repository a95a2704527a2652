from __future__ import annotations

import csv
import io
import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import dask
import pytest
from example_files import cells, load
from mesh_files import obj
from small_run import BATCH_WORKER, small_surface

import iga_nn
import solve
from iga_nn.batch.surfaces import Entry
from iga_nn.options import MapOptions
from iga_nn.report.document import read
from iga_nn.samples import write_obj

g1 = load("benchmarks/g1")

DUCK = g1.Row(
    "duck",
    verdict="certified",
    one_to_one="yes",
    control_points="30 x 30 x 30",
    det_lower_bound=0.0123,
    arap_mean_unit_volume=0.341,  # exactly the paper's
    arap_max_unit_volume=13.27,  # just above
    arap_mean_as_given=99.0,
    arap_max_as_given=99.0,
    boundary_rms_unit_volume=0.0004,
    boundary_rms_as_given=99.0,
    distance_rms=0.000567,
    distance_max=0.00891,
    spline_to_mesh_rms=0.00123,
    flipped_triangles=2,
    seconds=120.0,
    origin="growth",
    attempts="network, growth",
    rounds_approach=0,
    rounds_grow=11,
    rounds_shape=0,
    rounds_unfold=3,
    rounds_separate=0,
    rounds_polish=2,
    seconds_approach=0.0,
    seconds_grow=20.0,
    seconds_shape=0.0,
    seconds_unfold=30.0,
    seconds_separate=0.0,
    seconds_polish=10.0,
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
    assert paper["arap_mean"] == "0.341" and paper["arap_max"] == "13.269" and paper["boundary"] == "0.000846"
    assert paper["table"] == "B.6" and paper["seconds"] == "226.5"


def test_figures_at_or_below_the_papers_are_bold_at_the_papers_scale(tmp_path):
    text = g1.as_markdown([CONCH, DUCK], options(tmp_path))
    figures = ["0.0123", "**0.341**", "0.341", "13.270", "13.269", "**0.000400**", "0.000846"]
    duck = ["duck", "1", "certified", "yes", *figures]
    conch = ["conch", "1", "folded", "yes", "", "**1.400**", "1.468", "99.000", "50.818", "99.000000", "0.001690"]
    assert cells(text, "duck")[0] == duck and cells(text, "conch")[0] == conch
    assert cells(text, "duck")[1:] == [
        ["duck", "0.000567", "0.00891", "0.00123", "", "", "", "2"],
        ["duck", "30 x 30 x 30", "120.0", "226.5", "", "", "", "", ""],
        ["duck", "growth", "network, growth", "", "11 / 20.0", "", "3 / 30.0", "", "2 / 10.0"],
        ["duck", "", "", "", "", "2.50e-05", "", "21"],
    ]


def test_a_map_of_several_blocks_is_measured_otherwise_and_never_bold(tmp_path):
    row = replace(DUCK, model="horse_default", blocks=9, arap_mean_as_given=0.3, boundary_rms_as_given=0.001)
    (found, *_) = cells(g1.as_markdown([row], options(tmp_path)), "horse_default")
    assert found[1] == "9" and found[5:7] == ["0.300", "4.340"] and found[-2:] == ["**0.001000**", "0.003490"]


def test_a_remeshed_shape_has_the_volume_of_the_conch_and_both_layouts(tmp_path):
    (tmp_path / "cmu").mkdir()
    write_obj(iga_nn.sample("bean"), tmp_path / "cmu/santa.obj")
    chosen = options(tmp_path, names=("santa_cube", "santa_default"))
    cube, default = g1._tasks(chosen, leave_out=())
    assert (cube.mapping.blocks, default.mapping.blocks) == (1, "auto") and cube.mesh == default.mesh
    surface = iga_nn.load_surface(cube.mesh)
    assert surface.scale**-3 == pytest.approx(3.1416, rel=1e-6)
    assert surface.vertices.max(axis=0) == pytest.approx(-surface.vertices.min(axis=0))
    assert cube.problem_options.exact == "exp(x+z)*sin(y)"


def test_a_failure_keeps_its_row_and_says_why(tmp_path):
    rows = [g1.Row("bird", "no | surface"), replace(DUCK, status="cannot be solved"), g1.Row("santa4", g1.NOT_PUBLIC)]
    text = g1.as_markdown(rows, options(tmp_path))
    assert cells(text, "bird") == [["bird", "", "no \\| surface", "", "", "", "2.744", "", "37.446", "", "0.000961"]]
    assert cells(text, "duck")[0][2] == "certified; cannot be solved"
    assert cells(text, "santa4") == [
        ["santa4", "", "model not public", "", "", "", "3.936", "", "95.842", "", "0.005270"]
    ]


def test_the_markdown_ends_with_the_counts_and_the_machine(tmp_path):
    bird = g1.Row("bird", "not found")
    rows = [CONCH, DUCK, bird, g1.Row("santa4", g1.NOT_PUBLIC)]
    *_, counts, machine = g1.as_markdown(rows, options(tmp_path)).split("\n\n")
    assert counts.startswith(
        "Certified and one-to-one 1 of 3; of G1, ARAP mean at or below the paper's 1 of 2, rms at the vertices at or "
    )
    assert counts.endswith("below the paper's 1 of 2.")
    assert f"{g1.processes.cores()} cores, 1 at a time" in machine and machine.endswith("preset fast, seed 0.\n")
    assert all(f"{name} " in machine for name in ("python", "torch", "numpy", "iga-nn"))


def test_what_is_no_benchmark_says_so(tmp_path):
    quick = MapOptions(device="cpu", steps_factor=0.1, control_points=8)
    text = g1.as_markdown([DUCK], options(tmp_path, mapping=quick, names=("duck", "pig")))
    assert "Not finished yet: pig." in text and "times 0.1" in text and "8 control points" in text
    auto = g1._options(["--models", str(tmp_path), "--control-points", "auto", "--tolerance", "1e-4"])
    assert "auto control points a direction with tolerance 0.0001;" in g1.as_markdown([DUCK], auto)
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
    assert found["horse_cube"]["status"].startswith("not found: the README of HybridOctree_Hex")
    assert found["pig"]["status"] == f"{tmp_path}/models/pig.obj: not found; there, `iga-nn fetch pig` gets it"
    assert (
        "Certified and one-to-one 0 of 12; of G1, ARAP mean at or below the paper's 0 of 11" in capsys.readouterr().out
    )
    assert (
        g1.main(["--models", str(tmp_path / "models"), "--out", str(tmp_path), "--only", "santa4", "duck_default"]) == 0
    )


def test_models_are_looked_for_in_the_folder_of_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("IGA_NN_DATA", str(tmp_path))
    chosen = g1._options(["--out", str(tmp_path / "out"), "--only", "pig", "conch"])
    assert chosen.models == tmp_path and chosen.names == ("conch", "pig")
    (tmp_path / "pig.mesh").touch()
    (tmp_path / "santa4.obj").touch()
    assert g1.file_of("pig", tmp_path).name == "pig.mesh"
    assert g1._absence("pig", tmp_path) is None and g1._absence("santa4", tmp_path) is None
    (tmp_path / "pig.obj").touch()
    assert g1.file_of("pig", tmp_path).name == "pig.obj"


def test_bad_arguments_are_one_line(tmp_path, capsys):
    here = ("--models", str(tmp_path), "--out", str(tmp_path / "out"))
    assert "horse: no such model" in error_of(capsys, *here, "--only", "duck", "horse")
    assert "--jobs 0" in error_of(capsys, *here, "--jobs", "0")
    assert "seed -1" in error_of(capsys, *here, "--seed", "-1")
    assert "steps factor must be a positive number" in error_of(capsys, *here, "--steps-factor", "nan")
    assert "--preset" in error_of(capsys, *here, "--preset", "slow")
    assert "nowhere: no such folder" in error_of(capsys, "--models", "nowhere")
    (tmp_path / "file").touch()
    assert g1.main([*here, "--out", str(tmp_path / "file")]) == 2
    assert "file: cannot be written" in capsys.readouterr().err


@pytest.fixture
def formula(formula_training, in_this_process, in_folder):
    """Arguments for a duck whose map is given by formula, in this process."""
    formula_training()
    write_obj(iga_nn.sample("cube"), "duck.obj")
    return ["--models", ".", "--out", "out", "--only", "duck", "--steps-factor", "0.001"]


def test_a_row_holds_what_was_measured_and_is_kept(formula, capsys):
    assert g1.main(formula) == 0
    row = table(Path("out"))["duck"]
    assert row["status"] == "done" and row["verdict"] == "certified" and "" not in row.values()
    assert row["flipped_triangles"] == "0" and row["seconds_train"] == "1.0"
    assert float(row["boundary_rms_as_given"]) < 1e-12
    assert float(row["seconds"]) == pytest.approx(2.1)  # train, fit, optimize, certify
    assert float(row["l2_refine_1"]) < float(row["l2_refine_0"]) < 1e-2
    assert "duck: done, certified, ARAP mean " in capsys.readouterr().out
    report = read(Path("out/duck"))
    report["parameterization"] |= {"patches": [{}, {}], "control_points": 9072}
    blocks = g1.row_of(SimpleNamespace(entry=Entry("duck", "duck.obj", Path("out/duck")), report=report))
    assert (blocks.blocks, blocks.control_points, blocks.flipped_triangles) == (2, "9072", None)
    written = Path("out/duck/volume.npz").stat().st_mtime_ns
    assert g1.main(formula) == 0 and table(Path("out"))["duck"] == row
    assert Path("out/duck/volume.npz").stat().st_mtime_ns == written


def test_what_went_on_from_a_checkpoint_has_no_time(formula):
    checkpoint = Path("out/duck/checkpoint/training.safetensors")
    checkpoint.parent.mkdir(parents=True)
    checkpoint.touch()
    assert g1.main(formula) == 0
    row = table(Path("out"))["duck"]
    assert row["verdict"] == "certified" and row["seconds"] == row["threads"] == row["seconds_train"] == ""


def test_a_solve_that_does_not_converge_is_a_status(formula, monkeypatch):
    unlimited = solve.solve_with

    def stopped(volume, problem, options):
        return unlimited(volume, problem, replace(options, max_iterations=1))

    monkeypatch.setattr("solve.solve_with", stopped)
    assert g1.main(formula) == 1
    row = table(Path("out"))["duck"]
    assert "did not converge" in row["status"] and row["iterations_refine_0"] == "1"


def test_a_failure_is_a_row(formula, formula_training, capsys):
    formula_training(error=RuntimeError("no idea\nwhy"))
    assert g1.main(formula) == 1
    row = table(Path("out"))["duck"]
    assert (
        row["status"] == "internal error, please report it: RuntimeError: no idea why; the terminal shows the traceback"
        and row["verdict"] == ""
    )
    assert "Traceback" in capsys.readouterr().err


def test_an_interruption_keeps_the_rows(formula, formula_training, monkeypatch, capsys):
    def interrupted(*_):
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr("iga_nn.batch.cluster.computed", interrupted)
    assert g1.main(formula) == 130
    assert "Not finished yet: duck." in Path("out/g1.md").read_text()
    assert (
        capsys.readouterr().err == "g1.py: interrupted; 1 surface: 1 waiting; run the same command again to continue\n"
    )


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_models_run_in_processes_of_their_own(tmp_path):
    surface = small_surface()
    (tmp_path / "duck.obj").write_text(obj(surface.vertices, surface.faces))
    (tmp_path / "pig.obj").write_text("no surface\n")
    arguments = ["--models", str(tmp_path), "--out", str(tmp_path / "out"), "--only", "pig", "duck"]
    with dask.config.set({"distributed.worker.preload": [str(BATCH_WORKER)]}):
        assert g1.main([*arguments, "--steps-factor", "0.003"]) == 1
    found = table(tmp_path / "out")
    assert list(found) == ["duck", "pig"]
    assert "0 faces are no surface" in found["pig"]["status"] and found["pig"]["verdict"] == ""
    assert found["duck"]["verdict"] in ("certified", "folded", "undecided")
    assert int(found["duck"]["threads"]) == g1.processes.cores()
    assert float(found["duck"]["seconds"]) > 0.0
