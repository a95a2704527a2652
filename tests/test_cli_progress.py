from __future__ import annotations

import io
import logging
from pathlib import Path

import pytest
from rich.console import Console

from iga_nn.batch.run_batch import Running
from iga_nn.batch.surfaces import Entry
from iga_nn.batch.table import Batch, Row
from iga_nn.cli import progress
from parameterize.progress import Progress

RUNNING = [Running("bean", "cube", 0.4), Running("duck", "spline", 0.9)]


def batch(*states):
    return Batch(Path("out"), tuple(Row(Entry(str(i), str(i), Path(str(i))), s) for i, s in enumerate(states)))


def test_one_bar_shows_how_many_ended_and_how_far_the_others_are():
    out = io.StringIO()
    display = progress.Display(Console(file=out, force_terminal=True))
    with display.bar:
        progress.tell_batch(display.show, batch("waiting", "waiting", "waiting", "certified"), [])
        (task,) = display.bar.tasks
        assert (task.completed, task.total, task.fields["state"]) == (1, 4, "workers start")
        progress.tell_batch(display.show, batch("waiting", "waiting", "refused", "certified"), RUNNING)
        assert task.completed == pytest.approx(3.3) and task.fields["ended"] == "2/4"
        assert task.fields["state"] == "bean cube 40%, duck spline 90%"
        display.bar.refresh()
        progress.tell_batch(display.show, batch("certified", "failed", "refused", "certified"), [])
        assert task.completed == task.total == 4 and task.fields["state"] == ""
    assert "duck spline 90%" in out.getvalue() and "surfaces;" not in out.getvalue()  # no lines beside the bar


def test_plain_lines_come_every_ten_seconds(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    out = io.StringIO()
    display = progress.Display(Console(file=out, width=200))
    for now[0] in (1.0, 9.0, 11.0, 12.0, 22.0):
        progress.tell_batch(display.show, batch("waiting", "waiting", "certified"), RUNNING)
    line = "1 of 3 surfaces; bean cube 40%, duck spline 90%"
    assert out.getvalue() == f"{line}; 0:11 passed\n{line}; 0:22 passed\n"


def test_a_run_has_a_line_for_every_stage(monkeypatch):
    out = io.StringIO()
    monkeypatch.setattr(progress.time, "monotonic", lambda: 5.0)
    display = progress.Display(Console(file=out, width=200))
    for stage, step in (("cube", 0), ("cube", 1), ("edges", 0)):
        progress.tell_run(display.show, Progress(stage, step, 5, 0.5, 1, 61.0))
    rest = "/5, 1 fold, 1:01 of the training left, loss 5.000e-01; 0:00 passed"
    assert out.getvalue().splitlines() == [f"cube     step 0{rest}", f"edges    step 0{rest}"]


def test_where_the_number_of_steps_is_not_known_no_end_is_shown(monkeypatch):
    """The steps of the layout and of the rounds end once they gain nothing more: only what has passed is known."""
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    out, terminal = io.StringIO(), io.StringIO()
    display = progress.Display(Console(file=out, width=200))
    for now[0] in (103.0, 500.0, 700.0):
        progress.tell_run(display.show, Progress("spline", 12, 640, 0.5, 0, None))
    line = "spline   step 12, 0 folds, loss 5.000e-01;"
    assert out.getvalue().splitlines() == [f"{line} 0:03 passed", f"{line} 6:40 passed", f"{line} 10:00 passed"]
    shown = progress.Display(Console(file=terminal, force_terminal=True))
    progress.tell_run(shown.show, Progress("layout", 3, 300, 0.5, 0, None))
    (task,) = shown.bar.tasks
    assert task.total is None and task.completed == 3 and "left" not in task.fields["state"]


@pytest.mark.parametrize("quiet", [True, False])
def test_a_line_for_each_surface_that_ends(quiet, capsys):
    log = logging.getLogger("iga_nn.batch.run_batch")
    with progress.shown_batch(quiet) as show:
        assert (show is None) == quiet
        log.info("bean: certified")
        log.warning("duck: refused, open")
    assert capsys.readouterr().err == ("" if quiet else "bean: certified\n") + "warning: duck: refused, open\n"
