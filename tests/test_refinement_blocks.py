"""Knots inserted into blocks: a ring of four rods in a torus."""

from functools import cache

import numpy as np
import pytest
from block_bodies import map_of, surface_fit
from block_starts import torus

from parameterize import refinement
from parameterize.certificate.certify import certify
from parameterize.checkpoint import Checkpoints
from parameterize.config import RefinementConfig, SplineConfig, preset
from parameterize.optimization.phases import Polish, Schedule, Separate, Shape, Unfold
from parameterize.optimization.rounds import optimize
from parameterize.optimization.term import Weights
from parameterize.progress import History, ignore
from parameterize.quality.distances import two_sided
from parameterize.refinement import refine
from parameterize.run import parameterize
from parameterize.spline.body import Body, shared_numbers
from parameterize.surface.surface import surface_from_arrays

CONFIG = SplineConfig(steps=5)
SCHEDULE = Schedule((Shape(), Unfold(), Separate(), Polish(rounds=1)), rounds=6)
OPTIONS = {"tolerance": 1e-9, "max_control_points": 6}


@cache
def first():
    """A certified map of few spans, and the data of its surface: a torus whose height has eight waves around."""
    blocks, points, faces = torus(around=64, across=28)
    x, y, z = (points - 0.5).T
    points[:, 2] += 0.15 * z * np.cos(8.0 * np.arctan2(y, x))
    start = map_of(blocks.with_spans(2))
    fit = surface_fit(start, points, faces)
    found, _ = optimize(start, fit, CONFIG, SCHEDULE, history=History())
    assert not any(found.faults)
    return found, fit


def refined(checkpoints=None, progress=ignore, **options):
    kept = checkpoints or Checkpoints(None, {}, resume=False)
    given = first(), CONFIG, RefinementConfig(**options), Weights()
    return refine(*given[0], *given[1:], history=History(), progress=progress, checkpoints=kept)


@cache
def limited():
    return refined(**OPTIONS)


@pytest.fixture(autouse=True)
def few_rounds(monkeypatch):
    monkeypatch.setattr(refinement, "ROUNDS", 4)
    monkeypatch.setattr(refinement, "POLISH", 2)


def size_of(spline):
    return shared_numbers(spline.nets.shapes, spline.nets.interfaces)[1]


@pytest.mark.slow
def test_knots_are_inserted_into_blocks_until_the_limit_and_the_boundary_comes_closer():
    found, fit, told = limited()
    assert told.stopped == "limit reached" and len(told.levels) > 1 and told.dropped is None
    assert not any(found.faults) and certify(found.spline.body).verdict == "certified"
    assert isinstance(found.spline.body, Body)  # whose interfaces agree bit by bit
    assert [level.control_points for level in told.levels] == sorted({level.control_points for level in told.levels})
    assert told.levels[0].control_points == size_of(first()[0].spline) < size_of(found.spline)
    assert told.levels[-1].control_points == size_of(found.spline)
    assert max(max(shape) for shape in found.spline.nets.shapes) == 6
    assert len({shape[:2] for shape in found.spline.nets.shapes}) == 1  # the directions across are one all around
    assert told.levels[-1].distance < 0.75 * told.levels[0].distance
    gaps = two_sided(found.spline.body, fit.points, fit.sliding.triangles).summary()
    assert gaps.rms / np.linalg.norm(np.ptp(fit.points, axis=0)) == pytest.approx(told.levels[-1].distance)
    assert f"{size_of(found.spline):,} control points" in str(told.levels[-1])


@pytest.mark.slow
def test_blocks_interrupted_and_resumed_are_undisturbed(tmp_path):
    (whole, _, told), steps = limited(), []

    def interrupt(state):
        steps.append(state.step)
        if len(steps) > 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        refined(Checkpoints(tmp_path, {}, resume=False), interrupt, **OPTIONS)
    resumed, _, again = refined(Checkpoints(tmp_path, {}, resume=True), **OPTIONS)
    assert np.array_equal(resumed.spline.control, whole.spline.control) and again == told


@pytest.mark.slow
def test_a_torus_is_refined_to_a_tolerance(monkeypatch):
    monkeypatch.undo()
    _, points, faces = torus(around=48, across=20)
    config = preset("fast").scaled(0.3).refined(1e-4, 40)
    result = parameterize(surface_from_arrays(points, faces), config)
    told = result.refinement
    assert result.origin == "blocks" and result.decomposition.startswith("1 handle, ")
    assert result.certificate.verdict == "certified"
    assert len(told.levels) > 1 and told.levels[-1].distance < told.levels[0].distance
    assert told.stopped != "tolerance met" or told.levels[-1].distance <= 1e-4
    assert told.levels[-1].control_points == result.quality.control_points
