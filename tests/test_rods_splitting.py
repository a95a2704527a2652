"""Nodes are merged where one block serves two, and split where one does not serve all branches."""

import numpy as np
import pytest
from thick_graphs import curve, thick

from parameterize.layouts.rods.merging import merge
from parameterize.layouts.rods.splitting import junction_at, split
from parameterize.surface.solid import Solid

X, Y, Z = np.eye(3)


def star(*tips):
    nodes = [np.zeros(3), *tips]
    return made(nodes, [(0, k, curve(nodes[0], tip)) for k, tip in enumerate(tips, start=1)])


def made(nodes, edges):
    skeleton, vertices, faces = thick(nodes, edges)
    return skeleton, Solid(vertices, faces)


def in_plane(*degrees):
    return [np.array([np.cos(t), np.sin(t), 0.0]) for t in np.radians(degrees)]


def demand_branches_meet_their_nodes(skeleton):
    for branch in skeleton.branches:
        assert np.allclose(branch.points[[0, -1]], skeleton.nodes[list(branch.ends)], atol=1e-12)
        assert len(branch.points) == len(branch.radii)


@pytest.mark.parametrize(
    ("tips", "degrees"),
    [
        ([X, -X, Y, -Y, Z, -Z], [6]),
        (in_plane(0, 120, 240), [3]),
        (in_plane(0, 60, 120, 180, 240, 300), [4, 4]),  # a cube on its corner would have all its faces for them
        (in_plane(180, -70, -35, 0, 35, 70), [4, 4]),
        (in_plane(*range(0, 360, 45)), None),
    ],
)
def test_a_node_is_split_where_its_branches_crowd(tips, degrees):
    skeleton, body = star(*tips)
    found = split(skeleton, body)
    junctions = [degree for degree in found.degrees if degree > 2]
    assert found.handles == 0 and sum(degree == 1 for degree in found.degrees) == len(tips)
    assert max(junctions) <= 6 and (degrees is None or junctions == degrees)
    angles = [junction_at(found, k)[1].angles.max() for k, degree in enumerate(found.degrees) if degree > 2]
    assert np.degrees(max(angles)) < 50.0
    demand_branches_meet_their_nodes(found)


def letter_h(width):
    """Two limbs up, two down, and a bar between."""
    nodes = [np.array([side * width / 2, 0.0, 0.0]) for side in (-1, 1)]
    tips = [np.array([side * (width / 2 + 0.5), up, 0.0]) for side in (-1, 1) for up in (-1, 1)]
    nodes = [*nodes, *tips]
    return made(nodes, [(0, 1, curve(*nodes[:2])), *((k // 2, k + 2, curve(nodes[k // 2], tips[k])) for k in range(4))])


@pytest.mark.parametrize(("width", "junctions"), [(0.3, [4]), (0.8, [3, 3])])
def test_near_junctions_become_one(width, junctions):
    skeleton, body = letter_h(width)
    found = merge(skeleton, body)
    assert sorted(degree for degree in found.degrees if degree > 2) == junctions
    assert found.handles == 0 and len(found.nodes) == len(junctions) + 4
    demand_branches_meet_their_nodes(found)


def test_a_small_loop_stays():
    ends = [-0.15 * X, 0.15 * X, -X, X]
    edges = [(0, 1, curve(ends[0], ends[1], bulge)) for bulge in (0.05 * Y, -0.05 * Y)]
    skeleton, body = made(ends, [*edges, (0, 2, curve(ends[0], ends[2])), (1, 3, curve(ends[1], ends[3]))])
    assert merge(skeleton, body) is skeleton
