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
