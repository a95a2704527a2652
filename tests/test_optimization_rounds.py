from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from shapes import rounded_cube, turned

from parameterize.certificate.jacobian import certify
from parameterize.checkpoint import Checkpoints
from parameterize.config import SplineConfig
from parameterize.cube.cube import project_radially
from parameterize.optimization.determinant_penalty import SpanBarrier
from parameterize.optimization.distortion import DistortionEnergy
from parameterize.optimization.energy import SplineEnergy
from parameterize.optimization.rounds import Optimized, optimize
from parameterize.optimization.sliding import SlidingParameters
from parameterize.optimization.surface_distance import SurfaceFit
from parameterize.progress import History
from parameterize.quality.quality import arap
from parameterize.spline.bspline import gauss_points, greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.geometry import vertex_quadrics, vertex_weights

DESCEND = "parameterize.optimization.rounds.descend"
CONFIG = SplineConfig(control_points=7, steps=5, penalties=(20.0, 100.0, 500.0, 2500.0), rounds=6, far=1.0)
KNOTS = (open_uniform_knots(7, 3),) * 3


def wavy_control(amplitude, seed=0):
    row = greville(KNOTS[0], 3)
    points = np.stack(np.meshgrid(row, row, row, indexing="ij"))
    return points + amplitude * np.random.default_rng(seed).uniform(-1.0, 1.0, points.shape)


def as_volume(control):
    return BSplineVolume((3,) * 3, KNOTS, np.moveaxis(control, 0, -1))


def surface_fit():
    """A rounded cube, slightly turned, whose parameters are the radial projection."""
    points, faces = rounded_cube(300, power=12.0)
    centred = points - 0.5
    vertices = turned(points)
    quadrics, weights = (
        vertex_quadrics(vertices, faces, CONFIG.tangential),
        vertex_weights(vertices, faces, len(vertices)),
    )
    return SurfaceFit(SlidingParameters(KNOTS, 3, 0.5 + project_radially(centred), faces), vertices, quadrics, weights)


def gauss_mean(volume, density, n_gauss=CONFIG.gauss):
    points, weights = zip(*(gauss_points(k, n_gauss) for k in volume.knots), strict=True)
    jacobians = volume.grid_jacobian(*(p.ravel() for p in points))
    return float(np.einsum("i,j,k,ijk->", *(w.ravel() for w in weights), density(jacobians)))


def mean_arap(volume):
    return gauss_mean(volume, arap)


def test_distortion_is_the_quadrature_of_the_arap_energy():
    control = wavy_control(0.02)
    config = replace(CONFIG, inner_gauss=CONFIG.gauss)
    energy, _, folded = DistortionEnergy(KNOTS, config).energy_and_gradient(control, penalty=0.0)
    assert energy == pytest.approx(mean_arap(as_volume(control)), rel=1e-9)
    assert folded == 0


def test_folded_points_are_counted():
    control = wavy_control(0.0)
    control[0] *= -1.0
    _, _, folded = DistortionEnergy(KNOTS, CONFIG).energy_and_gradient(control, penalty=1.0)
    assert folded == (2 * CONFIG.gauss + 2 * CONFIG.inner_gauss) ** 3  # four spans a direction


def dumbbell():
    """Control points of a map on 20 spans a direction, 5 times thinner where w is near 1/2, and its knots."""
    knots = (open_uniform_knots(23, 3),) * 3
    points = np.stack(np.meshgrid(*(greville(row, 3) for row in knots), indexing="ij"))
    points[:2] *= np.where(np.abs(points[2] - 0.5) < 0.3, 0.2, 1.0)
    return points, knots


