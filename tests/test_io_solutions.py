"""A solution is read back from the folder of a run, with its law and its report; what does not fit is refused."""

import json
from pathlib import Path

import numpy as np
import pytest

import iga_nn
from iga_nn.cli.commands import main
from solve.study import benchmark_volume

PLACES = [[0.3, 0.4, 0.5], [0.8, 0.1, 0.9]]


@pytest.fixture
def solved(in_folder):
    """Folders of a scalar problem on one patch, and of an elastic one on two."""
    benchmark_volume(2).save("one.npz")
    halves = [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (u + a, v, w), 4) for a in (0, 1)]
    iga_nn.Body.from_patches(halves).save("two.npz")
    assert main(["solve", "poisson", "one.npz", "--exact", "x*y*z", "--refine", "0", "--out", "heat"]) == 0
    law = ["--young", "100", "--fix", "nx < -0.9", "--load", "nx > 0.9=0;0;1", "--ask", "uz max", "--refine", "0"]
    assert main(["solve", "elasticity", "two.npz", *law, "--out", "bar"]) == 0


def refused(path, **given):
    with pytest.raises(iga_nn.InputError) as caught:
        iga_nn.load_solution(path, **given)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_solution_is_what_the_run_has_found(solved):
    heat, bar = iga_nn.load_solution("heat"), iga_nn.load_solution("bar/solution.npz")
    again = iga_nn.solve(iga_nn.load_volume("one.npz"), iga_nn.Poisson(exact="x*y*z"))
    assert np.array_equal(heat(PLACES), again(PLACES)) and heat.problem.exact == "x*y*z"
    assert heat.report.as_dict() | {"seconds": {}} == again.report.as_dict() | {"seconds": {}}
    assert np.array_equal(heat.quantity("flux", PLACES), again.quantity("flux", PLACES))
    level = json.loads(Path("bar/report.json").read_text())["elasticity"]["levels"][-1]
    assert bar.report.dofs == level["dofs"] and bar.report.balance.load == pytest.approx((0, 0, 1))
    assert bar.extremes("von_mises").largest == pytest.approx(level["extremes"]["von_mises"]["largest"])
    assert bar.answers[0].value == pytest.approx(bar.probe([bar.answers[0].at])[0, 2])
    bar.save("again.npz")
    assert iga_nn.export("two.npz", "view", "seen.vtu", solution="bar/solution.npz").is_file()


def test_what_does_not_belong_together_is_refused_in_one_line(solved):
    assert "no such" in refused("nowhere") or "is missing or damaged" in refused("nowhere")
    assert "solution.npz" in refused("heat", volume="two.npz")
    benchmark_volume(3).save("one.npz")
    assert refused("heat").startswith("one.npz: has changed since the run")
    Path("one.npz").unlink()
    assert refused("heat").startswith("one.npz: is not there")
    Path("bar/solution.npz").write_bytes(Path("heat/solution.npz").read_bytes())
    assert "bar/solution.npz: belongs to another volume" in refused("bar")
    Path("bar/solution.npz").write_bytes(b"PK")
    assert refused("bar").startswith("bar/solution.npz")
    Path("bar/solution.npz").unlink()
    assert "holds no solution" in refused("bar")
    Path("bar/report.json").write_text("{}")
    assert "report.json: is missing or damaged" in refused("bar")
