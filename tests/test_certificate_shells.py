"""Bodies whose boundary meets itself nowhere, and which nevertheless may cover a place twice."""

import numpy as np
import pytest
from patches import cells, grid, met_twice, patch

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.spline.body import Body

HOLLOW = [place for place in grid(3, 3, 3).tolist() if place != [1, 1, 1]]


def box(low, size):
    return patch(lambda u, v, w: tuple(low + size * part for part in (u, v, w)))


def test_a_void_is_a_shell_that_faces_inward():
    body = Body.from_patches(cells(HOLLOW))
    assert certify(body).verdict == "certified"
    found = check_boundary(body)
    assert found.injective is True and found.overlap is False


def test_two_voids():
    places = [place for place in grid(5, 3, 3).tolist() if place not in ([1, 1, 1], [3, 1, 1])]
    assert check_boundary(Body.from_patches(cells(places))).injective is True


def test_a_body_that_covers_a_place_twice_between_two_shells():
    """All that is local holds: det J, the sides of the interfaces, two disjoint boxes as boundary."""
    body = met_twice()
    found = certify(body)
    assert found.verdict == "certified" and found.volume == pytest.approx(100.0 + 18.0)
    check = check_boundary(body)
    assert check.undecided == 0 and check.meeting is None  # the boundary is one-to-one
    assert check.overlap is True and check.injective is False
    inside = [np.all(np.abs(one([[0.5, 0.5, 0.5]])[0] - 0.5) < 1e-12) for one in body]
    assert sum(inside) == 2  # two patches with the same middle


def test_two_bodies_beside_each_other():
    assert check_boundary(Body((box(0.0, 1.0), box(1.5, 1.0)))).injective is True


def test_a_body_inside_another_one():
    found = check_boundary(Body((box(0.0, 3.0), box(1.0, 1.0))))
    assert found.injective is False and found.overlap is True and found.undecided == 0


def test_a_body_in_the_void_of_another_one():
    assert check_boundary(Body.from_patches([*cells(HOLLOW), box(1.2, 0.6)])).injective is True


def test_a_body_around_the_void_of_another_one():
    """Neither body contains the other: one has a void, which the other one fills, and more around it."""
    places = [place for place in grid(5, 5, 5).tolist() if place != [2, 2, 2]]
    assert check_boundary(Body.from_patches([*cells(places), box(1.5, 2.0)])).injective is False


def test_a_body_in_the_corner_of_an_angle():
    """The second body lies within the box around the first one."""
    angle = cells([[0, 0, 0], [1, 0, 0], [0, 1, 0]])
    moved = patch(lambda u, v, w: (1.25 + 0.5 * u, 1.25 + 0.5 * v, 0.25 + 0.5 * w))
    assert check_boundary(Body.from_patches([*angle, moved])).injective is True