def test_less_det_is_asked_for_where_a_part_is_far_thinner():
    control, knots = dumbbell()
    config = replace(CONFIG, least_floor=0.05, gauss=1, inner_gauss=1)
    distortion = DistortionEnergy(knots, config)
    before = [distortion.energy_and_gradient(control, penalty)[0] for penalty in (0.0, 1.0)]
    shares = distortion.lower_floors(control)
    assert shares[..., [0, -1]] == pytest.approx(1.0)
    assert shares[..., 8:12] == pytest.approx(0.5 * 0.2**2 / config.min_det)
    volume = BSplineVolume((3,) * 3, knots, np.moveaxis(control, 0, -1))
    det = np.linalg.det(volume.grid_jacobian(*[0.025 + 0.05 * np.arange(20)] * 3))
    after = [distortion.energy_and_gradient(control, penalty)[0] for penalty in (0.0, 1.0)]
    assert before[0] == after[0]
    for share, (plain, penalised) in ((1.0, before), (shares, after)):
        short = np.maximum(share * config.min_det - det, 0.0) / share
        assert penalised - plain == pytest.approx(float((short**2).mean()), rel=1e-9)
    assert after[1] - after[0] < 0.3 * (before[1] - before[0])


def test_floors_that_are_lowered_keep_the_gradient_true():
    control, knots = dumbbell()
    control = 0.7 * control + 0.01 * np.random.default_rng(0).normal(size=control.shape)
    distortion = DistortionEnergy(knots, replace(CONFIG, least_floor=0.05))
    barrier = SpanBarrier(knots, 3, 0.1)
    barrier.activate(np.argwhere(np.ones((20, 20, 20))))
    barrier.lower_floors(distortion.lower_floors(control))
    direction = np.random.default_rng(1).normal(size=control.shape)

    def energies(c):
        return np.array([distortion.energy_and_gradient(c, 1e3)[0], barrier.energy_and_gradient(c)[0]])

    found = (energies(control + 1e-7 * direction) - energies(control - 1e-7 * direction)) / 2e-7
    gradients = distortion.energy_and_gradient(control, 1e3)[1], barrier.energy_and_gradient(control)[1]
    assert [float((g * direction).sum()) for g in gradients] == pytest.approx(found.tolist(), rel=1e-4)


@pytest.mark.parametrize("amplitude", [0.02, 0.12])
def test_gradients_against_finite_differences(amplitude):
    control = wavy_control(amplitude)
    energy = SplineEnergy(CONFIG, KNOTS, surface_fit())
    energy.barrier.activate(np.indices((4, 4, 4)).reshape(3, -1).T)
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


@pytest.mark.parametrize("limit", [100.0, 0.3])  # nothing above it; most points above it
def test_curvature_is_the_second_derivative_where_the_map_stretches(limit):
    distortion = DistortionEnergy(KNOTS, replace(CONFIG, arap_limit=limit))
    control, step = 1.6 * wavy_control(0.02), wavy_control(0.5, seed=4) - wavy_control(0.0)
    ahead, behind = (distortion.energy_and_gradient(control + s * 1e-5 * step, 0.0)[1] for s in (1.0, -1.0))
    expected = (ahead - behind) / 2e-5
    found = distortion.curvature(control, 0.0)(step.astype(np.float32)).astype(np.float64)
    assert np.linalg.norm(found - expected) < 1e-3 * np.linalg.norm(expected)


def test_curvature_stays_positive_where_the_energy_bends_down():
    distortion, control = DistortionEnergy(KNOTS, CONFIG), 0.4 * wavy_control(0.05)
    for seed in range(5):
        step = (wavy_control(0.5, seed) - wavy_control(0.0)).astype(np.float32)
        assert float((step * distortion.curvature(control, 20.0)(step)).sum()) > 0.0


def test_newton_direction_leads_down():
    energy = SplineEnergy(CONFIG, KNOTS, surface_fit())
    control = wavy_control(0.1, seed=3)
    value, gradient, _ = energy.volume_part(control)
    outer, pulled = energy.surface_part(control)
    direction = energy.newton_direction(control, -(gradient + pulled))
    moved = control + direction
    assert energy.volume_part(moved)[0] + energy.surface_part(moved)[0] < 0.5 * (value + outer)


