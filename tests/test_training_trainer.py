"""After the first stage the trainer turns the ball so that the cube's edges lie on ridges of the surface."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from shapes import rounded_cube, turned

from iga_nn import preset
from parameterize.checkpoint import Checkpoints
from parameterize.cube.cube import project_radially
from parameterize.progress import History, ignore
from parameterize.training.trainer import Trainer

CUBE, FACES = rounded_cube(1500, 30.0)
RIDGE = np.sort(np.abs(CUBE - 0.5), axis=1)[:, 1] > 0.47  # on the edges of the rounded cube


def trained(*, turn=True, given_corners=None):
    """The trainer of one step on a rounded cube that lies askew."""
    options = preset("fast")
    stages = (replace(options.stages[0], steps=1),)
    trainer = Trainer(
        turned(CUBE, (0.5, -0.4, 0.3)),
        FACES,
        replace(options, stages=stages, train=replace(options.train, turn=turn)),
        seed=0,
        device=torch.device("cpu"),
        dtype=torch.float32,
        given_corners=given_corners,
        history=History(),
        progress=ignore,
        checkpoints=Checkpoints(None, {}, resume=False),
    )
    trainer.run()
    return trainer


def to_edges(trainer):
    """How near the ridges come to the edges of the cube from its centre: 1/2 on them."""
    places = project_radially(trainer.mapped()[RIDGE] - 0.5)
    return float(np.median(np.sort(np.abs(places), axis=1)[:, 1]))


def test_the_first_stage_ends_with_the_cubes_edges_on_ridges():
    assert to_edges(trained()) > 0.47
    assert to_edges(trained(turn=False)) < 0.42


def test_given_corners_say_how_the_cube_lies():
    given = np.array([int(np.argmax(CUBE @ (2.0 * np.array(side) - 1.0))) for side in np.ndindex(2, 2, 2)])
    with_turn, without = (trained(turn=turn, given_corners=given).mapped() for turn in (True, False))
    assert np.array_equal(with_turn, without)


def test_a_turned_network_keeps_its_shape():
    trainer = trained(turn=False)
    before = trainer.mapped() - 0.5
    rotation = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    trainer.network.turn(torch.as_tensor(rotation, dtype=torch.float32))
    assert trainer.mapped() - 0.5 == pytest.approx(before @ rotation.T, abs=1e-6)
