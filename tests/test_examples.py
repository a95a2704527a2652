from __future__ import annotations

import importlib.util
import sys
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import pytest

import iga_nn
from iga_nn.cli import main

EXAMPLES = Path(iga_nn.__file__).resolve().parents[1] / "examples"


def load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"example_{name}", EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def test_first_run(capsys):
    load("first_run").main("ellipsoid", iga_nn.preset("fast").scaled(0.005).with_control_points(8), levels=2)
    out = capsys.readouterr().out
    assert "ARAP" in out and "L2 rate" in out


def test_convergence_rates(tmp_path, capsys):
    studies = load("convergence").main(["--out", str(tmp_path), "--degrees", "2", "3", "--levels", "3"])
    for degree, rows in studies["h"].items():
        assert degree + 0.9 < rows[-1].rate_l2 < degree + 1.3
        assert degree - 0.1 < rows[-1].rate_h1 < degree + 0.3
    p, k = (studies[name] for name in studies if "refinement" in name)
    assert p[3][0].report.l2 == pytest.approx(k[3][0].report.l2)  # where both start: one space
    assert [rows[0].report.dofs for rows in k.values()] == [7**3, 8**3, 9**3, 10**3]  # C^(degree - 1) on 4^3 elements
    assert [rows[0].report.dofs for rows in p.values()] == [7**3, 11**3, 15**3, 19**3]  # C^2: a knot more each
    for study in (p, k):
        errors = [rows[0].report.l2 for rows in study.values()]
        assert all(b < a / 5 for a, b in pairwise(errors))
    assert {file.name for file in tmp_path.iterdir()} == {
        "convergence.csv",
        "convergence.png",
        "orders.csv",
        "orders.png",
    }
    assert "degree  elements  dofs" in capsys.readouterr().out


def test_validation_runs_what_is_there_and_keeps_the_row_of_what_is_not(formula_training, in_folder, capsys):
    formula_training()
    Path("models").mkdir()
    main(["sample", "ellipsoid", "--out", "models/conch.obj"])
    assert load("validation").main(["--models", "models", "--out", "out", "--steps-factor", "0.1"]) == 0
    text = Path("out/validation.md").read_text()
    assert text.strip() in capsys.readouterr().out
    assert "| conch | paper | 1.468 | 50.818 | 0.00169 | - |" in text
    assert "| santa4 | ours | model not public |" in text
    assert "| santa4 | paper | 194.23 | 38.71 | 232.93 |" in text
    assert "no measurement" in text
    assert text.count("| conch | 0 | 343 |") == 1 and "![error](conch/figure14.png)" in text
