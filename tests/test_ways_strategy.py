"""Which way follows those that were tried, which of their maps is the result, and what a user may ask for."""

import re
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from example_files import load_file
from small_run import small_surface, tiny_config

import iga_nn
from iga_nn.cli.commands import main
from parameterize.checkpoint import Checkpoints
from parameterize.config import WayName
from parameterize.layouts.rods.along_skeleton import LayoutError
from parameterize.optimization.endings import Course, Reason
from parameterize.run import parameterize
from parameterize.ways import blocks, strategy
from parameterize.ways.mapping_task import MappingTask
from parameterize.ways.network import Network
from parameterize.ways.strategy import (
    BLOCKS,
    GROWTH,
    LAST,
    NETWORK,
    PLANES,
    SHARP,
    STIFF,
    STUBS,
    WAYS,
    attempts,
    first_way,
    ways_of,
)
from parameterize.ways.tried import Tried, best_of
from parameterize.ways.way import Attempt, Suits

CUBES = (NETWORK, GROWTH, STIFF, LAST)
DOCS = Path(iga_nn.__file__).resolve().parents[1] / "docs"
FAR, NEAR = 2.0 * GROWTH.far, 0.5 * GROWTH.far


def task_of(surface=None, config=None):
    return MappingTask(
        surface or small_surface(), config or tiny_config(), 3, "cpu", "float32", None, {}, {}, Checkpoints.none()
    )


def next_way(before, ways, most=4):
    """The way that the strategy takes after these, of a body that all suit."""
    task = SimpleNamespace(
        most_starts=most, surface=SimpleNamespace(is_plain=True, genus=0), config=SimpleNamespace(blocks=None, starts=4)
    )
    left = ways[1 + max((ways.index(one.way) for one in before), default=-1) :]
    return next((way for way in left if strategy._is_next(way, before, task)), None)


def tried(way, unproved=0, *, meets=False, distance=NEAR, back=NEAR):
    """A way that was tried and the map that it has made, of which so much is proved."""
    faults = (unproved, meets)
    found = SimpleNamespace(
        faults=faults, rank=(*faults, False), meets_itself=meets, spline=SimpleNamespace(control=None)
    )
    fit = SimpleNamespace(mean_square=lambda _: distance**2)
    attempt = Attempt(found, Course({}, {}, Reason.STALLED), fit, None)
    vars(attempt)["distance_back"] = back
    return Tried(way, attempt, {})


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
def test_the_way_that_follows(before, following, monkeypatch):
    monkeypatch.setattr(strategy.SHARP.__class__, "suits", lambda *_: Suits(True))
    assert next_way(before, CUBES) is following


def test_at_most_as_many_cubes_are_tried_as_the_options_say():
    assert next_way((FOLDED,), CUBES, most=1) is None and next_way((FOLDED,), CUBES, most=2) is GROWTH
    assert next_way((tried(BLOCKS, 1),), (BLOCKS, *CUBES), most=1) is NETWORK  # blocks do not count


@pytest.mark.parametrize("injective", [None, True])
def test_a_map_on_ridges_whose_boundary_is_undecided_has_a_follower(injective):
    one = tried(SHARP)
    one.attempt.found.injective = injective
    assert next_way((one,), (SHARP, *CUBES)) is (None if injective else NETWORK)


def test_where_no_blocks_fit_a_body_without_handles_one_cube_is_tried(monkeypatch):
    def refused(_):
        raise LayoutError("too thin")

    monkeypatch.setattr(blocks, "_blocks", refused)
    task, ways = task_of(), (BLOCKS, SHARP, *CUBES)
    assert BLOCKS.make(task, Checkpoints.none()) is None
    assert Tried(BLOCKS, None, {}).report().ending == "no blocks fit"
    assert next_way((Tried(BLOCKS, None, {}),), ways) is NETWORK  # a layout along sharp edges is never second
    assert next_way((tried(BLOCKS),), ways) is None
    assert next_way((tried(BLOCKS, distance=FAR),), ways) is NETWORK
    assert next_way((tried(BLOCKS, back=FAR),), ways) is NETWORK
    with pytest.raises(LayoutError, match="too thin"):
        BLOCKS.make(replace(task, config=replace(task.config, blocks=9)), Checkpoints.none())


def test_one_cube_does_not_follow_blocks_of_a_body_with_handles():
    ring = Mock(surface=SimpleNamespace(is_plain=True, genus=1), config=SimpleNamespace(blocks=None, starts=4))
    assert not any(way.suits(ring).applies for way in (SHARP, *CUBES))


def test_one_cube_is_refused_for_a_body_with_handles():
    task = SimpleNamespace(
        surface=SimpleNamespace(is_plain=True, genus=2),
        config=SimpleNamespace(blocks=1),
        checkpoints=Checkpoints.none(),
    )
    with pytest.raises(LayoutError, match="genus 2: one cube is never mapped one-to-one onto a body with handles"):
        first_way(task, WAYS)


def test_the_best_map_is_the_one_of_which_most_is_proved_then_the_nearest():
    far, near = tried(GROWTH, distance=FAR), tried(STIFF, distance=NEAR)
    assert best_of((HARD, FOLDED, far, near)) == (STIFF, near.attempt)
    assert best_of((CROSSED, FOLDED)) == (NETWORK, CROSSED.attempt)
    assert best_of((far, tried(LAST, distance=FAR))) == (GROWTH, far.attempt)
    assert best_of((HARD,)) is None


