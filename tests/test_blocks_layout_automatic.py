"""Starts of blocks from skeletons: right-handed, inside the body, closed, of its genus."""

import numpy as np
import pytest
from thick_graphs import curve, exposed_genus, genus, loop, thick

from parameterize.blocks.inside import Body
from parameterize.blocks.layout import LayoutError, block_layout
from parameterize.certificate.body import certify
from parameterize.skeleton.graph import Skeleton
from parameterize.spline.multipatch import MultiPatch
from parameterize.spline.volume import BSplineVolume

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


def trilinear(block):
    """The block as a spline of degree 1."""
    count = len(block.sections)
    knots = np.concatenate([[0.0], np.linspace(0.0, 1.0, count), [1.0]])
    ends = np.array([0.0, 0.0, 1.0, 1.0])
    return BSplineVolume((1, 1, 1), (ends, ends, knots), np.ascontiguousarray(np.moveaxis(block.sections, 0, 2)))


@pytest.fixture(scope="module", params=GRAPHS, ids=lambda name: name.replace(" ", "_"))
def start(request):
    skeleton, vertices, faces = thick(*GRAPHS[request.param])
    return block_layout(skeleton, vertices, faces), vertices, faces, skeleton


def test_a_start_is_right_handed_inside_the_body_and_of_its_genus(start):
    layout, vertices, faces, skeleton = start
    certificate = certify(MultiPatch(tuple(map(trilinear, layout.blocks)), layout.interfaces))
    assert certificate.verdict == "certified" and not any(patch.left_handed for patch in certificate.patches)
    assert Body(vertices, faces).contains(layout.corners).all()
    assert exposed_genus(layout) == genus(vertices, faces) == skeleton.handles


def test_limbs_end_in_their_tips(start):
    layout, vertices, faces, skeleton = start
    tips = skeleton.nodes[np.array(skeleton.degrees) == 1]
    closed = [(i, side) for i, free in enumerate(layout.exposed[:, 4:]) for side in (0, 1) if free[side]]
    rods = [(i, side) for i, side in closed if layout.blocks[i].name.startswith("rod")]
    assert len(rods) == len(tips)
    for i, side in rods:
        middle = layout.blocks[i].face(f"w{side}").mean(axis=(0, 1))
        assert np.linalg.norm(tips - middle, axis=1).min() < 0.2


def test_a_point_is_refused():
    with pytest.raises(LayoutError, match="one cube serves such a body"):
        block_layout(Skeleton(np.zeros((1, 3)), np.ones(1), (), 1.0, 0.04), np.zeros((0, 3)), np.zeros((0, 3), int))
