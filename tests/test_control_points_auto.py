"""`--control-points auto` on the command line: what the report, the page and the terminal say of it."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import pytest
from conftest import formula_parameterization, told

from iga_nn.cli.commands import main
from iga_nn.report import document as reports
from parameterize.refinement import Level, Refinement

FIRST, LAST = Level((30, 30, 30), 9e-4, 0.02, 0), Level((34, 41, 30), 4.7e-4, 0.01, 0)
MET = Refinement(5e-4, 60, "tolerance met", (FIRST, LAST), None)
FAR = "30 x 30 x 30; rms distance 0.0009 of the diagonal"
TOLD = {
    "34 x 41 x 30, 30 x 30 x 30 at first; rms distance 0.00047 of the diagonal, tolerance 0.0005 met; "
    "largest distance 0.01": MET,
    f"{FAR}, tolerance 0.001 met; largest distance 0.02": Refinement(1e-3, 60, "tolerance met", (FIRST,), None),
    f"{FAR}, tolerance 0.0005 not met with at most 30 per direction; largest distance 0.02": Refinement(
        5e-4, 30, "limit reached", (FIRST,), None
    ),
    f"{FAR}, tolerance 0.0005 not met: no better map that is certified was found with 34 x 41 x 30; "
    "largest distance 0.02": Refinement(5e-4, 60, "no better map", (FIRST,), replace(LAST, unproved=2)),
}


@pytest.mark.parametrize("words", TOLD)
def test_it_is_said_how_many_and_why(words):
    section = {"refinement": json.loads(json.dumps(asdict(TOLD[words])))}
    assert reports.control_points_in_words({"parameterization": section}) == words
    assert reports.control_points_in_words({"parameterization": {}}) == ""


def test_of_several_blocks_the_number_of_all_control_points_is_said():
    blocks = Refinement(1e-3, 60, "tolerance met", (replace(LAST, control_points=2916),), None)
    section = {"refinement": json.loads(json.dumps(asdict(blocks)))}
    assert reports.control_points_in_words({"parameterization": section}).startswith("2,916; rms distance")


def test_reports_of_older_versions_are_still_put_into_words():
    level = {"control_points": [30, 30, 30], "boundary": 9e-4, "unproved": 0}
    told = {"tolerance": 1e-3, "max_control_points": 60, "stopped": "tolerance met", "levels": [level], "dropped": None}
    words = "30 x 30 x 30; rms distance 0.0009 of the diagonal at the vertices, tolerance 0.001 met"
    assert reports.control_points_in_words({"parameterization": {"refinement": told}}) == words


@pytest.fixture
def asked(monkeypatch):
    """The configuration that the training is given, in whose place there is a map by formula."""
    seen = []

    def parameterize(surface, config, when_made=None, **options):
        seen.append(config)
        return told(replace(formula_parameterization(), refinement=MET), when_made)

    monkeypatch.setattr("parameterize.run.parameterize", parameterize)
    return seen


def test_report_page_and_terminal_say_it(asked, in_folder, capsys):
    flags = ["--control-points", "auto", "--tolerance", "1e-3", "--max-control-points", "31"]
    assert main(["parameterize", "cube", "--out", "out", *flags]) == 0
    (config,) = asked
    assert (config.refinement.tolerance, config.refinement.max_control_points) == (1e-3, 31)
    (words, *_) = TOLD
    assert f"control points   {words}" in capsys.readouterr().out
    report = reports.read(in_folder / "out")
    assert report["parameterization"]["refinement"]["levels"][-1]["control_points"] == [34, 41, 30]
    assert report["command"] == "iga-nn parameterize cube " + (
        "--control-points auto --tolerance 0.001 --max-control-points 31 --out out"
    )
    assert words in (in_folder / "out" / "report.html").read_text()
    assert reports.verdict(report, in_folder / "out")["refinement"]["stopped"] == "tolerance met"


def test_room_for_the_most_control_points_is_asked_for_before_the_training(asked, in_folder, capsys):
    flags = ["--control-points", "auto", "--refine", "3"]
    assert main(["run", "poisson", "cube", *flags]) == 2
    assert "refine 3 gives" in capsys.readouterr().err and not asked


@pytest.mark.parametrize("given", ["many", "-1"])
def test_other_words_are_refused(given, in_folder, capsys):
    assert main(["parameterize", "cube", f"--control-points={given}"]) == 2
    *_, last = capsys.readouterr().err.strip().splitlines()
    assert last.startswith("iga-nn: ") and given in last
