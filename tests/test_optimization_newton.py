from parameterize.optimization import newton
from parameterize.optimization.newton import LEAST_STEPS, StoppingRule
from parameterize.optimization.phases import Schedule
from parameterize.optimization.rounds import _StepReport


def test_damping_grows_while_steps_are_cut_and_goes_once_they_are_whole():
    found, damping = [], 0.0
    for length in (1.0, 0.3, 0.2, 0.7, 1.0, 1.0, 1.0):
        damping = newton._next_damping(damping, length)
        found.append(damping)
    first, factor = newton._DAMPING, newton._DAMPING_GROWTH
    assert found == [0.0, first, factor * first, factor * first, first, 0.0, 0.0]


def expected(number, step, most=60):
    report = _StepReport(number, most, Schedule((), 9, usual_steps=(40, 30, 10)), None, None)
    report.step = step
    return report._expected_steps()


def test_the_steps_left_are_those_of_a_usual_run():
    assert [expected(0, step) for step in (0, 38, 39, 55)] == [79, 41, 41, 41]
    assert expected(2, 3) == 6 and expected(7, 0) == LEAST_STEPS - 1
    assert expected(0, 0, most=20) == 19 + 20 + 10


def steps_until_the_end(rule, gains):
    """How many steps a rule allows that lower the energy, 1 to begin with, by such shares of it."""
    energy = 1.0
    for number, gain in enumerate(gains, start=1):
        before, energy = energy, energy * (1.0 - gain)
        if rule.ends(before, energy, energy):
            return number
    return None


def test_a_round_does_not_end_on_one_small_gain():
    assert steps_until_the_end(StoppingRule(60, gain=0.01), [0.1] * 6 + [0.001, 0.1, 0.001, 0.1] * 9) is None
    assert steps_until_the_end(StoppingRule(60, gain=0.01), [0.1] * 6 + [0.001, 0.001, 0.1]) == 8


def test_a_round_has_some_steps_at_least_and_others_at_most():
    assert steps_until_the_end(StoppingRule(60, gain=0.01), [0.0] * 20) == LEAST_STEPS
    assert steps_until_the_end(StoppingRule(9, gain=0.01), [0.1] * 20) == 9


def test_a_round_ends_where_the_energy_goes_up_and_down():
    assert steps_until_the_end(StoppingRule(60, gain=0.01), [0.1, -0.2, 0.1, -0.2, 0.1, -0.2, 0.1, -0.2, 0.1]) == 7
