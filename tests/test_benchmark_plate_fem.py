import numpy as np
import pytest
from example_files import cells, load

from solve import benchmark_volume

benchmark = load("benchmarks/plate_fem")


def test_the_tops_of_the_holes_are_those_that_are_pulled_open():
    around = np.radians([0.0, 80.0, 100.0, 200.0, -90.0])
    ring = np.stack([2.0 + 0.45 * np.cos(around), 1.0 + 0.45 * np.sin(around)])
    assert benchmark.at_wall(ring, 1.0).all() and not benchmark.at_wall(ring, -1.0).any()
    assert benchmark.top_of(ring, 1.0).tolist() == [False, True, True, False, False]
    mirrored = ring * [[1.0], [-1.0]]
    assert benchmark.top_of(mirrored, 1.0).tolist() == [False, True, True, False, False]


def test_the_table_ends_with_the_differences_from_the_finest_meshes(monkeypatch, tmp_path, capsys):
    def of_elements(far, near, sides):
        return 100, benchmark.Figures(*np.arange(1.0, 7.0) * (1.0 + near + sides))

    def of_splines(body, refine):
        return 50, benchmark.Figures(*np.arange(1.0, 7.0) * (1.1 + 0.1 * refine))

    monkeypatch.setattr(benchmark, "of_elements", of_elements)
    monkeypatch.setattr(benchmark, "of_splines", of_splines)
    monkeypatch.setattr(benchmark, "MESHES", ((1.0, 0.5), (0.5, 0.0)))
    benchmark_volume(2).save(tmp_path / "volume.npz")
    assert benchmark.main(["--volume", str(tmp_path / "volume.npz"), "--out", str(tmp_path)]) == 0
    text = (tmp_path / "plate_fem.md").read_text()
    assert cells(text, "splines, level 1")[0][1:4] == ["50", "1.2", "2.4"]
    flat, circle = (cells(text, f"difference to the {what}")[0][2:] for what in ("flat sides", "round holes"))
    assert flat == ["-95.20 %"] * 4 + [""] * 2 and circle == ["+20.00 %"] * 6
    assert "splines, level 0 | 50" in capsys.readouterr().out


def test_quadratic_tetrahedra_stretch_the_plate():
    pytest.importorskip("skfem")
    pytest.importorskip("gmsh")
    _, found = benchmark.of_elements(0.8, 0.4, 8)
    bar = 6.0 / (4.0 * 0.8)  # its length over the section, without holes
    assert bar < found.displacement < 1.5 * bar and found.energy == pytest.approx(0.5 * found.displacement)
    assert 1.0 / 3.2 < found.left < found.left_most < 5.0 / 3.2
