from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import iga_nn
from iga_nn.errors import InputError
from iga_nn.figures.render import can_draw
from iga_nn.options import ElasticityOptions, MapOptions, PoissonOptions
from iga_nn.workflow import output_folder as folder
from iga_nn.workflow import pipeline
from parameterize.spline.volume import BSplineVolume
from solve import benchmark_volume

MODELS = Path(os.environ.get("IGA_NN_DATA", Path(__file__).resolve().parents[2] / "shared" / "models"))


def test_run_returns_what_it_wrote(formula_training, in_folder):
    formula_training()
    outcome = iga_nn.run("poisson", "cube", "out", poisson=PoissonOptions(refine=(0,)))
    assert outcome.report == json.loads((outcome.folder / "report.json").read_text())
    volume = BSplineVolume.load(outcome.folder / "volume.npz")
    level = outcome.report["poisson"]["levels"][0]
    assert level["dofs"] == int(np.prod(volume.shape))
    assert outcome.report["input"]["file"] == "cube"


def test_volume_and_report_outlive_a_failing_solve(formula_training, in_folder, monkeypatch):
    formula_training()
    monkeypatch.setattr("solve.solve_with", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        iga_nn.run("poisson", "cube", "out")
    assert (in_folder / "out" / "volume.npz").exists()
    report = json.loads((in_folder / "out" / "report.json").read_text())
    assert report["parameterization"]["bijective"] == "certified"
    assert report["parameterization"]["origin"] == "network" and "division" in report["parameterization"]
    assert "total" not in report["seconds"]  # unfinished: the same command may run again


def test_a_refused_solve_leaves_a_page_of_the_map(formula_training, in_folder):
    formula_training(amplitude=0.4)

    def refuse(*_, **__):
        raise ValueError("exact is not finite at x=0.5")

    with pytest.MonkeyPatch.context() as patched, pytest.raises(InputError, match="not finite"):
        patched.setattr("solve.solve_with", refuse)
        iga_nn.run("poisson", "cube", "out", poisson=iga_nn.PoissonOptions(solve_anyway=True))
    report = json.loads((in_folder / "out" / "report.json").read_text())
    assert report["not_solved"] == "exact is not finite at x=0.5" and "total" not in report["seconds"]
    page = (in_folder / "out" / "report.html").read_text()
    assert "not solved</strong>exact is not finite at x=0.5" in page and "det J &gt; 0: folded" in page


def test_broken_input_leaves_an_earlier_result_alone(formula_training, in_folder):
    formula_training()
    pipeline.parameterize_to("cube", "out")
    before = (in_folder / "out" / "report.json").read_bytes()
    with pytest.raises(iga_nn.MeshError):
        pipeline.parameterize_to("missing.obj", "out", force=True)
    assert (in_folder / "out" / "report.json").read_bytes() == before


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("volume.npz", b"my own", "holds volume.npz without a report of its run"),
        ("solution.npz", b"my own", "holds solution.npz without a report of its run"),
        ("report.json", b'{"x":', "report.json is damaged"),
        ("report.json", b"[]", "report.json is damaged"),
        ("report.json", b'{"schema": 1, "seconds": {"total": 1}, "parameterization": 3}', "report.json is damaged"),
        ("report.json", b'{"schema": 1, "seconds": 3}', "report.json is damaged"),
    ],
)
@pytest.mark.parametrize("resume", [False, True])
def test_files_that_no_report_tells_of_are_kept(formula_training, in_folder, name, content, says, resume):
    formula_training()
    held = in_folder / "out" / name
    held.parent.mkdir()
    held.write_bytes(content)
    with pytest.raises(InputError, match=f"out: {says}; --force replaces"):
        pipeline.parameterize_to("cube", "out", mapping=MapOptions(resume=resume))
    assert held.read_bytes() == content
    pipeline.parameterize_to("cube", "out", force=True)
    assert held.exists() == (name != "solution.npz") and (in_folder / "out" / "report.json").exists()


def test_a_solve_keeps_a_solution_that_no_report_tells_of(in_folder):
    benchmark_volume(3).save(in_folder / "mine.npz")
    held = in_folder / "out" / "solution.npz"
    held.parent.mkdir()
    held.write_bytes(b"my own")
    with pytest.raises(InputError, match="holds solution.npz without a report"):
        pipeline.solve_to("mine.npz", "out", problem_options=PoissonOptions(refine=(0,)))
    assert held.read_bytes() == b"my own"


