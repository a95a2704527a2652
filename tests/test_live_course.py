from __future__ import annotations

import pytest

from iga_nn.live.course import Course


class Clock:
    """Stands for the time."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def course(clock):
    return Course(clock)


def test_a_run_of_which_nothing_was_told_is_at_its_beginning_and_its_end_is_not_known(course, clock):
    clock.now += 30.0
    assert course.share == 0.0 and course.left is None


@pytest.mark.parametrize("every", [1.0, 7.0])
def test_the_share_is_that_of_the_time_where_the_estimate_is_right(every, course, clock):
    for second in range(80):
        if second % every == 0:
            course.tell(100.0 - second)
        assert course.share == pytest.approx(second / 100.0) and course.left == pytest.approx(100.0 - second)
        clock.now += 1.0


def test_the_share_never_falls_and_never_stands_where_a_longer_way_is_told(course, clock):
    course.tell(10.0)
    clock.now += 5.0
    assert course.share == pytest.approx(0.5)
    course.tell(20.0)  # another attempt
    assert course.share == pytest.approx(0.5) and course.left == pytest.approx(20.0)
    clock.now += 10.0
    assert course.share == pytest.approx(0.75)


def test_an_end_that_has_passed_is_not_known_and_the_share_is_not_whole(course, clock):
    course.tell(10.0)
    for second in range(40):
        assert course.share < 0.95 and (course.left is None) == (second >= 10)
        clock.now += 1.0


def test_an_estimate_that_stands_still_is_none(course, clock):
    for second in range(30):
        course.tell(9.0)
        assert (course.left is None) == (second >= 8)
        clock.now += 1.0
    for second in range(30):  # it counts down again
        course.tell(50.0 - second)
        clock.now += 1.0
    assert course.left == pytest.approx(20.0)


@pytest.mark.parametrize(("slips", "known"), [(0.4, True), (0.6, False)])
def test_an_estimate_that_falls_by_less_than_half_of_the_time_is_none(slips, known, course, clock):
    for second in range(12):
        course.tell(100.0 - (1.0 - slips) * second)
        clock.now += 1.0
    assert (course.left is not None) == known


def test_a_pause_keeps_the_share(course, clock):
    course.tell(10.0)
    clock.now += 4.0
    course.pause()
    clock.now += 100.0
    assert course.share == pytest.approx(0.4) and course.left is None
    course.tell(6.0)
    clock.now += 3.0
    assert course.share == pytest.approx(0.7)
