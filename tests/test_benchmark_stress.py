from __future__ import annotations

import csv
import io
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from example_files import cells, load, shown

from iga_nn import sample
from iga_nn.options import MapOptions

stress = load("benchmarks/stress")
shapes = stress.hard_shape.__globals__

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
    spline_to_mesh_max=0.01,
    seconds=100.0,
    t_cal=10.0,
)


def options(folder, **given):
    values = {"numbers": (1, 7, 8), "mapping": MapOptions(device="cpu"), "jobs": 1, "out": Path(folder)}
    return stress.Options(**(values | given))


@pytest.mark.parametrize("number", range(10))
def test_each_kind_is_a_sound_surface(number):
    surface = stress.hard_shape(number)
    assert surface.name == f"{number:03d}-{stress.KINDS[number]}"
    assert len(surface.crossings) == 0 and 1500 <= len(surface.faces) <= 3000


def test_equal_numbers_are_equal_shapes_and_others_are_not():
    kind, triangles = stress.KINDS.index("spiky"), shapes["_triangles"]

    def points(number):
        return triangles("spiky", np.random.default_rng([shapes["SEED"], number]), 1.0)[0]

    np.testing.assert_array_equal(points(kind), points(kind))
    assert points(kind).shape != points(kind + 10).shape


def test_kinds_take_turns():
    kinds = [stress.kind_of(number) for number in range(40)]
    assert {kinds.count(kind) for kind in stress.KINDS} == {4}
    chosen, _ = stress._options(["--count", "16", "--kinds", "thin", "long", "--out", "/tmp"])
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
    assert cells(text, "bent")[0][2:] == ["3", "2", "67 %", "2.50", "0.00200", "10.0"]
    assert cells(text, "spiky")[0][2:5] == ["2", "0", "0 %"]
    assert cells(text, "008-spiky")[0][1:6] == ["folded", "12", "2000", "4.00", "100"]
    assert cells(text, "002-spiky")[0][1] == "certified, meets itself"
    assert cells(text, "013-bent")[0][1] == "out \\| of memory"
    assert not cells(text, "007-bent") and "Certified 2 of 5 surfaces, 40.0 %." in text
    assert "Not finished yet: 1 of 6 surfaces." in text and "no measurement" not in text
    quick = options(tmp_path, mapping=MapOptions(steps_factor=0.1))
    assert "no measurement" in stress.as_text([ROW], quick)


def test_finished_rows_are_not_run_again(tmp_path, monkeypatch):
    chosen = options(tmp_path, numbers=(7, 8))
    (tmp_path / "rows").mkdir()
    chosen.row_file(7).write_text(json.dumps(vars(replace(ROW, settings=chosen.settings))))
    chosen.row_file(8).write_text(json.dumps(vars(replace(ROW, number=8, settings="others"))))
    monkeypatch.setattr(stress, "_command", lambda *_: [sys.executable, "-c", "import os; os.abort()"])
    done, lost = stress.results(chosen)
    assert done.number == 7 and done.certified
    assert lost.number == 8 and lost.error == "its process ended with code -6, without a result"
    assert json.loads(chosen.row_file(8).read_text())["settings"] == "others"  # a killed one is tried again


def test_a_surface_end_to_end_and_not_twice(tmp_path, capsys):
    arguments = ["--count", "6", "--kinds", "bumpy", "--out", str(tmp_path)]
    arguments += ["--steps-factor", "0.003", "--control-points", "5"]
    assert stress.main(arguments) == 0
    (row,) = csv.DictReader(io.StringIO((tmp_path / "stress.csv").read_text()))
    assert row["number"] == "0" and row["kind"] == "bumpy"
    assert row["verdict"] in ("certified", "folded", "undecided") and float(row["t_cal"]) > 0.0
    assert (tmp_path / "000-bumpy.obj").exists() == (
        row["verdict"] != "certified" or row["boundary_injective"] == "False"
    )
    written = (tmp_path / "rows" / "000.json").stat().st_mtime_ns
    assert stress.main(arguments) == 0
    assert (tmp_path / "rows" / "000.json").stat().st_mtime_ns == written
    assert "000-bumpy" in capsys.readouterr().out


def test_the_picture_shows_the_surface_and_the_places(tmp_path):
    surface = sample("bean")
    stress.draw(surface, surface.vertices[:3], tmp_path / "bean.png")
    assert shown(tmp_path / "bean.png")


def test_bad_arguments_are_one_line(tmp_path, capsys):
    for given, word in ((("--count", "0"), "--count 0"), (("--kinds", "round"), "round"), (("--jobs", "0"), "--jobs")):
        with pytest.raises(SystemExit) as stop:
            stress.main([*given, "--out", str(tmp_path)])
        assert stop.value.code == 2 and word in capsys.readouterr().err
