"""Gradients that are averaged where patches meet, against exact ones."""

from itertools import combinations

import numpy as np
import pytest

import iga_nn
from parameterize.spline.body import Body
from parameterize.spline.volume import BSplineVolume
from solve.averaging import averaged_groups
from solve.field_groups import groups_of
from solve.quantities import group_values

ROW = np.linspace(0.0, 1.0, 5)


def hexahedron(corners, points=4):
    """The trilinear image of a cube; corners: (2, 2, 2, 3)."""

    def point(u, v, w):
        weights = [np.stack([1.0 - t, t]) for t in (u, v, w)]
        return tuple(np.einsum("i...,j...,k...,ijk->...", *weights, corners[..., a]) for a in range(3))

    return BSplineVolume.from_function(point, points)


def hexahedra():
    """Five tetrahedra of a cube, each divided into four hexahedra."""
    cube = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij")).reshape(3, -1).T.astype(float)
    patches = []
    for tet in ((0, 3, 5, 6), (0, 1, 3, 5), (0, 2, 3, 6), (0, 4, 5, 6), (3, 5, 6, 7)):
        points = cube[list(tet)]
        for k in range(4):
            others = [i for i in range(4) if i != k]
            if np.linalg.det(points[others] - points[k]) < 0.0:
                others = others[::-1]
            corners = np.empty((2, 2, 2, 3))
            for place in np.ndindex(2, 2, 2):
                chosen = [k, *(other for other, one in zip(others, place, strict=True) if one)]
                corners[place] = points[chosen].mean(axis=0)
            patches.append(hexahedron(corners))
    return Body.from_patches(patches)


@pytest.fixture(scope="module")
def body():
    return hexahedra()


def errors(groups, exact):
    """The errors of gradients of a scalar at samples of all patches."""
    found = []
    for group in groups:
        gradients = group_values(group, lambda u, grad, x: grad[0], ROW, ROW, ROW)
        found.append(np.linalg.norm(gradients - exact(np.asarray(group.points_on(ROW, ROW, ROW))), axis=0).ravel())
    return np.concatenate(found)


@pytest.mark.parametrize("degree", [2, 3])
def test_averages_are_nearer_to_the_exact_gradient(body, degree):
    solution = iga_nn.solve(body, iga_nn.Poisson(exact="sin(3*x)*y+z*z"), degree=degree)

    def exact(x):
        return np.stack([3.0 * np.cos(3.0 * x[0]) * x[1], np.sin(3.0 * x[0]), 2.0 * x[2]])

    own, averaged = errors(groups_of(solution), exact), errors(averaged_groups(solution), exact)
    assert averaged.max() < 0.8 * own.max()
    assert (averaged**2).mean() < 1.05 * (own**2).mean()


def test_where_patches_meet_there_is_one_gradient(body):
    solution = iga_nn.solve(body, iga_nn.Poisson(source="1", boundary="0"), degree=2)
    seen = {}
    for group in averaged_groups(solution):
        found = group_values(group, lambda u, grad, x: grad[0], ROW[::4], ROW[::4], ROW[::4])
        points = np.asarray(group.points_on(ROW[::4], ROW[::4], ROW[::4])).reshape(3, -1).T
        for point, gradient in zip(points.round(9) + 0.0, found.reshape(3, -1).T, strict=True):
            seen.setdefault(tuple(point), []).append(gradient)
    shared = [values for values in seen.values() if len(values) > 1]
    assert len(shared) > 20
    for values in shared:
        assert max(np.linalg.norm(a - b) for a, b in combinations(values, 2)) < 1e-9


def test_constant_gradients_stay(body):
    solution = iga_nn.solve(body, iga_nn.Poisson(exact="1+2*x-y+3*z"), degree=2)
    assert (
        errors(averaged_groups(solution), lambda x: np.array([2.0, -1.0, 3.0])[:, None, None, None, None]).max() < 1e-7
    )


@pytest.mark.slow
def test_two_materials_one_cube_and_kinks_keep_their_own_gradients(body):
    halves = Body.from_patches(
        [BSplineVolume.from_function(lambda u, v, w, a=a: (u + a, v, w), 4) for a in (0, 1)], solids=["a", "b"]
    )
    unlike = iga_nn.solve(halves, iga_nn.Poisson(source="1", boundary="0", kappa={"a": 1.0, "b": 5.0}))
    alone = iga_nn.solve(halves.patches[0], iga_nn.Poisson(source="1", boundary="0"), refine=1)
    kinked = iga_nn.solve(body, iga_nn.Poisson(source="1", boundary="0"), degree=1, refine=1)
    for solution in (unlike, alone, kinked, unlike.field):
        assert all(group.gradients is None for group in averaged_groups(solution))
    assert averaged_groups(iga_nn.solve(halves, iga_nn.Poisson(source="1", boundary="0")))[0].gradients is not None
