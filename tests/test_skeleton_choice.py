"""Blocks along the skeleton, one block with stubs, or one cube: decided by the skeleton's figures, with a reason."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from thick_bodies import capsule, implicit, plate, ring, star

from parameterize.skeleton.choice import choose
from parameterize.skeleton.graph import Branch, Skeleton
from parameterize.skeleton.solid import skeleton_of

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def limbs(count, length, tube):
    """A star of straight limbs of radius 1, whose skeleton is known."""
    ends = np.stack([np.cos(np.arange(count)), np.sin(np.arange(count)), np.zeros(count)], axis=1) * length
    curves = [np.linspace((0.0, 0.0, 0.0), end, 9) for end in ends]
    branches = tuple(Branch((0, i + 1), curve, np.ones(9)) for i, curve in enumerate(curves))
    return Skeleton(np.concatenate([np.zeros((1, 3)), ends]), np.ones(count + 1), branches, tube, 0.04, 1.0)


def test_long_limbs_get_blocks_and_the_reason_names_them():
    choice = choose(limbs(4, 10.0, 0.9))
    assert choice.division == "blocks" and choice.reason.startswith("4 limbs: 0.90 of the volume")
    assert "longest limb 10.0 radii" in choice.reason


@pytest.mark.parametrize(
    ("skeleton", "reason"),
    [
        (limbs(2, 10.0, 0.9), "no place where limbs meet"),
        (limbs(4, 5.0, 0.9), "short limbs"),
        (limbs(4, 10.0, 0.6), "a fat trunk"),
        (Skeleton(np.zeros((1, 3)), np.ones(1), (), 0.8, 0.04, 1.0), "no place where limbs meet"),
    ],
)
def test_other_bodies_without_handles_stay_one_cube(skeleton, reason):
    if skeleton.branches and len(skeleton.branches) == 2:  # a rod: its two halves are one branch
        first, second = skeleton.branches
        rod = Branch((0, 1), np.concatenate([first.points[::-1], second.points[1:]]), np.ones(17))
        skeleton = dataclasses.replace(skeleton, nodes=skeleton.nodes[1:], radii=np.ones(2), branches=(rod,))
    choice = choose(skeleton)
    assert choice.division == "cube" and reason in choice.reason


def test_a_body_with_limbs_and_a_plate_with_one_hole_get_blocks():
    assert choose(skeleton_of(*star(AXES[:4], reach=2.2))).division == "blocks"
    choice = choose(skeleton_of(*plate([(0, 0)])))
    assert choice.division == "blocks" and "1 handle, flat branches" in choice.reason


def test_a_ball_with_a_small_handle_is_one_block_with_a_stub():
    body = implicit(lambda x: np.minimum(np.linalg.norm(x, axis=0) - 1.0, ring(x, 1.0, 0.4, 0.12)), (1.6, 1.1, 1.1), 56)
    choice = choose(skeleton_of(*body))
    assert choice.division == "body" and choice.reason.startswith("1 handle on a fat body")


def test_a_cup_with_a_handle_is_called_a_shell():
    def cup(x):
        radius = np.hypot(x[0], x[1])
        wall = np.maximum(np.maximum(radius - 1.0, np.abs(x[2]) - 1.2), -np.maximum(radius - 0.85, -x[2] - 1.05))
        handle = capsule(x, (1.0, 0.0, -0.6), (1.6, 0.0, -0.6), 0.1)
        handle = np.minimum(handle, capsule(x, (1.6, 0.0, -0.6), (1.6, 0.0, 0.6), 0.1))
        return np.minimum(wall, np.minimum(handle, capsule(x, (0.95, 0.0, 0.6), (1.6, 0.0, 0.6), 0.1)))

    body = implicit(cup, (1.9, 1.2, 1.4), 90)
    assert body[2] == 1
    choice = choose(skeleton_of(*body))
    assert choice.division == "body" and choice.reason.startswith("1 handle on a shell")
