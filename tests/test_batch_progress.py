"""Surfaces of a batch end in one thread while others tell of their steps in another."""

from __future__ import annotations

import threading
import time
from contextlib import nullcontext
from pathlib import Path

from iga_nn.batch import cluster
from iga_nn.batch.run_batch import run_tasks
from iga_nn.batch.task import Task
from iga_nn.options import MapOptions, WorkerOptions
from iga_nn.workflow.worker_run import Ended


def test_progress_is_called_by_one_thread_at_a_time(in_folder, monkeypatch):
    def computed(client, tasks, options, tell, work):
        steps = threading.Thread(target=lambda: [tell(0, "S(2)", 0.01 * step) for step in range(20)])
        steps.start()
        for number in range(1, len(tasks)):
            yield number, Ended("refused", "not a surface")
        steps.join()
        yield 0, Ended("refused", "not a surface")

    inside = threading.Lock()
    calls = []

    def progress(batch, running):
        assert inside.acquire(blocking=False)
        time.sleep(0.005)
        calls.append(len(running))
        inside.release()

    monkeypatch.setattr(cluster, "connected", lambda *_: nullcontext())
    monkeypatch.setattr(cluster, "computed", computed)
    tasks = [Task(f"{i}.obj", f"{i}.obj", Path("out", str(i)), MapOptions(resume=True), None) for i in range(6)]
    batch = run_tasks(Path("out"), tasks, WorkerOptions(memory_limit="0"), progress=progress)
    assert batch.counts == {"refused": 6}
    assert len(calls) == 1 + 20 + 6 and max(calls) == 1
