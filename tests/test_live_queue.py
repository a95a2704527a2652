from __future__ import annotations

import time
from pathlib import Path
from threading import Event

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES, obj

from iga_nn.live import worker as job_process
from iga_nn.live.queue import Jobs, safe_name
from iga_nn.live.worker import Step
from iga_nn.models import resolve
from iga_nn.options import MapOptions, PoissonOptions
from iga_nn.workflow.worker_run import Ended
from parameterize.progress import Progress

AT = Progress("cube", 3, 10, 0.5, 0, 7.0)


class Runs:
    """Stands for the runs of jobs: each waits until it is let go, or stopped."""

    def __init__(self):
        self.let_go, self.order, self.running, self.most = Event(), [], 0, 0

    def __call__(self, job):
        self.order.append(job.number)
        self.running += 1
        self.most = max(self.most, self.running)
        yield "started"
        yield Step(AT, np.zeros((len(job.surface.vertices) + 5, 3)))
        while not (self.let_go.is_set() or job.stop.is_set()):
            time.sleep(0.01)
        self.running -= 1
        yield Ended("stopped" if job.stop.is_set() else "done")


@pytest.fixture
def runs():
    return Runs()


@pytest.fixture
def jobs(runs, tmp_path):
    queue = Jobs(tmp_path, resolve_path, runs, lambda job: None)
    yield queue
    queue.close()


def resolve_path(path):
    return resolve(str(path))


def wait_for(job, state):
    end = time.monotonic() + 20.0
    while job.state != state:
        assert time.monotonic() < end, (job.state, job.text)
        time.sleep(0.01)


def accepted(jobs, name="cube.obj"):
    job = jobs.add(name)
    job.path.write_text(obj(CUBE, TRIANGLES))
    jobs.check(job)
    wait_for(job, "ready")
    return job


def test_one_runs_at_a_time_and_the_others_wait_in_order(jobs, runs):
    first, second, third = (accepted(jobs) for _ in range(3))
    for job in (first, third, second):
        jobs.start(job)
    wait_for(first, "running")
    assert [job.state for job in jobs] == ["running", "waiting", "waiting"]
    assert [jobs.before(job) for job in (first, third, second)] == [0, 1, 2]
    runs.let_go.set()
    wait_for(second, "done")
    assert runs.order == [1, 3, 2] and runs.most == 1
    assert {job.state for job in jobs} == {"done"} and jobs.before(second) == 0


def test_a_problem_is_solved_on_a_finished_volume_and_again_on_the_same(tmp_path):
    jobs = Jobs(tmp_path, resolve_path, lambda job: iter([Ended("done")]), lambda job: None)
    first = accepted(jobs, "my cube.obj")
    first.results.mkdir()
    first.volume.write_bytes(b"volume")
    first.volume.with_name("boundary.npz").write_bytes(b"part")
    jobs.start(first)
    wait_for(first, "done")
    second = jobs.solve(first, PoissonOptions(exact="x"))
    wait_for(second, "done")
    third = jobs.solve(second, PoissonOptions(exact="y"))
    assert (second.parent, third.parent) == (first.number, first.number)
    wait_for(third, "done")
    assert [job.name for job in jobs] == ["my cube.obj", "my cube.npz", "my cube.npz"]
    assert third.volume == third.path and third.path.read_bytes() == b"volume"
    assert third.path.with_name("boundary.npz").read_bytes() == b"part"  # regions are found on it
    assert third.problem_options.exact == "y" and third.results != third.path
    jobs.close()


def test_of_a_part_called_boundary_volume_and_surface_are_kept_apart(tmp_path):
    jobs = Jobs(tmp_path, resolve_path, lambda job: iter([Ended("done")]), lambda job: None)
    first = accepted(jobs, "boundary.obj")
    first.results.mkdir()
    first.volume.write_bytes(b"volume")
    first.volume.with_name("boundary.npz").write_bytes(b"part")
    jobs.start(first)
    wait_for(first, "done")
    second = jobs.solve(first, PoissonOptions(exact="x"))
    wait_for(second, "done")
    assert second.volume.read_bytes() == b"volume"
    assert second.volume.with_name("boundary.npz").read_bytes() == b"part"
    jobs.close()


def test_a_run_is_told_step_by_step(jobs, runs):
    job = accepted(jobs)
    jobs.start(job)
    runs.let_go.set()
    wait_for(job, "done")
    assert job.log == ["started"] and job.progress == AT and job.losses == [0.5]
    assert job.mapped.shape == job.surface.vertices.shape  # without what the training added


def test_stop_and_go_on(jobs, runs):
    job = accepted(jobs)
    jobs.start(job)
    wait_for(job, "running")
    jobs.stop(job)
    wait_for(job, "stopped")
    runs.let_go.set()
    jobs.start(job)
    wait_for(job, "done")
    assert runs.order == [1, 1]


