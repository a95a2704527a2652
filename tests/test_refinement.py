from dataclasses import asdict

import numpy as np
import pytest
from shapes import rounded_cube, turned

from parameterize import refinement
from parameterize.checkpoint import Checkpoints
from parameterize.config import RefinementConfig, SplineConfig
from parameterize.cube.cube import project_radially
from parameterize.cube.cutting import subdivide_finely
from parameterize.optimization.endings import CertifiedMap, Course, Reason
from parameterize.optimization.phases import FIRM_ROUNDS, RAMP, Polish, Schedule, Separate, Shape, Unfold
from parameterize.optimization.rounds import optimize
from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.surface_distance import TANGENTIAL, Correspondence
from parameterize.optimization.term import Weights
from parameterize.progress import History, ignore
from parameterize.quality.distances import two_sided
from parameterize.refinement import refine
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.spline_map import ControlNets, SplineMap
from parameterize.surface.geometry import vertex_quadrics, vertex_weights

CONFIG = SplineConfig(control_points=6, steps=12)
SCHEDULE = Schedule((Shape(RAMP), Unfold(RAMP), Separate(RAMP), Polish(RAMP, rounds=1)), rounds=7)
KNOTS = (open_uniform_knots(6, 3),) * 3
OWN = 300


def surface_fit():
    """A rounded cube, slightly turned, whose parameters are the radial projection."""
    points, faces = subdivide_finely(*rounded_cube(OWN, power=4.0), CONFIG.longest_edge / 4.0, 9 * OWN)
    vertices = turned(points)
    places = SlidingParameters(ControlNets(3, (KNOTS,)), 0.5 + project_radially(points - 0.5), triangles=faces)
    quadrics = vertex_quadrics(vertices, faces, TANGENTIAL)
    return Correspondence(places, vertices, quadrics, vertex_weights(vertices, faces, OWN))


@pytest.fixture(scope="module", autouse=True)
def few_rounds():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(refinement, "ROUNDS", 4)
        patch.setattr(refinement, "POLISH", 1)
        yield


@pytest.fixture(scope="module")
def first():
    """A certified map, and its surface data."""
    fit, row = surface_fit(), greville(KNOTS[0], 3)
    control = np.stack(np.meshgrid(row, row, row, indexing="ij"))
    found, _ = optimize(SplineMap.on_cube(3, KNOTS, control), fit, CONFIG, SCHEDULE, history=History())
    assert not any(found.faults)
    return found, fit


def refined(first, checkpoints=None, progress=ignore, **options):
    limits = RefinementConfig(**options)
    kept = checkpoints or Checkpoints(None, {}, resume=False)
    return refine(*first, CONFIG, limits, Weights(), history=History(), progress=progress, checkpoints=kept)


def distance(found, fit):
    """Between the surface and the boundary of F, both ways, over the diagonal."""
    volume = found.spline.volume
    return two_sided(volume, fit.points, fit.sliding.triangles).summary().rms / np.linalg.norm(
        np.ptp(fit.points, axis=0)
    )


@pytest.fixture(scope="module")
def once(first, tmp_path_factory):
    """What one refinement makes of it, the options of that, and the folder of its checkpoints."""
    options, folder = {"tolerance": 0.95 * distance(*first)}, tmp_path_factory.mktemp("refined")
    return refined(first, Checkpoints(folder, {}, resume=False), **options), options, folder


def test_a_map_close_enough_stays_as_it_is(first):
    found, fit, told = refined(first, tolerance=1.0)
    assert found is first[0] and fit is first[1]
    assert told.stopped == "tolerance met" and told.dropped is None
    (level,) = told.levels
    assert level.control_points == (6, 6, 6) and level.unproved == 0
    assert level.distance == pytest.approx(distance(*first), rel=1e-12)


