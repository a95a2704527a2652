"""A run ends at its time limit with the best result it has, says what is missing, and goes on with more time."""

import json
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from mesh_files import obj
from plane_bodies import arrays

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.options.texts import duration
from iga_nn.workflow import pipeline, time_limit
from iga_nn.workflow.output_folder import RunFolder
from iga_nn.workflow.time_limit import clock, demand_time
from parameterize.time_limit import OutOfTime, closing, limited, present_limit, reserving
from solve import solve_with
from solve.study import benchmark_volume

RUN = ["run", "poisson", "L.obj", "--control-points", "6", "--refine", "0", "1", "--out", "out"]


@pytest.fixture
def slow(monkeypatch):
    """A function that lets the solve refined `at` times run into the clock; None restores it."""

    def install(at):
        def solve(body, problem, options):
            if options.refine == at:
                raise OutOfTime("time limit of 600 s is reached")
            return solve_with(body, problem, options)

        monkeypatch.setattr("solve.solve_with", solve)

    Path("L.obj").write_text(obj(*arrays("L")))
    return install


def report():
    return json.loads(Path("out/report.json").read_text())


def test_times_in_words():
    assert [duration("--time-limit", text) for text in ("90s", "10min", "1.5h", "2 min", 7)] == [90, 600, 5400, 120, 7]
    for text in ("", "0s", "-1min", "soon", "1 day", "nan", "inf"):
        with pytest.raises(InputError, match="give a time such as 90s, 10min or 1h"):
            duration("--time-limit", text)


@pytest.mark.parametrize("in_thread", [False, True])
def test_the_clock_interrupts_what_runs_once_and_leaves_what_writes_alone(in_thread, monkeypatch):
    monkeypatch.setattr(time_limit, "TICK", 0.01)
    found = []

    def work():
        with clock(0.05):
            with closing():
                time.sleep(0.1)
            found.append("written")
            try:
                for _ in range(1000):
                    time.sleep(0.005)
            except OutOfTime:
                found.append("interrupted")
            time.sleep(0.05)
            found.append("told once")

    thread = threading.Thread(target=work) if in_thread else None
    if thread:
        thread.start()
        thread.join()
    else:
        work()
    assert found == ["written", "interrupted", "told once"]


def test_a_level_that_takes_longer_than_is_left_is_not_begun():
    with limited(100.0), reserving(40.0):
        demand_time(1, 50.0)
        with pytest.raises(OutOfTime, match=r"time limit of 100 s: refine 1 takes about 1:10, and 1:00 are left"):
            demand_time(1, 70.0)


def test_the_last_complete_level_is_the_result_and_a_resumed_run_goes_on(in_folder, few_distances, slow, capsys):
    slow(1)
    assert main([*RUN, "--time-limit", "10min"]) == 0
    found = report()
    assert found["not_solved"] == "time limit of 600 s is reached; refine 0 is complete, refine 1 is missing"
    assert found["incomplete"] == "the time limit of 600 s has ended the levels of the solve"
    assert "CUT SHORT" in capsys.readouterr().out and "The run was cut short" in Path("out/report.html").read_text()
    assert Path("out/solution.vtu").is_file() and iga_nn.load_solution("out").report.dofs > 0
    slow(None)
    assert main([*RUN, "--time-limit", "10min"]) == 2  # it is not finished, and not replaced either
    assert main([*RUN, "--resume"]) == 0
    assert len(report()["poisson"]["levels"]) == 2 and not {"incomplete", "not_solved"} & report().keys()
    assert not Path("out/checkpoint").exists()


def test_without_a_level_the_map_is_the_result(in_folder, few_distances, slow):
    slow(0)
    assert main([*RUN, "--time-limit", "10min"]) == 4
    assert report()["parameterization"]["bijective"] == "certified" and "poisson" not in report()


def test_without_a_map_it_ends_as_one_that_is_not_certified(in_folder, slow, monkeypatch, capsys):
    monkeypatch.setattr(time_limit, "TICK", 0.01)
    monkeypatch.setattr("parameterize.ways.planes.exact_blocks", lambda *_, **__: time.sleep(60.0))
    assert main([*RUN, "--time-limit", "0.5s"]) == 3
    said = capsys.readouterr().err.splitlines()[-1]
    assert said.startswith("iga-nn: out: the time limit of 0.5 s is reached before there is a result; ")


def test_a_solve_resumes_too(in_folder, slow):
    benchmark_volume(2).save("volume.npz")
    solve = ["solve", "poisson", "volume.npz", "--exact", "x*y*z", "--out", "out"]
    slow(1)
    assert main([*solve, "--time-limit", "10min"]) == 0 and "incomplete" in report()
    first = report()["poisson"]["levels"]
    slow(0)  # a level that is done is not solved again
    assert main([*solve, "--resume"]) == 0
    assert len(report()["poisson"]["levels"]) == 2 and report()["poisson"]["levels"][:1] == first
    assert not Path("out/checkpoint").exists() and main([*solve, "--resume"]) == 0
    assert main([*solve[:-4], "--exact", "x*y", "--out", "out", "--resume"]) == 2


def test_figures_are_left_out_where_the_limit_is_long_over(tmp_path, monkeypatch):
    monkeypatch.setattr(time_limit, "LATEST", 0.0)
    state = RunFolder(tmp_path)
    with limited(10.0):
        assert not time_limit.is_late()
    with limited(-1.0):
        state.draw("map", volume=None)
        assert state.report["not_drawn"] == {"figures of the map": "the time limit is over"}


def test_the_clock_does_not_end_the_page_of_a_map_that_is_done(monkeypatch):
    """A plate was certified and written, and the run said that the limit came before there was a result."""
    seen = []
    monkeypatch.setattr(pipeline, "scene_of", lambda *_, **__: seen.append(present_limit().is_closing))
    with limited(10.0):
        assert pipeline._finish(SimpleNamespace(finish=lambda write: "done"), None) == "done"
        assert seen == [True] and not present_limit().is_closing