def test_a_waiting_job_is_taken_out(jobs, runs):
    first, second = accepted(jobs), accepted(jobs)
    jobs.start(first)
    jobs.start(second)
    jobs.stop(second)
    assert second.state == "ready" and first.state != "done"
    runs.let_go.set()
    wait_for(first, "done")
    assert runs.order == [1]
    jobs.start(second)
    wait_for(second, "done")


def test_only_what_was_accepted_is_started(jobs, runs):
    job = jobs.add("broken.obj")
    job.path.write_text("v 0 0 0\nf 1 2 3\n")
    jobs.check(job)
    wait_for(job, "refused")
    jobs.start(job)
    jobs.stop(job)
    assert job.state == "refused" and job.text.startswith("broken.obj: ") and runs.order == []


def test_what_is_refused_leaves_no_file(jobs):
    job = jobs.add("large.obj")
    job.path.write_bytes(b"#" * 1000)
    jobs.refuse(job, "large.obj: larger than 1 MB")
    assert list(job.folder.iterdir()) == []


def test_a_deleted_job_is_gone_with_its_folder_and_its_number(jobs, runs):
    first, second = accepted(jobs), accepted(jobs)
    jobs.delete(second)
    assert list(jobs) == [first] and not second.folder.exists() and first.folder.is_dir()
    jobs.start(second)  # from a tab that does not know yet
    jobs.delete(second)
    assert second.state == "ready" and runs.order == []
    assert accepted(jobs).number == 3


def test_a_job_at_work_is_not_deleted(jobs, runs):
    first, second = accepted(jobs), accepted(jobs)
    jobs.start(first)
    jobs.start(second)
    wait_for(first, "running")
    for job in (first, second, jobs.add("checked.obj")):
        jobs.delete(job)
        assert job in list(jobs) and job.folder.is_dir()
    jobs.stop(first)
    wait_for(first, "stopped")
    jobs.delete(first)
    assert first not in list(jobs)


def test_a_problem_on_a_volume_that_is_gone_leaves_no_job(jobs):
    first = accepted(jobs)
    with pytest.raises(OSError, match="volume"):
        jobs.solve(first, PoissonOptions())
    assert list(jobs) == [first]


def test_a_failed_job_is_tried_again_anew(tmp_path):
    ends = iter(["failed", "done"])

    def run(job):
        seen.append((list(job.log), job.progress))
        yield "started"
        yield Step(AT, None)
        yield Ended(next(ends), "why")

    seen: list = []
    jobs = Jobs(tmp_path, resolve_path, run, lambda job: None)
    job = accepted(jobs)
    jobs.start(job)
    wait_for(job, "failed")
    assert job.text == "why" and job.progress == AT
    jobs.start(job)
    wait_for(job, "done")
    assert seen == [([], None)] * 2
    jobs.close()


def test_a_run_that_breaks_fails_alone(tmp_path):
    def broken(job):
        yield "started"
        raise RuntimeError

    jobs = Jobs(tmp_path, resolve_path, broken, lambda job: None)
    for job in (accepted(jobs), accepted(jobs)):
        jobs.start(job)
        wait_for(job, "failed")
    jobs.close()


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("bean.obj", "bean.obj"),
        ("../../etc/passwd", "passwd"),
        ("C:\\models\\my part.stl", "my part.stl"),
        ("..", "surface"),
        ("", "surface"),
        ("-rf.obj", "rf.obj"),
        (".hidden.ply", "hidden.ply"),
        ("a\x00b<c>.off", "a_b_c_.off"),
        ("ä" * 200 + ".obj", "ä" * 76 + ".obj"),
    ],
)
def test_names_are_files_in_the_jobs_folder(given, kept, tmp_path):
    assert safe_name(given) == kept
    assert (tmp_path / safe_name(given)).resolve().parent == tmp_path.resolve()


def test_the_process_says_why_it_failed(tmp_path: Path):
    (tmp_path / "cut.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\n")
    *before, last = job_process.run(tmp_path, "cut.obj", MapOptions(), PoissonOptions(), Event())
    assert isinstance(last, Ended) and last.state == "refused" and last.line.startswith("cut.obj: ")
    assert not any(isinstance(message, Ended) for message in before)


def test_a_stopped_process_is_gone(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(job_process, "GRACE", 0.0)
    (tmp_path / "cube.obj").write_text(obj(CUBE, TRIANGLES))
    stop = Event()
    stop.set()
    start = time.monotonic()
    messages = list(job_process.run(tmp_path, "cube.obj", MapOptions(), PoissonOptions(), stop))
    assert messages == [Ended("stopped")] and time.monotonic() - start < 10.0
