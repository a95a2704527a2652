"""Collapses of edges keep a surface closed and where it is, and leave no thin triangles."""

from __future__ import annotations

import igl
import numpy as np
import pytest

from iga_nn.samples import sample
from parameterize.surface.collapses import collapsed
from parameterize.surface.geometry import edge_table, signed_volume
from parameterize.surface.topology import crossing_faces, genus_of


@pytest.mark.parametrize("name", ["cube", "bean", "seashell"])
def test_a_divided_surface_becomes_its_own_again(name):
    coarse = sample(name)
    vertices, faces = igl.upsample(coarse.unit_vertices, coarse.faces, 2)
    points, triangles = collapsed(vertices, faces, 2 * len(coarse.faces))
    assert len(triangles) <= 2 * len(coarse.faces) and np.all(edge_table(triangles)[1] == 2)
    assert igl.hausdorff(np.asfortranarray(vertices), faces, points, triangles) < 1e-3
    assert signed_volume(points, triangles) == pytest.approx(signed_volume(vertices, faces), rel=1e-5)
    assert np.degrees(igl.internal_angles(points, triangles)).min() > 5.0
    assert genus_of(triangles) == 0 and not len(crossing_faces(points, triangles))


@pytest.mark.parametrize("most", [4, 5, 20])
def test_few_triangles_stay_a_closed_surface(most):
    points, triangles = collapsed(sample("bean").unit_vertices, sample("bean").faces, most)
    assert len(triangles) == most - most % 2 and np.all(edge_table(triangles)[1] == 2)
    assert len(points) == len(triangles) // 2 + 2


def test_a_hole_through_a_body_stays():
    u, v = np.meshgrid(*[2.0 * np.pi * np.arange(24) / 24] * 2, indexing="ij")
    ring = np.stack([(2.0 + np.cos(v)) * np.cos(u), (2.0 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1).reshape(-1, 3)
    number = np.arange(24 * 24).reshape(24, 24)
    right, up, across = np.roll(number, -1, 0), np.roll(number, -1, 1), np.roll(number, (-1, -1), (0, 1))
    faces = np.concatenate(
        [np.stack(t, axis=-1).reshape(-1, 3) for t in ((number, right, across), (number, across, up))]
    )
    _, triangles = collapsed(ring, faces, 60)
    assert len(triangles) <= 60 and genus_of(triangles) == 1
    assert len(collapsed(ring, faces, 4)[1]) > 4  # seven vertices at least, of fourteen triangles
