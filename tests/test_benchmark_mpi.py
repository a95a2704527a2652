import csv

import numpy as np
import pytest
from example_files import EXAMPLES, load

benchmark = load("benchmarks/mpi")


def test_model_of_a_step_by_hand():
    """n = 5, degree 3: 8 functions a direction, 6 of them free."""
    halo, transposition = benchmark.model(5, 3)
    assert halo == 2 * 3 * 8 * 8 * 2 * 8
    assert transposition == pytest.approx(2 * 216 * 8 * 2 / 3)
    assert benchmark.model(5, 1) == (0.0, 0.0)
    assert benchmark.predicted(5, 1, 0.3) == (0.3, 0.0)
    whole, waiting = benchmark.predicted(100, 4, 0.4)
    assert 0.1 < whole == 0.1 + waiting < 0.11


def test_a_row_is_the_solve_and_what_does_not_fit_is_said(tmp_path):
    row = benchmark.measure(8, None, tmp_path / "8.npy", None)
    assert row.iterations > 10 and row.memory_mb >= 0.0 and row.halo == 0.0
    assert np.load(tmp_path / "8.npy").shape == (11, 11, 11)
    small = benchmark.Row(8, 1, None, 17, 2.0, 1.0, 100.0)
    many = benchmark.Row(8, 4, None, 17, 0.6, 0.5, 30.0, halo=2e5, transposition=1e4, difference=2e-15)
    text = benchmark.text_of([small, many, benchmark.Row(8, 1, 20)])
    assert "| 8 | 4 | none | 17 | 0.6 | 0.5 | 30 | 0.30 | 0.200 / 0.017 | 0.010 / 0.009 |" in text
    assert "| 8 | 1 | 20 | out of memory |" in text and "2.0e-15" in text


def test_results_hold_what_is_promised():
    """The file beside the script: memory a process, and a limit that one process does not fit and four do."""
    with (EXAMPLES / "benchmarks/results/mpi.csv").open() as file:
        rows = list(csv.DictReader(file))
    free = {int(row["ranks"]): row for row in rows if not row["limit_mb"]}
    assert float(free[4]["memory_mb"]) <= 0.35 * float(free[1]["memory_mb"])
    limited = {int(row["ranks"]): row["iterations"] for row in rows if row["limit_mb"]}
    assert limited[1] == "" and limited[4] == free[1]["iterations"]
