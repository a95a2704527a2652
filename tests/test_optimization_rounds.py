from dataclasses import replace

import numpy as np
import pytest
from shapes import rounded_cube, turned

from parameterize.certificate.certify import certify
from parameterize.checkpoint import Checkpoints
from parameterize.config import SplineConfig
from parameterize.cube.cube import project_radially
from parameterize.optimization.endings import Reason
from parameterize.optimization.energy import SplineEnergy
from parameterize.optimization.phases import RAMP, Polish, Schedule, Separate, Shape, Unfold
from parameterize.optimization.rounds import optimize
from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.spans import in_blocks
from parameterize.optimization.surface_distance import TANGENTIAL, Correspondence
from parameterize.optimization.term import RoundWeights, Weights
from parameterize.progress import History
from parameterize.quality.distortion import arap
from parameterize.spline.bspline import gauss_points, greville, open_uniform_knots
from parameterize.spline.spline_map import ControlNets, SplineMap
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.geometry import vertex_quadrics, vertex_weights
from parameterize.time_limit import limited, reserving

DESCEND = "parameterize.optimization.rounds.descend"
CONFIG = SplineConfig(control_points=7, steps=5)
SCHEDULE = Schedule((Shape(RAMP), Unfold(RAMP, far=1.0), Separate(RAMP), Polish(RAMP)), rounds=6)
KNOTS = (open_uniform_knots(7, 3),) * 3
NETS = ControlNets(3, (KNOTS,))
ALL_SPANS = in_blocks([np.indices((4, 4, 4)).reshape(3, -1).T])


def gauss_mean(volume, density, n_gauss=3):
    points, weights = zip(*(gauss_points(k, n_gauss) for k in volume.knots), strict=True)
    jacobians = volume.grid_jacobian(*(p.ravel() for p in points))
    return float(np.einsum("i,j,k,ijk->", *(w.ravel() for w in weights), density(jacobians)))


def mean_arap(volume):
    return gauss_mean(volume, arap)


def wavy_control(amplitude, seed=0):
    row = greville(KNOTS[0], 3)
    points = np.stack(np.meshgrid(row, row, row, indexing="ij"))
    return points + amplitude * np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape)


def as_volume(control):
    return BSplineVolume((3,) * 3, KNOTS, np.moveaxis(control.reshape(3, 7, 7, 7), 0, -1))


def surface_fit():
    """A rounded cube, slightly turned, whose parameters are the radial projection."""
    points, faces = rounded_cube(300, power=12.0)
    centred = points - 0.5
    vertices = turned(points)
    quadrics, weights = (
        vertex_quadrics(vertices, faces, TANGENTIAL),
        vertex_weights(vertices, faces, len(vertices)),
    )
    places = SlidingParameters(NETS, 0.5 + project_radially(centred), triangles=faces)
    return Correspondence(places, vertices, quadrics, weights)


def penalised_energy():
    energy = SplineEnergy(NETS, surface_fit(), Weights())
    energy.distortion.terms[0].penalty = RAMP[0]
    energy._round = RoundWeights(RAMP[0], Weights.surface)
    return energy


@pytest.mark.parametrize("amplitude", [0.02, 0.12])
def test_gradients_against_finite_differences(amplitude):
    control = wavy_control(amplitude).reshape(3, -1)
    energy = penalised_energy()
    energy.determinants.activate(ALL_SPANS)
    _, inner, _ = energy.volume_part(control)
    _, outer = energy.surface_part(control)
    for seed in range(3):
        direction = np.random.default_rng(seed).normal(size=control.shape)
        h = 1e-6
        moved = [
            (energy.volume_part(c)[0], energy.surface_part(c)[0])
            for c in (control + h * direction, control - h * direction)
        ]
        slopes = [(a - b) / (2.0 * h) for a, b in zip(*moved, strict=True)]
        assert float((inner * direction).sum()) == pytest.approx(slopes[0], rel=1e-4)
        assert float((outer * direction).sum()) == pytest.approx(slopes[1], rel=1e-4)


def test_newton_direction_leads_down():
    energy = penalised_energy()
    control = wavy_control(0.1, seed=3).reshape(3, -1)
    value, gradient, _ = energy.volume_part(control)
    outer, pulled = energy.surface_part(control)
    direction = energy.newton_direction(control, -(gradient + pulled))
    moved = control + direction
    assert energy.volume_part(moved)[0] + energy.surface_part(moved)[0] < 0.5 * (value + outer)


