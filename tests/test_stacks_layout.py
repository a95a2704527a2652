"""Blocks of stacks of extrusions whose outlines are curved."""

import numpy as np
import pytest
from manifold3d import CrossSection
from plane_bodies import arrays, prism, ring
from shapes import rounded_cube

from parameterize.certificate.certify import certify
from parameterize.layouts.stacks.stack import stack_of
from parameterize.layouts.stacks.stacked_blocks import stacked_blocks
from parameterize.layouts.stacks.tapers import tapered_stack_of
from parameterize.quality.distances import nearest_on_boundary, two_sided
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.surface.geometry import signed_volume


def disc(radius, x=0.0, y=0.0):
    """A circle, as a polygon of 48 corners."""
    return CrossSection.circle(radius, 48).translate((x, y))


def plate(width, depth, *holes):
    """A rectangle with holes, in the plane."""
    found = CrossSection.square((width, depth), True)
    for hole in holes:
        found -= hole
    return found


def slot():
    """A straight line of length 2 as wide as a disc of radius 0.5."""
    return disc(0.5, -1.0) + disc(0.5, 1.0) + CrossSection.square((2.0, 1.0), True)


BODIES = {  # what makes each body, the number of its blocks, and its exact volume
    "cylinder": (lambda: disc(1.0).extrude(2.0), 5, 2.0 * np.pi),
    "tilted cylinder": (lambda: disc(1.0).extrude(2.0).rotate((20.0, 35.0, 50.0)), 5, 2.0 * np.pi),
    "washer": (lambda: (disc(1.0) - disc(0.6)).extrude(0.3), 4, 0.3 * 0.64 * np.pi),
    "shaft with a shoulder": (lambda: disc(1.0).extrude(1.0) + disc(0.5).extrude(3.0), 14, 1.5 * np.pi),
    "plate with a hole": (lambda: plate(4.0, 3.0, disc(0.8, 0.3, 0.2)).extrude(1.0), 8, 12.0 - 0.64 * np.pi),
    "plate with a slot": (lambda: plate(5.0, 3.0, slot()).extrude(1.0), 10, 13.0 - 0.25 * np.pi),
    "blind hole": (
        lambda: plate(4.0, 3.0).extrude(2.0) - disc(0.8).extrude(1.0).translate((0.0, 0.0, 1.0)),
        21,
        24.0 - 0.64 * np.pi,
    ),
    "segment of a disc on a cylinder": (
        lambda: disc(1.0).extrude(2.0) - plate(2.0, 4.0).extrude(2.0).translate((-0.5, 0.0, 1.0)),
        18,
        np.pi + np.pi / 3.0 - np.sqrt(3.0) / 4.0,
    ),
}


@pytest.mark.parametrize("name", BODIES)
def test_blocks_follow_the_outlines_of_a_stack(name):
    make, count, volume = BODIES[name]
    vertices, faces = arrays(make())
    blocks = stacked_blocks(vertices, faces, 6, 3)
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    assert len(blocks) == count
    body = blocks.spline.body
    assert certify(body).verdict == "certified"
    distances = nearest_on_boundary(vertices, body, SampledBoundary.of(body))[2]
    assert distances.max() < 2e-5 * diagonal  # the vertices lie on the circles
    filled = _volume(body)
    assert abs(filled - volume) < 0.1 * abs(signed_volume(vertices, faces) - volume)  # of the round body
    assert 1e-4 < blocks.off < 1e-3


def _volume(body):
    """The volume of patches by quadrature."""
    places, weights = np.polynomial.legendre.leggauss(12)
    places, weights = 0.5 * places + 0.5, 0.5 * weights
    cubed = weights[:, None, None] * weights[:, None] * weights
    return sum(
        float(np.sum(cubed * np.linalg.det(patch.grid_jacobian(places, places, places)))) for patch in body.patches
    )


def test_finely_meshed_walls_have_the_same_profile():
    vertices, faces = arrays(BODIES["washer"][0]().refine(4))
    stack = stack_of(vertices.astype(np.float32).astype(np.float64), faces)
    assert len(stack.heights) == 2 and len(stack.profiles) == 1 and len(stack.profiles[0]) == 2


def test_a_polygon_of_many_corners_becomes_a_circle():
    blocks = stacked_blocks(*arrays(prism(ring(80, 1.0), 1.0)), 6, 3)
    assert len(blocks) == 5 and blocks.off < 4e-4


def test_the_angle_of_sharp_edges_decides_what_a_corner_is():
    vertices, faces = arrays(prism(ring(12, 1.0), 1.0))  # turns of 30 degrees
    assert stacked_blocks(vertices, faces, 6, 3).off > 1e-3
    assert stacked_blocks(vertices, faces, 6, 3, sharp=20.0).off < 1e-12


def test_the_number_of_blocks_binds():
    vertices, faces = arrays(BODIES["washer"][0]())
    assert stacked_blocks(vertices, faces, 6, 3, most=3) is None


