"""Patches are glued where their faces have the same trace, in every orientation, and nowhere else."""

from __future__ import annotations

from itertools import permutations, product

import numpy as np
import pytest
from bodies import turned
from cube_grids import box, frame, plate, ring, two

import iga_nn
from iga_nn import Body, BSplineVolume, Interface
from parameterize.spline.body import as_body, shared_numbers
from parameterize.spline.bspline import greville
from parameterize.spline.interface import face_layer


def uneven(corner):
    """A cube with other degrees and knots in each direction."""
    knots = (
        np.array([0.0, 0, 0, 0.3, 1, 1, 1]),
        np.array([0.0, 0, 0, 0, 0.2, 0.7, 1, 1, 1, 1]),
        np.array([0.0, 0, 0.6, 1, 1]),
    )
    degrees = (2, 3, 1)
    rows = [greville(row, degree) for row, degree in zip(knots, degrees, strict=True)]
    return BSplineVolume(degrees, knots, np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1) + corner)


@pytest.mark.parametrize("axes", list(permutations(range(3))))
@pytest.mark.parametrize("flips", list(product((False, True), repeat=3)))
def test_a_neighbour_is_found_however_its_parameters_run(axes, flips):
    first, second = uneven((0, 0, 0)), turned(uneven((0, 1, 0)), axes, flips)
    body = Body.from_patches([first, second])
    (interface,) = body.interfaces
    assert interface.first == (0, "v1")
    nets = [face_layer(body.patches[p].control_points, face) for p, face in (interface.first, interface.second)]
    assert np.array_equal(nets[0], interface.turned(nets[1]))
    assert sum(map(len, body.outer)) == 10


@pytest.mark.parametrize(
    ("body", "interfaces"), [(two(), 1), (plate(), 8), (frame(), 24), (ring(), 1), (ring(patches=4), 4)]
)
def test_bodies_have_their_interfaces(body, interfaces):
    assert len(body.interfaces) == interfaces
    assert sum(map(len, body.outer)) == 6 * len(body) - 2 * interfaces


def test_a_ring_is_glued_to_itself():
    (interface,) = ring().interfaces
    assert (interface.first, interface.second) == ((0, "u0"), (0, "u1"))
    assert str(interface) == "p0_u0 = p0_u1"


def test_shared_coefficients_have_one_number():
    body = plate(1, 1)  # eight cubes of eight control points around a hole: 32 points in all
    numbers, count = shared_numbers([patch.shape for patch in body], body.interfaces)
    points = np.full((count, 3), np.nan)
    for own, patch in zip(numbers, body, strict=True):
        points[own] = patch.control_points
    assert count == 32 and len(np.unique(points, axis=0)) == 32


def test_nearly_equal_control_points_become_one():
    left, right = box((0, 0, 0)), box((1, 0, 0))
    moved = BSplineVolume(right.degrees, right.knots, right.control_points + 1e-9)
    body = Body.from_patches([left, moved])
    assert np.array_equal(body.patches[0].control_points[-1], body.patches[1].control_points[0])
    assert Body.from_patches([left, moved], tolerance=1e-12).interfaces == ()


def test_faces_over_the_same_corners_with_other_shapes_are_not_glued():
    lens = BSplineVolume.from_function(lambda u, v, w: (u + 0.2 * (1 - u) * v * (1 - v), v, w), 5)
    assert Body.from_patches([box((-1, 0, 0)), lens]).interfaces == ()


def test_a_face_that_has_shrunk_to_an_edge_is_not_glued():
    """Two wedges around a common edge: the faces that have become the edge are not an interface."""
    wedges = [
        BSplineVolume.from_function(lambda u, v, w, s=s: (s * u, u * (2 * v - 1) / 2, w), 3, degree=1)
        for s in (1.0, -1.0)
    ]
    assert Body.from_patches(wedges).interfaces == ()


@pytest.mark.parametrize(
    ("patches", "says"),
    [
        (lambda: [], "one patch or more"),
        (lambda: [box((0, 0, 0))] * 2, "every face is glued"),
        (lambda: [box((0, 0, 0)), box((1, 0, 0)).refined()], "p0_u1 and p1_u0 are the same surface"),
        (lambda: [box((0, 0, 0)), box((1, 0, 0)), box((1, 0, 0))], "are one surface: at most two"),
    ],
)
def test_what_does_not_match_is_named(patches, says):
    with pytest.raises(ValueError, match=says):
        Body.from_patches(patches())