def test_damping_costs_the_squared_change_of_the_jacobian():
    identity = wavy_control(0.0)
    distortion = DistortionEnergy(KNOTS, replace(CONFIG, inner_gauss=CONFIG.gauss))
    step = (wavy_control(0.5, seed=2) - identity).astype(np.float32)
    damped, free = (float((step * distortion.curvature(identity, 0.0, damping)(step)).sum()) for damping in (3.0, 0.0))
    change = gauss_mean(as_volume(step.astype(np.float64)), lambda jacobians: (jacobians**2).sum(axis=(-2, -1)))
    assert damped - free == pytest.approx(2.0 * 3.0 * change, rel=1e-4)


def test_a_round_does_not_end_on_one_small_gain():
    steps = []
    for small_gains in (1, 2):
        history, config = History(), replace(CONFIG, rounds=1, steps=12, least_steps=3, first_gain=0.5)
        optimize(wavy_control(0.0), KNOTS, surface_fit(), replace(config, small_gains=small_gains), history=history)
        steps.append(len(history.rows))
    assert steps[0] < steps[1]


def test_a_polish_that_folds_is_mended_before_more_is_taken_back(monkeypatch):
    certified = certify(as_volume(wavy_control(0.0)))
    folded = replace(certified, verdict="folded", unproved=np.array([[1, 1, 1]]))
    answers, taken_back = iter([certified, certified, folded, certified, certified]), []
    monkeypatch.setattr(Optimized, "of", lambda control, *_: Optimized(control, next(answers), True))
    original = SplineEnergy.take_back
    monkeypatch.setattr(SplineEnergy, "take_back", lambda *given: (taken_back.append(1), original(*given)))
    control, fit = wavy_control(0.0), surface_fit()
    fit.give_way(np.full(len(fit.points), 0.1))
    steps = iter(range(1, 9))
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: control + 1e-6 * next(steps))
    optimize(control, KNOTS, fit, replace(CONFIG, rounds=9, mendings=0), history=History())
    assert len(taken_back) == 2 and np.all(fit.yielding == 1.0)  # 0.1, 0.4, folded, 1


def test_what_a_polish_folds_is_moved_back_there_and_nowhere_else(monkeypatch):
    knots = (open_uniform_knots(14, 3),) * 3
    row = greville(knots[0], 3)
    start = np.stack(np.meshgrid(row, row, row, indexing="ij"))
    better = 1.001 * start
    better[:, 2, 2, 2] += 0.4  # folds around the spans next to a corner
    monkeypatch.setattr(DESCEND, lambda energy, control, number, **_: better if number == 1 else control)
    fit = surface_fit().on_knots(knots)
    fit.give_way(np.full(len(fit.points), 0.2))
    kept = optimize(start, knots, fit, replace(CONFIG, rounds=2), history=History())
    assert kept.certificate.verdict == "certified"
    moved_back, moved = (kept.control == start).all(axis=0), (kept.control == better).all(axis=0)
    assert moved_back[2, 2, 2] and moved[9:].all() and bool((moved_back | moved).all())
    near = (fit.places.parameters < 0.2).all(axis=1)
    assert np.all(fit.yielding[near] == 0.2) and np.median(fit.yielding) == 0.8  # 0.2 times 4, near the fold a quarter


@pytest.mark.parametrize(("counts", "rounds"), [((9, 8, 7, 6, 5), 4), ((9, 8, 4, 4, 3), 5)])
def test_rounds_end_where_they_unfold_no_more(monkeypatch, counts, rounds):
    folded = replace(certify(as_volume(wavy_control(0.0))), verdict="folded")
    unproved = iter([np.ones((k, 3), dtype=np.int64) for k in (20, *counts)])
    monkeypatch.setattr(
        Optimized, "of", lambda control, *_: Optimized(control, replace(folded, unproved=next(unproved)), None)
    )
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: control)
    config = replace(CONFIG, rounds=5, firm_rounds=1, stalling=3, most_smoothed=0)
    optimize(wavy_control(0.0), KNOTS, surface_fit(), config, history=History())
    assert len(list(unproved)) == 5 - rounds


