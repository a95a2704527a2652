"""The way to a body with stubs: what its report counts, and when other ways follow."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from thick_bodies import eared

import parameterize.ways.stubs as ways
from parameterize.checkpoint import Checkpoints
from parameterize.config import preset
from parameterize.optimization.endings import CertifiedMap, Course, Reason
from parameterize.optimization.term import Weights
from parameterize.progress import History, ignore
from parameterize.spline.spline_map import SplineMap
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.errors import MeshError
from parameterize.surface.surface import surface_from_arrays
from parameterize.ways.mapping_task import MappingTask
from parameterize.ways.way import Attempt

NOTHING_KEPT = Checkpoints(None, {}, resume=False)


def attempt(spline, rounds, seconds):
    return Attempt(CertifiedMap.of(spline), Course(Counter(rounds), seconds, Reason.STALLED), None, Weights())


class Cube:
    """In place of the growth: a cube of half the body's extent, with the rounds that it would have taken."""

    def make(self, task, checkpoints):
        cube = BSplineVolume.from_function(
            lambda u, v, w: (0.25 + 0.5 * u, 0.25 + 0.5 * v, 0.25 + 0.5 * w), task.config.spline.control_points
        )
        return attempt(SplineMap.of(cube), {"grow": 11, "unfold": 1}, {"grow": 3.0, "unfold": 0.5})


@pytest.fixture(scope="module")
def task():
    vertices, faces, _ = eared()
    report = {"history": History(), "progress": ignore}
    return MappingTask(
        surface_from_arrays(vertices, faces, "eared"), preset("fast"), 0, "cpu", "float64", None, {}, report
    )


@pytest.fixture
def as_begun(monkeypatch):
    """All blocks stay as they are laid, after one round."""
    monkeypatch.setattr(ways, "GROWTH", Cube())
    monkeypatch.setattr(ways, "softened", lambda stiff, *_: stiff)

    def begun(first, *_):
        return attempt(first, {"approach": 1, "unfold": 2}, {"approach": 1.0, "unfold": 0.25})

    monkeypatch.setattr(ways, "optimized", begun)


def test_rounds_and_seconds_of_the_body_alone_count(task, as_begun):
    made = ways.STUBS.make(task, NOTHING_KEPT)
    assert made.course.rounds == {"grow": 11, "approach": 1, "unfold": 3}
    assert made.course.seconds == {"grow": 3.0, "approach": 1.0, "unfold": 0.75}
    assert made.found.certificate.verdict == "certified" and len(made.found.spline.nets.knots) > 10
    corner = made.found.spline.body.patches[-1]([[1.0, 1.0, 1.0]])[0]  # of the body, at its place
    assert np.linalg.norm(corner - 0.5) < 1.0


def test_other_ways_follow_a_body_that_is_refused_or_has_too_many_blocks(task, as_begun, monkeypatch, caplog):
    few = replace(task, config=replace(task.config, blocks=3))
    assert ways.STUBS.make(few, NOTHING_KEPT) is None
    assert "at most 3 are allowed" in caplog.text

    def refused(*_):
        raise MeshError("sheets touch in a point")

    monkeypatch.setattr(ways, "surface_from_arrays", refused)
    assert ways.STUBS.make(task, NOTHING_KEPT) is None
    assert "sheets touch in a point" in caplog.text
