"""A surface and options whose training takes about a second."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
from shapes import rounded_cube, turned

from parameterize.config import NetworkConfig, StageConfig, StageName, preset
from parameterize.surface.surface import surface_from_arrays

BATCH_WORKER = Path(__file__).with_name("batch_worker.py")
STEPS = (6, 4, 8, 4, 8)
FEW = (40,)  # samples a direction of a face of the spline's boundary; 160 otherwise


def shortened(config):
    """The same way with a small network, few samples and few steps: one start of two rounds."""
    return replace(
        config,
        starts=1,
        network=NetworkConfig(width=16, modules=1, frequencies=3),
        train=replace(config.train, cell=0.2, triangles=200, easy_loss=None),
        stages=tuple(map(StageConfig, get_args(StageName), STEPS)),
        spline=replace(config.spline, fit_cell=0.1, steps=3, rounds=2),
        steps_factor=0.25 * config.steps_factor,
    )


def tiny_config():
    config = shortened(preset("fast"))
    return replace(config, spline=replace(config.spline, control_points=6))


def small_surface(stretch=2.0):
    points, faces = rounded_cube(200, power=5.0)
    top = np.flatnonzero(points[faces].mean(axis=1)[:, 2] > 0.9 * points[:, 2].max())
    return surface_from_arrays(stretch * turned(points) + [10.0, 0.0, -3.0], faces, "pillow", groups={"top": top})
