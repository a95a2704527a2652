import igl
import numpy as np
import pytest
from bodies import exact_ring, ring, row_of
from rational_shapes import bent_bar, quarter_ring

from parameterize.spline import location
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.location import bezier_nets
from parameterize.spline.patch_groups import group_of
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.spline.volume import BSplineVolume


def twisted(u, v, w):
    """A column turned by two radians, wider at one end, bent: certified, and not the graph of anything."""
    angle, size = 2.0 * w, 1.0 + 0.5 * w
    x, y = size * (u - 0.5), size * (v - 0.5)
    return np.cos(angle) * x - np.sin(angle) * y + w**2, np.sin(angle) * x + np.cos(angle) * y, 3.0 * w


def uneven():
    """Another degree and other knots a direction, one of them double."""
    degrees = (2, 3, 1)
    knots = (
        np.array([0.0, 0, 0, 0.1, 0.1, 0.7, 1, 1, 1]),
        np.concatenate([[0.0] * 4, [0.01, 0.5, 0.97], [1.0] * 4]),
        np.array([0.0, 0, 0.25, 1, 1]),
    )
    grid = np.meshgrid(*[greville(row, p) for row, p in zip(knots, degrees, strict=True)], indexing="ij")
    return BSplineVolume(degrees, knots, np.stack(twisted(*grid), axis=-1))


PLACES = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
TURNS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((2, 1, 0), (False, True, False))]

VOLUMES = {
    "cubic": BSplineVolume.from_function(twisted, 9),
    "uneven": uneven(),
    "left-handed": BSplineVolume.from_function(lambda u, v, w: twisted(v, u, w), 7),
    "one span": BSplineVolume.from_function(lambda u, v, w: (u + 0.2 * v * w, v, 1e-3 * w), 4),
    "large": BSplineVolume.from_function(twisted, 6).transformed(1e6, [1e9, 0.0, -1e9]),
    "ring": quarter_ring(),
    "rational": bent_bar(),
}


@pytest.mark.parametrize("name", VOLUMES)
def test_points_inside_are_found(name):
    volume, rng = VOLUMES[name], np.random.default_rng(0)
    places = rng.random((3000, 3))
    places[:300, 0], places[300:600, 1], places[600:900, 2] = 0.0, 1.0, rng.integers(0, 2, 300)
    found = volume.locate(volume(places))
    size = np.linalg.norm(np.ptp(volume.control_points.reshape(-1, 3), axis=0))
    noise = 1e-15 * np.abs(volume.control_points).max() / size  # of the points themselves
    np.testing.assert_allclose(volume(found), volume(places), atol=(1e-14 + noise) * size)
    np.testing.assert_allclose(found, places, atol=1e-11 + 1e4 * noise)
    assert found.min() >= 0.0 and found.max() <= 1.0


@pytest.mark.parametrize("name", ["cubic", "uneven", "left-handed", "ring", "rational"])
@pytest.mark.parametrize("gap", [1e-1, 1e-4, 1e-8])
def test_points_beside_the_boundary_are_told_apart(name, gap):
    volume, rng = VOLUMES[name], np.random.default_rng(1)
    axis, side = rng.integers(0, 3, 200), rng.integers(0, 2, 200)
    places = 0.1 + 0.8 * rng.random((200, 3))
    places[np.arange(200), axis] = side
    outwards = np.linalg.inv(volume.jacobian(places))[np.arange(200), axis] * np.where(side, 1.0, -1.0)[:, None]
    outwards *= gap / np.linalg.norm(outwards, axis=1, keepdims=True)
    assert np.isnan(volume.locate(volume(places) + outwards)).all()
    assert gap == 0.1 or np.isfinite(volume.locate(volume(places) - outwards)).all()


