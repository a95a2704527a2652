import csv

import pytest
from example_files import load

benchmark = load("benchmarks/solver")


def case(solver="iga-nn", law="poisson", spans=8):
    return benchmark.Case(solver, law, spans, 3, 1)


def test_row_is_the_solve_of_the_reference():
    """L2 at n = 8: 1.438e-5 with p Gauss points, 1.434e-5 with p + 1."""
    found = benchmark.run_ours(case())
    assert found["l2"] == pytest.approx(1.438e-5, rel=1e-3)
    assert found["dofs"] == 11**3
    assert found["wall"] > 0.0 and found["solve"] > 0.0


def test_table_and_file_hold_the_row(tmp_path):
    figures = {"setup": 0.5, "solve": 1.5, "wall": 1.1, "iterations": 17, "l2": 1.4e-5, "peak_mb": 170}
    row = benchmark.Row("iga-nn", "poisson", 8, 3, 2, 1331, **figures)
    assert row.seconds_per_mdof == pytest.approx(1502.63, abs=0.01)
    benchmark.save([row], tmp_path)
    text = (tmp_path / "solver.md").read_text()
    assert "| iga-nn | poisson | 8 | 3 | 2 | 1331 | 0.50 | 1.50 | 1.10 | 1502.6 | 17 | 1.4000e-05 | 170 |" in text
    with (tmp_path / "solver.csv").open() as file:
        assert next(csv.DictReader(file))["iterations"] == "17"


@pytest.mark.parametrize(("law", "spans"), [("poisson", 8), pytest.param("elasticity", 3, marks=pytest.mark.slow)])
def test_mfem_agrees(law, spans):
    pytest.importorskip("mfem.ser")
    theirs, ours = benchmark.run_mfem(case("mfem", law, spans)), benchmark.run_ours(case(law=law, spans=spans))
    assert theirs["l2"] == pytest.approx(ours["l2"], rel=0.02)
    assert theirs["dofs"] == ours["dofs"]
