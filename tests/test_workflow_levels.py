"""Levels that are done outlive what ends the next one, and a run that resumes goes on with that one."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from mesh_files import obj
from plane_bodies import arrays

import iga_nn
from iga_nn.cli.commands import main
from solve import ConvergenceError, solve_with
from solve.study import benchmark_volume

PLACES = os.pathsep.join(str(Path(iga_nn.__file__).parents[1] / place) for place in (".", "tests/support"))
MESHES = ["--refine", "0", "1", "2"]
QUICK = ["--control-points", "6", *MESHES]
FEWER = QUICK[:-1]


@pytest.fixture
def ending(monkeypatch):
    """A function that lets the solve refined `at` times end with an error; it returns the levels that are begun."""

    def install(error=None, at=2):
        begun = []

        def solve(body, problem, options):
            begun.append(options.refine)
            if options.refine == at and error is not None:
                raise error
            return solve_with(body, problem, options)

        monkeypatch.setattr("solve.solve_with", solve)
        return begun

    return install


def report_of(out):
    return json.loads((Path(out) / "report.json").read_text())


def numbers(section):
    """The levels of a section without the seconds, which differ from run to run."""
    return section | {"levels": [{**level, "seconds": sorted(level["seconds"])} for level in section["levels"]]}


def body_of_planes(place):
    """An L of three exact blocks, whose start keeps no rounds."""
    Path(place).write_text(obj(*arrays("L")))


ENDS = [
    (KeyboardInterrupt(), 130, "interrupted"),
    (MemoryError(), 2, "refine 2: the memory does not suffice"),
    (ConvergenceError("no convergence"), 4, "no convergence"),
    (ValueError("exact is not finite at x=0.5"), 2, "exact is not finite"),
]


@pytest.mark.parametrize(
    ("body", "error", "code", "says"), [*(("cube", *end) for end in ENDS), *(("L.obj", *end) for end in ENDS[:1])]
)
def test_what_is_done_is_shown_and_a_resumed_run_goes_on(
    body, error, code, says, formula_training, ending, in_folder, few_distances, capsys
):
    if body == "cube":
        formula_training()
    body_of_planes("L.obj")
    run = ["run", "poisson", body, *QUICK]
    assert main([*run, "--out", "whole"]) == 0
    ending(error)
    assert main([*run, "--out", "out"]) == code
    part, whole = report_of("out"), report_of("whole")
    assert numbers(part["poisson"])["levels"] == numbers(whole["poisson"])["levels"][:2]
    assert part["poisson"]["levels"][1]["extremes"] and len(part["poisson"]["rates"]["l2"]) == 1
    assert says in part["not_solved"] and part["not_solved"].endswith("refine 0, 1 is complete, refine 2 is missing")
    page = Path("out/report.html").read_text()
    assert "A level was not solved" in page and "refine 2 is missing" in page
    assert f"{part['poisson']['levels'][1]['dofs']:,}" in page and Path("out/solution.vtu").stat().st_size > 1000
    assert Path("out/convergence.png").is_file() and "total" not in part["seconds"]

    assert main([*run, "--out", "out"]) == 2
    assert "--resume continues it, --force starts anew" in capsys.readouterr().err.splitlines()[-1]
    begun = ending()
    assert main([*run, "--out", "out", "--resume"]) == 0 and begun == [2]
    assert "refine 0, 1: solved before the interruption" in capsys.readouterr().err
    after = report_of("out")
    assert numbers(after["poisson"]) == numbers(whole["poisson"]) and "not_solved" not in after
    assert after.keys() == whole.keys() and not Path("out/checkpoint").exists()
    for name in ("volume.npz", "solution.npz"):
        assert (Path("out") / name).read_bytes() == (Path("whole") / name).read_bytes()


def test_an_elastic_body_keeps_the_areas_of_its_regions(ending, in_folder, few_distances, coarse_regions):
    body_of_planes("L.obj")
    run = ["run", "elasticity", "L.obj", *FEWER, "--fix", "z < 1e-6", "--load", "nz > 0.9=0;0;-1"]
    run += ["--ask", "uz min", "reaction z of z < 1e-6"]
    assert main([*run, "--out", "whole"]) == 0
    for at, code in ((1, 130), (1, 130), (None, 0)):  # interrupted again right after it goes on
        ending(KeyboardInterrupt() if at else None, at)
        assert main([*run, "--out", "out", "--resume"]) == code
        if at:
            assert len(report_of("out")["elasticity"]["levels"]) == at
            areas = [region["area"] for region in report_of("out")["elasticity"]["regions"]]
            assert areas == pytest.approx([5.0, 5.0], rel=1e-2)
    assert numbers(report_of("out")["elasticity"]) == numbers(report_of("whole")["elasticity"])
    asked = report_of("out")["elasticity"]["asked"]
    assert [answer["ask"] for answer in asked] == run[-2:] and asked[1]["value"] == pytest.approx(5.0, rel=1e-2)


def test_levels_of_another_problem_are_solved_anew(formula_training, ending, in_folder, capsys):
    formula_training()
    ending(KeyboardInterrupt())
    assert main(["run", "poisson", "cube", *QUICK]) == 130
    begun = ending()
    assert main(["run", "poisson", "cube", *QUICK, "--exact=x*y", "--resume"]) == 0 and begun == [0, 1, 2]
    assert "those of another problem: all are solved anew" in capsys.readouterr().err


def test_a_solution_that_is_not_that_of_the_last_level_is_solved_anew(formula_training, ending, in_folder, capsys):
    formula_training()
    ending(KeyboardInterrupt())
    assert main(["run", "poisson", "cube", *QUICK]) == 130
    Path("cube/solution.npz").write_bytes(b"another")
    begun = ending()
    assert main(["run", "poisson", "cube", *QUICK, "--resume"]) == 0 and begun == [0, 1, 2]
    assert "is not the solution of the last level" in capsys.readouterr().err


def test_one_more_level_can_be_asked_for_on_the_way(formula_training, ending, in_folder):
    formula_training()
    ending(KeyboardInterrupt(), at=1)
    assert main(["run", "poisson", "cube", "--refine", "0", "1"]) == 130
    begun = ending()
    assert main(["run", "poisson", "cube", "--refine", "0", "1", "2", "--resume"]) == 0 and begun == [1, 2]


def test_an_interruption_of_the_first_level_leaves_the_map_and_its_page(
    ending, in_folder, few_distances, capsys, monkeypatch
):
    body_of_planes("L.obj")
    run = ["run", "poisson", "L.obj", "--control-points", "6", "--refine", "0"]
    ending(KeyboardInterrupt(), at=0)
    assert main(run) == 130
    assert "--resume continues from the map, and does again what came after" in capsys.readouterr().err
    assert report_of("L")["not_solved"] == "interrupted" and "poisson" not in report_of("L")
    assert "The problem was not solved" in Path("L/report.html").read_text()
    monkeypatch.setattr("parameterize.run.parameterize", lambda *_, **__: pytest.fail("the map is there"))
    begun = ending()
    assert main([*run, "--resume"]) == 0 and begun == [0] and "not_solved" not in report_of("L")
    assert "L: the map is there, and kept" in capsys.readouterr().err


def test_a_solve_keeps_its_levels_and_is_not_replaced_unasked(ending, in_folder, capsys):
    benchmark_volume(3).save("map.npz")
    ending(KeyboardInterrupt())
    assert main(["solve", "poisson", "map.npz", *MESHES, "--out", "out"]) == 130
    said = "the same command with --resume continues from the levels that are solved, and does again what came after"
    assert capsys.readouterr().err.splitlines()[-1] == f"iga-nn: interrupted; {said}"
    assert len(report_of("out")["poisson"]["levels"]) == 2 and Path("out/solution.vtu").is_file()
    ending()
    assert main(["solve", "poisson", "map.npz", *MESHES, "--out", "out"]) == 2
    assert "holds an interrupted run; --resume continues it" in capsys.readouterr().err
    assert main(["solve", "poisson", "map.npz", *MESHES, "--out", "out", "--force"]) == 0


def test_a_study_keeps_what_is_solved(in_folder, monkeypatch):
    benchmark_volume(3).save("map.npz")
    asked = ["study", "map.npz", "--degree", "3", "4", "--refine", "0", "1"]
    assert main([*asked, "--out", "whole"]) == 0
    from iga_nn.workflow import pipeline
    from solve import convergence

    begun = []

    def interrupted(volume, problem, levels, degree, **options):
        begun.append((degree, *levels))
        if len(begun) == 4:
            raise KeyboardInterrupt
        return convergence(volume, problem, levels, degree, **options)

    monkeypatch.setattr(pipeline, "convergence", interrupted)
    assert main([*asked, "--out", "out"]) == 130
    rows, whole = Path("out/study.csv").read_text().splitlines(), Path("whole/study.csv").read_text().splitlines()
    assert [row.split(",")[:3] for row in rows] == [row.split(",")[:3] for row in whole[: len(begun)]]
    assert report_of("out")["not_solved"].startswith("interrupted; 1 of the solves are missing")
    assert Path("out/study.png").is_file()


CHILD = """
import os, signal, sys
import iga_nn.figures.render, iga_nn.workflow.pipeline
import solve as package
from parameterize.spline.sampled_boundary import SampledBoundary
from small_run import FEW
from solve import solve_with
SampledBoundary.of.__func__.__defaults__ = FEW
iga_nn.figures.render.can_draw = lambda: False

