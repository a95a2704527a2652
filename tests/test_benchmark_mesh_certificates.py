from example_files import load

benchmark = load("benchmarks/mesh_certificates")


def test_every_kind_is_certified(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["mesh_certificates.py", "--elements", "48"])
    benchmark.main()
    rows = capsys.readouterr().out.splitlines()[2:]
    assert len(rows) == len(benchmark.KINDS) and all("| certified | yes |" in row for row in rows)
