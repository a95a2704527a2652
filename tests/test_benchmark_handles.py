from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from types import SimpleNamespace

import pytest
from example_files import cells, load

import iga_nn
from iga_nn.options import MapOptions
from iga_nn.samples import write_obj

handles = load("benchmarks/handles")

RING = handles.Row(
    "torus",
    "handles",
    genus=1,
    faces=6144,
    blocks=3,
    control_points=6400,
    verdict="certified",
    one_to_one="yes",
    det_lower_bound=0.1,
    arap_mean=0.1,
    arap_max=1.5,
    distance_rms=2e-4,
    distance_max=3e-3,
    seconds=40.0,
)


def options(folder, *names, **given):
    surfaces = tuple(handles.Named(name, "handles", Path(folder) / f"{name}.obj", True) for name in names)
    values = {"surfaces": surfaces, "mapping": MapOptions(device="cpu"), "jobs": 1, "out": Path(folder)}
    return handles.Options(**(values | given))


def test_the_tables_have_a_row_a_surface_and_count_what_is_sound(tmp_path):
    folded = handles.Row("mug", "handles", genus=1, blocks=1, verdict="folded", one_to_one="no", arap_mean=0.3)
    refused = handles.Row("frame", "handles", "too | thin")
    text = handles.as_text([RING, folded, refused], options(tmp_path, "torus", "mug", "frame", "plate_1"))
    assert cells(text, "torus") == [
        ["torus", "1", "3", "6,400", "certified", "yes", "0.100", "1.50", "2.00e-04", "3.00e-03", "40"]
    ]
    assert cells(text, "mug")[0][:7] == ["mug", "1", "1", "", "folded", "no", "0.300"]
    assert cells(text, "frame")[0][1:6] == ["", "", "", "too \\| thin", ""]
    assert "Certified and one-to-one 1 of 3. ARAP mean: median 0.200, largest 0.300." in text
    assert "Not finished yet: 1 of 4 surfaces." in text and "no measurement" not in text
    quick = options(tmp_path, "torus", mapping=MapOptions(steps_factor=0.1))
    assert "no measurement" in handles.as_text([RING], quick) and "At most" not in handles.as_text([RING], quick)
    cube = options(tmp_path, "torus", mapping=MapOptions(blocks=1))
    assert "At most 1 block." in handles.as_text([RING], cube)


def test_a_map_is_sound_where_both_is_proved():
    assert RING.sound
    assert not handles.Row("a", "handles", verdict="certified", one_to_one="undecided").sound
    assert not handles.Row("a", "handles", verdict="undecided", one_to_one="yes").sound


def test_of_several_blocks_the_report_has_the_distortion_and_the_counts(tmp_path):
    report = {
        "input": {"vertices": 1248, "faces": 2500},
        "parameterization": {
            "bijective": "certified",
            "boundary_injective": True,
            "control_points": 6400,
            "det_lower_bound": 0.1,
            "arap": {"unit_volume": {"mean": 0.1, "max": 1.5}},
            "surface_distance": {"two_sided": {"of_diagonal": {"rms": 2e-4, "mean": 1e-4, "max": 3e-3}}},
            "patches": [{}, {}, {}],
        },
    }
    known = SimpleNamespace(entry=SimpleNamespace(name="double_torus", folder=tmp_path), report=report)
    row = handles.row_of(known, "handles")
    assert (row.genus, row.blocks, row.control_points, row.arap_mean, row.arap_max) == (2, 3, 6400, 0.1, 1.5)
    assert (row.distance_rms, row.distance_max, row.one_to_one, row.sound) == (2e-4, 3e-3, "yes", True)
    assert row.seconds is None


@pytest.fixture
def box(formula_training, in_this_process, in_folder):
    """Arguments for a cube whose map is given by formula, in this process."""
    formula_training()
    write_obj(iga_nn.sample("cube"), "box.obj")
    return ["--files", "box.obj", "--out", "out", "--steps-factor", "0.001"]


def rows():
    return {row["surface"]: row for row in csv.DictReader(io.StringIO(Path("out/handles.csv").read_text()))}


