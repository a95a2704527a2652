"""Sharp edges, smooth faces and first views of bodies that are known by hand."""

import numpy as np
import pytest
from bodies import exact_ring, hollow

import iga_nn
from iga_nn.figures.fields import outer_faces, points_of
from iga_nn.figures.first_view import Cells, shown_from, views_of
from iga_nn.figures.outline import outline_of, outward
from iga_nn.figures.render import Patch, longest_first, thinned
from iga_nn.report.packed import Drawn
from iga_nn.report.viewer import scene_of
from parameterize.spline.volume import BSplineVolume
from solve.study import benchmark_volume


def length_of(body):
    places = points_of(body).on(outer_faces(body)).reshape(-1, 3)
    ends = places[outline_of(body).edges]
    return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum()


def test_a_hollow_cube_has_the_edges_of_two_cubes_and_twelve_faces():
    body = hollow()
    assert length_of(body) == pytest.approx(12 * 4.0 + 12 * 1.0)
    assert len(set(outline_of(body).faces.tolist())) == 12


def test_a_ring_of_four_quarters_has_four_circles_and_four_faces():
    body = exact_ring()
    found = points_of(body).on(outer_faces(body))
    radii = np.hypot(found[..., 0], found[..., 1])
    assert length_of(body) == pytest.approx(4.0 * np.pi * (radii.min() + radii.max()), rel=1e-3)
    assert len(set(outline_of(body).faces.tolist())) == 4


def test_normals_point_outwards():
    body = hollow()
    points = points_of(body).on(outer_faces(body))
    middles, normals = points[:, 1:, 1:], outward(body, points)
    outside = np.abs(middles).max(axis=-1) > 1.0
    assert np.all(((middles * normals).sum(axis=-1) > 0.0) == outside)


def test_the_first_view_shows_the_load_and_not_the_flat_back():
    plate = BSplineVolume.from_function(lambda u, v, w: (6.0 * u, 5.0 * v, w), (4, 4, 4))
    for side in (1.0, -1.0):
        law = iga_nn.Elasticity(fix="ny < -0.9", load={f"{side:g}*nz > 0.9": (0, 0, 1)}, poisson_ratio=0.0)
        view = shown_from(plate, iga_nn.solve(plate, law))
        assert view.towards[2] * side > 0.5


def test_there_are_24_views_and_z_points_up_in_those_from_aside():
    bar = np.random.default_rng(0).uniform(size=(500, 3)) * [3.0, 2.0, 2.5]
    views = views_of(bar)
    assert len(views) == 24 and all(view.up[2] > 0.5 for view in views if abs(view.towards[2]) < 0.8)
    np.testing.assert_allclose(np.abs(longest_first(bar)), np.eye(3)[[0, 2, 1]])


def test_what_lies_behind_is_not_seen():
    body = hollow()
    cells = Cells.of(body, iga_nn.Elasticity(fix="box(-0.6, -0.6, -0.6, 0.6, 0.6, 0.6)").conditions)
    assert np.count_nonzero(cells.regions == 0) > 100
    for view in views_of(cells.middles)[::6]:
        assert np.mean(cells.regions[cells.seen(view)] == 0) < 0.02


def test_layers_have_the_regions_and_the_singular_places():
    volume = benchmark_volume(1, amplitude=0.0)
    heated = iga_nn.solve(volume, iga_nn.Poisson(value="nz > 0.99 and x < 0.5", exchange={"nx > 0.9": (1, 20)}))
    scene = scene_of(volume, heated)
    names = [name for _, name in scene["regions"]["legend"]]
    assert names[0].startswith("value: nz > 0.99") and names[1].startswith("exchange: nx > 0.9")
    assert scene["singular"]["texts"] == [place.text for place in heated.singular] and scene["edges"]
    assert isinstance(Drawn(outer_faces(volume), 1).thinned(points_of(volume))[0], np.ndarray)


def test_a_flat_face_is_drawn_of_fewer_samples_and_a_bent_one_of_all():
    u, v = np.meshgrid(*[np.linspace(0.0, 1.0, 121)] * 2, indexing="ij")
    flat = np.stack([u, v, u + v], axis=-1)[None]
    bent = np.stack([u, v, u**2], axis=-1)[None]
    even, uneven = np.ones_like(flat), np.abs(np.sin(40.0 * flat))
    assert thinned(Patch(flat, even), 1.7).points.shape == (1, 16, 16, 3)
    assert thinned(Patch(bent, even), 1.7).points.shape == (1, 121, 16, 3)
    assert thinned(Patch(flat, uneven), 1.7).points.shape == (1, 121, 121, 3)
    assert thinned(Patch(flat[:, :2, :2], even[:, :2, :2]), 0.0).points.shape == (1, 2, 2, 3)
