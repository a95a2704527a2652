"""The benchmark of CAD parts: distances that are known, rows and shares of the table, and the parts of our own."""

from __future__ import annotations

import json
import subprocess
import sys
from math import pi, sqrt

import igl
import numpy as np
import pytest
from example_files import EXAMPLES, cells, load
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeSphere
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer

import iga_nn

parts = load("benchmarks/parts")
brep = load("benchmarks/brep")
volume_boundary = load("benchmarks/volume_boundary")
part_distances = load("benchmarks/part_distances")


def step(shape, path):
    writer = STEPControl_Writer()
    writer.Transfer(shape, STEPControl_AsIs)
    writer.Write(str(path))
    return path


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    return step(BRepPrimAPI_MakeBox(1.0, 2.0, 3.0).Shape(), tmp_path_factory.mktemp("cad") / "box.step")


def saved(folder, place):
    """Return the file of a body of two glued patches, whose points x in 1 x 2 x 3 are moved."""
    halves = [
        iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: place(u, 2 * v, 1.5 * (w + a)), 5) for a in (0, 1)
    ]
    iga_nn.Body.from_patches(halves).save(folder / "volume.npz")
    return volume_boundary.Boundary.load(folder / "volume.npz")


def test_a_moved_face_is_as_far_as_it_is_moved(box, tmp_path):
    part = brep.Brep.load(box)
    found = part_distances.measured(part, saved(tmp_path, lambda x, y, z: (1.01 * x, y, z)))
    assert part.volume == pytest.approx(6.0) and part.diagonal == pytest.approx(sqrt(14.0), rel=1e-6)
    assert found["to_part"] == pytest.approx(0.01 / sqrt(14.0), rel=1e-6)
    assert found["to_volume"] == pytest.approx(0.01 / sqrt(14.0), rel=1e-6)
    assert (found["edges"], found["corners"], found["valid"]) == (12, 8, True)
    assert found["edges_max"] == pytest.approx(0.01 / sqrt(14.0), rel=1e-6)
    assert found["corners_max"] == pytest.approx(0.01 / sqrt(14.0), rel=1e-6)


def test_edges_count_where_the_boundary_is_bent(tmp_path):
    """The edge between two patches in the middle of a side does not, and triangles are near to curved faces."""
    body = saved(tmp_path, lambda x, y, z: (x * (1.0 + 0.05 * y * (2.0 - y)), y, z))
    points, segments = body.sharp_edges
    assert len(segments) == 16 * 2 * (8 * 2 + 4 * 4)  # spans of sixteen segments, each seen from two faces
    on_planes = np.abs(points[:, 1:] / (2.0, 3.0) - 0.5) > 0.5 - 1e-9
    assert (on_planes.sum(axis=1) + (points[:, 0] < 1e-9) + (points[:, 0] > 1.0 - 1e-9) >= 2).all()
    vertices, triangles, fineness = body.triangles
    squared = igl.point_mesh_squared_distance(body.points(4), vertices, triangles)[0]
    assert np.sqrt(squared.max()) / body.size < max(fineness, 1e-9) < 2e-5


def test_the_distance_is_that_of_the_exact_face(tmp_path):
    part = brep.Brep.load(step(BRepPrimAPI_MakeCylinder(2.0, 5.0).Shape(), tmp_path / "rod.step"))
    angles = np.linspace(0.0, 2 * np.pi, 50)
    points = np.stack([2.001 * np.cos(angles), 2.001 * np.sin(angles), np.full(50, 2.5)], axis=1)
    assert part.distances(points) == pytest.approx(1e-3, rel=1e-6)
    above = np.array([[0.3, 0.2, 5.25], [3.0, 0.0, 6.0]])  # over the face, and beside it: from its rim
    assert part.distances(above) == pytest.approx([0.25, sqrt(2.0)], rel=1e-6)
    assert len(part.sharp_edges) == 2 and len(part.corners) == 0 and part.volume == pytest.approx(20 * pi)
    assert part.distances(part.surface_points(200, np.random.default_rng(0))).max() < 1e-9


