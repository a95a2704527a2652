"""What ways share, and which of them a body takes first: why, and what is not computed for it."""

import logging
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from block_starts import torus
from shapes import rounded_cube

from parameterize.config import preset
from parameterize.surface.surface import surface_from_arrays
from parameterize.ways import blocks, stubs
from parameterize.ways import mapping_task as ways_task
from parameterize.ways.mapping_task import MappingTask
from parameterize.ways.strategy import BLOCKS, NETWORK, STUBS, WAYS, attempts, first_way
from parameterize.ways.tried import Tried


def task_of(config, given_corners=None, body=None):
    """The task of a torus, or of another surface (vertices, faces)."""
    vertices, faces = body or torus(around=32, across=14)[1:]
    return MappingTask(surface_from_arrays(vertices, faces), config, 0, "cpu", "float32", given_corners, {}, {})


@pytest.mark.parametrize(("control_points", "spans"), [(4, 4), (11, 4), (20, 4), (30, 6), (40, 8), (60, 12)])
def test_spans_across_a_block_follow_the_control_points_in_proportion(control_points, spans):
    config = preset("fast").with_control_points(control_points)
    assert task_of(config, body=rounded_cube(200, 2.0)).spans_across == spans


def test_the_blocks_of_a_torus_have_the_spans_of_the_options():
    for control_points, spans in ((30, 6), (40, 8)):
        made = blocks._blocks(task_of(preset("fast").with_control_points(control_points)))
        assert np.all(made.spans[:, :2] == spans)


def test_why_a_body_with_handles_gets_blocks_is_told_and_logged(caplog, monkeypatch):
    caplog.set_level(logging.INFO)
    task = task_of(preset("fast"))
    way, suits = first_way(task, WAYS)
    assert way is BLOCKS and suits.why.startswith("1 handle, thick branches: ") and not caplog.messages
    monkeypatch.setattr(BLOCKS.__class__, "make", lambda *_: SimpleNamespace(distance=0.0))
    monkeypatch.setattr(Tried, "serves", True)
    assert attempts(task, WAYS, task.checkpoints)[1] == suits.why and suits.why in caplog.messages
    assert task.seconds["fit"] > 0.0


def test_a_fat_body_with_thin_handles_gets_stubs_and_blocks_if_these_fail(monkeypatch):
    task = task_of(preset("fast"))
    monkeypatch.setattr(stubs, "TUBE_OF_HANDLES", 1.0)
    monkeypatch.setattr(stubs, "_handles", lambda _: ("a handle",))
    way, suits = first_way(task, WAYS)
    assert way is STUBS and suits.why.startswith("1 handle, thin ones on a fat body: ")
    assert BLOCKS.follows((Tried(STUBS, None, {}),)) and BLOCKS.suits(task).applies


def test_a_compact_body_gets_one_cube_without_a_skeleton(monkeypatch):
    monkeypatch.setattr(ways_task, "skeleton_of", lambda *_: pytest.fail("no skeleton is needed"))
    way, suits = first_way(task_of(preset("fast"), body=rounded_cube(200, 2.0)), WAYS)
    assert way is NETWORK and "a compact body" in suits.why and suits.level == logging.DEBUG


def test_where_the_options_say_it_nothing_is_chosen():
    body = rounded_cube(200, 2.0)
    for config, corners, way in (
        (preset("fast").with_blocks(1), None, NETWORK),
        (preset("fast").with_blocks(5), None, BLOCKS),
        (preset("fast"), np.arange(8), NETWORK),
    ):
        taken, suits = first_way(task_of(config, corners, body), WAYS)
        assert taken is way and suits.why == ""


def test_what_a_body_is_like_is_found_once_for_its_surface(monkeypatch):
    task = task_of(preset("fast"))
    skeleton = task.skeleton
    monkeypatch.setattr(ways_task, "skeleton_of", lambda *_: pytest.fail("it is known"))
    assert replace(task, seed=1).skeleton is skeleton
