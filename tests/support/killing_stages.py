"""Runs killed by SIGKILL right after a checkpoint of each stage, and resumed: `python tests/support/killing_stages.py`.

The resumed run has to give the volume of a run left alone, and may not do again what the checkpoint holds: there the
function that does it is replaced by one that ends the process.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from killing import finished, said_of, started
from mesh_files import obj
from plane_bodies import arrays, prism
from small_run import FEW, small_surface, tiny_config
from test_cube_constrained import drum

import parameterize.cube.sphere as sphere
import parameterize.training.trainer as trainer
import parameterize.ways.blocks as blocks
import parameterize.ways.mapping_task as task
import parameterize.ways.planes as planes
import parameterize.ways.stacks as stacks
from iga_nn.options import MapOptions
from iga_nn.workflow.output_folder import RunFolder
from parameterize.checkpoint import Checkpoints
from parameterize.spline.sampled_boundary import SampledBoundary

TINY = tiny_config()
FOUR = replace(TINY, starts=4, train=replace(TINY.train, easy_loss=0.0))  # no training: a cube grows
SHAFT = [(np.cos(t), np.sin(t)) for t in np.arange(40) * np.pi / 20]


def mesh_of(name):
    """Vertices and faces of a small body."""
    if name == "pillow":
        surface = small_surface()
        return surface.vertices, surface.faces
    if name == "ring":
        found = trimesh.creation.torus(2.0, 0.7, major_sections=24, minor_sections=12)
        return np.array(found.vertices), np.array(found.faces)
    return {"L": lambda: arrays("L"), "shaft": lambda: arrays(prism(SHAFT, 2.0)), "drum": lambda: drum(40)}[name]()


@dataclass(frozen=True)
class Stage:
    """A body and its options; the checkpoint after which the run is killed, and how many of it there are by then."""

    body: str
    config: object
    checkpoint: str
    count: int = 1
    done: tuple[tuple[object, str], ...] = ()  # what a resumed run does not do again: modules, and names in them


SPHERE = ((sphere, "_halves"),)
STAGES = (
    Stage("pillow", TINY, "training", 2),
    Stage("pillow", TINY, "spline", 1, ((trainer.Trainer, "_step"),)),
    Stage("pillow", FOUR, "sphere", 1, SPHERE),
    Stage("pillow", FOUR, "sphere", 2, SPHERE),
    Stage("pillow", FOUR, "spline-1-coarse", 3, (*SPHERE, (sphere, "_stepped"))),
    Stage("pillow", FOUR, "spline-1", 1, (*SPHERE, (sphere, "_stepped"))),
    Stage("drum", FOUR.with_blocks(1), "sphere", 2, SPHERE),
    Stage("L", TINY, "first", 1, ((planes, "exact_blocks"),)),
    Stage("shaft", TINY, "first", 1, ((stacks, "stacked_blocks"),)),
    Stage("ring", TINY, "first", 1, ((blocks, "blocks_along"), (task, "skeleton_of"))),
    Stage("ring", TINY, "spline", 2, ((blocks, "blocks_along"), (task, "skeleton_of"))),
)
save = Checkpoints.save


def killed_after(name, count):
    """`Checkpoints.save` that kills the process once it has kept this checkpoint so many times."""
    left = [count]

    def saved(self, own, *given):
        save(self, own, *given)
        left[0] -= self._folder is not None and own + self._suffix == name
        if left[0] == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    return saved


def same_after(stage, mesh, place, expected):
    """Whether a run that is killed after a checkpoint, and resumed, gives the expected volume."""
    Checkpoints.save = killed_after(stage.checkpoint, stage.count)
    process = started(mesh, place)
    process.join()
    Checkpoints.save = save
    if process.exitcode != -signal.SIGKILL:
        raise RuntimeError(f"{stage.checkpoint}: never kept: {said_of(place).read_text()}")
    before = [(home, name, getattr(home, name)) for home, name in stage.done]
    for home, name, _ in before:
        setattr(home, name, lambda *_, **__: os._exit(9))
    same = finished(mesh, place, "--resume") == expected
    for home, name, function in before:
        setattr(home, name, function)
    return same


def main() -> int:
    """Kill, resume, compare; print the log and return 1 where a volume differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", nargs="+", default=[stage.body for stage in STAGES])
    bodies = parser.parse_args().bodies
    asked = [stage for stage in STAGES if stage.body in bodies]
    sphere._CHECKPOINT_SECONDS = -1.0  # one after each step
    RunFolder.draw = lambda *_, **__: None
    SampledBoundary.of.__func__.__defaults__ = FEW
    known, differing = {}, 0
    with tempfile.TemporaryDirectory() as folder:
        for number, stage in enumerate(asked):
            MapOptions.config = lambda _, config=stage.config: config
            mesh, way = Path(folder, f"{stage.body}.obj"), (stage.body, stage.config)
            mesh.write_text(obj(*mesh_of(stage.body)))
            if way not in known:
                known[way] = finished(mesh, Path(folder, f"whole {number}"))
            same = same_after(stage, mesh, Path(folder, str(number)), known[way])
            print(f"{stage.body:8s} {stage.checkpoint:14s} {stage.count} ", "same" if same else "DIFFERS", flush=True)
            differing += not same
    print(f"{len(asked) - differing} of {len(asked)} volumes are the same as those left alone")
    return 1 if differing else 0


if __name__ == "__main__":
    sys.exit(main())