def test_the_number_of_threads_changes_no_bit(monkeypatch):
    control, found = wavy_control(0.1, seed=3).reshape(3, -1), []
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    for threads in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        energy = penalised_energy()
        energy.determinants.activate(ALL_SPANS)  # two pieces of work
        energy.slide(control)
        value, gradient, _ = energy.volume_part(control)
        outer, pulled = energy.surface_part(control)
        direction = energy.newton_direction(control, -(gradient + pulled))
        found.append((value, outer, gradient, pulled, direction, energy.surface.sliding.parameters))
    (value, outer, *arrays), (again, outer_again, *others) = found
    assert value == again and outer == outer_again
    assert all(np.array_equal(a, b) for a, b in zip(arrays, others, strict=True))


def optimise_from(control, schedule=SCHEDULE, config=CONFIG, fit=None, **options):
    """Return the map, the course of the rounds, and the columns of their history."""
    history = History()
    found, course = optimize(
        SplineMap.on_cube(3, KNOTS, control), fit or surface_fit(), config, schedule, history=history, **options
    )
    return found, course, history.arrays()


@pytest.fixture
def no_descent(monkeypatch):
    """Steps that change nothing: what is folded stays so."""
    monkeypatch.setattr("parameterize.optimization.rounds.descend", lambda energy, control, *_: control)


def test_an_easy_shape_ends_certified_with_less_distortion():
    start = wavy_control(0.08)
    fit = surface_fit()
    before = np.linalg.norm(fit.residuals(start.reshape(3, -1)), axis=1).mean()
    found, course, columns = optimise_from(start, replace(SCHEDULE, rounds=10), fit=fit)
    assert found.certificate.verdict == "certified"
    volume = as_volume(found.spline.control)
    assert certify(volume).verdict == "certified"
    assert mean_arap(volume) < 0.75 * mean_arap(as_volume(start))
    assert np.linalg.norm(fit.residuals(found.spline.control), axis=1).mean() < 0.5 * before
    first = columns["loss"][: CONFIG.steps]
    assert set(columns["stage"]) == {"spline"} and (np.diff(first) < 0.0).all()
    assert course.ending is Reason.POLISHED
    assert set(course.rounds) == set(course.seconds) >= {"shape", "polish"}


def test_a_folded_start_is_unfolded():
    start = wavy_control(0.0)
    start[:, 3, 3, 3] += np.array([1.5, 0.3, 0.1])  # the middle control point, past its neighbours
    assert certify(as_volume(start)).verdict == "folded"
    found, _, _ = optimise_from(start)
    assert found.certificate.verdict == "certified"
    assert mean_arap(as_volume(found.spline.control)) < mean_arap(as_volume(start))


def test_smoothing_bends_least_next_to_the_spans_and_moves_nothing_else():
    knots = (open_uniform_knots(14, 3),) * 3
    row = greville(knots[0], 3)
    control = np.stack(np.meshgrid(row, row, row, indexing="ij"))
    around = np.array([[0, 4, 4, 4]])
    folded = control.copy()
    folded[:, 6, 6, 6] += 0.4
    nets = ControlNets(3, (knots,))
    energy = SplineEnergy(nets, surface_fit().on_nets(nets), Weights())
    smoothed = energy.smoothed(folded.reshape(3, -1), around).reshape(folded.shape)
    assert np.allclose(smoothed, control, atol=1e-7)  # a cube bends nowhere
    folded[:, 10, 6, 6] += 0.4  # spans 3 to 5 need the points 3 to 8
    smoothed = energy.smoothed(folded.reshape(3, -1), around).reshape(folded.shape)
    moved = np.argwhere((smoothed != folded).any(axis=0))
    assert moved.min() == 3 and moved.max() == 8 and len(moved) == 6**3


def test_what_gave_way_counts_again_once_the_map_is_certified():
    start, fit = wavy_control(0.08), surface_fit()
    fit.relax(np.full(len(fit.points), 0.05))
    found, course, _ = optimise_from(start, replace(SCHEDULE, rounds=10), fit=fit)
    assert found.certificate.verdict == "certified"
    assert np.median(fit.relaxation) == 1.0
    assert course.rounds["polish"] >= 3  # 0.05 times 4 a round


