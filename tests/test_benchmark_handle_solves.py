import csv

import pytest
from example_files import cells, load

from solve import benchmark_volume

benchmark = load("benchmarks/handle_solves")


@pytest.fixture
def one_map(tmp_path):
    (tmp_path / "twisted").mkdir()
    benchmark_volume(2).save(tmp_path / "twisted" / "volume.npz")
    return tmp_path


def test_rates_works_and_iterations_are_measured_beside_a_cube(one_map, coarse_regions):
    assert benchmark.main([str(one_map), "--laws", "poisson", "clamped", "--out", str(one_map / "out")]) == 0
    with (one_map / "out" / "handle_solves.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["law"], row["level"]) for row in rows] == [
        ("poisson", "0"), ("poisson", "1"), ("clamped", "0"), ("clamped", "1")
    ]  # fmt: skip
    assert 3.0 < float(rows[1]["rate"]) < 5.0 and rows[0]["rate"] == ""
    assert 0.5 < float(rows[3]["work"]) < 2.0 and float(rows[3]["change"]) < 0.05  # of a bar: length over area
    assert rows[2]["unknowns"] == str(3 * 5**3) and rows[0]["iterations"] == rows[0]["of_cube"]  # it is that cube
    assert benchmark.main([str(one_map), "--laws", "poisson", "--out", str(one_map / "out")]) == 0
    with (one_map / "out" / "handle_solves.csv").open() as file:
        assert list(csv.DictReader(file)) == rows  # measured again; the other law's stay
    table = (one_map / "out" / "handle_solves.md").read_text()
    assert cells(table, "twisted")[0][:5] == ["twisted", "1", "poisson", "0", "125"]
    assert cells(table, "twisted")[0][-1] == "1.0"


def test_a_folder_without_maps_is_refused(one_map, capsys):
    for given, word in (([], "a map"), (["--only", "torus"], "torus")):
        with pytest.raises(SystemExit) as stop:
            benchmark.main([str(one_map / "twisted"), *given])
        assert stop.value.code == 2 and f"holds no volume.npz of {word}" in capsys.readouterr().err
