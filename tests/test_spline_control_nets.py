"""Control nets of several blocks in one array, and what interfaces make of them."""

import numpy as np
import pytest
from block_bodies import BODIES, rod, uniform_nets, wavy

from parameterize.spline.body import Body
from parameterize.spline.interface import Interface, axis_side, face_layer

TURNS = (0, 5, 7)


def random_control(nets, seed=0, rows=3):
    return np.random.default_rng(seed).normal(size=(rows, nets.starts[-1]))


@pytest.fixture(params=[(name, turn) for name in BODIES for turn in TURNS], ids=str)
def nets(request):
    name, turn = request.param
    return BODIES[name](turn).nets


def test_parts_are_taken_out_and_joined_again():
    nets = uniform_nets((1, 2, 3), (2, 2, 1))
    assert nets.shapes == ((4, 5, 6), (5, 5, 4)) and nets.spans == ((1, 2, 3), (2, 2, 1))
    assert nets.starts.tolist() == [0, 120, 220] and nets.first_spans.tolist() == [0, 6, 10]
    control = random_control(nets)
    parts = [nets.of_block(control, block) for block in range(2)]
    assert [part.shape for part in parts] == [(3, 4, 5, 6), (3, 5, 5, 4)]
    assert all(part.flags.c_contiguous for part in parts)
    assert np.array_equal(nets.joined(parts), control)
    assert np.array_equal(nets.of_block(control[0], 1), parts[1][0])


def test_merging_is_the_orthogonal_projection_onto_maps_without_gaps(nets):
    control, other = random_control(nets), random_control(nets, seed=1)
    merged = nets.merged(control)
    assert not np.array_equal(merged, control)
    assert np.allclose(nets.merged(merged), merged, rtol=0.0, atol=1e-15)
    assert np.vdot(merged, other) == pytest.approx(np.vdot(control, nets.merged(other)), rel=1e-12)
    for row, one in zip(control, merged, strict=True):
        assert np.array_equal(nets.merged(row), one)


def test_merged_faces_have_the_same_bits_on_both_sides(nets):
    merged = nets.merged(random_control(nets))
    nets_of = [np.moveaxis(nets.of_block(merged, block), 0, -1) for block in range(len(nets.knots))]
    for interface in nets.interfaces:
        (p, face), (q, other) = interface.first, interface.second
        second = interface.turned(face_layer(nets_of[q], other))
        assert np.array_equal(face_layer(nets_of[p], face), second)


def test_values_that_agree_and_those_inside_stay(nets):
    control = random_control(nets)
    moved = (nets.merged(control) != control).any(axis=0)
    for block in range(len(nets.knots)):
        u, v, w = nets.shapes[block]
        inside = nets.of_block(moved, block)
        glued = np.zeros((u, v, w), dtype=bool)
        for axis, side in ((face // 2, face % 2) for face in np.flatnonzero(~nets.exposed[6 * block :][:6])):
            np.moveaxis(glued, axis, 0)[-side] = True
        assert np.array_equal(inside, glued)
    ones = np.ones((3, nets.starts[-1]))
    assert np.array_equal(nets.merged(ones), ones)


def test_a_mask_gains_what_is_one_with_its_points():
    nets = rod(7).nets
    (interface,) = nets.interfaces
    assert interface.swapped and any(interface.flipped)
    (_, face), (_, other) = interface.first, interface.second
    chosen = np.zeros(nets.starts[-1], dtype=bool)
    layer = face_layer(nets.of_block(np.arange(nets.starts[-1]), 0), face)
    partners = interface.turned(face_layer(nets.of_block(np.arange(nets.starts[-1]), 1), other))
    chosen[layer[1, 4]] = chosen[nets.starts[1] - 1 - layer[1, 4]] = True
    found = np.flatnonzero(nets.merged_mask(chosen) & ~chosen).tolist()
    inside = nets.starts[1] - 1 - layer[1, 4]
    assert inside not in layer
    assert found == [partners[1, 4]]


def test_exposed_faces_are_those_that_are_not_glued(nets):
    glued = {(block, axis_side(face)) for one in nets.interfaces for block, face in (one.first, one.second)}
    for number, exposed in enumerate(nets.exposed):
        assert exposed == ((number // 6, divmod(number % 6, 2)) not in glued)
    assert nets.exposed.sum() == len(nets.exposed) - 2 * len(nets.interfaces)


def test_one_cube_merges_nothing_and_one_glued_to_itself_is_no_cube():
    nets = uniform_nets((2, 2, 2))
    control = random_control(nets)
    assert nets.is_single and nets.merged(control) is control and nets.exposed.all()
    tube = uniform_nets((2, 2, 2), interfaces=[Interface((0, "w0"), (0, "w1"))])
    assert not tube.is_single and tube.exposed.tolist() == [True] * 4 + [False] * 2
    ends = tube.of_block(tube.merged(control), 0)[..., [0, -1]]
    assert np.array_equal(ends[..., 0], ends[..., 1])
    assert ends[..., 0] == pytest.approx(tube.of_block(control, 0)[..., [0, -1]].mean(axis=-1))


def test_a_merged_map_is_a_body_of_patches():
    body = wavy(rod(7, lengths=(1.0, 2.0, 0.5)), 0.05).body  # interfaces are checked, bit by bit
    assert isinstance(body, Body) and len(body) == 3 and len(body.interfaces) == 2