def test_knots_are_inserted_until_the_tolerance_is_met(first, once):
    (found, fit, told), options, _ = once
    assert told.stopped == "tolerance met" and len(told.levels) > 1
    assert told.levels[-1].distance == pytest.approx(distance(found, fit), rel=1e-12)
    assert told.levels[-1].distance <= options["tolerance"]
    assert not any(found.faults)
    assert found.spline.volume.shape == told.levels[-1].control_points > (6, 6, 6)
    assert told.levels[0].rounds == {} and sum(told.levels[1].rounds.values()) > 0
    assert told.levels[1].seconds.keys() == told.levels[1].rounds.keys() and told.levels[1].ending
    for row in fit.sliding.knots:
        assert set(KNOTS[0]) < set(row)


@pytest.mark.slow
def test_no_direction_gets_more_than_the_limit(first):
    found, fit, told = refined(first, tolerance=1e-9, max_control_points=7)
    assert told.stopped == "limit reached"
    assert max(told.levels[-1].control_points) == 7 == max(found.spline.volume.shape)
    assert not any(found.faults) and distance(found, fit) < distance(*first)


def test_the_last_certified_map_is_kept_where_a_finer_one_is_not(first, monkeypatch, caplog):
    def folded(start, *args, **options):
        pressed = start.control.copy()
        pressed[:, 0] += 0.5  # at a corner
        return CertifiedMap.of(start.with_control(pressed)), Course({}, {}, Reason.STALLED)

    monkeypatch.setattr(refinement, "optimize", folded)
    found, fit, told = refined(first, tolerance=1e-9)
    assert found is first[0] and fit is first[1]
    assert told.stopped == "no better map" and len(told.levels) == 1
    assert told.dropped.unproved > 0 and max(told.dropped.control_points) > 6
    assert "the one before is kept" in caplog.text
    assert asdict(told)["dropped"]["unproved"] == told.dropped.unproved


def test_spans_that_are_not_proved_are_halved_first(first, monkeypatch):
    """A fold is pressed into one corner: what lies there is halved, and nothing else."""
    control, seen = first[0].spline.control.copy(), []
    control[:, 0] += 0.5  # at a corner
    found = CertifiedMap.of(first[0].spline.with_control(control))
    assert set(map(tuple, found.certificate.unproved)) == {(0, 0, 0)}

    def caught(start, *args, **options):
        seen.append(start.knots)
        raise KeyboardInterrupt

    monkeypatch.setattr(refinement, "optimize", caught)
    with pytest.raises(KeyboardInterrupt):
        refined((found, first[1]), tolerance=1.0)
    for row in seen[0]:
        assert np.setdiff1d(row, KNOTS[0]).tolist() == [pytest.approx(1.0 / 6.0)]


def test_interrupted_and_resumed_is_undisturbed(first, once, tmp_path):
    steps = []

    def interrupt(state):
        steps.append(state.step)
        if steps[-1] > CONFIG.steps * (FIRM_ROUNDS + 1):  # in the second round
            raise KeyboardInterrupt

    (undisturbed, _, told), options, _ = once
    with pytest.raises(KeyboardInterrupt):
        refined(first, Checkpoints(tmp_path, {}, resume=False), interrupt, **options)
    resumed, _, again = refined(first, Checkpoints(tmp_path, {}, resume=True), **options)
    assert np.array_equal(resumed.spline.control, undisturbed.spline.control) and again == told


def test_knots_once_chosen_are_those_of_the_checkpoint(first, once, monkeypatch):
    """Another machine may round otherwise, and choose other ones, which the optimised map would not fit."""
    (_, fit, told), options, folder = once
    monkeypatch.setattr(refinement, "SHARE", 0.1)
    _, other, again = refined(first, Checkpoints(folder, {}, resume=True), **options)
    assert again == told
    assert all(np.array_equal(a, b) for a, b in zip(fit.sliding.knots, other.sliding.knots, strict=True))


def test_weights_that_gave_way_are_carried_over(first):
    fit = surface_fit()
    fit.relax(np.linspace(0.1, 1.0, len(fit.points)))
    finer = tuple(np.sort(np.append(row, 0.1)) for row in KNOTS)
    other = fit.on_nets(ControlNets(3, (finer,)))
    assert np.array_equal(other.relaxation, fit.relaxation) and np.array_equal(other.weights, fit.weights)
    assert np.array_equal(other.sliding.parameters, fit.sliding.parameters)
    assert other.sliding.knots == finer
