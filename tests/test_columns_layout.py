"""Blocks of stacks of extrusions whose outlines are curved."""

import numpy as np
import pytest
from manifold3d import CrossSection
from plane_bodies import arrays, prism, ring
from shapes import rounded_cube

from parameterize.certificate.body import certify
from parameterize.columns.layout import columns_of
from parameterize.columns.stack import stack_of
from parameterize.quality.distances import nearest_on_boundary
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
}


@pytest.mark.parametrize("name", BODIES)
def test_blocks_follow_the_outlines_of_a_stack(name):
    make, count, volume = BODIES[name]
    vertices, faces = arrays(make())
    columns = columns_of(vertices, faces, 6, 3)
    diagonal = np.linalg.norm(np.ptp(vertices, axis=0))
    assert len(columns) == count
    body = columns.spline.body
    assert certify(body).verdict == "certified"
    distances = nearest_on_boundary(vertices, body, SampledBoundary.of(body))[2]
    assert distances.max() < 2e-5 * diagonal  # the vertices lie on the circles
    filled = _volume(body)
    assert abs(filled - volume) < 0.1 * abs(signed_volume(vertices, faces) - volume)  # of the round body
    assert 1e-4 < columns.off < 1e-3


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
    columns = columns_of(*arrays(prism(ring(80, 1.0), 1.0)), 6, 3)
    assert len(columns) == 5 and columns.off < 4e-4


def test_the_angle_of_sharp_edges_decides_what_a_corner_is():
    vertices, faces = arrays(prism(ring(12, 1.0), 1.0))  # turns of 30 degrees
    assert columns_of(vertices, faces, 6, 3).off > 1e-3
    assert columns_of(vertices, faces, 6, 3, sharp=20.0).off < 1e-12


def test_the_number_of_blocks_binds():
    vertices, faces = arrays(BODIES["washer"][0]())
    assert columns_of(vertices, faces, 6, 3, most=3) is None


def test_other_bodies_are_no_stacks():
    cone = disc(1.0).extrude(1.0, scale_top=(0.5, 0.5))
    for vertices, faces in (arrays(cone), rounded_cube(6)):
        assert stack_of(vertices, faces) is None
