"""Whole runs killed by SIGKILL in each of their stages, and resumed: `python tests/support/killing_run.py`.

What a killed run leaves is read, or at least not taken for finished; the resumed one gives the volume and the solution
of a run left alone. The function of the stage is replaced by one that kills the process.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
from pathlib import Path

from killing import FORK, run, said_of
from mesh_files import obj
from plane_bodies import arrays
from small_run import FEW

import iga_nn.io.view
import iga_nn.models
import iga_nn.report.html
import iga_nn.workflow.mapping as mapping
import iga_nn.workflow.solving as solving
import parameterize.run
import parameterize.ways.planes as planes
from iga_nn.report import document as reports
from iga_nn.workflow.output_folder import RunFolder
from parameterize.spline.sampled_boundary import SampledBoundary
from solve import solve_with

RESULTS = ("volume.npz", "solution.npz")
ARGUMENTS = ["run", "poisson", "L.obj", "--control-points", "6", "--refine", "0", "1", "--out"]
STAGES = {  # the function in which the run is killed, and the levels of report.json by then
    "reading": (mapping, "resolve", 0),
    "layout": (planes, "exact_blocks", 0),
    "certificate": (parameterize.run, "certify", 0),
    "map written": (mapping, "tell", 0),
    "level 0": ("solve", 0, 0),
    "level 1": ("solve", 1, 1),
    "view of the solution": (iga_nn.io.view, "write_solution", 2),
    "scene": (solving, "scene_of", 2),
    "page": (iga_nn.report.html, "write", 2),
}


def dying(stage: str):
    """The place, the name and a function in which a process of this stage dies."""
    home, name, _ = STAGES[stage]

    def killed(*given, **named):
        os.kill(os.getpid(), signal.SIGKILL)

    if home != "solve":
        return home, name, killed
    return (
        sys.modules["solve"],
        "solve_with",
        lambda *given: killed() if given[2].refine == name else solve_with(*given),
    )


def ended(folder: Path, *more: str) -> int:
    """The exit code of a run in a process of its own, negative where a signal ended it."""
    process = FORK.Process(target=run, args=([*ARGUMENTS, str(folder), *more], folder))
    process.start()
    process.join()
    return process.exitcode


def resumes(stage: str, folder: Path, expected: dict[str, bytes]) -> bool:
    """Whether a run killed in a stage leaves what it had, and the same command with --resume makes the same."""
    home, name, killed = dying(stage)
    before = getattr(home, name)
    setattr(home, name, killed)
    code = ended(folder)
    setattr(home, name, before)
    if code != -signal.SIGKILL:
        raise RuntimeError(f"{stage}: ended with {code}: {said_of(folder).read_text()}")
    left = reports.read(folder) or {}
    levels = len(reports.solved(left).get("levels", ()))
    if levels != STAGES[stage][2] or reports.is_finished(left):
        print(f"{stage}: {levels} levels are left")
        return False
    if code := ended(folder, "--resume"):
        raise RuntimeError(f"{stage}: the resumed run ended with {code}: {said_of(folder).read_text()}")
    same = all((folder / name).read_bytes() == content for name, content in expected.items())
    return same and (folder / "report.html").is_file() and not list(folder.glob(".*.part*"))


def main() -> int:
    """Kill, resume, compare; print the log and return 1 where something differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stages", nargs="+", default=list(STAGES), choices=list(STAGES))
    stages = parser.parse_args().stages
    RunFolder.draw = lambda *_, **__: None
    SampledBoundary.of.__func__.__defaults__ = FEW
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        Path("L.obj").write_text(obj(*arrays("L")))
        whole = Path(place, "whole")
        if ended(whole):
            raise RuntimeError(said_of(whole).read_text())
        expected = {name: (whole / name).read_bytes() for name in RESULTS}
        same = 0
        for number, stage in enumerate(stages):
            good = resumes(stage, Path(place, str(number)), expected)
            print(f"{stage:24s}", "same" if good else "DIFFERS", flush=True)
            same += good
    print(f"{same} of {len(stages)} volumes are the same as those left alone")
    return 0 if same == len(stages) else 1


if __name__ == "__main__":
    sys.exit(main())
