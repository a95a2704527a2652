"""Skeletons by formula with the surfaces of tubes around them, and what the exposed faces of a layout make up."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pyvista
from scipy.spatial import cKDTree

from parameterize.layouts.skeleton.graph import Branch, Skeleton
from parameterize.spline.body import shared_numbers
from parameterize.spline.interface import face_layer
from parameterize.spline.volume import FACE_NAMES
from parameterize.surface.geometry import edge_table, signed_volume

RADIUS = 0.2  # of the tubes; graphs are about as large as the unit ball


def curve(first, last, bulge=(0.0, 0.0, 0.0), steps=40):
    """A curve between two points: half a sine of the bulge on the way."""
    t = np.linspace(0.0, 1.0, steps + 1)[:, None]
    return (1 - t) * np.array(first, float) + t * np.array(last, float) + np.sin(np.pi * t) * np.array(bulge, float)


def loop(node, outward, across, size, steps=60):
    """A circle of a radius that leaves a node and comes back to it."""
    angle = np.linspace(-np.pi, np.pi, steps + 1)[:, None]
    outward, across = np.array(outward, float), np.array(across, float)
    return np.array(node, float) + size * ((1 + np.cos(angle)) * outward + np.sin(angle) * across)


def thick(nodes, edges, radius=RADIUS, cells=44):
    """The skeleton of curves (first node, last node, points), and the surface around them: vertices and faces."""
    branches = tuple(Branch((i, j), points, np.full(len(points), radius)) for i, j, points in edges)
    skeleton = Skeleton(np.array(nodes, float), np.full(len(nodes), radius), branches, 1.0, 0.04)
    dense = np.concatenate([_filled(branch.points) for branch in branches])
    low, high = dense.min(axis=0) - 1.3 * radius, dense.max(axis=0) + 1.3 * radius
    spacing = (high - low).max() / cells
    dimensions = np.ceil((high - low) / spacing).astype(int) + 1
    grid = pyvista.ImageData(dimensions=dimensions, spacing=[spacing] * 3, origin=low)
    away = cKDTree(dense).query(grid.points)[0] - radius
    mesh = grid.contour([0.0], scalars=away).triangulate().clean()
    vertices, faces = np.asarray(mesh.points, float), mesh.faces.reshape(-1, 4)[:, 1:].astype(np.int64)
    return skeleton, vertices, faces if signed_volume(vertices, faces) > 0 else faces[:, ::-1]


def _filled(points):
    t = np.linspace(0.0, 1.0, 6)[:, None, None]
    return ((1 - t) * points[:-1] + t * points[1:]).reshape(-1, 3)


def genus(vertices, faces):
    return 1 - (len(vertices) - len(edge_table(faces)[0]) + len(faces)) // 2


def exposed_genus(blocks):
    """The genus of the surface that the exposed faces make up; it is closed: two of them meet at each of its edges.

    Each block is a lattice of three points a direction: an edge has its middle point.
    """
    numbers, _ = shared_numbers([(3, 3, 3)] * len(blocks), blocks.interfaces)
    corners, edges, count = set(), Counter(), 0
    for block, free in zip(numbers, blocks.exposed, strict=True):
        for name in np.array(FACE_NAMES)[free]:
            net = face_layer(block, str(name))
            corners.update(net[::2, ::2].ravel().tolist())
            edges.update([net[0, 1], net[2, 1], net[1, 0], net[1, 2]])
            count += 1
    assert set(edges.values()) == {2}
    return 1 - (len(corners) - len(edges) + count) // 2
