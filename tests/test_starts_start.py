"""What all starts share: the blocks along the skeleton, and their spans."""

import logging

import numpy as np
import pytest
from block_starts import torus
from shapes import rounded_cube

from parameterize.attempts import BLOCKS, BODY, STARTS, starts_of
from parameterize.config import preset
from parameterize.layouts.skeleton.choice import Choice
from parameterize.starts import start
from parameterize.starts.start import Task, spans_across
from parameterize.surface.surface import surface_from_arrays


def task_of(config, given_corners=None, body=None):
    """The task of a torus, or of another surface (vertices, faces)."""
    vertices, faces = body or torus(around=32, across=14)[1:]
    return Task(surface_from_arrays(vertices, faces), config, 0, "cpu", "float32", given_corners, {}, {})


@pytest.mark.parametrize(("control_points", "spans"), [(4, 4), (11, 4), (20, 4), (30, 6), (40, 8), (60, 12)])
def test_spans_across_a_block_follow_the_control_points_in_proportion(control_points, spans):
    assert spans_across(control_points) == spans


def test_the_blocks_of_a_torus_have_the_spans_of_the_options():
    for control_points, spans in ((30, 6), (40, 8)):
        layout = task_of(preset("fast").with_control_points(control_points)).layout
        assert {block.spans[:2] for block in layout.blocks} == {(spans, spans)}


def test_why_a_body_with_handles_gets_blocks_is_told_and_logged(caplog):
    caplog.set_level(logging.INFO)
    task = task_of(preset("fast"))
    assert starts_of(task) == (BLOCKS,) and task.choice.division == "blocks"
    assert task.choice.reason.startswith("1 handle, thick branches: ") and task.choice.reason in caplog.messages
    assert task.seconds["fit"] > 0.0


def test_a_fat_body_with_thin_handles_gets_stubs_and_blocks_where_these_fail(monkeypatch):
    monkeypatch.setattr(start, "choose", lambda _, stubs: Choice("body", "1 handle, a thin one on a fat body"))
    task = task_of(preset("fast"))
    assert starts_of(task) == (BODY, BLOCKS) and task.choice.reason == "1 handle, a thin one on a fat body"


def test_a_compact_body_gets_one_cube_without_a_skeleton(monkeypatch, caplog):
    caplog.set_level(logging.INFO)
    monkeypatch.setattr(start, "skeleton_of", lambda *_: pytest.fail("no skeleton is needed"))
    task = task_of(preset("fast"), body=rounded_cube(200, 2.0))
    assert starts_of(task) == STARTS and "a compact body" in task.choice.reason and not caplog.messages


def test_where_the_options_say_it_nothing_is_chosen():
    body = rounded_cube(200, 2.0)
    for config, corners, starts in (
        (preset("fast").with_blocks(1), None, STARTS),
        (preset("fast").with_blocks(5), None, (BLOCKS,)),
        (preset("fast"), np.arange(8), STARTS),
    ):
        task = task_of(config, corners, body)
        assert starts_of(task) == starts and task.choice.reason == ""
