"""Which start follows those that were tried, and which of their maps is the result."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import Mock, PropertyMock

import pytest
from small_run import small_surface, tiny_config

from parameterize import attempts
from parameterize.attempts import BLOCKS, GROWTH, LAST, NETWORK, SHARP, STARTS, STIFF, next_start, starts_of
from parameterize.layouts.rods.along_skeleton import LayoutError
from parameterize.optimization.endings import Course, Reason
from parameterize.run import parameterize
from parameterize.starts.start import Attempt, Start
from parameterize.starts.tried import Tried, best_of

FAR, NEAR = 2.0 * GROWTH.far, 0.5 * GROWTH.far


def tried(start, unproved=0, *, meets=False, distance=NEAR, back=NEAR):
    """A start that was tried and the map that it has made, of which so much is proved."""
    faults = (unproved, meets)
    found = SimpleNamespace(
        faults=faults, rank=(*faults, False), meets_itself=meets, spline=SimpleNamespace(control=None)
    )
    fit = SimpleNamespace(mean_square=lambda _: distance**2)
    attempt = Attempt(found, Course({}, {}, Reason.STALLED), fit, None)
    vars(attempt)["distance_back"] = back
    return Tried(start, attempt, {})


HARD = Tried(NETWORK, None, {"train": 1.0})
FOLDED, CROSSED = tried(NETWORK, 3), tried(NETWORK, meets=True)


@pytest.mark.parametrize(
    ("before", "following"),
    [
        ((), NETWORK),
        ((tried(NETWORK),), None),
        ((tried(NETWORK, distance=FAR),), None),
        ((HARD,), GROWTH),
        ((FOLDED,), GROWTH),
        ((CROSSED,), GROWTH),
        ((HARD, tried(GROWTH)), None),
        ((FOLDED, tried(GROWTH, 1)), STIFF),
        ((FOLDED, tried(GROWTH, 1, distance=FAR)), STIFF),
        ((FOLDED, tried(GROWTH, meets=True)), STIFF),
        ((HARD, tried(GROWTH, distance=FAR)), STIFF),
        ((HARD, tried(GROWTH, distance=FAR), tried(STIFF, 1)), None),
        ((FOLDED, tried(GROWTH, 1, distance=FAR), tried(STIFF, distance=FAR)), None),
        ((FOLDED, tried(GROWTH, 1, distance=FAR), tried(STIFF, 1)), LAST),
        ((FOLDED, tried(GROWTH, 1), tried(STIFF, 1)), LAST),
        ((FOLDED, tried(GROWTH, 1), tried(STIFF, 1), tried(LAST, 1)), None),
    ],
)
def test_the_start_that_follows(before, following):
    assert next_start(before, STARTS) is following


@pytest.mark.parametrize(
    ("genus", "blocks", "division", "first"),
    [
        (1, None, "blocks", (BLOCKS,)),
        (0, 9, "blocks", (BLOCKS,)),
        (0, 1, "cube", STARTS),
        (0, None, "cube", STARTS),
        (0, None, "blocks", (BLOCKS, *STARTS)),
    ],
)
def test_bodies_with_handles_or_limbs_start_from_blocks(genus, blocks, division, first):
    options = {
        "surface": SimpleNamespace(genus=genus),
        "config": SimpleNamespace(blocks=blocks, starts=4),
        "ridges": None,
    }
    assert starts_of(SimpleNamespace(**options, choice=SimpleNamespace(division=division))) == first


@pytest.mark.parametrize(("most", "first"), [(5, (SHARP, *STARTS)), (1, STARTS)])
def test_a_body_with_ridges_first_has_the_edges_of_its_cube_on_them(most, first):
    choice, config = SimpleNamespace(division="cube"), SimpleNamespace(blocks=None, starts=most)
    task = SimpleNamespace(surface=SimpleNamespace(genus=0), config=config, choice=choice, ridges=object())
    assert starts_of(task) == first


def test_a_map_on_ridges_whose_boundary_is_undecided_has_a_follower():
    one = tried(SHARP)
    one.attempt.found.injective = None
    assert next_start((one,), (SHARP, *STARTS)) is NETWORK
    one.attempt.found.injective = True
    assert next_start((one,), (SHARP, *STARTS)) is None


def test_where_no_blocks_fit_a_body_without_handles_one_cube_is_tried():
    task = Mock(seconds={})
    type(task).layout = PropertyMock(side_effect=LayoutError("too thin"))
    task.surface.genus, task.config.blocks = 0, None
    nothing = Mock(load=Mock(return_value=None))
    assert BLOCKS.make(task, nothing) is None
    assert Tried(BLOCKS, None, {}).report().ending == "no blocks fit"
    assert next_start((Tried(BLOCKS, None, {}),), (BLOCKS, *STARTS)) is NETWORK
    assert next_start((tried(BLOCKS),), (BLOCKS, *STARTS)) is None
    assert next_start((tried(BLOCKS, distance=FAR),), (BLOCKS, *STARTS)) is NETWORK
    assert next_start((tried(BLOCKS, back=FAR),), (BLOCKS, *STARTS)) is NETWORK
    assert next_start((tried(BLOCKS, distance=FAR),), (BLOCKS,)) is None
    task.config.blocks = 9
    with pytest.raises(LayoutError, match="too thin"):
        BLOCKS.make(task, nothing)


def test_one_cube_is_refused_for_a_body_with_handles():
    task = SimpleNamespace(surface=SimpleNamespace(genus=2), config=SimpleNamespace(blocks=1))
    with pytest.raises(LayoutError, match="genus 2: one cube is never mapped one-to-one onto a body with handles"):
        starts_of(task)


def test_the_best_map_is_the_one_of_which_most_is_proved_then_the_nearest():
    far, near = tried(GROWTH, distance=FAR), tried(STIFF, distance=NEAR)
    assert best_of((HARD, FOLDED, far, near)) == (STIFF, near.attempt)
    assert best_of((CROSSED, FOLDED)) == (NETWORK, CROSSED.attempt)
    assert best_of((far, tried(LAST, distance=FAR))) == (GROWTH, far.attempt)
    assert best_of((HARD,)) is None


def test_starts_have_names_of_their_own():
    assert len({start.name for start in STARTS}) == len(STARTS)


def test_what_was_tried_is_reported():
    report = tried(STIFF, 3, distance=FAR).report()
    assert (report.start, report.origin, report.ending) == ("stiff growth", "growth", "stalled")
    assert (report.unproved, report.meets_itself, report.distance) == (3, False, pytest.approx(FAR))
    assert HARD.report().ending == "hard for the network" and HARD.report().unproved is None


def test_a_start_is_one_object_in_the_tuple(few_distances, monkeypatch):
    class Again(Start):
        def make(self, task, checkpoints):
            return NETWORK.make(task, checkpoints)

    monkeypatch.setattr(attempts, "STARTS", (Again("again", "network", "training once more"),))
    result = parameterize(small_surface(), replace(tiny_config(), starts=2), seed=3, device="cpu")
    assert [attempt.start for attempt in result.attempts] == ["again"]