@pytest.mark.parametrize(("far", "rounds"), [(0.02, 2), (10.0, 5)])
def test_rounds_end_where_what_is_folded_is_far_from_the_surface(monkeypatch, far, rounds):
    certificate = replace(certify(as_volume(wavy_control(0.0))), verdict="folded", unproved=np.ones((20, 3), dtype=int))
    monkeypatch.setattr(Optimized, "of", lambda control, *_: Optimized(control, certificate, None))
    ended = []
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: ended.append(1) or control + 0.1)
    optimize(
        wavy_control(0.0), KNOTS, surface_fit(), replace(CONFIG, rounds=5, firm_rounds=2, far=far), history=History()
    )
    assert len(ended) == rounds


def test_rounds_go_on_where_smoothing_alone_leads_away(monkeypatch):
    """What the steps have reached counts: the rounds after it lead back to the surface."""
    certificate = replace(certify(as_volume(wavy_control(0.0))), verdict="folded", unproved=np.ones((2, 3), dtype=int))
    monkeypatch.setattr(Optimized, "of", lambda control, *_: Optimized(control, certificate, None))
    monkeypatch.setattr(
        "parameterize.optimization.rounds._Rounds._smoothed",
        lambda _, found: replace(found, control=found.control + 10.0),
    )
    monkeypatch.setattr(DESCEND, lambda energy, control, number, **_: wavy_control(0.0))
    ended = []
    monkeypatch.setattr(SplineEnergy, "start_round", lambda *_: ended.append(1))
    optimize(
        wavy_control(0.0), KNOTS, surface_fit(), replace(CONFIG, rounds=4, firm_rounds=1, far=0.5), history=History()
    )
    assert len(ended) == 4


def test_the_number_of_threads_changes_no_bit(monkeypatch):
    control, found = wavy_control(0.1, seed=3), []
    monkeypatch.delenv("NUMBA_NUM_THREADS", raising=False)
    for threads in ("1", "3"):
        monkeypatch.setenv("OMP_NUM_THREADS", threads)
        energy = SplineEnergy(CONFIG, KNOTS, surface_fit())
        energy.barrier.activate(np.indices((4, 4, 4)).reshape(3, -1).T)  # two pieces of work
        energy.slide(control)
        value, gradient, _ = energy.volume_part(control)
        outer, pulled = energy.surface_part(control)
        direction = energy.newton_direction(control, -(gradient + pulled))
        found.append((value, outer, gradient, pulled, direction, energy.surface.places.parameters))
    (value, outer, *arrays), (again, outer_again, *others) = found
    assert value == again and outer == outer_again
    assert all(np.array_equal(a, b) for a, b in zip(arrays, others, strict=True))


def optimise_from(control, config=CONFIG, **options):
    history = History()
    return optimize(control, KNOTS, surface_fit(), config, history=history, **options), history.arrays()


def test_an_easy_shape_ends_certified_with_less_distortion():
    start = wavy_control(0.08)
    fit = surface_fit()
    before = np.linalg.norm(fit.residuals(start), axis=1).mean()
    history = History()
    found = optimize(start, KNOTS, fit, CONFIG, history=history)
    assert found.certificate.verdict == "certified"
    volume = as_volume(found.control)
    assert certify(volume).verdict == "certified"
    assert mean_arap(volume) < 0.75 * mean_arap(as_volume(start))
    assert np.linalg.norm(fit.residuals(found.control), axis=1).mean() < 0.5 * before
    first = history.arrays()["loss"][: CONFIG.steps]
    assert set(history.arrays()["stage"]) == {"spline"} and (np.diff(first) < 0.0).all()


def test_a_folded_start_is_unfolded():
    start = wavy_control(0.0)
    start[:, 3, 3, 3] += np.array([1.5, 0.3, 0.1])  # the middle control point, past its neighbours
    assert certify(as_volume(start)).verdict == "folded"
    found, _ = optimise_from(start)
    assert found.certificate.verdict == "certified"
    assert mean_arap(as_volume(found.control)) < mean_arap(as_volume(start))


