"""Batches with worker processes, interrupted, killed and out of memory, and a batch that is run again."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mesh_files import CUBE, TRIANGLES, obj
from small_run import small_surface

from iga_nn.cli.commands import main

PROGRAM = """
from small_run import tiny_config
from iga_nn.options import MapOptions
MapOptions.config = lambda _: tiny_config()  # as in the workers: a result of another config is another run's
from iga_nn.__main__ import run_and_exit
run_and_exit()
"""
SUPPORT = Path(__file__).resolve().parent / "support"
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
PATIENCE = 900.0  # seconds, on a busy machine


class Command:
    """`iga-nn batch` in a process group of its own, as a terminal starts it, in a folder with the surfaces."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        scratch = folder / "scratch"
        scratch.mkdir(exist_ok=True)
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join((str(SUPPORT.parents[1]), str(SUPPORT))),
            "DASK_DISTRIBUTED__WORKER__PRELOAD": str(SUPPORT / "batch_worker.py"),
            "TMPDIR": str(scratch),
        }
        command = [sys.executable, "-P", "-c", PROGRAM, "batch", *arguments, "--refine", "0", "--out", "out"]
        self.out, self.err = folder / "stdout", folder / "stderr"
        with self.out.open("w") as out, self.err.open("w") as err:
            self.process = subprocess.Popen(
                command, cwd=folder, env=environment, stdout=out, stderr=err, start_new_session=True
            )
        self.scratch = scratch

    def wait_for(self, file: Path) -> str:
        """The content of a file that a worker writes."""
        end = time.monotonic() + PATIENCE
        while not (file.exists() and file.read_text()):
            assert self.process.poll() is None and time.monotonic() < end, self.err.read_text()
            time.sleep(0.05)
        return file.read_text()

    def ended(self) -> int:
        """The exit code, once the command and all processes it started have ended and left no files."""
        code = self.process.wait(PATIENCE)
        end = time.monotonic() + PATIENCE
        while _is_group(self.process.pid):
            assert time.monotonic() < end, "processes are left"
            time.sleep(0.05)
        assert not [path for path in self.scratch.iterdir() if "torch" not in path.name]  # torch keeps a cache
        assert "Traceback" not in self.err.read_text(), self.err.read_text()
        return code


def _is_group(number: int) -> bool:
    """Whether a process of that group is left."""
    try:
        os.killpg(number, 0)
    except ProcessLookupError:
        return False
    return True


def table(folder: Path) -> dict[str, dict[str, str]]:
    with (folder / "out" / "batch.csv").open(newline="") as stream:
        rows = {Path(row["surface"]).stem: row for row in csv.DictReader(stream)}
    known = json.loads((folder / "out" / "batch.json").read_text())
    assert [row["state"] for row in known["surfaces"]] == [row["state"] for row in rows.values()]
    assert (folder / "out" / "batch.html").read_text().count("<tr>") == 1 + len(rows)
    return rows


def states(folder: Path) -> dict[str, str]:
    return {name: row["state"] for name, row in table(folder).items()}


FINISHED = ("certified", "not certified", "not the part")  # so short a training need not be any good