def test_the_checkpoint_stays_until_all_is_solved(formula_training, in_folder, monkeypatch):
    formula_training()
    checkpoint = in_folder / "out" / "checkpoint" / "spline.safetensors"
    checkpoint.parent.mkdir(parents=True)
    checkpoint.touch()
    again = MapOptions(resume=True)
    with monkeypatch.context() as patched:
        patched.setattr("solve.solve_with", lambda *_, **__: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            iga_nn.run("poisson", "cube", "out", mapping=again)
    assert checkpoint.exists()
    with pytest.raises(InputError, match="holds an interrupted run"):
        iga_nn.run("poisson", "cube", "out")
    iga_nn.run("poisson", "cube", "out", mapping=again, poisson=PoissonOptions(refine=(0,)))
    assert not checkpoint.parent.exists()


def test_a_map_that_was_changed_is_not_kept(formula_training, in_folder, monkeypatch, caplog):
    """An interrupted run goes on with the map of its report, and not with a volume of 8 times its size."""
    formula_training()
    with monkeypatch.context() as patched:
        patched.setattr("solve.solve_with", lambda *_, **__: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            iga_nn.run("poisson", "cube", "out", mapping=MapOptions(resume=True))
    made = iga_nn.load_volume("out/volume.npz")
    replace(made, control_points=2.0 * made.control_points).save("out/volume.npz")
    caplog.set_level("INFO")
    iga_nn.run("poisson", "cube", "out", mapping=MapOptions(resume=True), poisson=PoissonOptions(refine=(0,)))
    assert np.array_equal(iga_nn.load_volume("out/volume.npz").control_points, made.control_points)
    assert "volume.npz is not that of the report: the map is made anew" in caplog.text


def test_a_finished_result_without_its_files_is_no_answer(formula_training, in_folder):
    formula_training()
    pipeline.parameterize_to("cube", "out")
    with pytest.raises(InputError, match="leave --vector out"):
        pipeline.parameterize_to("cube", "out", mapping=MapOptions(resume=True), vector=True)
    whole = Path("out/volume.npz").read_bytes()
    Path("out/volume.npz").write_bytes(whole[:-100])
    with pytest.raises(InputError, match="volume.npz has changed since this finished result; --force makes it anew"):
        pipeline.parameterize_to("cube", "out", mapping=MapOptions(resume=True))
    Path("out/volume.npz").write_bytes(whole)
    pipeline.parameterize_to("cube", "out", mapping=MapOptions(resume=True))
    for name in ("boundary.npz", "volume.npz"):
        Path("out", name).unlink()
        with pytest.raises(InputError, match=f"{name} is gone"):
            pipeline.parameterize_to("cube", "out", mapping=MapOptions(resume=True))


def test_a_hidden_file_has_a_folder_of_its_own():
    assert folder.default_folder("models/.bean.obj") == Path(".bean")
    assert folder.default_folder("models/bean.obj.gz") == Path("bean")


def test_given_corners_are_marked_in_the_picture(formula_training, in_folder, monkeypatch):
    formula_training()
    seen = []
    draw = "iga_nn.workflow.output_folder.RunFolder.draw"
    monkeypatch.setattr(draw, lambda state, part, **known: seen.append(known["marks"]))
    Path("corners.json").write_text("[7, 6, 5, 4, 3, 2, 1, 0]")
    pipeline.parameterize_to("cube", "out", mapping=MapOptions(corners=Path("corners.json")))
    pipeline.parameterize_to("cube", "out", force=True)
    assert np.array_equal(seen[0], iga_nn.sample("cube").vertices[7::-1]) and seen[1] is None


@pytest.mark.pictures
def test_the_faces_that_a_solve_names_are_shown_until_the_next_solve(in_folder):
    benchmark_volume(3).save("map.npz")
    mixed = PoissonOptions(neumann=("u1",), refine=(0,))
    outcome = pipeline.solve_to("map.npz", "out", problem_options=mixed)
    picture = outcome.folder / "named_faces.png"
    if can_draw():
        assert picture.is_file()
    picture.touch()
    assert "faces by name</h2>" in (outcome.folder / "report.html").read_text() or not can_draw()
    pipeline.solve_to("map.npz", "out", problem_options=PoissonOptions(refine=(0,)), force=True)
    assert not picture.exists()


def test_a_device_that_cannot_solve_the_problem_costs_no_file(in_folder):
    benchmark_volume(3).save("map.npz")
    pipeline.solve_to("map.npz", "out", problem_options=PoissonOptions(refine=(0,)))
    before = {file.name: file.read_bytes() for file in Path("out").iterdir()}
    with pytest.raises(InputError, match="device must be one of cpu, cuda"):
        pipeline.solve_to("map.npz", "out", problem_options=ElasticityOptions(exact="x;0;0"), force=True, device="tpu")
    assert {file.name: file.read_bytes() for file in Path("out").iterdir()} == before


def test_unknown_problem_is_refused():
    with pytest.raises(InputError, match="heat"):
        iga_nn.run("heat", "cube")


def test_options_of_another_problem_are_refused():
    with pytest.raises(InputError, match=r"^elasticity: .* give poisson="):
        iga_nn.run("poisson", "cube", elasticity=ElasticityOptions())


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"mapping": {"seed": 1}}, r"mapping: must be MapOptions\(...\), got {'seed': 1}"),
        ({"poisson": iga_nn.Poisson(exact="x")}, r"poisson: must be PoissonOptions\(...\), got Poisson"),
        ({"mesh": iga_nn.sample("cube")}, r"mesh: must be a string or a path, got Surface\("),
        ({"out": 3}, "out: must be a string or a path or None, got 3"),
    ],
)
def test_arguments_of_another_type_are_refused(given, says, in_folder):
    with pytest.raises(InputError, match=says):
        iga_nn.run("poisson", **{"mesh": "cube"} | given)


def test_config_follows_the_options():
    config = MapOptions(preset="paper", steps_factor=0.1, control_points=12).config()
    assert config.name == "paper" and config.spline.control_points == 12
    assert config.stages[0].steps == 60


def test_default_problem_is_the_papers_at_volume_1():
    assert PoissonOptions().problem().exact == "exp(X+Z)*sin(Y)"
    assert PoissonOptions(source="1").problem().exact is None


@pytest.mark.slow
@pytest.mark.parametrize("name", ["conch", "bunny", "duck"])
def test_published_models_end_to_end(name, in_folder):
    model = MODELS / f"{name}.obj"
    if not model.exists():
        pytest.skip(f"{model}: not there; set IGA_NN_DATA to the folder of the models")
    report = iga_nn.run("poisson", model, "out").report
    assert report["seconds"]["total"] < 600.0
    assert all(level["converged"] for level in report["poisson"]["levels"])
    assert report["poisson"]["levels"][1]["l2"] < report["poisson"]["levels"][0]["l2"]
    files = {file.name for file in (in_folder / "out").iterdir()}
    assert files >= {"volume.npz", "boundary.npz", "solution.npz", "history.npz", "report.json", "history.png"}
