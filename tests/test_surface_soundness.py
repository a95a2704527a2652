"""A surface is sound where the repairs find nothing to do; what they repair or refuse is not."""

from __future__ import annotations

import numpy as np
import pytest

from iga_nn.samples import sample
from parameterize.surface.soundness import is_sound

BOX = sample("cube").faces


@pytest.mark.parametrize("name", ["cube", "bean"])
def test_samples_are_sound_however_they_are_numbered(name):
    faces = sample(name).faces
    numbers = 7 + np.random.default_rng(1).permutation(int(faces.max()) + 1)  # the first vertices are not used
    assert is_sound(faces) and is_sound(faces[:, ::-1]) and is_sound(numbers[faces])


def test_two_surfaces_side_by_side_are_sound():
    assert is_sound(np.concatenate([BOX, BOX + BOX.max() + 1]))


@pytest.mark.parametrize(
    "faces",
    [
        np.empty((0, 3), dtype=np.int64),
        BOX[1:],  # open
        np.concatenate([BOX[:1, ::-1], BOX[1:]]),  # one face the other way round
        np.concatenate([BOX, BOX[:1]]),  # a face twice
        np.concatenate([BOX, BOX]),
        np.concatenate([BOX, BOX[:, ::-1]]),
        np.concatenate([BOX, [[0, 0, 1]]]),  # a corner twice
        np.array([[0, 1, 2], [2, 1, 0]]),  # two faces that lie on each other
        np.concatenate([BOX, np.where(BOX == 5, 5, BOX + BOX.max() + 1)]),  # two sheets touch at a vertex
    ],
)
def test_what_repairs_are_for_is_not_sound(faces):
    assert not is_sound(faces)


def test_sheets_that_touch_along_an_edge_are_not_sound():
    other = np.where(np.isin(BOX, BOX[0, :2]), BOX, BOX + BOX.max() + 1)
    assert not is_sound(np.concatenate([BOX, other]))