@pytest.mark.slow
def test_a_batch_survives_what_happens_to_it(tmp_path):
    """Interrupted, then a worker killed, out of memory, a refused surface."""
    parts = tmp_path / "parts"
    parts.mkdir()
    surface = small_surface()
    for name in ("first", "held"):
        (parts / f"{name}.obj").write_text(obj(surface.vertices, surface.faces))
    hold, pid, began = (parts / f"held.{ending}" for ending in ("hold", "pid", "began"))
    hold.touch()

    interrupted = Command(tmp_path, "parts", "--workers", "1")
    interrupted.wait_for(pid)
    interrupted.wait_for(tmp_path / "out" / "first" / "report.html")
    os.killpg(interrupted.process.pid, signal.SIGINT)
    assert interrupted.ended() == 130
    last = interrupted.err.read_text().splitlines()[-1]
    assert last.startswith("iga-nn: interrupted; 2 surfaces: ") and "run the same command again" in last
    assert (tmp_path / "out" / "held" / "checkpoint" / "training.safetensors").exists()
    assert states(tmp_path)["held"] == "waiting"

    pid.unlink()
    began.unlink()
    (parts / "hungry.obj").write_text(obj())
    (parts / "open.obj").write_text(obj(CUBE, TRIANGLES[1:]))
    written = (tmp_path / "out" / "first" / "volume.npz").stat().st_mtime_ns
    killed = Command(tmp_path, "parts", "--memory-limit", "1.5GiB")
    victim = int(killed.wait_for(pid))
    assert began.read_text().startswith("corners")  # from the checkpoint of the interrupted command
    began.unlink()
    os.kill(victim, signal.SIGKILL)
    hold.unlink()
    assert killed.ended() == 2
    rows = table(tmp_path)
    assert rows["first"]["state"] in FINISHED and rows["held"]["state"] == rows["first"]["state"]
    assert began.read_text().startswith("corners")  # and from that of the killed worker
    same = [(tmp_path / "out" / name / "volume.npz").read_bytes() for name in ("first", "held")]
    assert same[0] == same[1]
    assert (tmp_path / "out" / "first" / "volume.npz").stat().st_mtime_ns == written
    assert rows["hungry"]["state"] == "failed" and "out of memory" in rows["hungry"]["line"]
    assert rows["open"]["state"] == "refused" and rows["open"]["line"].startswith("open surface: ")
    assert {path.name for path in tmp_path.iterdir()} == {"parts", "out", "scratch", "stdout", "stderr"}


def test_each_body_of_a_file_has_a_row_of_its_own(formula_training, in_this_process, in_folder, capsys):
    formula_training()
    moved = CUBE + [3.0, 0.0, 0.0]
    Path("pair.obj").write_text(obj([*CUBE, *moved], [*TRIANGLES, *(TRIANGLES + 8)]))
    assert main(["batch", "pair.obj", "--split", "--refine", "0", "--out", "out", "--quiet"]) == 0
    rows = json.loads(Path("out", "batch.json").read_text())["surfaces"]
    assert [row["surface"] for row in rows] == ["pair.obj-0", "pair.obj-1"]
    for number in (0, 1):
        report = json.loads(Path("out", f"pair-{number}", "report.json").read_text())
        assert f"--component {number}" in report["command"]
        assert report["input"]["bbox"][0] == [3.0 * number, 0.0, 0.0]
    assert main(["batch", "pair.obj", "--split", "--component", "0", "--out", "out"]) == 2
    assert "split takes every component: leave --component out" in capsys.readouterr().err


def test_what_was_refused_or_failed_is_run_again_alone(formula_training, in_this_process, in_folder, capsys):
    Path("parts").mkdir()
    for name in ("done", "failed"):
        Path("parts", f"{name}.obj").write_text(obj())
    formula_training()
    assert main(["batch", "parts/done.obj", "--refine", "0", "--out", "out"]) == 0
    written = Path("out/done/volume.npz").stat().st_mtime_ns
    Path("parts/open.obj").write_text(obj(CUBE, TRIANGLES[1:]))
    formula_training(error=RuntimeError("no idea why"))
    assert main(["batch", "parts", "--refine", "0", "--out", "out"]) == 2
    assert states(in_folder) == {"done": "certified", "failed": "failed", "open": "refused"}
    capsys.readouterr()

    Path("parts/failed.obj").rename("parts/renamed.obj")
    Path("parts/open.obj").write_text(obj())
    formula_training()
    assert main(["batch", "parts", "--refine", "0", "--out", "out", "--json", "--quiet"]) == 0
    known = json.loads(capsys.readouterr().out)
    assert [row["folder"] for row in known["surfaces"]] == ["done", "open", "renamed"]
    assert {row["state"] for row in known["surfaces"]} == {"certified"} == set(states(in_folder).values())
    assert Path("out/done/volume.npz").stat().st_mtime_ns == written
