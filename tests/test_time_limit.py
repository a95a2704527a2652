"""How a stage asks for the time that is left, what others reserve of it, and what ends it."""

import math
import time

import pytest

from parameterize.time_limit import OutOfTime, check_time, limited, present_limit, reserving, seconds_left
from parameterize.time_limit import seconds_to_spare as to_spare


def test_without_a_limit_any_time_is_left():
    with limited(None), reserving(5.0):
        check_time()
        assert seconds_left() == to_spare() == math.inf and present_limit() is None


def test_a_stage_ends_where_others_need_the_rest():
    with limited(10.0):
        assert 9.0 < seconds_left() <= 10.0
        with reserving(4.0, 8.0):
            assert 5.0 < seconds_left() <= 6.0 and 1.0 < to_spare() <= 2.0
        with reserving(11.0), pytest.raises(OutOfTime, match="time limit of 10 s is reached"):
            check_time()
        check_time()
    assert present_limit() is None


def test_an_interruption_by_the_clock_is_one():
    with pytest.raises(KeyboardInterrupt), limited(1e-3):
        time.sleep(2e-3)
        check_time()
