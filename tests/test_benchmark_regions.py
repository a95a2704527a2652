from example_files import load

from solve import benchmark_volume

benchmark = load("benchmarks/regions")


def test_a_region_is_measured_beside_whole_faces(capsys, monkeypatch, tmp_path):
    benchmark_volume(2).save(tmp_path / "volume.npz")
    monkeypatch.setattr("sys.argv", ["regions.py", str(tmp_path / "volume.npz"), "--levels", "2"])
    monkeypatch.setattr(benchmark, "REGIONS", (benchmark.WHOLE, "X < 0"))
    benchmark.main()
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines()[2:]]
    assert [row[0] for row in rows] == ["| `u0 or u1 or v0`"] * 2 + ["| `X < 0`"] * 2
    assert all(float(row[3]) > 3.0 for row in rows[1::2])  # rates at degree 3
    assert float(rows[2][2]) < 1.5 * float(rows[0][2]) and rows[0][5] == "1.00"
