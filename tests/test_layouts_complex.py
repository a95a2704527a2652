"""Hexahedra by vertex numbers: which faces are glued, what spans edges have, and the map of all of them."""

import numpy as np
import pytest
from block_bodies import glued
from block_starts import double_torus, torus

from parameterize.layouts.complex import Complex, spline_of
from parameterize.layouts.planar.coons import coons_patch
from parameterize.spline.interface import face_layer, orientations
from parameterize.spline.volume import FACE_NAMES

CUBE = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1).transpose(2, 0, 1, 3)  # [w][u][v]
BESIDE = CUBE + [1.0, 0.0, 0.0]


def test_a_hexahedron_is_bilinear_across_and_linear_between_its_sections():
    bent = np.concatenate([CUBE, CUBE[1:] + [0.5, 0.0, 1.0]])
    blocks = glued(("rod", bent, (2, 3, 4)))
    places = [[0.25, 0.75, 0.0], [0.5, 0.5, 0.5], [0.5, 0.5, 0.75], [1.0, 1.0, 1.0]]
    expected = [[0.25, 0.75, 0.0], [0.5, 0.5, 1.0], [0.75, 0.5, 1.5], [1.5, 1.0, 2.0]]
    assert np.allclose(blocks.straight(0)(places), expected, atol=1e-15)
    assert blocks.hexahedra.shape == (1, 2, 2, 2) and blocks.sections(0).shape == (2, 2, 3)
    assert np.array_equal(blocks.points[blocks.sections(0)], np.moveaxis(bent, 0, 2))
    assert spline_of(blocks, 3).nets.spans == ((2, 3, 4),)


def test_faces_with_the_same_vertices_are_glued_in_any_turn():
    turned = np.rot90(BESIDE, axes=(1, 2))  # u along -y, v along x
    blocks = glued(("first", CUBE, (2, 2, 2)), ("second", turned, (2, 2, 2)))
    (interface,) = blocks.interfaces
    assert (interface.first, interface.second) == ((0, "u1"), (1, "v0")) and interface.flipped == (True, False)
    assert blocks.exposed.sum() == 10 and not blocks.exposed[0, 1] and not blocks.exposed[1, 2]


def plain_interfaces(blocks):
    """The faces with equal vertices, looked at one after the other."""
    waiting = {}
    for second in ((number, name) for number in range(len(blocks)) for name in FACE_NAMES):
        vertices = face_layer(blocks.sections(second[0]), second[1])
        key = tuple(sorted(vertices.ravel().tolist()))
        if key not in waiting:
            waiting[key] = second
            continue
        first = waiting.pop(key)
        below = face_layer(blocks.sections(first[0]), first[1])
        yield next(way for way in orientations(first, second) if np.array_equal(below, way.turned(vertices)))


