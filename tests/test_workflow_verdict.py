"""A map that is too far from its surface is not offered as the part, nor solved on unless the user asks for it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from iga_nn.cli.commands import main
from iga_nn.report import document as reports
from iga_nn.report import html
from parameterize.quality.distances import Distances
from parameterize.quality.quality import BothScales, Volumes
from solve.study import benchmark_volume

FAR = 0.4  # amplitude for which the map folds and has 2.4 % less volume than its surface


@pytest.fixture
def good(formula_training):
    """The quality of a map by formula, within 1 % of its surface."""
    from conftest import formula_parameterization

    return formula_parameterization().quality


def at(quality, distance=0.0, volume=1.0):
    """A quality whose largest distance is a share of the diagonal, and whose volume is a multiple of the mesh's."""
    gaps = Distances(0.0, 0.0, distance * quality.diagonal)
    distances = BothScales(gaps, gaps)
    return replace(quality, surface_distance=distances, volumes=Volumes(2.0 * volume, 2.0))


@pytest.mark.parametrize(
    ("distance", "volume", "reasons"),
    [
        (0.019, 1.019, []),
        (0.0, 0.981, []),
        (0.057, 1.0, ["its boundary is up to 5.7 % of the diagonal from the surface"]),
        (0.001, 0.55, ["its volume is 45 % less than the part's"]),
        (0.7, 2.2, ["its boundary is up to 70 % of the diagonal", "its volume is 120 % more"]),
        (float("nan"), float("nan"), ["its boundary is up to nan %", "its volume is nan %"]),
    ],
)
def test_two_per_cent_of_the_diagonal_or_of_the_volume_are_too_many(good, distance, volume, reasons):
    found = at(good, distance, volume)
    assert len(found.not_the_part) == len(reasons)
    assert all(text.startswith(start) for text, start in zip(found.not_the_part, reasons, strict=True))
    report = {"parameterization": found.as_dict()}
    assert report["parameterization"].get("not_the_part", []) == list(found.not_the_part)
    assert (reports.state(report) == "not the part") == bool(reasons)
    assert str(found).startswith("NOT THE PART: its") == bool(reasons)


def test_a_map_that_is_not_the_part_says_so_first_and_is_solved_if_asked(formula_training, in_folder, capsys):
    formula_training(amplitude=FAR)
    assert main(["run", "poisson", "cube", "--refine", "0"]) == 5
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "NOT THE PART     its volume is 2.4 % less than the part's"
    assert out[1].startswith(
        "NOT SOLVED       the map is not the part: its volume is 2.4 % less than the part's; the map"
    )
    assert (
        next(line for line in out if line.startswith("verdict")).split(None, 1)[1].startswith("NOT THE PART; det J > 0")
    )
    report = json.loads(Path("cube/report.json").read_text())
    assert html.verdicts(report)[0][:2] == ("bad", "This is not the part") and "poisson" not in report
    page = Path("cube/report.html").read_text()
    assert page.index("This is not the part") < page.index("folded") and "The problem was not solved" in page
    assert not Path("cube/solution.npz").exists() and report["advice"]

    assert main(["check", "cube/volume.npz"]) == 5  # the same, from the report of the run
    assert capsys.readouterr().out.startswith("NOT THE PART")
    assert main(["solve", "poisson", "cube/volume.npz", "--refine", "0", "--out", "s", "--json"]) == 5
    assert list(json.loads(capsys.readouterr().out))[1:3] == ["not_the_part", "not_solved"]
    assert main(["solve", "poisson", "cube/volume.npz", "--refine", "0", "--out", "s", "--force"]) == 5
    assert capsys.readouterr().out.startswith("NOT THE PART")
    assert main(["solve", "poisson", "cube/volume.npz", "--refine", "0", "--out", "t", "--solve-anyway"]) == 5
    report = json.loads(Path("t/report.json").read_text())
    assert report["poisson"]["levels"] and "not_solved" not in report and "--solve-anyway" in report["command"]
    assert "solve_anyway" not in report["poisson"]


@pytest.mark.parametrize(
    "command",
    [
        ["solve", "poisson", "--source", "1", "--boundary", "0", "--refine", "0"],
        ["study", "--refine", "0"],
        ["modes", "--number", "1", "--fix", "u0"],
    ],
    ids=lambda words: words[0],
)
def test_nothing_is_solved_on_a_folded_volume_unless_asked(in_folder, capsys, command):
    benchmark_volume(2, amplitude=FAR).save("volume.npz")
    words, rest = command[: 1 + (command[0] == "solve")], command[1 + (command[0] == "solve") :]
    assert main([*words, "volume.npz", *rest, "--out", "out"]) == 3
    report = json.loads(Path("out/report.json").read_text())
    assert report["not_solved"] == "the map folds; --solve-anyway --force solves on it all the same"
    assert capsys.readouterr().out.startswith("NOT SOLVED       the map folds")
    assert main([*words, "volume.npz", *rest, "--out", "out", "--force", "--solve-anyway"]) == 3
    report = json.loads(Path("out/report.json").read_text())
    assert "not_solved" not in report and {"poisson", "study", "modes"} & set(report)


def test_another_volume_in_the_folder_of_a_run_is_not_judged_by_its_report(formula_training, in_folder):
    formula_training(amplitude=FAR)
    assert main(["parameterize", "cube"]) == 5
    benchmark_volume(2).save("cube/volume.npz")
    assert main(["solve", "poisson", "cube/volume.npz", "--refine", "0", "--out", "out"]) == 0
    assert "surface_distance" not in json.loads(Path("out/report.json").read_text())["parameterization"]
