"""Starts of blocks from skeletons: right-handed, inside the body, closed, of its genus, in one piece."""

from collections import defaultdict

import numpy as np
import pytest
from thick_graphs import curve, exposed_genus, genus, loop, thick

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.layouts.rods.along_skeleton import LayoutError, blocks_along
from parameterize.layouts.skeleton.graph import Skeleton
from parameterize.surface.solid import Solid

HUB, X, Y, Z = np.zeros(3), *np.eye(3)


def star(*directions):
    """Limbs from the origin."""
    nodes = [HUB, *directions]
    return nodes, [(0, k, curve(HUB, tip)) for k, tip in enumerate(directions, start=1)]


def on_corners(nodes, pairs):
    return nodes, [(i, j, curve(nodes[i], nodes[j], 0.1 * np.cross(nodes[i], nodes[j]))) for i, j in pairs]


CUBE = [np.array(corner) for corner in np.ndindex(2, 2, 2)]
GRAPHS = {
    "circle": ([HUB], [(0, 0, loop(HUB, X, Y, 0.7))]),
    "twisted circle": (
        [HUB],
        [(0, 0, loop(HUB, X, Y, 0.7) + [[0, 0, 0.4 * np.sin(3 * t)] for t in np.linspace(0, 2 * np.pi, 61)])],
    ),
    "rod": ([-X, X], [(0, 1, curve(-X, X, 0.5 * Y))]),
    "two loops": ([HUB], [(0, 0, loop(HUB, X, Y, 0.7)), (0, 0, loop(HUB, -X, Y, 0.7))]),
    "two loops across": ([HUB], [(0, 0, loop(HUB, X, Y, 0.7)), (0, 0, loop(HUB, -X, Z, 0.7))]),
    "three limbs": star(*(np.array([np.cos(t), np.sin(t), 0.0]) for t in 2 * np.pi * np.arange(3) / 3)),
    "two legs": star(Y, [0.4, -1.0, 0.0], [-0.4, -1.0, 0.0]),
    "tetrahedron": star([1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]),
    "five limbs": star(*(np.array([np.cos(t), np.sin(t), 0.0]) for t in 2 * np.pi * np.arange(5) / 5)),
    "six limbs": star(X, -X, Y, -Y, Z, -Z),
    "eight limbs": star(*(2.0 * corner - 1.0 for corner in CUBE)),
    "hand": star(-X, *(np.array([np.cos(t), np.sin(t), 0.0]) * 1.5 for t in np.linspace(-1.2, 1.2, 5))),
    "theta": ([-X, X], [(0, 1, curve(-X, X, 0.8 * way)) for way in (Y, -Y, 0 * Y)]),
    "frame": on_corners(CUBE, [(i, j) for i in range(8) for j in range(i) if abs(CUBE[i] - CUBE[j]).sum() == 1]),
    "limb on a circle": ([HUB, -X], [(0, 0, loop(HUB, X, Y, 0.7)), (0, 1, curve(HUB, -X))]),
}


@pytest.fixture(scope="module", params=GRAPHS, ids=lambda name: name.replace(" ", "_"))
def start(request):
    skeleton, vertices, faces = thick(*GRAPHS[request.param], cells=60)  # fingers fuse on fewer
    return blocks_along(skeleton, vertices, faces), vertices, faces, skeleton


def test_a_start_is_right_handed_inside_the_body_and_of_its_genus(start):
    blocks, vertices, faces, skeleton = start
    certificate = certify(blocks.body)
    assert certificate.verdict == "certified" and not any(patch.left_handed for patch in certificate.patches)
    assert check_boundary(blocks.body).injective
    assert Solid(vertices, faces).contains(blocks.points).all()
    assert exposed_genus(blocks) == genus(vertices, faces) == skeleton.handles


def test_limbs_end_in_their_tips(start):
    blocks, vertices, faces, skeleton = start
    tips = skeleton.nodes[np.array(skeleton.degrees) == 1]
    closed = [(i, side) for i, free in enumerate(blocks.exposed[:, 4:]) for side in (0, 1) if free[side]]
    rods = defaultdict(list)  # a rod may be cut into strips
    for i, side in closed:
        if (name := blocks.names[i]).startswith("rod"):
            ends = blocks.points[blocks.hexahedra[i][:, :, side]]
            rods[name.partition(", strip")[0], side].append(ends.mean(axis=(0, 1)))
    assert len(rods) == len(tips)
    for middles in rods.values():
        assert np.linalg.norm(tips - np.mean(middles, axis=0), axis=1).min() < 0.2


def test_a_point_is_refused():
    with pytest.raises(LayoutError, match="one cube serves such a body"):
        blocks_along(Skeleton(np.zeros((1, 3)), np.ones(1), (), 1.0, 0.04), np.zeros((0, 3)), np.zeros((0, 3), int))


def test_spans_follow_the_lengths():
    skeleton, vertices, faces = thick(*GRAPHS["limb on a circle"])
    blocks = blocks_along(skeleton, vertices, faces, spans=5)
    spans = {name: tuple(row) for name, row in zip(blocks.names, blocks.spans.tolist(), strict=True)}
    assert spans["junction 0"] == (5, 5, 5)
    assert spans["rod 0"] == (5, 5, 20)  # more than eight times as long as wide: four times the spans across
    assert spans["rod 1"][:2] == (5, 5) and 5 <= spans["rod 1"][2] <= 8  # a sixth as long


def test_a_skeleton_that_leaves_the_body_is_refused_with_the_place():
    skeleton, vertices, faces = thick(*GRAPHS["rod"])
    with pytest.raises(LayoutError, match=r"fits into the body: a .* near here; make the surface wider there"):
        blocks_along(skeleton, vertices + 0.25 * Z, faces, where=lambda place: "here")
