"""The rounds on bodies of several blocks: thin starts of a torus and a double torus, drawn to their surfaces."""

from collections import Counter
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from block_bodies import map_of, surface_fit
from block_starts import double_torus, torus

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.checkpoint import Checkpoints
from parameterize.config import SplineConfig
from parameterize.optimization.energy import SplineEnergy
from parameterize.optimization.phases import Polish, Schedule, Separate, Shape, Unfold
from parameterize.optimization.rounds import optimize
from parameterize.optimization.term import Weights
from parameterize.progress import History
from parameterize.spline.body import Body

SCHEDULE = Schedule((Shape(), Unfold(), Separate(), Polish(rounds=1)), rounds=6)


@cache
def torus_start():
    """A ring of four rods with few spans, and the surface's points and faces."""
    blocks, points, faces = torus(around=32, across=14)
    return map_of(blocks.with_spans((3, 3, 4))), points, faces


def optimised(start, points, faces, schedule=SCHEDULE, steps=5, **options):
    """The map, the course of the rounds, the columns of their history, and the root mean square distance."""
    fit, history = surface_fit(start, points, faces), History()
    found, course = optimize(start, fit, SplineConfig(steps=steps), schedule, history=history, **options)
    return found, course, history.arrays(), fit.mean_square(found.spline.control) ** 0.5


def demand_certified(found):
    """Demand det J > 0 everywhere, no gap, and a boundary that is proved not to meet itself."""
    body = found.spline.body
    assert isinstance(body, Body)  # whose interfaces agree bit by bit
    assert found.certificate.verdict == certify(body).verdict == "certified"
    assert found.injective is True and check_boundary(body).injective is True


def test_a_torus_of_four_rods_is_certified_and_close():
    start, points, faces = torus_start()
    found, course, columns, distance = optimised(start, points, faces)
    demand_certified(found)
    before = surface_fit(start, points, faces).mean_square(start.control) ** 0.5
    assert distance < 2e-3 < 0.02 < before
    assert (np.diff(columns["loss"][:5]) < 0.0).all()
    assert course.rounds["shape"] >= 1 and course.rounds["polish"] == 1


@pytest.mark.slow
def test_a_double_torus_with_a_junction_is_certified_and_close():
    blocks, points, faces = double_torus(cells=60)
    blocks = blocks.with_spans([(4, 4, 4 if name == "junction" else 14) for name in blocks.names])
    schedule = replace(SCHEDULE, rounds=9)
    found, _, _, distance = optimised(map_of(blocks), points, faces, schedule, steps=8)
    demand_certified(found)
    assert distance < 2e-3


def test_the_edges_of_blocks_are_drawn_out_where_the_boundary_meets_itself():
    start, points, faces = torus_start()
    energy = SplineEnergy(start.nets, surface_fit(start, points, faces), Weights())
    places = energy.surface.sliding
    far = np.roll(places.parameters, len(points) // 2, axis=0), np.roll(places.cube_faces, len(points) // 2)
    places.place(*far)
    assert energy.anchors.energy_and_gradient(start.control)[0] == 0.0
    misplaced = np.linalg.norm(energy.surface.residuals(start.control), axis=1)
    Separate().begin(SimpleNamespace(energy=energy, spline=start, near=False, number=9, rounds=Counter()))  # type: ignore[arg-type]
    assert energy.anchors.energy_and_gradient(start.control)[0] > 0.0
    assert np.linalg.norm(energy.surface.residuals(start.control), axis=1).max() < 0.2 * misplaced.max()


def test_the_number_of_threads_changes_no_bit(monkeypatch):
    found = []
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    for threads in ("1", "2"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        found.append(optimised(*torus_start(), replace(SCHEDULE, rounds=2), steps=2))
    (first, _, columns, distance), (second, _, others, again) = found
    assert np.array_equal(first.spline.control, second.spline.control)
    assert np.array_equal(columns["loss"], others["loss"]) and distance == again


def test_interrupted_between_rounds_goes_on_to_the_same_result(tmp_path):
    start, options = torus_start(), {"schedule": replace(SCHEDULE, rounds=3), "steps": 2}
    whole, course, columns, distance = optimised(*start, **options)
    assert len(columns["step"]) > 4  # more than two rounds

    def interrupt(state):
        if state.step == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        optimised(*start, progress=interrupt, checkpoints=Checkpoints(tmp_path, {}, resume=False), **options)
    resumed, again, others, same = optimised(*start, checkpoints=Checkpoints(tmp_path, {}, resume=True), **options)
    assert np.array_equal(resumed.spline.control, whole.spline.control) and same == distance
    assert np.array_equal(others["loss"], columns["loss"]) and np.array_equal(others["step"], columns["step"])
    assert (again.rounds, again.ending) == (course.rounds, course.ending)
