"""The cube's corners and edges on the sharp edges of a surface."""

import numpy as np
from plane_bodies import arrays
from shapes import turned

from parameterize.cube.constrained import choose_sharp_corners, constrained
from parameterize.cube.cube import CORNERS, CubeLayout, project_radially, snap
from parameterize.cube.cutting import subdivide_finely
from parameterize.cube.edge_paths import lay_out
from parameterize.cube.flips import flipped
from parameterize.surface.features import features_of
from parameterize.surface.ridges import Ridges


def drum(sides=16):
    """A prism over a regular polygon, whose rims have no corners, in the unit cube: vertices and faces."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = 0.5 + 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.concatenate([np.insert(ring, 2, z, axis=1) for z in (0.0, 1.0)] + [[[0.5, 0.5, 0], [0.5, 0.5, 1]]])
    faces = []
    for i in range(sides):
        j = (i + 1) % sides
        faces += [
            [i, j, sides + j],
            [i, sides + j, sides + i],
            [2 * sides, j, i],
            [2 * sides + 1, sides + i, sides + j],
        ]
    return vertices, np.array(faces)


def laid(vertices, faces, places):
    """A layout whose cube has its edges on ridges, with these and what is constrained, from another one."""
    ridges = Ridges.of(features_of(vertices, faces), vertices, faces)
    columns, fine = subdivide_finely(np.hstack([vertices, places]), faces, 0.12, 5000)
    layout = CubeLayout(columns[:, :3], fine, 0.5 + project_radially(columns[:, 3:] - 0.5), len(vertices))
    found = lay_out(layout, choose_sharp_corners(layout, ridges), ridges)
    found = CubeLayout(found.points, found.faces, snap(found.places), found.n_own)
    return found, ridges, constrained(found, ridges)


def test_a_turned_cube_gets_its_edges_on_those_of_the_body():
    vertices = CORNERS.copy()
    faces = np.array(
        [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]
        + [[1, 5, 7], [1, 7, 3]]
    )
    layout, ridges, kept = laid(vertices, faces, turned(vertices - 0.5, (0.2, -0.3, 0.25)) + 0.5)
    assert kept.length > (1.0 - 1e-12) * ridges.total
    assert np.abs(layout.places[:8] - vertices).max() < 1e-12
    on = ridges.hold(layout.points)
    assert np.array_equal(kept.fixed.sum(axis=1) >= 2, on) and (kept.fixed.sum(axis=1) == 3).sum() == 8
    assert not flipped(layout.places, layout.faces).any()


def test_points_of_a_rim_without_corners_pass_the_corners_of_the_cube():
    vertices, faces = drum()
    layout, ridges, kept = laid(vertices, faces, turned(vertices - 0.5, (0.15, 0.1, 0.5)) + 0.5)
    on = ridges.hold(layout.points)
    assert kept.length > 0.99 * ridges.total and np.array_equal(kept.fixed.sum(axis=1) == 1, on)
    axis = kept.fixed[on].argmax(axis=1)
    assert len(np.unique(axis)) == 1
    assert np.isin(layout.places[on, axis], (0.0, 1.0)).all()
    assert (kept.faces[on] // 2 != axis).all()  # they slide on the faces beside the rim
    assert (layout.places[on, kept.faces[on] // 2] == kept.faces[on] % 2).all()


def test_an_L_has_its_corners_at_ends_of_its_ridges():
    vertices, faces = arrays("L")
    vertices = (vertices - vertices.min(axis=0)) / np.ptp(vertices, axis=0)
    places = 0.5 + project_radially(vertices - [0.4, 0.4, 0.5])
    layout, ridges, kept = laid(vertices, faces, places)
    corners = [np.abs(layout.places - corner).sum(axis=1).argmin() for corner in CORNERS]
    assert ridges.end_at(layout.points[corners]).all() and kept.length > 0.8 * ridges.total
