"""The tree finds the nearest triangle, and the nearest point of it, for any points and any triangles."""

from __future__ import annotations

import igl
import numpy as np
import pytest

from iga_nn.samples import sample
from parameterize.surface.triangle_tree import TriangleTree


def check(points, vertices, faces):
    squared, triangles, weights = TriangleTree(vertices, faces).nearest(points)
    expected = igl.point_mesh_squared_distance(points, vertices, faces)[0]
    np.testing.assert_allclose(np.sqrt(squared), np.sqrt(expected), rtol=1e-9, atol=1e-12)
    assert weights.min() >= 0.0 and abs(weights.sum(axis=1) - 1.0).max() < 1e-14
    feet = np.einsum("mk,mka->ma", weights, vertices[faces[triangles]])
    np.testing.assert_allclose(np.linalg.norm(points - feet, axis=1), np.sqrt(squared), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("name", ["cube", "bean"])
@pytest.mark.parametrize("spread", [1e-3, 0.1, 10.0])
def test_points_near_and_far(name, spread):
    surface = sample(name)
    points = surface.vertices + spread * np.random.default_rng(3).normal(size=surface.vertices.shape)
    check(points, surface.vertices, surface.faces)


@pytest.mark.parametrize("count", [1, 2, 7, 8, 9, 100])
def test_few_triangles_in_no_order(count):
    random = np.random.default_rng(count)
    check(random.normal(size=(500, 3)), random.normal(size=(3 * count, 3)), np.arange(3 * count).reshape(-1, 3))


def test_triangles_at_one_place_and_those_without_area():
    vertices = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    flat = np.array([[0, 1, 2], [1, 1, 1], [0, 0, 2]])
    points = np.random.default_rng(5).normal(size=(200, 3))
    check(points, vertices, flat)
    check(points, vertices, np.concatenate([flat, np.repeat([[0, 1, 3]], 50, axis=0)]))


def test_the_same_whatever_points_come_before(monkeypatch):
    surface, points = sample("bean"), np.random.default_rng(7).normal(size=(5000, 3))
    tree = TriangleTree(surface.vertices, surface.faces)
    squared, triangles, _ = tree.nearest(points)
    for other, found in zip((squared, triangles), tree.nearest(points[::-1])[:2], strict=True):
        np.testing.assert_array_equal(found[::-1], other)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    np.testing.assert_array_equal(tree.nearest(points)[0], squared)


def test_no_points():
    surface = sample("cube")
    assert [len(found) for found in TriangleTree(surface.vertices, surface.faces).nearest(np.empty((0, 3)))] == [0] * 3
