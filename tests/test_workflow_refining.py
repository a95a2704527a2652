"""Steps towards an accuracy are levels of a run, which says what became of it, and goes on after an interruption."""

import json
from pathlib import Path

import pytest
from cube_grids import glued
from mesh_files import obj
from plane_bodies import arrays

from iga_nn import InputError, PoissonOptions
from iga_nn.cli.commands import main
from iga_nn.workflow.pipeline import solve_to
from solve.refinement.loop import AdaptiveSolve

ASK = "u at (0.5, 0.5, 0.5)"


def section_of(folder):
    return json.loads((Path(folder) / "report.json").read_text())["poisson"]


@pytest.mark.parametrize(("given", "share"), [("2%", 0.02), ("0.02", 0.02), (0.5, 0.5), (" 1.5 % ", 0.015)])
def test_an_accuracy_is_a_share(given, share):
    options = PoissonOptions(accuracy=given, refine=(1, 2))
    assert options.wanted == pytest.approx(share) and options.levels == (1,)


@pytest.mark.parametrize("given", ["2", "0%", "-1%", "many", "100%"])
def test_what_is_no_share_is_refused(given):
    with pytest.raises(InputError, match="--accuracy .*: give a share such as 2% or 0.02"):
        PoissonOptions(accuracy=given)


def test_steps_are_levels_and_the_last_line_says_what_became_of_the_accuracy(in_folder, capsys):
    glued([(0, 0, 0), (1, 0, 0), (0, 1, 0)], 1, 2).save("body.npz")
    solve = ["solve", "poisson", "body.npz", "--source", "1", "--ask", ASK, "--accuracy", "2%", "--out", "out"]
    assert main(solve) == 0
    section = section_of("out")
    steps = section["refinement"]["steps"]
    assert section["refinement"] == {"accuracy": 0.02, "reached": True, "steps": steps}
    assert [level["graded"] for level in section["levels"]] == list(range(steps))
    (answer,) = section["asked"]
    assert answer["upper"] - answer["lower"] <= 0.04 * answer["value"]
    assert f"2 % reached in {steps} steps" in capsys.readouterr().out
    assert not any("grew" in notice for notice in section["notices"])


def test_what_stops_a_refinement_is_a_notice(in_folder, monkeypatch):
    glued([(0, 0, 0), (1, 0, 0)], 1, 2).save("body.npz")
    monkeypatch.setattr("iga_nn.workflow.refining.available_memory_mb", lambda: 1e-6)
    report = solve_to("body.npz", "out", problem_options=PoissonOptions(source="1", accuracy="1%")).report["poisson"]
    assert not report["refinement"]["reached"] and "GB of memory" in report["refinement"]["stopped"]
    assert report["notices"][0].startswith("accuracy 1 % is not reached in 1 steps: the next step takes")


def test_an_accuracy_is_for_one_process(in_folder):
    with pytest.raises(InputError, match="--accuracy refines in one process"):
        solve_to("body.npz", problem_options=PoissonOptions(accuracy="1%"), comm=object())


def test_an_interrupted_run_goes_on_with_its_last_step(in_folder, few_distances, monkeypatch):
    Path("L.obj").write_text(obj(*arrays("L")))
    run = ["run", "poisson", "L.obj", "--source", "1", "--control-points", "6", "--degree", "2", "--accuracy", "3%"]
    assert main([*run, "--out", "whole"]) == 0
    whole, step, done = section_of("whole"), AdaptiveSolve._step, []
    assert len(whole["levels"]) > 2

    def ends(self, options):
        done.append(options)
        if len(done) == 3:
            raise KeyboardInterrupt
        return step(self, options)

    monkeypatch.setattr(AdaptiveSolve, "_step", ends)
    assert main([*run, "--out", "out"]) == 130
    monkeypatch.setattr(AdaptiveSolve, "_step", step)
    assert len(section_of("out")["levels"]) == 2
    assert main([*run, "--out", "out", "--resume"]) == 0
    resumed = section_of("out")
    assert [level["dofs"] for level in resumed["levels"][:2]] == [level["dofs"] for level in whole["levels"][:2]]
    assert [level["graded"] for level in resumed["levels"]] == list(range(len(resumed["levels"])))
    assert resumed["refinement"]["reached"]
