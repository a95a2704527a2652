import numpy as np
import pytest
from scipy.spatial.distance import cdist

from parameterize.training.target_shapes import (
    cuboid_scale,
    nearest,
    nearest_on_cube,
    nearest_on_cube_face,
    nearest_on_cuboid,
)


def random_points(count=300, low=-0.6, high=1.6):
    return np.random.default_rng(0).uniform(low, high, (count, 3))


def cube_samples(n):
    """A grid with edges and corners on every face of the unit cube."""
    row = np.linspace(0.0, 1.0, n)
    a, b = (x.reshape(-1) for x in np.meshgrid(row, row, indexing="ij"))
    faces = []
    for axis in range(3):
        for side in (0.0, 1.0):
            face = np.full((len(a), 3), side)
            face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = a, b
            faces.append(face)
    return np.concatenate(faces)


def distance_to_cube_body(points):
    return np.linalg.norm(points - points.clip(0.0, 1.0), axis=1)


def cuboid_samples(d, n=120):
    """Dense points of the boundary of S(d): rays from the centre, cut where the distance to the cube is d."""
    k = np.arange(n * n)
    z = 1.0 - (2.0 * k + 1.0) / len(k)
    angle = np.pi * (3.0 - np.sqrt(5.0)) * k
    radius = np.sqrt(1.0 - z**2)
    rays = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
    low, high = np.zeros((len(k), 1)), np.full((len(k), 1), d + 1.0)
    for _ in range(60):
        middle = 0.5 * (low + high)
        inside = (distance_to_cube_body(0.5 + middle * rays) < d)[:, None]
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return 0.5 + cuboid_scale(d) * low * rays


@pytest.mark.parametrize("d", [1.0, 2.0])
def test_smooth_cuboid_has_volume_one(d):
    count = 64
    row = (np.arange(count) + 0.5) / count  # midpoint rule along z, exact areas of the rounded squares across it
    z = -d + (1.0 + 2.0 * d) * row
    reach = np.sqrt(np.maximum(d**2 - np.maximum(np.maximum(-z, z - 1.0), 0.0) ** 2, 0.0))
    areas = 1.0 + 4.0 * reach + np.pi * reach**2
    volume = areas.mean() * (1.0 + 2.0 * d)
    assert cuboid_scale(d) ** 3 * volume == pytest.approx(1.0, rel=2e-3)
    steiner = 1.0 + 6.0 * d + 3.0 * np.pi * d**2 + 4.0 / 3.0 * np.pi * d**3
    assert cuboid_scale(d) ** 3 * steiner == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("d", [1.0, 2.0])
def test_nearest_on_cuboid_against_dense_samples(d):
    points, samples = random_points(), cuboid_samples(d)
    found = nearest_on_cuboid(points, d)
    scale = cuboid_scale(d)
    unscaled = 0.5 + (found - 0.5) / scale
    assert distance_to_cube_body(unscaled) == pytest.approx(d, abs=1e-12)  # it lies on the boundary of S(d)
    brute = cdist(points, samples).min(axis=1)
    gap = np.linalg.norm(points - found, axis=1)
    assert (gap <= brute + 1e-12).all()  # no sample is closer
    assert (gap >= brute - 0.02).all()


def test_nearest_on_cuboid_inside_the_core_cube_goes_straight_to_the_closest_side():
    d = 1.0
    found = nearest_on_cuboid(np.array([[0.5, 0.45, 0.5]]), d)
    assert found[0].tolist() == pytest.approx([0.5, 0.5 - 1.5 * cuboid_scale(d), 0.5])


def test_nearest_on_cube_against_dense_samples():
    points, samples = random_points(low=-0.3, high=1.3), cube_samples(101)
    found = nearest_on_cube(points)
    assert ((found == 0.0) | (found == 1.0)).any(axis=1).all()
    assert ((found >= 0.0) & (found <= 1.0)).all()
    brute = cdist(points, samples).min(axis=1)
    gap = np.linalg.norm(points - found, axis=1)
    assert (gap <= brute + 1e-12).all() and (gap >= brute - 0.01).all()


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ([0.2, 0.5, 0.5], [0.0, 0.5, 0.5]),  # inside
        ([0.9, 0.95, 0.5], [0.9, 1.0, 0.5]),
        ([1.5, 0.3, 0.4], [1.0, 0.3, 0.4]),  # outside, before a face
        ([1.5, -0.3, 0.4], [1.0, 0.0, 0.4]),  # an edge
        ([1.5, -0.3, 7.0], [1.0, 0.0, 1.0]),  # a corner
        ([0.0, 0.3, 1.0], [0.0, 0.3, 1.0]),  # on an edge already
        ([0.4, 0.3, 1.0], [0.4, 0.3, 1.0]),  # on a face already
    ],
)
def test_nearest_on_cube_by_hand(point, expected):
    assert nearest_on_cube(np.array([point]))[0].tolist() == pytest.approx(expected, abs=1e-15)


def test_nearest_on_a_given_face():
    points = np.array([[0.2, 0.3, 0.9]] * 6)
    points[5, 0] = -0.4
    found = nearest_on_cube_face(points, np.arange(6))
    expected = [[0, 0.3, 0.9], [1, 0.3, 0.9], [0.2, 0, 0.9], [0.2, 1, 0.9], [0.2, 0.3, 0], [0, 0.3, 1]]
    assert found.tolist() == expected


def test_targets_by_name():
    points = random_points(20)
    assert np.array_equal(nearest("cube", points), nearest_on_cube(points))
    assert np.array_equal(nearest("S(2)", points), nearest_on_cuboid(points, 2.0))