def test_interrupted_between_rounds_goes_on_to_the_same_result(tmp_path):
    start, options = wavy_control(0.15, seed=1), {"config": replace(CONFIG, steps=2)}
    options["schedule"] = replace(SCHEDULE, rounds=3)
    whole, course, columns = optimise_from(start, **options)
    assert len(columns["step"]) > 4  # more than two rounds

    def interrupt(state):
        if state.step == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        optimise_from(start, progress=interrupt, checkpoints=Checkpoints(tmp_path, {}, resume=False), **options)
    resumed, again, others = optimise_from(start, checkpoints=Checkpoints(tmp_path, {}, resume=True), **options)
    assert np.array_equal(resumed.spline.control, whole.spline.control)
    assert np.array_equal(others["loss"], columns["loss"]) and np.array_equal(others["step"], columns["step"])
    assert (again.rounds, again.ending) == (course.rounds, course.ending)
    assert again.seconds.keys() == course.seconds.keys()


def test_a_folded_map_far_from_the_surface_is_given_up(no_descent):
    phases = (Shape(RAMP), Unfold(RAMP, far=0.02), Separate(RAMP), Polish(RAMP))
    found, course, _ = optimise_from(wavy_control(0.6), replace(SCHEDULE, phases=phases, rounds=9))
    assert course.ending is Reason.TOO_FAR
    assert course.rounds == {"shape": 2, "unfold": 2}
    assert found.certificate.verdict == "folded"


def test_a_map_with_too_much_folded_is_given_up(no_descent, monkeypatch):
    monkeypatch.setattr("parameterize.optimization.state.MOST_WATCHED", 10)
    _, course, _ = optimise_from(wavy_control(0.6), replace(SCHEDULE, rounds=9))
    assert course.ending is Reason.TOO_MANY_FOLDED and sum(course.rounds.values()) == 4


def test_rounds_end_where_they_unfold_no_more(no_descent):
    """The first round counts as one that halves the number of unproved spans, eight more do not."""
    _, course, _ = optimise_from(wavy_control(0.6), replace(SCHEDULE, rounds=20))
    assert course.ending is Reason.STALLED and sum(course.rounds.values()) == 9
    _, course, _ = optimise_from(wavy_control(0.6), replace(SCHEDULE, rounds=5))
    assert course.ending is Reason.OUT_OF_ROUNDS and sum(course.rounds.values()) == 5


def test_what_was_certified_is_the_result_where_the_polish_folds_more(monkeypatch):
    """Each polish folds the middle, and the next one more."""
    start, rounds = wavy_control(0.0), []

    def fold_more(energy, control, *_):
        rounds.append(1)
        folded = start.copy()
        folded[0, 1 : len(rounds), 3, 3] += 2.0
        return folded.reshape(3, -1)

    monkeypatch.setattr("parameterize.optimization.rounds.descend", fold_more)
    monkeypatch.setattr("parameterize.optimization.phases._MENDINGS", 0)
    fit = surface_fit()
    fit.relax(np.full(len(fit.points), 1e-6))  # so that the polish has something to take back
    found, course, _ = optimise_from(start, replace(SCHEDULE, rounds=12), fit=fit)
    assert found.certificate.verdict == "certified" and np.array_equal(found.spline.control, start.reshape(3, -1))
    assert course.ending is Reason.FOLDS_AGAIN and course.rounds == {"shape": 1, "polish": 2}


def test_a_time_limit_ends_the_rounds_with_the_best_map():
    start = SplineMap(NETS, wavy_control(0.0).reshape(3, -1))
    with limited(0.0) as limit:
        found, course = optimize(start, surface_fit(), CONFIG, SCHEDULE, history=History())
    assert (course.ending, sum(course.rounds.values())) == (Reason.OUT_OF_TIME, 0) and not any(found.faults)
    assert limit.cut == ["the rounds of the spline, after 0"]
    with limited(100.0), reserving(0.0, wished=100.0):  # a map without faults leaves the rest to others
        _, course = optimize(start, surface_fit(), CONFIG, SCHEDULE, history=History())
    assert (course.ending, sum(course.rounds.values())) == (Reason.OUT_OF_TIME, 0)
