from dataclasses import replace

import pytest
from example_files import load

benchmark = load("benchmarks/effectivity")


@pytest.mark.slow
def test_intervals_are_measured_beside_finer_solutions(capsys, monkeypatch):
    case = replace(benchmark.CASES["hexahedra, Poisson"], ask=("u at (0.25, 0.25, 0.2)", "energy"), refine=0)
    monkeypatch.setattr(benchmark, "CASES", {"hexahedra": case})
    rows = benchmark.main(["--degrees", "2"])
    assert [row.answer.ask for row in rows] == ["u at (0.25, 0.25, 0.2)", "energy"]
    assert all(row.is_inside and row.over_error < 3.0 for row in rows)
    assert "2 quantities: the truth is inside of 2" in capsys.readouterr().out
