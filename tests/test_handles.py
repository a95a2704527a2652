"""Thin handles on a fat body: found, cut off, and laid on its faces again."""

import numpy as np
import pytest
from thick_bodies import BALL, eared, plate

from parameterize.certificate.boundary import check_boundary
from parameterize.layouts.rods.clearance import Clearance
from parameterize.layouts.skeleton.curve_skeleton import skeleton_of
from parameterize.layouts.stubs.handles import handles_of, without_handles
from parameterize.layouts.stubs.stub_blocks import ACROSS, footprint, stub_blocks
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.geometry import signed_volume
from parameterize.surface.solid import Solid
from parameterize.surface.topology import genus_of


@pytest.fixture(scope="module")
def body():
    vertices, faces, genus = eared()
    skeleton = skeleton_of(vertices, faces, genus)
    return vertices, faces, skeleton, handles_of(skeleton, Solid(vertices, faces).lattice(0.03))


def test_each_ear_is_a_handle(body):
    *_, handles = body
    assert len(handles) == 2
    for handle in handles:
        ear = handle.curve.mean(axis=0)
        assert np.linalg.norm(handle.curve - [np.sign(ear[0]) * 0.55, 0.0, 0.0], axis=1).std() < 0.1
        assert 0.05 < handle.radius < 0.12  # of the tube, with the whole body at volume 1


def test_holes_of_a_plate_and_a_ring_alone_are_no_handles_of_a_body():
    vertices, faces, genus = plate([(-1.5, 0.0), (1.5, 0.0)])
    assert handles_of(skeleton_of(vertices, faces, genus), Solid(vertices, faces).lattice(0.03)) == ()


def test_the_body_without_its_handles_has_none(body):
    vertices, faces, skeleton, handles = body
    points, triangles, rims = without_handles(vertices, faces, skeleton, handles, 40_000)
    assert genus_of(triangles) == 0 and len(rims) == 2
    ball = 4.0 / 3.0 * np.pi * (BALL * np.ptp(vertices[:, 1]) / (2.0 * BALL)) ** 3
    assert ball < signed_volume(points, triangles) < 1.1 * ball  # stumps of the ears are left
    for (first, last), handle in zip(rims, handles, strict=True):
        for rim, end in ((first, handle.curve[0]), (last, handle.curve[-1])):
            assert np.linalg.norm(rim - end, axis=1).max() < 3.0 * handle.radius


def test_stubs_are_glued_to_whole_faces_and_the_body_stays_as_it_is(body):
    vertices, faces, skeleton, handles = body
    side = 0.5
    volume = BSplineVolume.from_function(
        lambda u, v, w: (side * (2 * u - 1), side * (2 * v - 1), side * (2 * w - 1) + 0.01 * u * v), control_points=13
    )
    spans = 10
    assert footprint(np.array([[1.0, 0.02, 0.5], [1.0, 0.1, 0.5]]), np.array([1, 1]), spans).first == (1, 4)
    ends = []
    for handle in handles:
        right = handle.curve[:, 0].mean() > 0.0
        places = [np.array([[float(right), 0.5 + x[1], 0.5]]) for x in (handle.curve[0], handle.curve[-1])]
        ends.append(tuple(footprint(place, np.array([int(right)]), spans) for place in places))
    blocks, parts = stub_blocks(volume, ends, handles, Clearance(skeleton, Solid(vertices, faces)))
    rods = blocks.spans[: len(blocks) - len(parts)]
    assert len(rods) == 2 and np.all(rods[:, :2] == ACROSS)
    glued = [face for one in blocks.interfaces for face in (one.first, one.second)]
    assert all((k, end) in glued for k in range(2) for end in ("w0", "w1"))
    corner = volume([[0.0, 0.0, 0.0]])[0]
    assert np.array_equal(parts[0]([[0.0, 0.0, 0.0]])[0], corner)
    assert check_boundary(blocks.body).injective is not False
