"""Faces of the part by a line of sight: by hand on a cube, and the region's text leads back to the face."""

import re

import numpy as np
import pytest
import trimesh
from mesh_files import CUBE, TRIANGLES

from iga_nn.live.picking import picked
from parameterize.surface.part import PartSurface


def box(size=1.0, place=(0.0, 0.0, 0.0)):
    return PartSurface(size * CUBE + place, TRIANGLES, {})


def point_of(region):
    return np.array([float(number) for number in re.fullmatch(r"face\((.*),(.*),(.*)\)", region).groups()])


@pytest.mark.parametrize(
    ("start", "end", "triangles", "region"),
    [
        ([0.25, 0.625, 5.0], [0.25, 0.625, 4.0], [2, 3], "face(0.25,0.62,1)"),
        ([0.25, 0.625, -5.0], [0.25, 0.625, -4.0], [0, 1], "face(0.25,0.62,0)"),
        ([-1.0, 0.5, 0.5], [2.0, 0.75, 0.5], [8, 9], "face(0,0.58,0.5)"),
    ],
)
def test_the_nearest_face_on_the_way_is_picked(start, end, triangles, region):
    found = picked(box(), np.array(start), np.array(end))
    assert found.triangles.tolist() == triangles and found.region == region
    assert found.area == pytest.approx(1.0)


def test_a_way_past_the_part_or_away_from_it_picks_nothing():
    assert picked(box(), np.array([2.0, 2.0, 2.0]), np.array([2.0, 2.0, 1.0])) is None
    assert picked(box(), np.array([0.5, 0.5, 2.0]), np.array([0.5, 0.5, 3.0])) is None


@pytest.mark.parametrize("size", [1e-4, 1.0, 2.5e5])
def test_the_text_has_the_digits_that_lead_to_the_face(size):
    for along in (0.5, 0.999, 0.9999):
        start = size * np.array([0.5, along, 2.0]) + 3.0 * size
        part = box(size, [3.0 * size] * 3)
        found = picked(part, start, start - [0.0, 0.0, size])
        assert part.nearest(point_of(found.region)[None])[0] in found.triangles and found.triangles.tolist() == [2, 3]
        assert len(found.region) < 40


def test_a_hole_is_seen_through_and_its_wall_is_round():
    mesh = trimesh.creation.annulus(r_min=1.0, r_max=2.0, height=1.0, sections=48)
    part = PartSurface(np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64), {})
    assert picked(part, np.array([0.0, 0.1, 5.0]), np.array([0.0, 0.1, 4.0])) is None
    wall = picked(part, np.array([0.0, 0.1, 0.0]), np.array([1.0, 0.1, 0.0]))
    assert wall.area == pytest.approx(48 * 2.0 * np.sin(np.pi / 48))