def test_a_file_end_to_end_and_not_twice(box, capsys):
    assert handles.main(box) == 0
    row = rows()["box"]
    assert (row["status"], row["list"], row["genus"], row["blocks"]) == ("done", "files", "0", "1")
    assert (row["verdict"], row["one_to_one"], row["control_points"]) == ("certified", "yes", str(7**3))
    report = json.loads(Path("out/box/report.json").read_text())
    against_cube = report["parameterization"]["arap"]["unit_volume"]["mean"]  # nearly its own box
    assert float(row["arap_mean"]) == pytest.approx(against_cube, rel=0.2) and float(row["distance_rms"]) < 1e-3
    assert float(row["seconds"]) == pytest.approx(2.1)
    written = Path("out/box/volume.npz").stat().st_mtime_ns
    assert handles.main(box) == 0 and rows()["box"] == row
    assert Path("out/box/volume.npz").stat().st_mtime_ns == written
    assert "box: certified, one-to-one: yes, ARAP mean " in capsys.readouterr().out


def test_what_cannot_be_run_keeps_its_row(box, capsys):
    Path("bad.obj").write_text("no surface\n")
    assert handles.main(["--files", "bad.obj", "gone.obj", "--out", "out"]) == 0
    found = rows()
    assert "0 faces are no surface" in found["bad"]["status"] and found["bad"]["verdict"] == ""
    assert found["gone"]["status"] == "model not found: gone.obj"
    assert cells(Path("out/handles.md").read_text(), "gone")[0][4] == "model not found: gone.obj"
    assert "Certified and one-to-one 0 of 2." in capsys.readouterr().out


def test_the_lists_have_made_surfaces_and_models(tmp_path, monkeypatch):
    monkeypatch.setenv("IGA_NN_DATA", str(tmp_path / "models"))
    chosen = handles._options(["--out", str(tmp_path / "out")]).surfaces
    names = [one.name for one in chosen]
    assert set(handles.shapes.SHAPES) < set(names) and {"rocker-arm", "human_man"} < set(names)
    made = {one.name: one for one in chosen}
    assert made["torus"].mesh == tmp_path / "out/surfaces/torus.obj" and not made["torus"].absent
    assert made["rocker-arm"].mesh == tmp_path / "models/handles/rocker-arm.obj" and made["rocker-arm"].absent
    two = handles._options(["--lists", "limbs", "--only", "dog", "ant", "--out", str(tmp_path / "out")]).surfaces
    assert [(one.name, one.list) for one in two] == [("dog", "limbs"), ("ant", "limbs")]


def test_blocks_are_an_option_of_the_map(tmp_path):
    assert handles._options(["--out", str(tmp_path)]).mapping.blocks == "auto"
    assert handles._options(["--blocks", "1", "--out", str(tmp_path)]).mapping.blocks == 1


def test_a_made_surface_is_written_before_it_is_computed(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setitem(
        handles.shapes.compute_named.__globals__, "compute_measured", lambda task, *_: seen.append(task.mesh)
    )
    task = SimpleNamespace(name="frame", mesh=str(tmp_path / "frame.obj"))
    handles.shapes.compute_named(task, 0, "")
    handles.shapes.compute_named(task, 0, "")
    assert seen == [task.mesh] * 2 and Path(task.mesh).read_text().startswith("# frame: 40 vertices")


def test_bad_arguments_are_one_line(tmp_path, capsys):
    for given, word in (
        (("--jobs", "0"), "--jobs 0"),
        (("--lists", "round"), "round"),
        (("--blocks", "few"), "--blocks"),
        (("--blocks", "0"), "blocks"),
        (("--only", "horse"), "--only horse: no such surface; there are torus, "),
        (("--files", "a/x.obj", "b/x.obj"), "x: two surfaces have this name"),
        (("--steps-factor", "nan"), "steps factor must be a positive number"),
    ):
        with pytest.raises(SystemExit) as stop:
            handles.main([*given, "--out", str(tmp_path)])
        error = capsys.readouterr().err
        assert stop.value.code == 2 and word in error and error.count("\n") == 1
