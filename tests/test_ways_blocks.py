"""Blocks along the skeleton, one block with stubs, or one cube: decided by the skeleton's figures, with a reason."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from thick_bodies import plate, star

from parameterize.layouts.skeleton.curve_skeleton import skeleton_of
from parameterize.layouts.skeleton.graph import Branch, Skeleton
from parameterize.ways import stubs
from parameterize.ways.blocks import BLOCKS, of_limbs

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def limbs(count, length, tube):
    """A star of straight limbs of radius 1, whose skeleton is known."""
    ends = np.stack([np.cos(np.arange(count)), np.sin(np.arange(count)), np.zeros(count)], axis=1) * length
    curves = [np.linspace((0.0, 0.0, 0.0), end, 9) for end in ends]
    branches = tuple(Branch((0, i + 1), curve, np.ones(9)) for i, curve in enumerate(curves))
    return Skeleton(np.concatenate([np.zeros((1, 3)), ends]), np.ones(count + 1), branches, tube, 0.04)


def test_long_limbs_get_blocks_and_the_reason_names_them():
    suits = of_limbs(limbs(4, 10.0, 0.9))
    assert suits.applies and suits.why.startswith("4 limbs: 0.90 of the volume")
    assert "longest limb 10.0 radii" in suits.why


@pytest.mark.parametrize(
    ("skeleton", "reason"),
    [
        (limbs(2, 10.0, 0.9), "no place where limbs meet"),
        (limbs(4, 5.0, 0.9), "short limbs"),
        (limbs(4, 10.0, 0.6), "a fat trunk"),
        (Skeleton(np.zeros((1, 3)), np.ones(1), (), 0.8, 0.04), "no place where limbs meet"),
    ],
)
def test_other_bodies_without_handles_stay_one_cube(skeleton, reason):
    if skeleton.branches and len(skeleton.branches) == 2:  # a rod: its two halves are one branch
        first, second = skeleton.branches
        rod = Branch((0, 1), np.concatenate([first.points[::-1], second.points[1:]]), np.ones(17))
        skeleton = dataclasses.replace(skeleton, nodes=skeleton.nodes[1:], radii=np.ones(2), branches=(rod,))
    suits = of_limbs(skeleton)
    assert not suits.applies and reason in suits.why


def with_handles(skeleton):
    """A task of a body whose skeleton has handles."""
    return SimpleNamespace(surface=SimpleNamespace(is_plain=True, genus=skeleton.handles), skeleton=skeleton)


def test_a_body_with_limbs_and_a_plate_with_one_hole_get_blocks():
    assert of_limbs(skeleton_of(*star(AXES[:4], reach=2.2))).applies
    suits = BLOCKS.suits(with_handles(skeleton_of(*plate([(0, 0)]))))
    assert suits.applies and "1 handle, flat branches" in suits.why


def test_thin_handles_on_a_fat_body_get_stubs_and_thick_branches_blocks(monkeypatch):
    """A ring of which little is in balls around its curve, and one that these fill."""
    turns = np.linspace(0.0, 2.0 * np.pi, 33)
    curve = np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
    for tube, thin in ((0.2, True), (0.8, False)):
        task = with_handles(Skeleton(curve[:1], np.ones(1), (Branch((0, 0), curve, np.ones(33)),), tube, 0.04))
        monkeypatch.setattr(stubs, "_handles", lambda _: ("a handle",))
        assert stubs.STUBS.suits(task).applies == thin and BLOCKS.suits(task).applies
        monkeypatch.setattr(stubs, "_handles", lambda _: ())
        assert not stubs.STUBS.suits(task).applies
