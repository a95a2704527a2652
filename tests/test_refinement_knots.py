import numpy as np
import pytest

from parameterize import refinement
from parameterize.refinement import halved_where_most, totals_along
from parameterize.spline.bspline import breakpoints, open_uniform_knots
from parameterize.spline.interface import Interface
from parameterize.spline.spline_map import ControlNets

KNOTS = tuple(open_uniform_knots(n, 3) for n in (7, 6, 5))  # 4, 3 and 2 spans
COUNTS = (7, 6, 5)


@pytest.fixture(autouse=True)
def no_limits(monkeypatch):
    monkeypatch.setattr(refinement, "SHARE", 1.0)
    monkeypatch.setattr(refinement, "GROWTH", 100.0)


def halved(amounts, most=60, narrowest=0.0):
    (found,) = halved_where_most(ControlNets(3, (KNOTS,)), amounts, most, np.full((1, 3), narrowest))
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


def rods(*interfaces):
    """Two blocks of 3 x 2 x 4 and 2 x 3 x 1 spans; u of the one and v of the other are one along their interface."""
    counts = ((6, 5, 7), (5, 6, 4))
    return ControlNets(3, tuple(tuple(open_uniform_knots(n, 3) for n in row) for row in counts), interfaces)


def test_spans_of_glued_blocks_are_halved_together_and_count_together(monkeypatch):
    """The first span of u continues in the last span of v, as the faces lie on each other swapped and flipped."""
    monkeypatch.setattr(refinement, "SHARE", 0.5)
    nets = rods(Interface((0, "w1"), (1, "w0"), swapped=True, flipped=(True, False)))
    amounts = [np.zeros(n) for n in (3, 2, 4, 2, 3, 1)]
    amounts[0][0], amounts[4][2], amounts[2][1] = 2.0, 2.0, 3.0
    one, other = halved_where_most(nets, amounts, 60, np.zeros((2, 3)))
    new = [np.setdiff1d(finer, row) for finer, row in zip((*one, *other), sum(nets.knots, ()), strict=True)]
    assert [len(row) for row in new] == [1, 0, 0, 0, 1, 0]
    assert new[0][0] == pytest.approx(1 / 6) and new[4][0] == pytest.approx(5 / 6)


def test_tied_spans_stay_where_one_of_them_would_exceed_the_limit_or_be_too_narrow():
    nets = rods(Interface((0, "w1"), (1, "w0"), swapped=True))
    amounts = [np.array([1.0, 0.0, 0.0]), *(np.zeros(n) for n in (2, 4, 2, 3, 1))]
    for most, narrowest in ((5, np.zeros((2, 3))), (60, np.array([[0.0, 0.0, 0.0], [0.0, 0.2, 0.0]]))):
        found = halved_where_most(nets, amounts, most, narrowest)
        assert [len(row) for rows in found for row in rows] == [len(row) for rows in nets.knots for row in rows]
    found = halved_where_most(nets, amounts, 7, np.full((2, 3), 0.15))
    assert [len(row) - 4 for rows in found for row in rows] == [7, 5, 7, 5, 7, 4]