def solve(body, problem, options):
    if options.refine == 1:
        os.kill(os.getpid(), signal.{name})
    return solve_with(body, problem, options)

package.solve_with = solve
sys.argv = ["iga-nn", *{arguments!r}]
from iga_nn.__main__ import run_and_exit
run_and_exit()
"""


@pytest.mark.exact
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGKILL", -signal.SIGKILL)])
def test_a_real_signal_in_a_level(name, code, in_folder, few_distances, ending):
    body_of_planes("L.obj")
    run = ["run", "poisson", "L.obj", *FEWER, "--out", "out"]
    program = CHILD.format(name=name, arguments=run)
    environment = os.environ | {"PYTHONPATH": PLACES, "OMP_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    assert len(report_of("out")["poisson"]["levels"]) == 1
    if name != "SIGKILL":
        way = "the same command with --resume continues from the levels that are solved, and does again what came after"
        assert done.stderr.splitlines()[-1] == f"iga-nn: interrupted; {way}"
        assert "refine 1 is missing" in Path("out/report.html").read_text() and Path("out/solution.vtu").is_file()
    begun = ending()
    assert main([*run, "--resume"]) == 0 and begun == [1]
    assert main([*run[:-1], "whole"]) == 0
    same = [np.load(Path(out, "solution.npz"))["p0_coefficients"] for out in ("out", "whole")]
    assert np.array_equal(*same) and numbers(report_of("out")["poisson"]) == numbers(report_of("whole")["poisson"])
