from __future__ import annotations

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from example_files import cells, load

from iga_nn.options import MapOptions
from parameterize.optimization.phases import Phase

stress = load("benchmarks/stress")
shapes = stress.compute_shape.__globals__
stress_shape = shapes["hard_shape"]

ROW = stress.Row(
    7,
    "bent",
    "fast",
    faces=2000,
    verdict="certified",
    boundary_injective=True,
    det_lower_bound=0.01,
    unproved=0,
    arap_mean=2.0,
    arap_max=30.0,
    boundary_rms=0.002,
    distance_rms=0.0005,
    distance_max=0.02,
    spline_to_mesh_max=0.01,
    seconds=100.0,
    origin="growth",
    attempts="network, growth",
    rounds_approach=0,
    rounds_grow=11,
    rounds_shape=0,
    rounds_unfold=3,
    rounds_separate=0,
    rounds_polish=2,
    seconds_approach=0.0,
    seconds_grow=20.0,
    seconds_shape=0.0,
    seconds_unfold=30.0,
    seconds_separate=0.0,
    seconds_polish=10.0,
)


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    """Shapes are made from fewer points than those that are measured: making them is what these tests take."""
    monkeypatch.setitem(shapes, "CELL", 0.04)
    monkeypatch.setitem(shapes, "FINE", 5_000)


def options(folder, **given):
    values = {"numbers": (1, 7, 8), "mapping": MapOptions(device="cpu"), "jobs": 1, "out": Path(folder)}
    return stress.Options(**(values | given))


@pytest.mark.parametrize("number", range(10))
def test_each_kind_is_a_sound_surface(number):
    surface = stress_shape(number)
    assert surface.name == f"{number:03d}-{stress.KINDS[number]}"
    assert len(surface.crossings) == 0 and 1500 <= len(surface.faces) <= 3000


@pytest.mark.parametrize("number", [1006, 1009, 1011])
def test_the_later_kinds_have_limbs_and_handles(number):
    vertices, faces = shapes["hard_triangles"](number)
    euler = len(vertices) - len(faces) // 2
    assert euler == 2 - 2 * shapes["genus_of"](number) and 4000 <= len(faces) <= 8000
    assert len(np.unique(faces)) == len(vertices)


def test_equal_numbers_are_equal_shapes_and_others_are_not():
    kind, triangles = stress.KINDS.index("spiky"), shapes["_triangles"]

    def points(number):
        return triangles("spiky", np.random.default_rng([shapes["SEED"], number]), 1.0)[0]

    np.testing.assert_array_equal(points(kind), points(kind))
    assert points(kind).shape != points(kind + 10).shape


def test_kinds_take_turns(tmp_path):
    kinds = [stress.kind_of(number) for number in range(40)]
    assert {kinds.count(kind) for kind in shapes["FIRST_KINDS"]} == {4}
    assert [stress.kind_of(number) for number in range(1000, 1004)] == ["limbed", "graph"] * 2
    assert [shapes["genus_of"](number) for number in range(1000, 1020, 2)] == [0] * 10
    assert sorted(shapes["genus_of"](number) for number in range(1001, 1081, 2)) == sorted([*range(1, 9)] * 5)
    chosen = stress._options(["--count", "16", "--kinds", "thin", "long", "--out", str(tmp_path)])
    assert chosen.numbers == (3, 5, 13, 15)


def test_shapes_are_as_hard_as_their_kind_says():
    flat, long = (
        shapes["_triangles"](kind, np.random.default_rng([shapes["SEED"], number]), 1.0)[0]
        for kind, number in (("flat", 4), ("long", 5))
    )
    for points, axis, ratio in ((flat, 2, 7.0), (long, 0, 6.0)):
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        others = np.delete(spread, axis)
        assert (others.min() / spread[2] if axis == 2 else spread[0] / others.max()) > ratio / 2.0