def test_all_of_a_box_agrees_with_the_winding_number():
    volume, rng = VOLUMES["cubic"], np.random.default_rng(2)
    points = rng.uniform([-1.0, -1.0, -0.2], [1.5, 1.0, 3.2], (5000, 3))
    boundary = SampledBoundary.of(volume)
    inside = igl.fast_winding_number(boundary.points, boundary.triangles, points) > 0.5
    assert 0.1 < inside.mean() < 0.9
    assert (np.isfinite(volume.locate(points)[:, 0]) != inside).sum() <= 2  # the triangles cut a little off


@pytest.mark.parametrize("name", ["cubic", "rational"])
def test_what_newton_does_not_find_is_found_by_halving(name, monkeypatch):
    volume, places = VOLUMES[name], np.random.default_rng(3).random((200, 3))
    location._index.cache_clear()
    index = location._index((volume,))
    index.groups[0].starts[:] = index.groups[0].starts[::-1].copy()  # the farthest starts
    monkeypatch.setattr(location, "_index", lambda _: index)
    np.testing.assert_allclose(volume.locate(volume(places)), places, atol=1e-11)


def test_bezier_nets_are_the_same_map():
    volume = uneven()
    nets = bezier_nets(group_of(volume))
    assert nets.shape == (3 * 4 * 2, 3, 4, 2, 3)
    np.testing.assert_allclose(nets[0, 0, 0, 0], volume([[0.0, 0.0, 0.0]])[0], atol=1e-14)
    np.testing.assert_allclose(nets[-1, -1, -1, -1], volume([[1.0, 1.0, 1.0]])[0], atol=1e-14)
    np.testing.assert_allclose(nets[1, 0, 0, 0], volume([[0.0, 0.0, 0.25]])[0], atol=1e-14)  # w is the fastest
    np.testing.assert_allclose(nets[2, 0, 0, 0], volume([[0.0, 0.01, 0.0]])[0], atol=1e-14)


def test_a_folded_map_ends_and_gives_one_of_the_places():
    row = greville(open_uniform_knots(6, 3), 3)
    net = np.stack(np.meshgrid(row, row, row, indexing="ij"), axis=-1)
    net[..., 0] = np.abs(net[..., 0] - 0.5)
    volume = BSplineVolume.uniform(net)
    points = volume(np.random.default_rng(4).random((50, 3)))
    np.testing.assert_allclose(volume(volume.locate(points)), points, atol=1e-9)


@pytest.mark.parametrize("body", [row_of(PLACES, TURNS), row_of(PLACES, TURNS[:1] * 3), exact_ring(), ring(3)])
def test_the_first_patch_that_holds_a_point_is_taken(body):
    """As when one patch after the other is asked, also on faces, edges and corners and outside; points find back."""
    rng = np.random.default_rng(5)
    owners, places = rng.integers(0, len(body), 400), rng.random((400, 3))
    for axis in range(3):
        places[100 * axis : 100 * axis + 150, axis] = rng.integers(0, 2, 150)
    points = body.points(owners, places)
    for number, patch in enumerate(body):
        np.testing.assert_allclose(points[owners == number], patch(places[owners == number]), atol=1e-14)
    points = np.concatenate([points, rng.uniform(points.min(axis=0), points.max(axis=0), (300, 3))])
    found, where = body.locate(points)
    alone = np.array([np.isfinite(patch.locate(points)[:, 0]) for patch in body])
    assert np.array_equal(found, np.where(alone.any(axis=0), alone.argmax(axis=0), -1))
    inside = found >= 0
    np.testing.assert_allclose(body.points(found[inside], where[inside]), points[inside], atol=1e-9)


def test_no_points_and_bad_points():
    volume = VOLUMES["cubic"]
    assert volume.locate(np.empty((0, 3))).shape == (0, 3)
    assert np.isnan(volume.locate([[1e300, 0.0, 0.0], [0.0, -1e160, 0.0]])).all()
    assert volume.locate([0.0, 0.0, 0.5]).shape == (1, 3)
    with pytest.raises(ValueError, match=r"shape \(m, 3\), got \(5, 2\)"):
        volume.locate(np.zeros((5, 2)))
    with pytest.raises(ValueError, match="finite"):
        volume.locate([[np.nan, 0.0, 0.0]])