def test_smoothing_bends_least_next_to_the_spans_and_moves_nothing_else():
    knots = (open_uniform_knots(14, 3),) * 3
    row = greville(knots[0], 3)
    control = np.stack(np.meshgrid(row, row, row, indexing="ij"))
    folded = control.copy()
    folded[:, 6, 6, 6] += 0.4
    energy = SplineEnergy(CONFIG, knots, surface_fit())
    assert np.allclose(energy.smoothed(folded, np.array([[4, 4, 4]])), control, atol=1e-7)  # a cube bends nowhere
    folded[:, 10, 6, 6] += 0.4  # spans 3 to 5 need the points 3 to 8
    smoothed = energy.smoothed(folded, np.array([[4, 4, 4]]))
    moved = np.argwhere((smoothed != folded).any(axis=0))
    assert moved.min() == 3 and moved.max() == 8 and len(moved) == 6**3


@pytest.mark.parametrize(("left", "most"), [(0, 2), (1, 2), (2, 2), (0, 1)])
def test_spans_that_stay_unproved_are_smoothed_where_fewer_are_left_then(monkeypatch, left, most):
    certified = certify(as_volume(wavy_control(0.0)))
    folded = [replace(certified, verdict="folded", unproved=np.ones((k, 3), dtype=np.int64)) for k in range(3)]
    proofs = [certified, *folded[1:]]
    smooth = wavy_control(0.1)
    monkeypatch.setattr(
        Optimized, "of", lambda x, *_: Optimized(x, proofs[left if np.array_equal(x, smooth) else 2], None)
    )
    monkeypatch.setattr(SplineEnergy, "smoothed", lambda *_: smooth)
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: control)
    start, config = wavy_control(0.0), replace(CONFIG, rounds=3, firm_rounds=2, smoothing_rounds=1, most_smoothed=most)
    kept = optimize(start, KNOTS, surface_fit(), config, history=History())
    assert np.array_equal(kept.control, smooth if left < 2 <= most else start)


@pytest.mark.parametrize(("most", "rounds"), [(0, 3), (1000, 5)])
def test_a_try_with_too_much_folded_is_given_up(monkeypatch, most, rounds):
    """Nothing is mended here; where single spans cannot be watched, the try ends once the surface would give way."""
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: control)
    checkpoints, saved = Checkpoints(None, {}, resume=False), []
    monkeypatch.setattr(checkpoints, "save", lambda *state: saved.append(state))
    config = replace(CONFIG, rounds=5, firm_rounds=3, most_watched=most)
    optimize(wavy_control(0.6), KNOTS, surface_fit(), config, history=History(), checkpoints=checkpoints)
    assert len(saved) == rounds and saved[-1][2]["lost"] == (most == 0)


def test_what_gave_way_counts_again_once_the_map_is_certified():
    start, fit, history = wavy_control(0.08), surface_fit(), History()
    fit.give_way(np.full(len(fit.points), 0.05))
    found = optimize(start, KNOTS, fit, replace(CONFIG, rounds=10, polish=8), history=history)
    assert found.certificate.verdict == "certified"
    assert np.median(fit.yielding) == 1.0
    assert history.arrays()["step"].max() >= 3 * CONFIG.steps  # rounds after the certificate: 0.05 times 4 a round


@pytest.mark.parametrize(
    ("counts", "rounds"),
    [([0, 0, 3, 1, 4, 9, 20], 5), ([0, 2, 2, 1, 0, 0, 0], 7), ([0, 3, 4, 0, 0, 0, 0], 3), ([0, 12, 1, 0, 0, 0, 0], 2)],
    ids=["worse and worse", "recovers", "worse once", "too many at once"],
)
def test_what_was_certified_is_the_result_where_further_rounds_fold_more(monkeypatch, counts, rounds):
    """With at most ten spans watched. Numbers of unproved spans after each round; the first is certified."""
    proved, steps, seen = certify(as_volume(wavy_control(0.0))), count(1), []
    answers = iter([0, *counts])  # the first is asked of the start

    def found(control, *_):
        left = next(answers)
        seen.append(
            Optimized(control, replace(proved, unproved=np.tile([1, 1, 1], (left, 1))) if left else proved, True)
        )
        return seen[-1]

    monkeypatch.setattr(Optimized, "of", found)
    monkeypatch.setattr("parameterize.optimization.rounds._Rounds._mended", lambda _, found: found)
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: control + 1e-6 * next(steps))
    fit = surface_fit()
    fit.give_way(np.full(len(fit.points), 1e-6))  # so that the polish has something to take back
    config = replace(CONFIG, rounds=12, polish=6, most_watched=10)
    kept = optimize(wavy_control(0.0), KNOTS, fit, config, history=History())
    assert len(seen) == 1 + rounds
    assert kept is [one for one, left in zip(seen[1:], counts, strict=False) if left == 0][-1]


