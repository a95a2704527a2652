from __future__ import annotations

import json
import math
from importlib.metadata import PackageNotFoundError

import numpy as np

from iga_nn.level_table import ESTIMATES, EXACT_ERRORS
from iga_nn.report import document as reports
from solve.solution import NORMS


def test_plain_writes_null_for_what_is_no_number_and_lists_for_arrays():
    value = {"a": math.nan, "b": np.float64(np.inf), "c": np.arange(3), "d": (np.int64(2), np.array([1.0, np.nan]))}
    assert reports.plain(value) == {"a": None, "b": None, "c": [0, 1, 2], "d": [2, [1.0, None]]}


def test_write_is_whole_and_read_takes_only_ours(tmp_path):
    reports.write(tmp_path, {"schema": 1, "x": math.nan})
    assert json.loads((tmp_path / "report.json").read_text()) == {"schema": 1, "x": None}
    assert [file.name for file in tmp_path.iterdir()] == ["report.json"]
    assert reports.read(tmp_path) == {"schema": 1, "x": None}
    (tmp_path / "report.json").write_text('{"schema": 99}')
    assert reports.read(tmp_path) is None
    (tmp_path / "report.json").write_text("{half")
    assert reports.read(tmp_path) is None
    assert reports.read(tmp_path / "nowhere") is None


def test_versions_are_those_of_what_is_installed(monkeypatch):
    def version(name):
        if name == "torch":
            raise PackageNotFoundError(name)
        return "1.2.3"

    assert "torch" in reports.versions()
    monkeypatch.setattr(reports, "version", version)
    assert {"python", "numpy", "scipy", "iga-nn"} == set(reports.versions())


def test_finished_means_that_the_total_was_written():
    assert not reports.is_finished(None)
    assert not reports.is_finished({"schema": 1, "seconds": {"train": 1.0}})
    assert reports.is_finished({"schema": 1, "seconds": {"total": 1.0}})


def test_verdict_keeps_the_numbers():
    report = {
        "parameterization": {
            "bijective": "certified",
            "arap": {"as_given": {"mean": 1.0, "max": 2.0}},
            "boundary": {"as_given": {"rms": 0.1, "mean": 0.05, "max": 0.3}},
        },
        "poisson": {"levels": [{"dofs": 8, "l2": 0.5, "iterations": 3, "converged": False}], "notices": []},
        "seconds": {"total": 3.0},
    }
    verdict = reports.verdict(report, "out")
    assert verdict["boundary_rms"] == {"as_given": 0.1}
    assert verdict["levels"] == [{"dofs": 8, "l2": 0.5, "iterations": 3, "converged": False}]
    assert reports.is_certified(report) and not reports.is_converged(report)


def test_the_errors_of_a_level_are_those_of_a_solve():
    assert (*EXACT_ERRORS, *ESTIMATES) == tuple(NORMS)


def test_of_thousands_of_patches_the_report_keeps_the_worst():
    """Patch 17 is not certified, patch 900 has the least bound, patch 1200 is the most distorted."""
    parts = [
        {
            "control_points": [4, 4, 4],
            "degrees": [3, 3, 2],
            "bijective": "undecided" if number == 17 else "certified",
            "orientation": "left-handed" if number == 3 else "right-handed",
            "det_lower_bound": None if number == 17 else 0.01 if number == 900 else 0.5,
            "arap": {"mean": 0.1, "max": 9.0 if number == 1200 else 0.2},
        }
        for number in range(1500)
    ]
    quality = {"patches": parts, "interfaces": ["p0_u1 = p1_u0"] * 2000, "bijective": "undecided"}
    short = reports.summarized(quality)
    assert short["summary"] == {
        "patches": 1500,
        "interfaces": 2000,
        "degrees": [2, 3],
        "orientations": ["left-handed", "right-handed"],
    }
    assert [part["number"] for part in short["patches"][:4]] == [17, 1200, 900, 0] and len(short["interfaces"]) == 10
    assert reports.summarized(short) is short and reports.claim({"parameterization": short}) == "one sign of det J"
    assert reports.shown_patches(short)[0][0] == reports.shown_patches(quality)[0][0] == "p17"
    assert reports.patches_heading(short) == reports.patches_heading(quality) == "The patches: of 1,500 the 10 worst"
    few = reports.summarized(quality | {"patches": parts[:30]})
    assert len(few["patches"]) == 30 and reports.patches_heading(few) == "The patches"
    assert [name for name, _ in reports.shown_patches(few)] == [f"p{number}" for number in range(30)]
