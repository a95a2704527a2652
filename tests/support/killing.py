"""A run killed at any moment and resumed gives the volume of a run left alone: `python tests/killing.py --moments 30`.

Each run, with options that take about a second, is a process of its own, forked from this
one, which has loaded everything before: it is killed by SIGKILL at a random share of the time that an undisturbed run
takes, then the same command goes on with --resume.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from mesh_files import obj
from small_run import FEW, small_surface, tiny_config

import iga_nn.figures.style  # the figures are not drawn, but matplotlib is loaded
import iga_nn.report.html  # noqa: F401 the children would load it one by one
from iga_nn.cli.commands import main as command
from iga_nn.io.formats import load_volume
from iga_nn.options import MapOptions
from iga_nn.workflow.output_folder import RunFolder, has_checkpoint
from iga_nn.workflow.verdict import certified_facts
from parameterize.spline.sampled_boundary import SampledBoundary

ENDED = (0, 3, 5)  # so short a training need not be certified, nor near the surface
FORK = multiprocessing.get_context("fork")


def started(mesh: Path, folder: Path, *more: str):
    """A run in a process of its own; what it says goes into a file beside its folder."""
    arguments = ["parameterize", str(mesh), "--out", str(folder), *more]
    process = FORK.Process(target=run, args=(arguments, folder))
    process.start()
    return process


def run(arguments: list[str], folder: Path) -> None:
    os.dup2(os.open(said_of(folder), os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os._exit(command(arguments))


def said_of(folder: Path) -> Path:
    return folder.with_suffix(".said")


def finished(mesh: Path, folder: Path, *more: str) -> bytes:
    """volume.npz of a run that is left alone."""
    process = started(mesh, folder, *more)
    process.join()
    if process.exitcode not in ENDED:
        raise RuntimeError(f"exit code {process.exitcode}: {said_of(folder).read_text()}")
    return (folder / "volume.npz").read_bytes()


def kill_and_resume(mesh: Path, folder: Path, moment: float, expected: bytes) -> tuple[str, bool]:
    """What the run was at when it was killed, and whether the resumed one gave the expected volume."""
    process = started(mesh, folder)
    process.join(moment)
    process.kill()
    process.join()
    lines = [line.split("  ")[0] for line in said_of(folder).read_text().splitlines() if line.strip()]
    place = lines[-1].strip() if lines else "loading"
    kept = "checkpoint" if has_checkpoint(folder) else "finished" if process.exitcode in ENDED else "nothing yet"
    same = finished(mesh, folder, "--resume") == expected
    return f"{place[:28]:28s} {kept:12s}", same and not list(folder.glob(".*.part*"))


def main() -> int:
    """Kill, resume, compare; print the log and return 1 where a volume differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moments", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    RunFolder.draw = lambda *_, **__: None  # the figures come after the volume and cost most of so short a run
    MapOptions.config = lambda _: tiny_config()
    SampledBoundary.of.__func__.__defaults__ = FEW
    surface = small_surface()
    rng, differing = np.random.default_rng(options.seed), 0
    with tempfile.TemporaryDirectory() as place:
        mesh = Path(place, "pillow.obj")
        mesh.write_text(obj(surface.vertices, surface.faces))
        start = time.perf_counter()
        expected = finished(mesh, Path(place, "undisturbed"))
        seconds = time.perf_counter() - start
        certified_facts(load_volume(Path(place, "undisturbed", "volume.npz")))  # loads what is compiled, for all
        print(f"undisturbed: {seconds:.1f} s")
        for number in range(options.moments):
            moment = rng.uniform(0.02, 1.0) * seconds
            was_at, same = kill_and_resume(mesh, Path(place, str(number)), moment, expected)
            print(
                f"{number + 1:3d}  killed after {moment:5.2f} s  {was_at} ", "same" if same else "DIFFERS", flush=True
            )
            differing += not same
    print(f"{options.moments - differing} of {options.moments} volumes are the same as the undisturbed one")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
