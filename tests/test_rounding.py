"""What is more than nothing is never shown as 0: seconds, memory, shares."""

import logging
from pathlib import Path
from types import SimpleNamespace

import pytest

from iga_nn.batch.run_batch import Running
from iga_nn.cli.answer import verdict_in_words
from iga_nn.cli.commands import main
from iga_nn.cli.progress import describe, tell_batch
from iga_nn.options import PoissonOptions
from iga_nn.report import document as reports
from iga_nn.report import html
from iga_nn.rounding import distance, distortion, rounded
from iga_nn.workflow import cost_estimate
from iga_nn.workflow.output_folder import Outcome
from parameterize.progress import Progress
from solve.study import benchmark_volume


@pytest.mark.parametrize(
    "value, digits, text",
    [
        (0.0, 1, "0.0"),
        (1e-12, 1, "below 0.1"),
        (0.0499, 1, "below 0.1"),
        (0.0501, 1, "0.1"),
        (0.0049, 2, "below 0.01"),
        (0.4, 0, "below 1"),
        (0.5, 0, "below 1"),  # half is rounded to the even number, here 0
        (0.51, 0, "1"),
        (1234.56, 1, "1,234.6"),
    ],
)
def test_numbers_by_hand(value, digits, text):
    assert rounded(value, digits) == text


def test_the_memory_of_a_small_solve_is_said(caplog):
    volume, options = benchmark_volume(2), PoissonOptions(refine=(0,))
    with caplog.at_level(logging.INFO, "iga_nn"):
        cost_estimate.tell_memory(volume, options.problem(), options.solve_options())
    assert caplog.messages == ["estimate: below 0.1 GB of memory"]


def test_little_free_memory_is_said(monkeypatch, caplog):
    volume, options = benchmark_volume(2), PoissonOptions(refine=(0,))
    monkeypatch.setattr(cost_estimate, "available_memory_mb", lambda _: 0.001)
    cost_estimate.tell_memory(volume, options.problem(), options.solve_options())
    assert "below 0.01 GB are free" in caplog.text


def test_the_last_moment_is_no_zero_seconds():
    assert "0:01 of the training left" in describe(Progress("cube", 1, 3, 0.5, 0, 0.2))


def test_a_share_that_has_begun_is_no_zero_percent():
    said = []
    running = [Running("bean", "S(2)", 0.003)]
    tell_batch(lambda line, **_: said.append(line), SimpleNamespace(rows=[0], counts={"waiting": 1}), running)
    assert said == ["0 of 1 surfaces; bean S(2) below 1%"]


def test_no_time_of_a_finished_solve_is_zero(in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    assert main(["solve", "poisson", "map.npz", "--refine", "0", "--out", "out"]) == 0
    folder = in_folder / "out"
    report = reports.read(folder)
    report["seconds"] = dict.fromkeys(report["seconds"], 0.004)
    assert "below 0.1 s" in verdict_in_words(Outcome(folder, report)).splitlines()
    html.write(folder, report, None)
    page = (folder / "report.html").read_text()
    assert "below 0.1 s" in page and page.count("below 0.01") == len(report["seconds"])


def test_rounding_errors_of_exact_blocks_are_no_figure():
    assert distance(2.74e-16) == distance(5.7e-14) == distortion(3.8e-26) == "exact"
    assert distance(3.31e-05) == "3.31e-05" and distortion(0.08572) == "0.08572"
    unit = {"mean": 1.5e-26, "max": 3.8e-26}
    apart = {"two_sided": {"of_diagonal": {"rms": 2.7e-16, "mean": 1e-16, "max": 5.7e-14}}}
    quality = {"bijective": "certified", "boundary_injective": True, "orientation": "right-handed"}
    quality |= {"control_points": [4, 4, 4], "degrees": [3, 3, 3], "arap": {"unit_volume": unit, "as_given": unit}}
    report = {"parameterization": quality | {"surface_distance": apart, "boundary": {}}, "seconds": {"total": 1.0}}
    facts = {name: (number, remark) for name, number, remark in html._facts(report)}
    assert facts["ARAP distortion, mean"] == ("none", "at volume 1")
    assert facts["Distance to the surface"] == ("exact", "surface to spline and back")
    told = verdict_in_words(Outcome(Path("out"), report))
    assert "exact: no distortion" in told and "exact; surface to spline and back" in told and "e-2" not in told
