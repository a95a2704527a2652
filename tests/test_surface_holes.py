from __future__ import annotations

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES, ball

from parameterize.surface.errors import MeshError
from parameterize.surface.holes import boundary_loops
from parameterize.surface.surface import surface_from_arrays


def pierced(numbers, subdivisions=3):
    vertices, faces = ball(subdivisions=subdivisions)
    return vertices, np.delete(faces, numbers, axis=0)


def test_loops_run_against_the_faces_beside_them():
    vertices, faces = ball(subdivisions=1)
    (loop,) = boundary_loops(vertices, faces[1:])
    start = loop.tolist().index(faces[0, 0])
    assert np.roll(loop, -start).tolist() == faces[0].tolist()


def test_holes_that_meet_in_a_vertex_are_filled_each_for_itself():
    vertices, faces = ball(subdivisions=3)
    around = np.flatnonzero((faces == 20).any(axis=1))  # six triangles; every second one is removed
    center = vertices[20]
    side = np.linalg.svd(center[None])[2][1:]
    angle = np.arctan2(*((vertices[faces[around]].mean(axis=1) - center) @ side.T).T)
    removed = around[np.argsort(angle)][::2]
    kept = np.delete(faces, removed, axis=0)
    loops = boundary_loops(vertices, kept)
    assert sorted(sorted(loop.tolist()) for loop in loops) == sorted(sorted(row) for row in faces[removed].tolist())
    surface = surface_from_arrays(vertices, kept, close=True)
    assert surface.volume == pytest.approx(surface_from_arrays(vertices, faces).volume)


def test_the_notice_says_how_many_how_long_and_how_much():
    vertices, faces = pierced([5, 400, 900])
    whole = surface_from_arrays(vertices, faces=ball(subdivisions=3)[1])
    surface = surface_from_arrays(vertices, faces, close=True, groups={"all": np.arange(len(faces))})
    assert surface.volume == pytest.approx(whole.volume)
    (notice,) = surface.notices
    area = sum(whole.part.area(np.array([number])) for number in (5, 400, 900))
    assert notice.startswith("closed 3 boundary loops, the longest ")
    share = 100 * area / whole.part.area(np.arange(1280))
    assert notice.endswith(f"3 faces added, their area {area:.3g}, {share:.2g} % of the surface")
    assert len(surface.groups["all"]) == 1277  # added faces are in no group


def test_large_holes_and_much_area_need_all():
    box = (CUBE, TRIANGLES[2:])
    with pytest.raises(MeshError, match="close the hole with --close all"):
        surface_from_arrays(*box)
    with pytest.raises(MeshError, match="the longest 231 % of the box's diagonal, more than 25 %"):
        surface_from_arrays(*box, close=True)
    assert surface_from_arrays(*box, close="all").volume == pytest.approx(1.0)
    many = pierced(np.arange(0, 1280, 12))
    with pytest.raises(MeshError, match="close the holes with --close, or"):
        surface_from_arrays(*many)
    with pytest.raises(MeshError, match=r"whose filling is 8\.\d % of the surface, more than 5 %"):
        surface_from_arrays(*many, close=True)
    assert len(surface_from_arrays(*many, close="all").faces) == 1280


def test_an_open_surface_of_mixed_winding_is_wound_first():
    vertices, faces = pierced([5, 400])
    mixed = np.concatenate([faces[:300, ::-1], faces[300:]])
    surface = surface_from_arrays(vertices, mixed, close=True)
    assert surface.volume == pytest.approx(surface_from_arrays(vertices, faces, close=True).volume)


def test_a_moebius_strip_is_one_sided():
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    across = np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1)
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    vertices = np.concatenate([circle - 0.3 * across, circle + 0.3 * across])
    ends = [(i, (i + 1, i + 25) if i < 23 else (24, 0)) for i in range(24)]
    faces = [row for i, (low, high) in ends for row in ([i, low, high], [i, high, i + 24])]
    with pytest.raises(MeshError, match="one-sided surface"):
        surface_from_arrays(vertices, faces, close="all")


def test_closed_surfaces_are_left_alone():
    assert surface_from_arrays(*ball(), close=True).notices == ()
