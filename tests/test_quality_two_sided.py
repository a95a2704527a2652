import numpy as np
import pytest
from shapes import CORNERS, CUBE_FACES

from parameterize.quality import distances as module
from parameterize.quality.distances import two_sided
from parameterize.spline.volume import BSplineVolume

HEIGHT = 0.01


def bulged_cube():
    """The unit cube whose face w = 1 bulges by 16 HEIGHT u (1 - u) v (1 - v): its corners and edges stay."""
    lift = 16.0 * HEIGHT * np.array([[0.0, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.0]])
    net = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 3)] * 3, indexing="ij"), axis=-1)
    net[:, :, 2, 2] += lift
    return BSplineVolume.uniform(net, degree=2)


def check(found):
    there, back = found.mesh_to_spline.summary(), found.spline_to_mesh.summary()
    rms = HEIGHT * 16.0 / 30.0 / 6.0**0.5  # the integral of u^2 (1 - u)^2 is 1/30; the cube has six faces
    for way in (there, back):
        assert way.max == pytest.approx(HEIGHT, rel=2e-3)
        assert way.rms == pytest.approx(rms, rel=1e-2)
        assert way.mean == pytest.approx(HEIGHT * 16.0 / 36.0 / 6.0, rel=1e-2)
    both = found.summary()
    assert both.max == max(there.max, back.max)
    assert both.rms == pytest.approx(((there.rms**2 + back.rms**2) / 2.0) ** 0.5, rel=1e-14)
    assert both.mean == pytest.approx((there.mean + back.mean) / 2.0, rel=1e-14)


def test_a_bulge_between_the_vertices_is_seen_both_ways():
    volume = bulged_cube().refined(3)
    assert np.abs(volume(CORNERS) - CORNERS).max() < 1e-14  # at the eight vertices there is nothing to see
    check(two_sided(volume, CORNERS, CUBE_FACES))


def test_uneven_knots_do_not_change_the_distances():
    volume = bulged_cube().refined(2)
    breaks = np.concatenate([np.linspace(0.0, 0.1, 9)[1:], np.linspace(0.1, 1.0, 5)[1:-1]])
    uneven = np.concatenate([[0.0] * 3, np.union1d(breaks, volume.knots[0][3:-3]), [1.0] * 3])
    check(two_sided(volume.on_knots((uneven, volume.knots[1], volume.knots[2])), CORNERS, CUBE_FACES))


def test_samples_know_where_they_are():
    volume = bulged_cube().refined(2)
    found = two_sided(volume, CORNERS, CUBE_FACES)
    for way in (found.mesh_to_spline, found.spline_to_mesh):
        assert len(way.distances) == len(way.shares) == len(way.parameters)
        assert way.shares.sum() == pytest.approx(1.0, rel=1e-12)
        np.testing.assert_allclose(way.parameters[way.distances.argmax()], [0.5, 0.5, 1.0], atol=0.02)
        assert way.distances[way.parameters[:, 2] < 0.999].max() < 1e-9


def test_there_are_not_more_samples_than_allowed(monkeypatch):
    volume = bulged_cube().refined(1)
    many = len(two_sided(volume, CORNERS, CUBE_FACES).mesh_to_spline.distances)
    monkeypatch.setattr(module, "_MOST_SAMPLES", many // 2)
    assert 8 < len(two_sided(volume, CORNERS, CUBE_FACES).mesh_to_spline.distances) <= many // 2
    monkeypatch.setattr(module, "_MOST_SAMPLES", 4)  # the mesh's own vertices stay
    assert len(two_sided(volume, CORNERS, CUBE_FACES).mesh_to_spline.distances) == 8
