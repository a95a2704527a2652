"""The stage towards the cube begins twice: with G as it is, and turned so that the cube's edges keep out of hollows."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shapes import ball
from small_run import STEPS, small_surface, tiny_config

from parameterize.config import NetworkConfig
from parameterize.cube.cube import CubeLayout
from parameterize.cube.turning import best_turn, concavity
from parameterize.run import parameterize
from parameterize.training import trainer
from parameterize.training.network import InverseMap

pytestmark = pytest.mark.usefixtures("few_distances")

QUARTER = Rotation.from_euler("xyz", [20.0, -30.0, 40.0], degrees=True).as_matrix()
ALWAYS, NEVER = -10.0, 1.0  # gains that every turn has, and none
RACED = math.ceil(0.45 * STEPS[2])


def run(*, progress=lambda _: None, folder=None, resume=False, **of_training):
    config = tiny_config()
    config = replace(config, train=replace(config.train, **of_training))
    how = {"progress": progress, "checkpoint_dir": folder, "resume": resume}
    return parameterize(small_surface(), config, seed=3, device="cpu", **how)


class Seen:
    """Counts the reports of each step."""

    def __init__(self):
        self._steps = []

    def __call__(self, state):
        self._steps.append((state.stage, state.step))

    def count(self, stage, step):
        return self._steps.count((stage, step))


@pytest.fixture
def turns_are_promising(monkeypatch):
    scores = iter([-1.0, -100.0] * 4)
    monkeypatch.setattr(trainer, "concavity", lambda *_: next(scores))
    monkeypatch.setattr(trainer, "best_turn", lambda *_: QUARTER)


def test_a_turned_network_maps_to_the_turned_places():
    rng = np.random.default_rng(0)
    network = InverseMap(NetworkConfig(width=8, modules=1), rng, "cpu", "float64")
    for name in ("last.weight", "last.bias"):
        network.parameters[name] = network.there(rng.normal(size=network.parameters[name].shape))
    points = rng.random((20, 3))
    before = network.at(points) - 0.5
    network.turn(QUARTER)
    assert network.at(points) - 0.5 == pytest.approx(before @ QUARTER.T)


def test_the_best_turn_makes_the_hollowness_least():
    points, faces = ball(600)
    points = points * (1.0 + 0.3 * np.sin(5.0 * points[:, :1]) * points[:, 1:2])
    layout = CubeLayout(points, faces, points / np.linalg.norm(points, axis=1, keepdims=True), len(points))
    turn = best_turn(layout, np.random.default_rng(0))
    assert concavity(replace(layout, places=layout.places @ turn.T)) < concavity(layout)


@pytest.mark.usefixtures("turns_are_promising")
def test_a_turn_that_does_not_win_leaves_no_trace(monkeypatch):
    monkeypatch.setattr(trainer, "_RACE_GAIN", NEVER)
    seen = Seen()
    raced, plain = run(progress=seen), run(race=0.0)
    assert np.array_equal(raced.volume.control_points, plain.volume.control_points)
    assert np.array_equal(raced.history["loss"], plain.history["loss"])
    assert seen.count("cube", 1) == 2 and seen.count("cube", RACED) == 2 and seen.count("cube", RACED + 1) == 1


@pytest.mark.usefixtures("turns_are_promising")
def test_a_turn_that_wins_goes_on(monkeypatch):
    monkeypatch.setattr(trainer, "_RACE_GAIN", ALWAYS)
    raced, plain = run(), run(race=0.0)
    assert not np.array_equal(raced.volume.control_points, plain.volume.control_points)
    cube = raced.history["stage"] == "cube"
    assert raced.history["step"][cube].tolist() == list(range(STEPS[2]))
    before = np.isin(raced.history["stage"], ["S(2)", "S(1)"])
    assert np.array_equal(raced.history["loss"][before], plain.history["loss"][before])


def test_no_turn_is_tried_where_the_edges_lie_well_already(monkeypatch):
    monkeypatch.setattr(trainer, "concavity", lambda *_: -1.0)
    seen = Seen()
    run(progress=seen)
    assert seen.count("cube", 1) == 1


@pytest.mark.usefixtures("turns_are_promising")
def test_a_run_killed_in_the_race_resumes_to_the_same_bits(tmp_path, monkeypatch):
    monkeypatch.setattr(trainer, "_RACE_GAIN", ALWAYS)
    whole, seen = run(), Seen()

    def interrupt(state):
        seen(state)
        if seen.count("cube", 2) == 2:  # with the turned network
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(progress=interrupt, folder=tmp_path)
    resumed = run(folder=tmp_path, resume=True)
    assert np.array_equal(whole.volume.control_points, resumed.volume.control_points)
