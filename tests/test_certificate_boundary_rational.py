"""The boundary of rational volumes and bodies: proofs on rings and coils, and a place where a coil meets itself."""

from dataclasses import replace

import numpy as np
import pytest
from rational_shapes import bent_bar, coil, octant, quarter_ring

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.patch_proofs import _differences
from parameterize.spline.bernstein import binomials
from parameterize.spline.body import Body
from parameterize.spline.rational import homogeneous
from parameterize.spline.volume import BSplineVolume


@pytest.mark.parametrize(
    "volume",
    [quarter_ring(), quarter_ring(0.05, 1.0, 0.1), bent_bar(), coil(3, 0.0), coil(5, 1.5), quarter_ring().refined()],
    ids=["ring", "thin", "bar", "three quarters", "coil", "refined"],
)
def test_boundaries_that_do_not_meet_are_proved(volume):
    assert check_boundary(volume).injective is True


@pytest.mark.parametrize("factor", [1e-60, 1e60])
def test_the_size_of_weights_does_not_matter(factor):
    assert check_boundary(replace(coil(5, 1.5), weights=factor * coil(5, 1.5).weights)).injective is True


@pytest.mark.parametrize("rise", [0.5, 0.2])
def test_a_coil_that_runs_into_itself_is_found(rise):
    found = check_boundary(coil(5, rise))
    assert found.injective is False
    p, q = (coil(5, rise)([place])[0] for place in found.meeting.parameters)
    np.testing.assert_allclose(p, q, atol=1e-12)
    assert np.abs(np.subtract(*found.meeting.parameters)).max() > 0.1


def test_weights_alone_decide_whether_the_boundary_meets_itself():
    """Heavy control points in the middle pull the lower face through the upper one, light ones do not."""
    u = np.linspace(0.0, 1.0, 5)
    points = np.stack(np.meshgrid(u, [0.0, 1.0], [0.0, 0.3], indexing="ij"), axis=-1)
    points[2, :, 0, 2] = 0.8  # the lower face's middle
    weights = np.ones((5, 2, 2))
    knots = np.array([0.0] * 5 + [1.0] * 5)
    line = np.array([0.0, 0.0, 1.0, 1.0])
    light, heavy = (
        BSplineVolume((4, 1, 1), (knots, line, line), points, np.where(points[..., 2:].max(-1) > 0.5, weight, weights))
        for weight in (0.5, 8.0)
    )
    assert check_boundary(light).injective is True
    assert check_boundary(heavy).injective is False


def test_a_face_that_shrinks_to_an_edge_is_not_injective():
    found = check_boundary(octant())
    assert found.injective is False and np.abs(found.meeting.point[:2]).max() < 1e-12  # on the axis z


def test_a_half_ring_of_two_patches_is_proved_and_a_ring_of_four():
    ring = quarter_ring()
    turn = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    quarters = [replace(ring, control_points=ring.control_points @ np.linalg.matrix_power(turn, k)) for k in range(4)]
    assert check_boundary(Body.from_patches(quarters[:2])).injective is True
    body = Body.from_patches(quarters)
    assert len(body.interfaces) == 4 and check_boundary(body).injective is True


@pytest.mark.parametrize("axis", [1, 2])
def test_a_mean_of_the_vectors_is_the_derivative(axis):
    """W^2 F_s over the degree, with weights B_ij C_kl that are positive and sum to 1."""
    rng, q, (s, t), step = np.random.default_rng(0), 2, (0.3, 0.7), 1e-6
    weights = rng.uniform(0.5, 2.0, (3, 3))
    net = homogeneous(rng.normal(size=(3, 3, 3)), weights / weights.max())

    def at(s):  # s along the axis
        return np.einsum("i,j,ijc->c", bernstein(q, s), bernstein(q, t), np.moveaxis(net, axis - 1, 0))

    ahead, behind = (at(s + sign * step) for sign in (1.0, -1.0))
    slope = (ahead[:3] / ahead[3] - behind[:3] / behind[3]) / (2.0 * step)
    vectors = _differences(net[None], axis)[0].reshape(q, q + 1, q + 1, q + 1, 3)
    shares = bernstein(q - 1, s), bernstein(q, t), bernstein(q, s), bernstein(q, t)
    mean = np.einsum("i,j,k,l,ijklc->c", *shares, vectors)
    np.testing.assert_allclose(q * mean, at(s)[3] ** 2 * slope, atol=1e-8)


def bernstein(q, t):
    i = np.arange(q + 1)
    return binomials(q) * t**i * (1.0 - t) ** (q - i)
