import numpy as np
import pytest

from parameterize import refinement
from parameterize.refinement import halved_where_most, totals_along
from parameterize.spline.bspline import breakpoints, open_uniform_knots

KNOTS = tuple(open_uniform_knots(n, 3) for n in (7, 6, 5))  # 4, 3 and 2 spans
COUNTS = np.array([7, 6, 5])


@pytest.fixture(autouse=True)
def no_limits(monkeypatch):
    monkeypatch.setattr(refinement, "SHARE", 1.0)
    monkeypatch.setattr(refinement, "GROWTH", 100.0)


def halved(amounts, most=60, narrowest=0.0):
    found = halved_where_most(KNOTS, amounts, COUNTS, most, narrowest)
    return [np.setdiff1d(finer, row).tolist() for finer, row in zip(found, KNOTS, strict=True)]


def test_amounts_are_summed_over_the_spans_of_each_direction():
    places = np.array([[0.0, 0.5, 1.0], [0.3, 0.5, 1.0], [1.0, 0.1, 0.4]])
    u, v, w = totals_along(places, np.array([1.0, 2.0, 4.0]), KNOTS)
    assert u.tolist() == [1.0, 2.0, 0.0, 4.0] and v.tolist() == [4.0, 3.0, 0.0] and w.tolist() == [4.0, 3.0]


@pytest.mark.parametrize(
    ("share", "where"),
    [(0.5, [[0.375], [], []]), (0.8, [[0.375, 0.875], [], []]), (0.9, [[0.375, 0.875], [pytest.approx(5 / 6)], []])],
)
def test_spans_are_halved_where_most_is_found_each_direction_its_own(monkeypatch, share, where):
    monkeypatch.setattr(refinement, "SHARE", share)
    assert halved((np.array([0.0, 5.0, 0.0, 3.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0]))) == where


def test_no_direction_gets_more_than_the_limit_and_the_others_go_on():
    amounts = np.array([4.0, 5.0, 3.0, 3.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0])
    assert halved(amounts, most=8) == [[0.375], [pytest.approx(5.0 / 6.0)], [0.25]]
    assert halved(amounts, most=7) == [[], [pytest.approx(5.0 / 6.0)], [0.25]]
    assert halved(amounts, most=5) == [[], [], []]


def test_one_refinement_grows_no_further_than_asked(monkeypatch):
    monkeypatch.setattr(refinement, "GROWTH", 1.5)
    amounts = tuple(np.ones(len(breakpoints(row)) - 1) for row in KNOTS)
    counts = [n + len(new) for n, new in zip(COUNTS, halved(amounts), strict=True)]
    assert 7 * 6 * 5 < np.prod(counts) <= 1.5 * 7 * 6 * 5


def test_narrow_spans_are_not_halved():
    amounts = tuple(np.ones(len(breakpoints(row)) - 1) for row in KNOTS)  # spans of 1/4, 1/3 and 1/2
    assert [len(new) for new in halved(amounts, narrowest=0.15)] == [0, 3, 2]


def test_nothing_found_means_nothing_halved():
    assert halved((np.zeros(4), np.zeros(3), np.zeros(2))) == [[], [], []]
