"""Two runs side by side, as text and as a page."""

import json
from pathlib import Path

import pytest
from browser import browse

from iga_nn.cli.commands import main
from iga_nn.report import comparison
from solve.study import benchmark_volume


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two solves of one body in tension, the second of half the stiffness and in other units of stress; no figures."""
    folder = tmp_path_factory.mktemp("runs")
    benchmark_volume(2).save(folder / "map.npz")
    load = ["--traction", "u1=1;0;0", "v0=0", "v1=0", "w0=0", "w1=0", "--refine", "0", "--quiet", "--unit", "mm"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("iga_nn.figures.render.can_draw", lambda: False)
        for name, young, stress in (("stiff", "200", "MPa"), ("soft", "100", "N/mm2")):
            given = ["--young", young, "--stress-unit", stress, "--out", str(folder / name)]
            assert main(["solve", "elasticity", str(folder / "map.npz"), *load, *given]) == 0
    return folder / "stiff", folder / "soft"


def of(runs):
    return [comparison.Run.of(folder) for folder in runs]


def test_numbers_stand_beside_each_other_with_their_ratio(runs):
    tables = comparison.rows(of(runs))
    assert list(tables) == ["The map", "The finest solve", "Largest and smallest values", "Forces and flows", "Seconds"]
    extremes = {row[0]: row[1:] for row in tables["Largest and smallest values"]}
    assert extremes["largest displacement [mm]"][2] == "2"
    stiff, soft = extremes["von Mises at most [MPa]"], extremes["von Mises at most [N/mm2]"]
    assert stiff[0].split()[0] == soft[1].split()[0] and stiff[1:] == ["–", "–"]  # units differ: no ratio
    assert ["unknowns", "375", "375", "1"] in tables["The finest solve"]


def test_reactions_are_compared_by_their_lengths(runs):
    one, other = of(runs)
    for run, size in ((one, 2.0), (other, 3.0)):
        finest = run.report["elasticity"]["levels"][-1]
        finest |= {"reactions": {"z < 1": [0.0, size, 0.0]}, "load": [0.0, -size, 0.0]}
    assert comparison.rows([one, other])["Forces and flows"] == [
        ["reaction on z < 1", "0, 2, 0", "0, 3, 0", "1.5"],
        ["load", "0, -2, 0", "0, -3, 0", "1.5"],
    ]


def test_a_volume_beside_a_solve_has_dashes(runs, in_folder):
    report = json.loads((runs[0] / "report.json").read_text())
    del report["elasticity"]
    (in_folder / "report.json").write_text(json.dumps(report))
    alone = comparison.Run.of(in_folder)
    tables = comparison.rows([alone, of(runs)[0]])
    assert ["unknowns", "–", "375", "–"] in tables["The finest solve"]


def test_the_page_is_one_file_that_fetches_nothing(runs, in_folder, chromium, capsys):
    assert main(["compare", *map(str, runs)]) == 0
    text = capsys.readouterr().out
    assert "largest displacement [mm]" in text and text.splitlines()[-1] == "open compare.html"
    page = Path("compare.html").read_text()
    assert page.count("The commands that repeat these") == 1 and page.count("det J &gt; 0: certified") == 2
    image, console, asked = browse(chromium, in_folder, Path("compare.html").resolve().as_uri(), 1000)
    assert console == "" and asked == [] and image.std() > 0.02


def test_what_is_no_run_is_one_line(runs, in_folder, capsys):
    Path("unfinished").mkdir()
    Path("unfinished/report.json").write_text(json.dumps({"schema": 1, "parameterization": {}, "seconds": {}}))
    Path("compare.html").write_text("mine")
    for other, says in (
        (".", ".: is no output folder of a run"),
        ("nowhere", "nowhere: is no output folder of a run"),
        ("unfinished", "unfinished: the run in this folder is not finished"),
        (str(runs[1]), "compare.html: exists; --force replaces it, --out names another file"),
    ):
        assert main(["compare", str(runs[0]), other]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith(f"iga-nn: {says}")
    assert main(["compare", *map(str, runs), "--out", "x.txt"]) == 2
    assert Path("compare.html").read_text() == "mine"


def test_several_runs_have_ratios_to_the_first(runs, in_folder, capsys):
    assert main(["compare", str(runs[1]), str(runs[0]), str(runs[1])]) == 0
    lines = capsys.readouterr().out.splitlines()
    (row,) = [line for line in lines if line.startswith("largest displacement [mm]")]
    assert row.split()[-2:] == ["0.5", "1"]
    page = Path("compare.html").read_text()
    assert page.count("det J &gt; 0: certified") == 3 and "ratios are those to the first" in page
