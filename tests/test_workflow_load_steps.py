"""Load steps of a run: interrupted, shown, resumed, and told in the report."""

import json

import pytest

import iga_nn
from iga_nn.options import FiniteOptions, PlasticOptions
from iga_nn.workflow.pipeline import solve_to
from parameterize.checkpoint import Checkpoints

BAR = PlasticOptions(young=200.0, hardening=20.0, roller=("u0", "v0", "w0"), load=("u1=1.5;0;0",), steps=4, refine=(0,))


@pytest.fixture
def volume(in_folder):
    bar = iga_nn.BSplineVolume.from_function(lambda u, v, w: (2 * u, v, w), control_points=3, degree=2)
    bar.save("bar.npz")
    return "bar.npz"


def interrupted_after(steps, monkeypatch):
    """Let the user interrupt a run once so many load steps are kept."""
    save, count = Checkpoints.save, [0]

    def counted(self, name, arrays, state):
        save(self, name, arrays, state)
        count[0] += name == "steps"
        if count[0] == steps:
            raise KeyboardInterrupt

    monkeypatch.setattr(Checkpoints, "save", counted)


def report(folder):
    return json.loads((folder / "report.json").read_text())


def test_an_interrupted_run_shows_its_last_load_step_and_goes_on_after_it(volume, tmp_path, monkeypatch):
    folder = tmp_path / "out"
    with monkeypatch.context() as patched:
        interrupted_after(3, patched)
        with pytest.raises(KeyboardInterrupt, match="--resume continues from the load steps"):
            solve_to(volume, folder, problem_options=BAR)
    found = report(folder)
    (level,) = found["plastic"]["levels"]
    assert level["load_factor"] == 0.75 and not level["converged"]
    assert "interrupted: this is the solution under 0.75 of the load" in found["plastic"]["notices"][0]
    outcome = solve_to(volume, folder, problem_options=BAR, resume=True)
    (level,) = outcome.report["plastic"]["levels"]
    assert [step["factor"] for step in level["load_steps"]] == [0.25, 0.5, 0.75, 1.0] and level["converged"]
    assert level["extremes"]["plastic_strain"]["largest"] == pytest.approx(0.5 / 20.0, rel=1e-6)


def test_a_solution_is_read_back_with_its_plastic_strain(volume, tmp_path):
    outcome = solve_to(volume, tmp_path / "out", problem_options=BAR)
    loaded = iga_nn.load_solution(outcome.folder)
    assert loaded.quantity("plastic_strain", [[0.5, 0.5, 0.5]])[0] == pytest.approx(0.025, rel=1e-6)


@pytest.mark.slow
def test_a_limit_load_is_a_result_that_says_so(volume, tmp_path):
    broken = PlasticOptions(young=200.0, roller=("u0", "v0", "w0"), load=("u1=1.5;0;0",), steps=2)
    found = solve_to(volume, tmp_path / "out", problem_options=broken).report["plastic"]
    assert 0.65 < found["levels"][0]["load_factor"] < 2.0 / 3.0 + 1e-9
    assert any("of the load: beyond no equilibrium is found" in notice for notice in found["notices"])


def test_rubber_is_solved_by_its_name(volume, tmp_path):
    rubber = FiniteOptions(law="yeoh", c10=0.5, bulk=20.0, fix=("u0",), load=("u1=0.2;0;0",), steps=1)
    found = solve_to(volume, tmp_path / "out", problem_options=rubber).report["finite"]
    assert found["law"] == "yeoh" and found["levels"][0]["extremes"]["volume_ratio"]["least"] < 1.01
