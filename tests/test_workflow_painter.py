import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from iga_nn.workflow import drawing
from iga_nn.workflow.drawing import Figures
from iga_nn.workflow.output_folder import RunFolder
from iga_nn.workflow.painter import Painter

HISTORY = {"stage": np.repeat(["S(2)", "cube"], 5), "loss": np.exp(-np.arange(10.0)), "folded": np.zeros(10)}


def history(folder, **columns):
    return Figures(folder, "map", {"history": HISTORY | columns})


def test_figures_are_drawn_beside_the_run_and_failures_are_told_in_the_end(tmp_path, caplog):
    with Painter() as beside:
        state = RunFolder(tmp_path, painter=beside)
        state.draw("map", history=HISTORY)
        (tmp_path / "other").mkdir()
        assert beside.begin(history(tmp_path / "other", folded=np.zeros(3)))
        assert "not_drawn" not in state.report
        state.wait_for_figures()
        process = beside._process
    assert process.returncode is not None
    assert (tmp_path / "history.png").stat().st_size > 10_000
    ((file, reason),) = state.report["not_drawn"].items()
    assert file == "history.png" and "shape" in reason
    assert f"history.png could not be drawn: {reason}" in caplog.messages


def test_the_run_draws_what_an_ended_process_leaves_and_what_has_no_pickle(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(drawing, "draw", lambda figures: drawn.append(figures) or {"lines.png": "why"})
    monkeypatch.setattr("iga_nn.workflow.output_folder.draw", lambda figures: drawn.append(figures) or {})
    with Painter() as beside:
        beside._process.kill()
        first = history(tmp_path)
        assert beside.begin(first) and beside.end() == {"lines.png": "why"} and drawn == [first]
        RunFolder(tmp_path, painter=beside).draw("solution", volume=lambda: 0)
        assert len(drawn) == 2 and beside.end() == {}


def test_an_interrupted_run_leaves_no_process_and_no_unfinished_figure(tmp_path):
    with pytest.raises(KeyboardInterrupt), Painter() as beside:
        assert beside.begin(history(tmp_path))
        (tmp_path / ".history.7.part.png").touch()
        raise KeyboardInterrupt
    assert beside._process.returncode is not None and list(tmp_path.glob(".*")) == []


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_the_process_ends_with_a_run_that_is_killed():
    program = "from iga_nn.workflow.painter import Painter; p = Painter(); print(p._process.pid, flush=True); input()"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-P", "-c", program]
    run = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, text=True)
    number = int(run.stdout.readline())
    os.kill(number, 0)
    run.send_signal(signal.SIGKILL)
    run.communicate()
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline and is_running(number):
        time.sleep(0.05)
    assert not is_running(number)


def is_running(number):
    """Return whether there is such a process, not counting one that has ended and waits to be asked."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{number}/stat")
    return not state.exists() or state.read_text().rsplit(")", 1)[1].split()[0] != "Z"