def test_other_bodies_are_no_stacks():
    for vertices, faces in (arrays(cone(0.0, 1.0, 1.0, 0.5)), rounded_cube(6)):
        assert stack_of(vertices, faces) is None


def cone(low, high, first, last, x=0.0, y=0.0):
    """A frustum between two heights, of 48 sides, with radii at both."""
    return disc(first).extrude(high - low, scale_top=(last / first,) * 2).translate((x, y, low))


def frustum(height, first, last):
    """Its volume, of a round one."""
    return np.pi / 3.0 * height * (first**2 + first * last + last**2)


TAPERED = {  # what makes each body, the number of its levels, and its exact volume
    "cone": (lambda: cone(0.0, 2.0, 1.2, 0.6), 2, frustum(2.0, 1.2, 0.6)),
    "finely meshed, tilted": (
        lambda: cone(0.0, 2.0, 1.2, 0.6).refine_to_length(0.4).rotate((20.0, 30.0, 40.0)),
        2,
        frustum(2.0, 1.2, 0.6),
    ),
    "countersink": (
        lambda: plate(4.0, 3.0).extrude(0.5) - cone(-1.0, 1.0, 0.3, 0.3, 0.2) - cone(0.25, 0.75, 0.3, 0.8, 0.2),
        3,
        6.0 - 0.25 * 0.09 * np.pi - frustum(0.25, 0.3, 0.55),
    ),
    "shaft with chamfers and a keyway": (
        lambda: (
            (cone(0.0, 0.2, 0.8, 1.0) + cone(0.2, 3.0, 1.0, 1.0) + cone(3.0, 3.2, 1.0, 0.8))
            - plate(0.4, 1.0).extrude(1.0).translate((0.0, 1.2, 1.0))
        ),
        6,
        None,
    ),
    "groove": (
        lambda: (
            cone(0.0, 1.0, 1.0, 1.0) + cone(1.0, 1.3, 1.0, 0.7) + cone(1.3, 1.6, 0.7, 1.0) + cone(1.6, 2.5, 1.0, 1.0)
        ),
        5,
        1.9 * np.pi + 2.0 * frustum(0.3, 1.0, 0.7),
    ),
    "drafted boss on a plate": (
        lambda: plate(4.0, 4.0).extrude(0.6) + cone(0.5, 2.0, 0.9, 0.7),
        3,
        9.6 + frustum(1.5, 0.9, 0.7) - frustum(0.1, 0.9, 0.9 - 0.2 / 15.0),
    ),
}


@pytest.mark.parametrize("name", TAPERED)
def test_sides_that_lean_are_followed(name):
    make, levels, volume = TAPERED[name]
    vertices, faces = arrays(make())
    assert stack_of(vertices, faces) is None and len(tapered_stack_of(vertices, faces).heights) == levels
    blocks = stacked_blocks(vertices, faces, 6, 3)
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    body = blocks.spline.body
    assert certify(body).verdict == "certified"
    found = two_sided(body, vertices, faces)
    assert found.summary().max < 1.2 * blocks.off * diagonal < 1e-3 * diagonal
    if volume is not None:
        assert abs(_volume(body) - volume) < 0.1 * abs(signed_volume(vertices, faces) - volume)


def test_plane_sides_beside_a_leaning_hole_stay_plane():
    vertices, faces = arrays(TAPERED["countersink"][0]())
    body = stacked_blocks(vertices, faces, 6, 3).spline.body
    u, v, w = np.meshgrid(*[np.linspace(0.0, 1.0, 9)] * 3, indexing="ij")
    points = np.concatenate([patch(np.stack([u, v, w], axis=-1).reshape(-1, 3)) for patch in body.patches])
    for axis in range(3):
        ends = points[:, axis] - points[:, axis].min(), points[:, axis].max() - points[:, axis]
        for away in ends:
            assert np.sum(away < 1e-12) >= 81  # a whole face of a block at least
            assert not np.any((away > 1e-9) & (away < 1e-4))


def test_a_side_that_closes_to_a_tip_and_one_in_two_places_are_refused():
    assert tapered_stack_of(*arrays(cone(0.0, 1.0, 1.0, 1e-9))) is None
    apart = cone(0.0, 1.0, 1.0, 1.0) + cone(1.0, 1.5, 1.0, 0.5) + cone(1.5, 2.5, 1.0, 1.0)  # one rim belongs to both
    assert tapered_stack_of(*arrays(apart)) is None


def test_round_bodies_are_no_stacks_of_many_levels():
    """The ring's flat rims meet its sides at 20 degrees: it is a coarse mesh of a smooth body."""
    assert tapered_stack_of(*rounded_cube(6)) is None
    ring = arrays(CrossSection.circle(0.35, 18).translate((1.0, 0.0)).revolve(72))
    assert tapered_stack_of(*ring) is None and tapered_stack_of(*ring, sharp=10.0) is not None
