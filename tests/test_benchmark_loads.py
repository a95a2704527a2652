from example_files import load

benchmark = load("benchmarks/loads")


def test_resultants_are_those_of_the_formulas(capsys, tmp_path):
    benchmark.main(["--only", "hanging", "wall", "founded", "--refine", "0", "--out", str(tmp_path)])
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines()[2:]]
    assert len(rows) == 6 and all(float(row[-1].rstrip(" |")) < 1e-10 for row in rows)
    assert "wall that holds water" in (tmp_path / "loads.md").read_text()
