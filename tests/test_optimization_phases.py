"""The phases of a spline stage: when each is over, and what they make of a map that a round has found."""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest
from test_optimization_rounds import surface_fit

from parameterize.optimization.endings import CertifiedMap, Course, Reason
from parameterize.optimization.energy import SplineEnergy
from parameterize.optimization.phases import Polish, Schedule, Separate, Shape, Unfold
from parameterize.optimization.state import State
from parameterize.optimization.term import Weights
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.spline_map import ControlNets, SplineMap
from parameterize.ways.growth import Grow

KNOTS = (open_uniform_knots(14, 3),) * 3
NETS = ControlNets(3, (KNOTS,))


def after(number, *, meets=False, yields=True, **given):
    """Where rounds stand, as far as phases ask."""
    usual = {
        "certified": False,
        "halved": 0,
        "many": False,
        "last_square": 0.0,
        "settled": True,
        "unproved": 0,
        "unproved_before": 0,
        "rounds": Counter(),
        "best": SimpleNamespace(meets_itself=meets),
        "energy": SimpleNamespace(yields=yields),
    }
    return SimpleNamespace(number=number, **usual | given)


GROW, SHAPE, UNFOLD = Grow(shares=(0.1, 1.0)), Shape(), Unfold(far=0.02, far_first=0.01, first=5)
SEPARATE, POLISH, ONCE = Separate(rounds=2, far=0.01), Polish(rounds=2), Counter({"polish": 1})


@pytest.mark.parametrize(
    ("phase", "state", "reason"),
    [
        (GROW, after(1), None),
        (GROW, after(2), Reason.GROWN),
        (SHAPE, after(1), None),
        (SHAPE, after(1, certified=True), Reason.CERTIFIED),
        (SHAPE, after(2), Reason.SHAPED),
        (UNFOLD, after(3, many=True, last_square=1.0), None),
        (UNFOLD, after(3, certified=True), Reason.CERTIFIED),
        (UNFOLD, after(4, many=True), Reason.TOO_MANY_FOLDED),
        (UNFOLD, after(4, last_square=0.021**2), Reason.TOO_FAR),
        (UNFOLD, after(4, last_square=0.019**2), None),
        (UNFOLD, after(5, last_square=0.019**2), Reason.TOO_FAR),
        (UNFOLD, after(10, halved=2), None),
        (UNFOLD, after(11, halved=2), Reason.STALLED),
        (SEPARATE, after(4), Reason.APART),
        (SEPARATE, after(4, meets=True), None),
        (SEPARATE, after(4, meets=True, last_square=0.011**2), Reason.DRIFTED_AWAY),
        (SEPARATE, after(6, meets=True, rounds=Counter({"separate": 2})), Reason.MEETS_ITSELF),
        (POLISH, after(4, yields=False), None),  # one round of it at least
        (POLISH, after(5, rounds=ONCE), None),
        (POLISH, after(5, rounds=ONCE, yields=False), Reason.POLISHED),
        (POLISH, after(5, rounds=ONCE, yields=False, settled=False), None),
        (POLISH, after(5, rounds=ONCE, settled=False, unproved=3), None),  # the next round may unfold it
        (POLISH, after(5, rounds=ONCE, settled=False, unproved=4, unproved_before=3), Reason.FOLDS_AGAIN),
        (POLISH, after(5, rounds=ONCE, settled=False, many=True), Reason.FOLDS_AGAIN),
        (POLISH, after(6, rounds=Counter({"polish": 2})), Reason.LESS_POLISHED),
    ],
)
def test_a_phase_says_when_it_is_over_and_why(phase, state, reason):
    assert phase.done(state) is reason


def test_every_ending_has_a_name_and_a_sentence():
    assert len({str(reason) for reason in Reason}) == len(Reason)
    assert all(reason.sentence.endswith(".") for reason in Reason)
    assert Reason("too far from the surface") is Reason.TOO_FAR
    assert [reason for reason in Reason if not reason.ends_the_rounds] == list(Reason)[:4]


def test_the_penalty_grows_by_the_rounds_of_the_stage():
    phase = Shape((1.0, 5.0))
    assert [phase.penalty(number) for number in range(3)] == [1.0, 5.0, 5.0]
    assert Schedule((GROW, UNFOLD), 9).grown == 2 and Schedule((SHAPE, UNFOLD), 9).grown == 0


