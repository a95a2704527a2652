"""Maps that grow from a cube: the layout without flips, the first map, the rounds and an interruption in them."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from shapes import ball, is_closed
from small_run import tiny_config

from parameterize import parameterize
from parameterize.config import preset
from parameterize.cube.flips import flipped
from parameterize.optimization.endings import CertifiedMap
from parameterize.optimization.term import Weights
from parameterize.progress import History, Progress, ignore
from parameterize.spline.bspline import open_uniform_knots
from parameterize.surface.surface import surface_from_arrays
from parameterize.ways.growth import GROWTH, LAST, SHARES, STIFF, first_cube
from parameterize.ways.mapping_task import MappingTask
from parameterize.ways.one_cube import surface_on_cube

pytestmark = pytest.mark.usefixtures("few_distances")


def bent_rod(count=900):
    """A rod bent to a half circle: no ray from its middle line's centre tells where its points belong."""
    points, faces = ball(count)
    angle, radius = 0.5 * np.pi * points[:, 0], 1.6 + 0.6 * points[:, 1]
    bent = np.stack([radius * np.sin(angle), radius * np.cos(angle), 0.6 * points[:, 2]], axis=1)
    return surface_from_arrays(bent, faces, "rod")


def on_cube(surface, config, seed=0):
    report = {"history": History(), "progress": ignore}
    task = MappingTask(surface, config, seed, "cpu", "float32", None, {}, report)
    return surface_on_cube(task, turn=0)


def test_a_bent_rod_lies_on_the_cube_without_a_flip():
    surface, config = bent_rod(), preset("fast").with_control_points(12)
    layout = on_cube(surface, config)
    assert not flipped(layout.places, layout.faces).any()
    assert is_closed(layout.faces)
    assert np.abs(layout.places - 0.5).max(axis=1) == pytest.approx(0.5)
    assert np.array_equal(layout.points[: len(surface.vertices)], surface.unit_vertices)
    others = on_cube(surface, config, seed=1)
    assert not np.allclose(others.places[:100], layout.places[:100])


def test_the_first_map_is_a_cube_that_faces_the_surface():
    surface = bent_rod()
    layout = on_cube(surface, preset("fast").with_control_points(8))
    knots = (open_uniform_knots(8, 3),) * 3
    cube = first_cube(layout, knots, 3)
    found = CertifiedMap.of(cube)
    assert found.certificate.verdict == "certified"
    assert found.certificate.lower_bound == pytest.approx(1.0)
    flat = cube.volume.control_points
    axes = np.stack([flat[-1, 0, 0] - flat[0, 0, 0], flat[0, -1, 0] - flat[0, 0, 0], flat[0, 0, -1] - flat[0, 0, 0]])
    assert axes @ axes.T == pytest.approx(np.eye(3))
    towards = ((layout.places - 0.5) @ axes * (layout.points - 0.5)).sum()
    assert towards > ((layout.places - 0.5) @ (axes @ np.diag([-1.0, -1.0, 1.0])) * (layout.points - 0.5)).sum()


def test_the_rounds_in_which_it_grows_come_first():
    schedule = GROWTH.schedule(preset("fast"))
    assert [phase.name for phase in schedule.phases] == ["grow", "unfold", "separate", "polish"]
    assert schedule.rounds == schedule.grown + 20
    assert list(SHARES) == sorted(SHARES) and SHARES[-1] == 1.0
    shorter = GROWTH.schedule(preset("fast").scaled(0.5))
    assert (schedule.phases[0].steps, shorter.phases[0].steps) == (12, 6)


def test_a_stiff_growth_keeps_its_fairness_and_the_last_one_may_end_farther_away():
    for growth in (STIFF, LAST):
        assert growth.weights == Weights(pytest.approx(10.0 * Weights.fairness), least_floor=0.05)
    assert GROWTH.weights == Weights()
    _, unfold, separate, _ = LAST.schedule(preset("fast")).phases
    assert unfold.far == unfold.far_first == separate.far == 0.05


def hard(config):
    return replace(config, starts=2, train=replace(config.train, easy_loss=0.0))


def test_a_bent_rod_is_certified_without_a_trained_network():
    config = hard(tiny_config())
    config = replace(
        config,
        spline=replace(preset("fast").spline, control_points=12, fit_cell=0.1),
        steps_factor=1.0,
    )
    result = parameterize(bent_rod(), config, device="cpu")
    assert result.certificate.verdict == "certified"
    assert result.quality.boundary_check.injective is True
    assert result.quality.boundary.unit_volume.rms < 0.01


@cache
def grown():
    """A short rod, options, and its map, which nothing interrupts; the tests of interruptions shorten its growth."""
    surface, config = bent_rod(300), hard(tiny_config())
    return surface, config, parameterize(surface, config, seed=1, device="cpu")


@pytest.mark.parametrize(("rounds", "kept"), [(1, "spline-1-coarse"), (3, "spline-1")])
def test_an_interrupted_growth_goes_on_to_the_same_bits(tmp_path, monkeypatch, rounds, kept):
    monkeypatch.setattr("parameterize.ways.growth.SHARES", (0.1, 1.0))
    surface, config, whole = grown()

    def interrupt(state: Progress):
        if state.stage == "spline" and state.step > rounds * config.spline.steps:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        parameterize(surface, config, seed=1, device="cpu", checkpoint_dir=tmp_path, progress=interrupt)
    assert (tmp_path / f"{kept}.safetensors").is_file()
    resumed = parameterize(surface, config, seed=1, device="cpu", checkpoint_dir=tmp_path, resume=True)
    assert np.array_equal(resumed.volume.control_points, whole.volume.control_points)
    assert np.array_equal(resumed.boundary.parameters, whole.boundary.parameters)