def test_the_table_gives_shares_by_kind_and_lists_what_failed(tmp_path):
    folded = replace(ROW, number=8, kind="spiky", verdict="folded", unproved=12, arap_mean=4.0)
    overlapping = replace(ROW, number=2, kind="spiky", boundary_injective=False)
    lost = stress.Row(13, "bent", "fast", error="out | of memory")
    rows = [folded, ROW, replace(ROW, number=1, arap_mean=3.0), overlapping, lost]
    text = stress.as_text(rows, options(tmp_path, numbers=(1, 2, 7, 8, 13, 14)))
    assert cells(text, "bent")[0][2:] == ["3", "2", "67 %", "2.50", "0.00200", "0.00050", "100", "100"]
    assert cells(text, "bent")[1][1:] == ["growth 2", "2.0", "", "11.0 / 20.0", "", "3.0 / 30.0", "", "2.0 / 10.0"]
    assert cells(text, "spiky")[0][2:5] == ["2", "0", "0 %"]
    assert cells(text, "008-spiky")[0][1:6] == ["folded", "12", "2000", "4.00", "100"]
    assert cells(text, "002-spiky")[0][1] == "certified, meets itself"
    assert cells(text, "013-bent")[0][1] == "out \\| of memory"
    assert not cells(text, "007-bent") and "Certified 2 of 5 surfaces, 40.0 %." in text
    assert "proved not to meet itself for 3. Seconds: median 100, longest 100." in text
    assert "Not finished yet: 1 of 6 surfaces." in text and "no measurement" not in text
    quick = options(tmp_path, mapping=MapOptions(steps_factor=0.1))
    assert "no measurement" in stress.as_text([ROW], quick)


@pytest.fixture
def formula(formula_training, in_this_process, in_folder):
    """Arguments for one surface that is made and then given a map by formula, in this process."""
    formula_training()
    return ["--count", "6", "--kinds", "bumpy", "--steps-factor", "0.001", "--out", "out"]


def rows(folder="out"):
    return list(csv.DictReader(io.StringIO(Path(folder, "stress.csv").read_text())))


def test_a_surface_end_to_end_and_not_twice(formula, capsys):
    assert stress.main(formula) == 0
    (row,) = rows()
    assert row["number"] == "0" and row["kind"] == "bumpy" and row["verdict"] == "certified" and row["error"] == ""
    assert int(row["faces"]) == len(stress_shape(0).faces)
    assert float(row["seconds"]) == pytest.approx(2.1)
    assert (row["origin"], row["attempts"], row["rounds_shape"], row["rounds_grow"]) == ("network", "network", "2", "0")
    assert Path("out/surfaces/000-bumpy.obj").is_file() and Path("out/000-bumpy/report.html").is_file()
    written = Path("out/000-bumpy/volume.npz").stat().st_mtime_ns
    assert stress.main(formula) == 0 and rows() == [row]
    assert Path("out/000-bumpy/volume.npz").stat().st_mtime_ns == written
    assert "000-bumpy: certified" in capsys.readouterr().out


def test_a_result_of_other_settings_is_left_alone(formula):
    assert stress.main(formula) == 0
    assert stress.main([*formula, "--control-points", "20"]) == 0
    (row,) = rows()
    assert row["verdict"] == "" and "holds the result of" in row["error"]


def test_a_shape_that_cannot_be_made_is_a_row(formula, monkeypatch):
    monkeypatch.setitem(shapes, "TRIES", 0)
    assert stress.main(formula) == 0
    (row,) = rows()
    assert row["error"] == "intersects itself even after 0 tries"


def test_bad_arguments_are_one_line(tmp_path, capsys):
    refused = (
        (("--count", "0"), "--count 0"),
        (("--kinds", "round"), "round"),
        (("--kinds", "graph"), "--first 1000"),
        (("--jobs", "0"), "--jobs"),
    )
    for given, word in refused:
        with pytest.raises(SystemExit) as stop:
            stress.main([*given, "--out", str(tmp_path)])
        assert stop.value.code == 2 and word in capsys.readouterr().err


def test_every_phase_has_its_columns():
    def below(kind):
        return {kind, *(one for own in kind.__subclasses__() for one in below(own))}

    names = {kind.name for kind in below(Phase) if hasattr(kind, "name") and kind.__module__.startswith("parameterize")}
    assert set(stress.processes.PHASES) == names and "approach" in names
    columns = stress.processes.columns_of(stress.Row)
    assert all(f"{what}_{name}" in columns for what in ("rounds", "seconds") for name in names)
