"""What all starts share: the blocks along the skeleton, and their spans."""

import pytest
from block_starts import torus

from parameterize.config import preset
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
