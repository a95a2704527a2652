"""Branches through the faces of a cube."""

import numpy as np
import pytest

from parameterize.layouts.rods.splitting import NORMALS, assigned


def around(*degrees):
    angles = np.radians(degrees)
    return np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], axis=1)


@pytest.mark.parametrize(
    ("ways", "angles"),
    [
        (around(0, 120, 240), [0, 30, 30]),  # opposite faces and one between: three that share a corner are 35 off
        (around(0, 90, 180, 270), [0, 0, 0, 0]),
        (around(0, 60, 180, 240), [15, 15, 15, 15]),
        (np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3), None),
    ],
)
def test_the_cube_is_turned_towards_the_branches(ways, angles):
    found = assigned(ways)
    assert np.allclose(found.axes @ found.axes.T, np.eye(3)) and np.isclose(np.linalg.det(found.axes), 1.0)
    assert len(set(found.faces.tolist())) == len(ways)
    normals = NORMALS[found.faces] @ found.axes
    assert np.allclose(np.cos(found.angles), (normals * ways).sum(axis=1))
    if angles is not None:
        assert np.allclose(np.sort(np.degrees(found.angles)), angles, atol=1e-4)


def test_six_branches_along_turned_axes_fit_without_error():
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    order = np.random.default_rng(6).permutation(6)
    assert np.degrees(assigned(NORMALS[order] @ turn).angles).max() < 1e-5


def test_no_turn_of_the_cube_is_better():
    rng = np.random.default_rng(7)
    ways = rng.normal(size=(5, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    found = assigned(ways)
    least = (found.angles**2).sum()
    for _ in range(300):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        cosines = ways @ (NORMALS @ turn).T
        others = np.arccos(np.clip(cosines, -1.0, 1.0)) ** 2
        assert others[np.arange(5), rng.permutation(6)[:5]].sum() > 0.9 * least