def test_what_was_tried_is_reported():
    report = tried(STIFF, 3, distance=FAR).report()
    assert (report.start, report.origin, report.ending) == ("stiff growth", "growth", "stalled")
    assert (report.unproved, report.meets_itself, report.distance) == (3, False, pytest.approx(FAR))
    assert HARD.report().ending == "hard for the network" and HARD.report().unproved is None


def test_ways_have_names_of_their_own_which_the_table_and_the_command_line_list():
    names = [way.name for way in WAYS]
    assert len(set(names)) == len(names)
    assert re.findall(r"^\| ([a-z ]+) \|", strategy.__doc__, flags=re.MULTILINE)[1:] == names
    assert [name.replace("-", " ") for name in WayName.__args__] == names


def test_the_table_of_the_manual_is_that_of_the_strategy():
    text = (DOCS / "ways.md").read_text(encoding="utf-8")
    table = load_file(DOCS / "ways_table.py")
    assert table.refreshed(text) == text, "`make docs` writes the table anew"


def test_ways_are_taken_by_themselves_or_by_their_names():
    assert ways_of(()) == ()
    assert ways_of((GROWTH, "planes", "body-with-stubs")) == (GROWTH, PLANES, STUBS)
    assert ways_of("body with stubs") == ways_of(STUBS) == ways_of(("body-with-stubs", STUBS)) == (STUBS,)
    with pytest.raises(
        ValueError, match="unknown way 'planks': choose from planes, stacks, hexahedra, body-with-stubs, "
    ):
        ways_of("planks")


@pytest.mark.parametrize("wrong", [7, None, b"planes", [7], [["planes"]], [None]])
def test_what_is_no_way_and_no_name_is_refused(wrong):
    with pytest.raises(TypeError, match="ways must be names of ways, such as"):
        parameterize(small_surface(), tiny_config(), ways=wrong)
    with pytest.raises(TypeError, match="ways must be names of ways, such as"):
        parameterize(small_surface(), replace(tiny_config(), ways=wrong))


def test_one_way_of_the_options_needs_no_list():
    result = iga_nn.parameterize(iga_nn.sample("cube"), replace(tiny_config(), ways="planes"))
    assert (result.origin, result.config.ways) == ("planes", ("planes",))


def test_a_way_that_is_named_twice_is_taken_once():
    assert iga_nn.MapOptions(ways=("body-with-stubs", "body-with-stubs")).config().ways == ("body with stubs",)


def test_a_user_may_ask_for_ways(few_distances):
    with pytest.raises(LayoutError, match=r"none of the ways asked for suits this body \(planes, stacks\)"):
        parameterize(small_surface(), tiny_config(), ways=("planes", "stacks"), device="cpu")
    with pytest.raises(LayoutError, match=r"none of the ways asked for makes a map of this body \(again\)"):
        parameterize(small_surface(), tiny_config(), ways=(Again(*OWN, gives_up=True),), device="cpu")
    result = parameterize(small_surface(), tiny_config(), ways=(GROWTH,), seed=3, device="cpu")
    assert (result.origin, [one.start for one in result.attempts]) == ("growth", ["growth"])
    assert result.config.ways == ("growth",) and result.decomposition == ""


def test_the_command_line_lists_the_ways_it_refuses_to_know(in_folder, capsys):
    assert main(["parameterize", "cube", "--ways", "planks", "--out", "out"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "--ways" in said and "planks" in said and "stiff-growth" in said
    assert main(["parameterize", "bean", "--ways", "planes", "body-with-stubs", "--out", "out"]) == 2
    assert "bean: none of the ways asked for suits this body (planes, body-with-stubs): allow others" in " ".join(
        capsys.readouterr().err.split()
    )


OWN = "again", "training once more"


@dataclass(frozen=True)
class Again(Network):
    gives_up: bool = False

    def make(self, task, checkpoints):
        return None if self.gives_up else NETWORK.make(task, checkpoints)


def test_a_way_of_a_users_own_is_one_object(few_distances):
    result = parameterize(small_surface(), tiny_config(), ways=(Again(*OWN),), seed=3, device="cpu")
    assert [attempt.start for attempt in result.attempts] == ["again"]


def test_a_run_that_resumes_does_not_choose_again(tmp_path, monkeypatch):
    surface, config = small_surface(), tiny_config()
    checkpoints = Checkpoints(tmp_path, {}, resume=True)
    task = replace(task_of(surface, config), checkpoints=checkpoints)
    made = tried(NETWORK).attempt
    monkeypatch.setattr(Network, "make", lambda *_: made)
    before = attempts(task, WAYS, checkpoints)
    monkeypatch.setattr(PLANES.__class__, "suits", lambda *_: pytest.fail("it is known"))
    assert attempts(task, WAYS, checkpoints) == before
    assert before[1].startswith("no handles, and a compact body: ")


def test_the_decomposition_has_an_earlier_name(few_distances):
    result = parameterize(small_surface(), replace(tiny_config(), blocks=1), ways=(GROWTH,), device="cpu")
    with pytest.warns(DeprecationWarning, match="now called parameterize.Parameterization.decomposition"):
        assert result.division == result.decomposition