def test_courses_of_one_stage_on_two_sets_of_knots_are_added():
    first = Course(Counter(shape=2), {"shape": 1.0}, Reason.OUT_OF_ROUNDS)
    later = Course(Counter(shape=1, polish=3), {"shape": 0.5, "polish": 4.0}, Reason.POLISHED)
    assert later.after(first) == Course(Counter(shape=3, polish=3), {"shape": 1.5, "polish": 4.0}, Reason.POLISHED)


def cube():
    row = greville(KNOTS[0], 3)
    return np.stack(np.meshgrid(row, row, row, indexing="ij"))


def state_of(control, fit=None, number=4):
    fit = (fit or surface_fit()).on_nets(NETS)
    parameters = fit.sliding.on_faces
    best = CertifiedMap.of(SplineMap.on_cube(3, KNOTS, control))
    state = State(SplineEnergy(NETS, fit, Weights()), best.spline, best, parameters, number=number, halved=2)
    state.best_square = fit.mean_square(best.spline.control)
    return state


def test_what_a_polish_folds_is_moved_back_there_and_nowhere_else():
    start = cube()
    better = 1.001 * start
    better[:, 2, 2, 2] += 0.4  # folds around the spans next to a corner
    state = state_of(start)
    fit = state.energy.surface
    fit.relax(np.full(len(fit.points), 0.8))
    kept = Polish().amended(state, CertifiedMap.of(SplineMap.on_cube(3, KNOTS, better)))
    assert kept.certificate.verdict == "certified"
    control = NETS.of_block(kept.spline.control, 0)
    moved_back, moved = (control == start).all(axis=0), (control == better).all(axis=0)
    assert moved_back[2, 2, 2] and moved[9:].all() and bool((moved_back | moved).all())
    near = (fit.sliding.parameters < 0.2).all(axis=1)
    assert np.all(fit.relaxation[near] == 0.2) and np.median(fit.relaxation) == 0.8  # a quarter near the fold


def test_a_polish_gives_the_data_more_weight_unless_the_map_folds_again():
    state = state_of(cube())
    fit = state.energy.surface
    fit.relax(np.full(len(fit.points), 0.1))
    Polish().begin(state)
    assert np.all(fit.relaxation == 0.4)
    state.spline = state.spline.with_control(1.001 * state.spline.control)
    Polish().begin(state)
    assert np.all(fit.relaxation == 0.4)


@pytest.mark.parametrize(("number", "smooth"), [(3, False), (4, True)])
def test_few_spans_that_stay_unproved_are_smoothed(number, smooth):
    folded = cube()
    folded[0, 6, 6, 6] += 0.33
    found = CertifiedMap.of(SplineMap.on_cube(3, KNOTS, folded))
    assert 0 < len(found.unproved) <= 10
    amended = Unfold().amended(state_of(cube(), number=number), found)
    assert (amended.certificate.verdict == "certified") == smooth and (amended is found) != smooth


def test_many_spans_are_not_smoothed(monkeypatch):
    folded = cube()
    folded[0, 6, 6, 6] += 0.33
    monkeypatch.setattr("parameterize.optimization.phases._MOST_SMOOTHED", 0)
    found = CertifiedMap.of(SplineMap.on_cube(3, KNOTS, folded))
    assert Unfold().amended(state_of(cube()), found) is found


def test_the_surface_gives_way_where_sheets_are_pushed_apart(monkeypatch):
    state = state_of(cube())
    monkeypatch.setattr(SplineEnergy, "watch_contact", lambda *_: np.array([[0, 0, 5, 5]]))
    Separate().begin(state)
    fit = state.energy.surface
    assert fit.relaxation.min() == 0.0625 and np.median(fit.relaxation) == 1.0


def test_a_certified_map_counts_by_what_is_proved_of_its_boundary():
    certified = CertifiedMap.of(SplineMap.on_cube(3, KNOTS, cube())).certificate
    apart, undecided, meets = (
        CertifiedMap(SplineMap.on_cube(3, KNOTS, cube()), certified, injective) for injective in (True, None, False)
    )
    assert apart.rank < undecided.rank < meets.rank
    assert apart.faults == undecided.faults < meets.faults
