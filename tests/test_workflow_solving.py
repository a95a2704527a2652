"""A solve in its folder tells which data it was given where, and what holds the body."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import iga_nn
from iga_nn.cli.commands import main
from iga_nn.figures import render
from iga_nn.workflow.solving import regions_of
from solve.study import benchmark_volume

BODY = ["--fix", "z < 1e-6", "--load", "nz > 0.9 and x < 1/2=0;0;-2", "--unit", "mm", "--stress-unit", "MPa"]


@pytest.mark.pictures
def test_regions_and_reactions_are_told_in_terminal_report_and_page(in_folder, capsys, coarse_regions):
    """A cube of side 1, held below and pressed on half of its top: load -1, which the fixed face answers."""
    grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 5)] * 3, indexing="ij"), axis=-1)
    iga_nn.BSplineVolume.uniform(grid).save("cube.npz")
    assert main(["solve", "elasticity", "cube.npz", *BODY, "--refine", "0", "--quiet", "--out", "out"]) == 0
    said = capsys.readouterr().out.splitlines()
    at = next(i for i, line in enumerate(said) if line.startswith("balance "))
    assert said[at] == "balance          load (0, 0, -1) N"
    assert said[at + 1] == f"{'':16s} fix 'z < 1e-6' answers (0, 0, 1) N"
    section = json.loads(Path("out/report.json").read_text())["elasticity"]
    fixed, loaded = section["regions"]
    assert fixed == {"kind": "fix", "region": "z < 1e-6", "data": "0;0;0", "area": pytest.approx(1.0, rel=1e-4)}
    assert loaded == {
        "kind": "load",
        "region": "nz > 0.9 and x < 1/2",
        "data": "0;0;-2",
        "area": pytest.approx(0.5, rel=1e-3),
    }
    text = Path("out/report.html").read_text().replace("\n", "")
    assert "<td>load</td><td>nz &gt; 0.9 and x &lt; 1/2</td><td>0;0;-2</td><td>0.5</td>" in text
    assert "<h2>What holds the body</h2>" in text and '<th scope="col">z [N]</th>' in text
    assert "<td>Fix &#39;z &lt; 1e-6&#39;</td><td>0</td><td>0</td><td>1</td>" in text
    assert Path("out/regions.png").is_file() == render.can_draw() == ('alt="Where data are given"' in text)


def test_data_of_conditions_are_told_as_text():
    given = iga_nn.Poisson(
        conditions=[iga_nn.Value("u0", "x*y"), iga_nn.Flux("u1", 2.5), iga_nn.Exchange("v0", "3", 20.0)]
    )
    report = iga_nn.solve(benchmark_volume(1), given).report
    assert [(one["kind"], one["data"]) for one in regions_of(given, report)] == [
        ("value", "x*y"),
        ("flux", "2.5"),
        ("exchange", "3, outside 20"),
    ]
    body = iga_nn.Elasticity(fix={"u0": (0.0, None, "x")}, spring={"u1": "7", "v0": (7, (0, 0, 1))}, roller="w0")
    report = iga_nn.solve(benchmark_volume(1), body).report
    assert [one["data"] for one in regions_of(body, report)] == ["0;free;x", "0", "7", "7, outside 0;0;1"]
    exact = iga_nn.Poisson(exact="x", value="u0")
    told = regions_of(exact, iga_nn.solve(benchmark_volume(1), exact).report)
    assert told == [{"kind": "value", "region": "u0", "data": "that of the exact solution"}]
