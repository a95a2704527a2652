"""What every worker of a test's batch loads before it computes: trainings of about a second, without figures.

The surface's name says what happens to it. `hungry` takes memory until its worker is ended. `held` waits in the middle
of the training while there is a file held.hold, and writes its process into held.pid. NAME.began is the first step.
"""

from __future__ import annotations

import os
import time
from functools import partial
from pathlib import Path
from types import FunctionType

from small_run import FEW, tiny_config

from iga_nn.options import MapOptions
from iga_nn.workflow import pipeline
from iga_nn.workflow.output_folder import RunFolder
from parameterize.spline.sampled_boundary import SampledBoundary

HOLD = "corners"  # the stage, after some checkpoints


def followed_run(run, name, folder, progress, **given):
    mesh = Path(name)
    if mesh.stem == "hungry":
        taken = []
        while True:
            taken += [b"x" * (16 << 20)] * (len(taken) < 150)  # more than the limit, less than all there is
            time.sleep(0.02)
    steps = []

    def followed(now):
        steps.append(f"{now.stage} {now.step}")
        mesh.with_suffix(".began").write_text(steps[0])
        progress(now)
        if mesh.stem == "held" and now.stage == HOLD and mesh.with_suffix(".hold").exists():
            mesh.with_suffix(".pid").write_text(str(os.getpid()))
            while mesh.with_suffix(".hold").exists():
                progress(now)
                time.sleep(0.05)

    return run(name, folder, progress=followed, **given)


if isinstance(pipeline.parameterize_to, FunctionType):  # dask loads this file more than once
    pipeline.parameterize_to = partial(followed_run, pipeline.parameterize_to)
    MapOptions.config = lambda _: tiny_config()
    SampledBoundary.of.__func__.__defaults__ = FEW
    RunFolder.draw = lambda *_, **__: None
    pipeline.scene_of = lambda *_, **__: None