def test_a_ball_has_no_sharp_edge_at_its_poles(tmp_path):
    part = brep.Brep.load(step(BRepPrimAPI_MakeSphere(2.0).Shape(), tmp_path / "ball.step"))
    assert part.sharp_edges == [] and len(part.corners) == len(part.sharp_points) == 0


def test_rows_say_why_there_is_no_map(tmp_path):
    part = parts.Part("cad", tmp_path / "bolt.step")
    late = parts.Ended(None, "", "", 600.0, 580.0, 900.0)
    assert parts.row_of(part, late).status == "ended after 580 CPU s"
    refused = parts.Ended(2, "", "note\niga-nn: bolt: too thin\n", 3.0, 3.0, 100.0)
    assert parts.row_of(part, refused).status == "iga-nn: bolt: too thin"
    assert parts.Ended(-9, "", "", 3.0, 3.0, 1.0).reason == "ended by SIGKILL"


def test_shares_count_what_is_within_the_limits(tmp_path):
    good = parts.Row("cad", "one", way="planes", blocks=9, unknowns=10_000, seconds=20.0, cpu=30.0, memory=800.0,
                     verdict="certified", one_to_one="yes", distance=1e-5, corners=1e-9, volume=-2e-4)  # fmt: skip
    far = parts.Row("cad", "two", way="blocks", seconds=40.0, verdict="certified", one_to_one="yes", distance=2e-3)
    none = parts.Row("cad", "three", status="ended after 600 s")
    options = parts.Options((), tmp_path, 1, 600.0, False)
    text = parts.as_text([none, far, good], options)
    assert cells(text, "one") == [
        ["one", "planes", "9", "10,000", "20", "30", "800", "certified", "yes", "1.0e-05", "", "1.0e-09", "-2.0e-04"]
    ]
    assert cells(text, "three")[0][7] == "ended after 600 s"
    assert cells(text, "cad")[0][1:5] == ["3", "2 (67%)", "1 (33%)", "30"]
    assert text.index("| two |") < text.index("| one |") < text.index("| three |")  # way by way


def test_a_process_is_ended_at_its_limit():
    ended = parts.watched([sys.executable, "-c", "import time; print('there', flush=True); time.sleep(60)"], 0.5)
    assert ended.code is None and ended.output == "there\n" and ended.seconds < 30.0 and ended.memory > 1.0


@pytest.mark.slow
def test_own_parts_are_valid_solids(tmp_path):
    script = EXAMPLES / "benchmarks" / "own_parts.py"
    subprocess.run([sys.executable, str(script), str(tmp_path)], check=True, capture_output=True)
    files = sorted(tmp_path.glob("*.step"))
    made = {file.stem: brep.Brep.load(file) for file in files}
    assert len(made) == 12 and all(part.is_valid and len(part.solids) == 1 for part in made.values())
    assert made["spring"].volume == pytest.approx(pi * 1.2**2 * 4 * sqrt((2 * pi * 8) ** 2 + 25), rel=1e-5)  # Pappus


@pytest.mark.slow
def test_an_exact_part_is_run_once_and_kept(box, tmp_path, capsys):
    asked = [str(box.parent), "--only", "box", "--out", str(tmp_path)]
    assert parts.main(asked) == 0
    (file,) = tmp_path.glob("*_box.json")
    row = json.loads(file.read_text())
    assert row["verdict"] == "certified" and row["one_to_one"] == "yes" and abs(row["volume"]) < 1e-9
    assert max(row["distance"], row["edges_rms"], row["corners"]) < 1e-9 and row["memory"] > 50.0
    file.write_text(json.dumps(row | {"unknowns": 12345}))
    assert parts.main(asked) == 0
    assert "12,345" in capsys.readouterr().out.splitlines()[-1]


def test_bad_arguments_are_one_line(box, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(parts, "own_parts", lambda folder: [])
    with pytest.raises(SystemExit):
        parts.main([str(box.parent), "--only", "ball", "--out", str(tmp_path)])
    assert "no such part or set; there are box" in capsys.readouterr().err
