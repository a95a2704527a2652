from __future__ import annotations

import base64
import json
import os

import numpy as np

from iga_nn.figures.colors import FACE_COLORS
from iga_nn.live.page_content import colors, places, row, triangles
from iga_nn.live.queue import Job
from iga_nn.options import PoissonOptions
from iga_nn.samples import sample
from parameterize.progress import Progress


def unpacked(packed, columns):
    return np.frombuffer(base64.b64decode(packed["bvals"]), packed["dtype"]).reshape(-1, columns)


def test_arrays_come_back_as_they_were():
    cube = sample("cube")
    cells = unpacked(triangles(cube), 4)
    assert np.all(cells[:, 0] == 3) and np.array_equal(cells[:, 1:], cube.faces)
    seen = unpacked(places(cube.unit_vertices), 3)
    lengths = [
        np.linalg.norm(points[cube.faces[:, 0]] - points[cube.faces[:, 1]], axis=1)
        for points in (seen, cube.unit_vertices)
    ]
    assert np.allclose(*lengths, atol=1e-6)  # turned, not deformed
    assert len(np.unique(unpacked(colors(cube.unit_vertices, cube, mapped=False), 3))) == 1


def test_colours_are_those_of_the_cubes_faces():
    cube = sample("cube")
    found = unpacked(colors(cube.vertices, cube, mapped=True), 3)
    centres = cube.vertices[cube.faces].mean(axis=1)
    for face, color in enumerate(FACE_COLORS):
        on_it = np.abs(centres[:, face // 2] - face % 2) < 1e-9
        assert np.any(on_it)
        assert {"#" + bytes(rgb).hex() for rgb in found[on_it]} == {color}


def test_a_row_says_stage_loss_and_time_left_of_the_training(tmp_path, monkeypatch):
    monkeypatch.setattr("iga_nn.live.page_content.time.time", lambda: 1065.0)
    job = Job(2, "bean.obj", tmp_path, state="running", surface=sample("bean"), losses=[10.0, 1.0, 0.1])
    job.progress = Progress("cube", 30, 300, 0.1, 4, 83.4)
    job.begun = 1000.0
    said = row(job, 0, PoissonOptions())
    assert [fact[1] for fact in said["facts"]] == ["3 of 7: to a cube", "1:05", "1.00e-01", "4"]
    assert said["facts"][1] == ["Time passed", "1:05", "1:24 of the training left"]
    assert said["facts"][3][2] == "0 is the aim"
    assert said["share"] == 0.1 and said["curve"] == "0.0,5.0 50.0,50.0 100.0,95.0"
    assert said["size"] == "2,500 vertices, 4,996 faces" and said["files"] == []
    assert json.loads(json.dumps(said)) == said


def test_results_are_offered_with_what_they_hold(tmp_path):
    job = Job(1, "bean.obj", tmp_path, state="done")
    job.results.mkdir()
    (job.results / "volume.npz").write_bytes(b"x" * 3_000_000)
    (job.results / "secret.txt").write_text("x")
    assert row(job, 0, PoissonOptions())["files"] == [
        {"name": "volume.npz", "size": "2.9 MB", "shows": "the spline volume"}
    ]


def test_a_waiting_job_knows_its_place(tmp_path):
    said = row(Job(1, "a.obj", tmp_path, state="waiting"), 2, PoissonOptions())
    assert said["label"] == "waiting, 2 jobs ahead" and not said["starts"] and not said["deletes"]


def test_where_the_end_is_not_known_a_row_says_so(tmp_path):
    job = Job(2, "bean.obj", tmp_path, state="running", progress=Progress("spline", 600, 640, 0.1, 0, None))
    said = row(job, 0, PoissonOptions())
    stage, passed, _, folds = said["facts"]
    assert stage[2] == "step 600" and said["share"] is None
    assert (passed[0], passed[2]) == ("Time passed", "how much is left is not known")
    assert folds == ["Folds at samples", "0", "between them the proof decides"]


def test_once_the_volume_of_this_run_is_made_the_last_stage_has_begun(tmp_path):
    job = Job(2, "bean.obj", tmp_path, state="running", progress=Progress("spline", 600, 640, 0.1, 0, None))
    job.results.mkdir()
    job.volume.write_bytes(b"of an older run")
    os.utime(job.volume, (1000.0, 1000.0))
    job.begun = 1001.0
    assert row(job, 0, PoissonOptions())["facts"][0][1] == "6 of 7: the spline"
    job.state = "failed"
    assert [fact[0] for fact in row(job, 0, PoissonOptions())["facts"]] == ["Stage", "Loss", "Folds at samples"]
    os.utime(job.volume, (1002.0, 1002.0))
    assert row(job, 0, PoissonOptions())["facts"][0][1] == "7 of 7: solution and report"


def test_a_failed_problem_has_its_form_to_correct(tmp_path):
    options = PoissonOptions(exact="x")
    job = Job(3, "bean.npz", tmp_path, state="failed", problem_options=PoissonOptions(source="log(x)"), parent=1)
    assert "form" not in row(job, 0, options)  # no volume
    job.path.write_bytes(b"volume")
    said = row(job, 0, options)
    assert said["form"] == {"problem": "poisson", "source": "log(x)"} and said["deletes"] and not said["starts"]
    assert said["what"] == "f = log(x); on the volume of 1"
    job.state = "running"
    assert "form" not in row(job, 0, options)