def test_a_block_of_turned_hexahedra_is_glued_as_by_a_plain_search():
    numbers, rng = np.arange(64).reshape(4, 4, 4), np.random.default_rng(0)
    cells = [numbers[i : i + 2, j : j + 2, k : k + 2] for i, j, k in np.ndindex(3, 3, 3)]
    cells = [cell.transpose(np.roll(range(3), rng.integers(3)))[:: rng.choice([-1, 1])] for cell in cells]
    points = np.stack(np.meshgrid(*[np.arange(4.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    blocks = Complex(points, np.array(cells))
    assert list(blocks.interfaces) == list(plain_interfaces(blocks)) and len(blocks.interfaces) == 54
    assert len(spline_of(blocks, 2).body) == 27  # equal at interfaces


def test_vertices_are_told_apart_by_number_alone():
    """Two cubes whose faces lie on each other, but have vertices of their own, as where two bodies touch."""
    cube = np.arange(8).reshape(2, 2, 2)
    points = np.moveaxis(CUBE, 0, 2).reshape(-1, 3)
    blocks = Complex(np.concatenate([points, points + [1.0, 0.0, 0.0]]), np.stack([cube, cube + 8]))
    assert blocks.interfaces == () and blocks.exposed.all()


def test_rods_between_the_same_two_edges_are_glued_only_with_the_same_sections():
    """Two arches from one edge to another, one inside the other: their side faces have the same four corners."""
    arch = np.concatenate([CUBE, CUBE[1:] + [0.5, 0.0, 1.0]])
    other = arch.copy()
    other[:, 1], other[:, 0] = arch[:, 1] + [1.0, 0.0, 0.0], arch[:, 1]
    assert len(glued(("one", arch, (2, 2, 2)), ("other", other, (2, 2, 2))).interfaces) == 1
    other[1, 0] += [0.0, 0.0, 0.1]  # another curve between the same ends
    assert glued(("one", arch, (2, 2, 2)), ("other", other, (2, 2, 2))).interfaces == ()


def test_glued_edges_have_the_same_spans():
    blocks = glued(("first", CUBE, (2, 2, 2)), ("second", BESIDE, (5, 3, 1)))
    assert blocks.spans.tolist() == [[2, 3, 2], [5, 3, 2]]  # the largest number of a class
    assert blocks.classes.tolist() == [[0, 1, 2], [3, 1, 2]]
    with pytest.raises(ValueError, match="one span or more, got 0"):
        blocks.with_spans([[2, 0, 2], [2, 2, 2]])


def test_spans_follow_the_lengths_of_edges():
    long = glued(("first", CUBE, (1, 1, 1)), ("second", 3.0 * CUBE + [1.0, 0.0, 0.0], (1, 1, 1)))
    assert long.with_even_spans(np.array([[1.0, 1.0, 1.0], [3.0, 3.0, 3.0]]), 6).spans.tolist() == [[2] * 3, [7] * 3]
    fewest = np.array([[9, 2, 2], [2, 2, 2]])
    assert long.with_even_spans(np.ones((2, 3)), 6, fewest).spans.tolist() == [[9, 6, 6], [6, 6, 6]]


def test_a_hexahedron_between_two_curved_faces_is_ruled():
    cube = Complex(np.moveaxis(CUBE, 0, 2).reshape(-1, 3), np.arange(8).reshape(1, 2, 2, 2)).with_spans(2)
    even = np.linspace(0.0, 1.0, 5)
    low = np.stack(np.meshgrid(even, even, [0.0], indexing="ij"), axis=-1)[:, :, 0]
    high = low + np.stack([0.0 * low[..., 0], 0.0 * low[..., 0], 1.0 + low[..., 0] * (1.0 - low[..., 0])], axis=-1)
    spline = spline_of(
        Complex(cube.points, cube.hexahedra, surfaces={(0, "w0"): low, (0, "w1"): high}).with_spans(2), 3
    )
    net = spline.volume.control_points
    assert np.array_equal(net[:, :, 0], low) and np.array_equal(net[:, :, -1], high)
    assert np.allclose(net[:, :, 2], 0.5 * (low + high))


def test_a_coons_patch_has_its_four_sides():
    u, v = np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, 4)
    low, high = np.stack([u, u * (1 - u)], axis=-1), np.stack([u, 1.0 - u * (1 - u)], axis=-1)
    left, right = np.stack([v * (v - 1), v], axis=-1), np.stack([1.0 + 0.0 * v, v], axis=-1)
    patch = coons_patch(low, high, left, right, u, v)
    for side, given in ((patch[:, 0], low), (patch[:, -1], high), (patch[0], left), (patch[-1], right)):
        assert np.allclose(side, given, atol=1e-15)
    flat = coons_patch(
        *(np.stack(rows, axis=-1) for rows in ((u, 0 * u), (u, 1 + 0 * u), (0 * v, v), (1 + 0 * v, v))), u, v
    )
    assert np.allclose(flat, np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1), atol=1e-15)


def test_starts_by_hand_leave_a_surface_of_their_genus():
    ring, *_ = torus()
    assert len(ring) == 4 and len(ring.interfaces) == 4 and ring.exposed.sum() == 16
    pair, *_ = double_torus()
    assert pair.names == ("left", "junction", "right")
    assert pair.exposed.sum(axis=1).tolist() == [4, 2, 4]
