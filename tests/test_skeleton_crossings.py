"""Lattice points inside a surface, and the pairs of them between which it passes."""

from __future__ import annotations

import numpy as np
import trimesh

from parameterize.skeleton.crossings import DIRECTIONS, crossed_pairs, inside_of


def box_corners(low, high):
    mesh = trimesh.creation.box(bounds=[low, high])
    return mesh.vertices[mesh.faces]


def test_directions_and_their_opposites_lead_to_all_neighbours():
    both = {*DIRECTIONS, *(tuple(-x for x in d) for d in DIRECTIONS)}
    assert len(DIRECTIONS) == 13 and len(both) == 26


def test_points_of_a_box_are_inside_up_to_its_half_open_faces():
    """A lattice point on a face belongs to the box on one side and not on the other: never twice, never to none."""
    inside = inside_of(box_corners((1, 2, 3), (4, 6, 8)), (9, 9, 9))
    assert inside.sum() == 3 * 4 * 5
    other = inside_of(box_corners((4, 2, 3), (7, 6, 8)), (9, 9, 9))
    assert not np.any(inside & other) and np.all((inside | other)[2:7, 3:6, 4:8])


def test_points_of_a_turned_body_are_those_of_its_implicit_form():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=7.0)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))
    mesh.apply_translation([9.3, 9.1, 9.2])
    inside = inside_of(mesh.vertices[mesh.faces], (19, 19, 19))
    radius = np.linalg.norm(
        np.stack(np.meshgrid(*[np.arange(19)] * 3, indexing="ij"), axis=-1) - (9.3, 9.1, 9.2), axis=-1
    )
    assert np.all(inside[radius < 6.9]) and not np.any(inside[radius > 7.0])


def test_two_boxes_with_a_narrow_gap_are_crossed_between_all_neighbours_across_it():
    """The gap lies between the planes x = 4 and x = 5: each pair of points on both sides is crossed, and no other."""
    corners = np.concatenate(
        [box_corners((0.5, 0.5, 0.5), (4.4, 5.5, 5.5)), box_corners((4.6, 0.5, 0.5), (8.5, 5.5, 5.5))]
    )
    inside = inside_of(corners, (10, 7, 7))
    assert inside.sum() == 8 * 5 * 5
    pairs = np.concatenate([np.stack(pair, axis=1) for pair in crossed_pairs(corners, inside)])
    assert np.all(np.sort(pairs[:, :, 0], axis=1) == (4, 5))
    steps = {tuple(step) for step in pairs[:, 1] - pairs[:, 0]}
    assert {tuple(abs(step[0]) for step in steps)} == {(1,) * 9} and len(steps) == 9
    straight = pairs[np.all(pairs[:, 0, 1:] == pairs[:, 1, 1:], axis=1)]
    assert len({tuple(pair) for pair in straight[:, 0].tolist()}) == 25
