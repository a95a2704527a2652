from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from iga_nn.batch import task as batch_task
from iga_nn.batch.task import Task, compute
from iga_nn.options import MapOptions, PoissonOptions
from iga_nn.workflow import worker_run


@pytest.fixture
def told(monkeypatch):
    messages = []
    worker = SimpleNamespace(log_event=lambda topic, message: messages.append((topic, message)))
    monkeypatch.setattr("distributed.get_worker", lambda: worker)
    monkeypatch.setattr(worker_run, "INTERVAL", 0.0)
    monkeypatch.setattr(worker_run, "SHARE", float("inf"))
    return messages


def task(mesh="cube", options=PoissonOptions(refine=(0,))):  # noqa: B008 - frozen
    return Task(mesh, mesh, Path("out"), MapOptions(resume=True), options)


def test_a_surface_leaves_what_run_leaves_and_tells_its_steps(told, formula_training, in_folder):
    formula_training()
    ended = compute(task(), 7, "batch")
    assert ended.state == "done" and ended.report["command"] == "iga-nn run poisson cube --refine 0 --out out"
    assert {"volume.npz", "solution.npz", "report.html"} <= {path.name for path in Path("out").iterdir()}
    shares = [message["share"] for _, message in told]
    assert told[0] == ("batch", {"number": 7, "stage": "S(2)", "share": 0.0})
    assert shares == pytest.approx([0.0, 1 / 15, 2 / 15])
    assert compute(task(), 7, "batch").report == ended.report  # finished already


def test_a_map_alone(told, formula_training, in_folder):
    formula_training()
    assert "poisson" not in compute(task(options=None), 0, "batch").report


def test_refusals_and_failures_are_lines(told, formula_training, in_folder, capsys):
    ended = compute(task("missing.obj"), 0, "batch")
    assert ended.state == "refused" and ended.line == "missing.obj: no such file: check the name and the folder"
    for error in (MemoryError(), RuntimeError("DefaultCPUAllocator: can't allocate memory: you tried 1 bytes")):
        formula_training(error=error)
        ended = compute(task(), 0, "batch")
        assert ended.state == "failed" and ended.line.startswith("out of memory: ")
    formula_training(error=RuntimeError("two\nlines"))
    ended = compute(task(), 0, "batch")
    internal = "internal error, please report it: RuntimeError: two lines; the terminal shows the traceback"
    assert ended.state == "failed" and ended.line == internal
    assert capsys.readouterr().err.count("Traceback") == 1


def test_an_interrupted_batch_ends_at_the_next_step(told, formula_training, in_folder):
    formula_training()
    batch_task.stop("interrupted")
    assert compute(task(), 0, "interrupted").state == "stopped"
    assert compute(task(), 0, "another").state == "done"
