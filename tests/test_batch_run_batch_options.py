"""What `iga-nn batch` refuses before anything is computed, each in one line."""

from __future__ import annotations

import socket
import sys
from pathlib import Path

import pytest

import iga_nn.batch
from iga_nn.batch import cluster
from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.workflow.output_folder import locked


def refused(capsys, *arguments, out=("--out", "out")):
    assert main(["batch", *arguments, *out]) == 2
    said = capsys.readouterr()
    assert not said.out and "Traceback" not in said.err
    (line,) = [line for line in said.err.splitlines() if line.startswith("iga-nn: ")]
    return line


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"surfaces": "cube"}, "surfaces: must be a tuple or a list, each entry a string or a path, got 'cube'"),
        ({"surfaces": [3]}, "surfaces: must be a tuple or a list, each entry a string or a path"),
        ({"out": None}, "out: must be a string or a path, got None"),
        ({"mapping": 3}, r"mapping: must be MapOptions\(...\), got 3"),
        ({"workers": 3}, r"workers: must be WorkerOptions\(...\), got 3"),
    ],
)
def test_arguments_of_another_kind_are_refused(in_folder, given, says):
    with pytest.raises(InputError, match=says):
        iga_nn.run_batch(**{"surfaces": ["cube"], "out": "out"} | given)


def test_bad_options_are_one_line_and_cost_nothing(in_folder, capsys):
    assert "name it with --out" in refused(capsys, "bean", out=())
    assert "out is empty" in refused(capsys, "bean", out=("--out", ""))
    for words in ((), ("poisson",), ("elasticity",)):
        assert "no surface is named" in refused(capsys, *words, out=())
    for word in ("elastic", "poison", "Elasticity"):
        assert f"{word}: no such problem and no such surface; did you mean" in refused(capsys, word, "cube")
    assert "no file matches" in refused(capsys, "bean", "*.obj")
    assert "workers 0" in refused(capsys, "bean", "--workers", "0")
    assert "threads per worker 9999" in refused(capsys, "bean", "--threads-per-worker", "9999")
    assert "retries -1" in refused(capsys, "bean", "--retries=-1")
    assert "--memory-limit: applies to workers on this machine" in refused(
        capsys, "bean", "--scheduler", "tcp://127.0.0.1:1", "--memory-limit", "8GiB"
    )
    assert "seed -1" in refused(capsys, "bean", "--seed=-1")
    assert "refine" in refused(capsys, "bean", "--refine", "9")
    assert list(in_folder.iterdir()) == []
    for text in ("much", "-4GiB", "nan", "1MB", "inf"):
        assert "memory limit" in refused(capsys, "bean", f"--memory-limit={text}")


def test_a_folder_that_cannot_be_used(in_folder, capsys):
    Path("file").touch()
    assert "file: cannot be written" in refused(capsys, "bean", out=("--out", "file"))
    Path("out").mkdir()
    with locked(Path("out")):
        assert "out: in use by another run" in refused(capsys, "bean")


def test_a_scheduler_that_does_not_answer(in_folder, capsys, monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE", 0.2)
    with socket.socket() as taken:  # it listens to nobody
        taken.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        assert f"{address}: no dask scheduler answers" in refused(capsys, "bean", "--scheduler", address)
    assert "nonsense: no dask scheduler answers" in refused(capsys, "bean", "--scheduler", "nonsense")


def test_without_the_extra_one_line_says_what_to_install(in_folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "iga_nn.batch.cluster")
    monkeypatch.delattr(iga_nn.batch, "cluster")
    assert "a batch needs distributed, which is not installed: pip install 'iga-nn[batch]'" in refused(capsys, "bean")