def test_interrupted_between_rounds_goes_on_to_the_same_result(tmp_path):
    start = wavy_control(0.15, seed=1)
    config = replace(CONFIG, steps=2, rounds=3)
    whole, columns = optimise_from(start, config)
    assert len(columns["step"]) > 2 * config.steps  # more than two rounds

    def interrupt(state):
        if state.step == 2 * config.steps - 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        optimise_from(start, config, progress=interrupt, checkpoints=Checkpoints(tmp_path, {}, resume=False))
    resumed, again = optimise_from(start, config, checkpoints=Checkpoints(tmp_path, {}, resume=True))
    assert np.array_equal(resumed.control, whole.control)
    assert np.array_equal(again["loss"], columns["loss"]) and np.array_equal(again["step"], columns["step"])


def test_a_map_whose_boundary_is_decided_is_kept(monkeypatch):
    """Of certified maps that do not meet themselves the last one counts of which that is proved."""
    config, steps, seen = replace(CONFIG, rounds=10, polish=3), count(1), []
    answers = iter([True, True, True, None])  # of the start, the first round, and the rounds of polish
    proved = certify(as_volume(wavy_control(0.0)))

    def found(control, *_):
        seen.append(Optimized(control, proved, next(answers, None)))
        return seen[-1]

    monkeypatch.setattr(Optimized, "of", found)
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: control + 1e-6 * next(steps))
    fit = surface_fit()
    fit.give_way(np.full(len(fit.points), 1e-6))  # so that the polish has something to take back
    kept = optimize(wavy_control(0.0), KNOTS, fit, config, history=History())
    assert kept is seen[2] and seen[-1].injective is None


@pytest.mark.parametrize(
    ("meets", "parted", "rounds"),
    [([True, True, False], 1.0, 7), ([False], 0.0, 2), ([True] * 9, 1.0, 3), ([True] * 9, 0.0, 1)],
)
def test_a_boundary_that_meets_itself_is_pushed_apart_before_the_polish(monkeypatch, meets, parted, rounds):
    """One round at least, one of polish; between them those that part the boundary, two at most.

    These let the surface give way by 1/16 each, which four rounds of polish take back. Where it still meets itself
    then, or is farther than `parted` from the surface, there is nothing to polish.
    """
    config = replace(CONFIG, rounds=10, parting=2, parted=parted)
    contacts, taken_back = [], []
    answers = iter([False, *meets])  # the first is asked of the start
    proved = certify(as_volume(wavy_control(0.0)))
    monkeypatch.setattr(Optimized, "of", lambda control, *_: Optimized(control, proved, not next(answers, False)))
    monkeypatch.setattr(DESCEND, lambda energy, control, *_, **__: control)
    monkeypatch.setattr(SplineEnergy, "watch_contact", lambda *_: contacts.append(1) or np.array([[0, 1, 1]]))
    original = SplineEnergy.take_back
    monkeypatch.setattr(SplineEnergy, "take_back", lambda *given: (taken_back.append(1), original(*given)))
    checkpoints = Checkpoints(None, {}, resume=False)
    saved = []
    monkeypatch.setattr(checkpoints, "save", lambda *state: saved.append(state))
    fit = surface_fit()
    optimize(wavy_control(0.0), KNOTS, fit, config, history=History(), checkpoints=checkpoints)
    assert len(saved) == rounds
    polished = meets[-1] is False
    assert len(taken_back) == (rounds - 1 - sum(meets) if polished else 0)
    assert len(contacts) == (rounds - 1 if meets[0] else 0)  # of all rounds after the first: sheets must stay apart
    assert np.all(fit.yielding == 1.0) == (polished or rounds == 1)
