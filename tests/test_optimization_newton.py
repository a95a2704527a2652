from dataclasses import replace

from parameterize.config import SplineConfig
from parameterize.optimization import newton

CONFIG = SplineConfig()


def test_damping_grows_while_steps_are_cut_and_goes_once_they_are_whole():
    found, damping = [], 0.0
    for length in (1.0, 0.3, 0.2, 0.7, 1.0, 1.0, 1.0):
        damping = newton._next_damping(damping, length, CONFIG)
        found.append(damping)
    first, factor = CONFIG.damping, CONFIG.damping_growth
    assert found == [0.0, first, factor * first, factor * first, first, 0.0, 0.0]


def test_the_steps_left_are_those_of_a_usual_run():
    config = replace(CONFIG, steps=60, usual_steps=(40, 30, 10))
    assert [newton._expected_steps(config, 0, step) for step in (0, 38, 39, 55)] == [79, 41, 41, 41]
    assert newton._expected_steps(config, 2, 3) == 6 and newton._expected_steps(config, 7, 0) == config.least_steps - 1
    assert newton._expected_steps(replace(config, steps=20), 0, 0) == 19 + 20 + 10
