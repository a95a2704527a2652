"""Bisection of patches among processes."""

import numpy as np
import pytest

from solve.discretization.partition import partition

GRID = np.stack(np.meshgrid(*map(np.arange, (8, 4, 2)), indexing="ij"), axis=-1).reshape(-1, 3).astype(float)


@pytest.mark.parametrize("count", [1, 2, 3, 4, 7, 64])
def test_every_process_has_patches_of_about_equal_weight(count):
    owners = partition(GRID, np.ones(len(GRID)), count)
    numbers = np.bincount(owners, minlength=count)
    assert len(numbers) == count and numbers.min() >= len(GRID) // count - 1 and numbers.max() <= len(GRID) // count + 2


def test_a_body_is_cut_across_its_longest_side_and_by_weight():
    halves = partition(GRID, np.ones(len(GRID)), 2)
    assert np.array_equal(halves, (GRID[:, 0] >= 4.0).astype(int))
    heavy = partition(GRID, np.where(GRID[:, 0] < 1.0, 7.0, 1.0), 2)
    assert np.array_equal(heavy, (GRID[:, 0] >= 1.0).astype(int))


def test_no_process_is_without_a_patch_where_one_weighs_most():
    assert sorted(partition(np.zeros((3, 3)), np.array([1.0, 1e6, 1.0]), 3)) == [0, 1, 2]
