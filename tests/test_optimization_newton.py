from parameterize.optimization import newton
from parameterize.optimization.newton import LEAST_STEPS, StoppingRule


def test_damping_grows_while_steps_are_cut_and_goes_once_they_are_whole():
    found, damping = [], 0.0
    for length in (1.0, 0.3, 0.2, 0.7, 1.0, 1.0, 1.0):
        damping = newton._next_damping(damping, length)
        found.append(damping)
    first, factor = newton._DAMPING, newton._DAMPING_GROWTH
    assert found == [0.0, first, factor * first, factor * first, first, 0.0, 0.0]


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