@pytest.mark.parametrize(
    ("interfaces", "says"),
    [
        ([Interface((0, "u1"), (1, "u1"))], "p0_u1 = p1_u1: the control points"),
        ([Interface((0, "u1"), (1, "u0"), flipped=(True, False))], "the control points or weights of the two faces"),
        ([Interface((0, "u1"), (2, "u0"))], "there are 2 patches, from 0 on"),
        ([Interface((0, "u1"), (1, "u0"))] * 2, "p0_u1 is glued twice"),
    ],
)
def test_interfaces_without_equal_traces_are_refused(interfaces, says):
    with pytest.raises(ValueError, match=says):
        Body((box((0, 0, 0)), box((1, 0, 0))), tuple(interfaces))


def test_other_objects_are_refused():
    with pytest.raises(TypeError, match="must be a BSplineVolume"):
        iga_nn.Body.from_patches([box((0, 0, 0)), "volume.npz"])
    for make in (iga_nn.Body, iga_nn.Body.from_patches):
        with pytest.raises(TypeError, match="patches must be a list of volumes, got BSplineVolume"):
            make(box((0, 0, 0)))


@pytest.mark.parametrize("tolerance", [-1.0, np.nan, 1.0, "a", None])
def test_a_tolerance_is_a_share(tolerance):
    with pytest.raises(ValueError, match="tolerance must be a share of the body's size"):
        Body.from_patches([box((0, 0, 0))], tolerance=tolerance)


def test_faces_that_nearly_match_are_told_but_not_glued():
    body = Body.from_patches([box((0, 0, 0)), box((1.00001, 0, 0)), box((2.00001, 0, 0)), box((4, 0, 0))])
    ((pair, distance),) = body.nearly_glued
    assert str(pair) == "p0_u1 = p1_u0" and distance == pytest.approx(1e-5)
    assert body.parts == [[0], [1, 2], [3]]
    assert plate().nearly_glued == [] and len(plate().parts) == 1


@pytest.mark.parametrize("face", [(0, "u7"), 0, (1,), ("0", "u0"), "p0_u1"])
def test_a_face_is_a_number_and_a_name(face):
    with pytest.raises(ValueError, match="a face is the number of a patch and a name"):
        Interface((0, "u1"), face)


def test_two_directions_are_flipped_or_not():
    with pytest.raises(ValueError, match="flipped must be two truth values"):
        Interface((0, "u1"), (1, "u0"), flipped=(True,))


def test_interfaces_are_objects():
    with pytest.raises(TypeError, match="interfaces must be Interface objects, got 'p0_u1 = p1_u0'"):
        Body((box((0, 0, 0)), box((1, 0, 0))), ("p0_u1 = p1_u0",))


def test_points_are_located_in_their_patches():
    owners, where = plate().locate([[0.25, 0.5, 0.5], [2.5, 2.5, 0.1], [1.5, 1.5, 0.5]])
    assert owners.tolist() == [0, 7, -1]
    assert where[:2] == pytest.approx(np.array([[0.25, 0.5, 0.5], [0.5, 0.5, 0.1]])) and np.isnan(where[2]).all()


def test_points_of_patches_are_what_locate_finds():
    body, places = plate(), np.array([[2.5, 2.5, 0.1], [0.25, 0.5, 0.5], [0.75, 0.5, 0.5]])
    assert body.points(*body.locate(places)) == pytest.approx(places)
    with pytest.raises(ValueError, match="there is no patch 8: the body has 8, from 0 on"):
        body.points([0, 8], places[:2])
    with pytest.raises(ValueError, match=r"got shapes \(2,\) and \(3, 3\)"):
        body.points([0, 1], places)


def test_a_volume_is_a_body_of_one_patch():
    volume = box((0, 0, 0))
    body = as_body(volume)
    assert body.is_single and body.only is volume and body.simplest is volume and as_body(body) is body
    assert body.face_name(0, "u0") == "u0" and body.size == 1.0 and body.numbering[1] == volume.control_points.size // 3


def test_several_patches_and_a_ring_are_no_image_of_a_cube():
    body = two()
    assert not body.is_single and body.simplest is body and body.face_name(1, "u1") == "p1_u1"
    with pytest.raises(ValueError, match=r"this body has 2 patches: use body.patches\[i\]"):
        _ = body.only
    glued = ring()
    assert not glued.is_single and glued.only is glued.patches[0] and glued.face_name(0, "v0") == "p0_v0"
