"""Distortion and distances, on maps whose values can be worked out by hand."""

import json

import igl
import numpy as np
import pytest
from shapes import CORNERS, CUBE_FACES

from parameterize.certificate.body import certify
from parameterize.certificate.boundary import check_boundary
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.quality.distances import Distances, nearest_on_boundary
from parameterize.quality.quality import arap, arap_grid, measure, scaled_jacobian
from parameterize.spline.bspline import collocation, greville, open_uniform_knots
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.nearest import distance_to_mesh


def greville_grid(n, degree=3):
    row = greville(open_uniform_knots(n, degree), degree)
    return np.stack(np.meshgrid(row, row, row, indexing="ij"), axis=-1)


def affine(matrix, n=5):
    return BSplineVolume.uniform(greville_grid(n) @ np.asarray(matrix, dtype=float).T)


def ball(n=14):
    """Interpolates the map from the cube onto the unit ball that scales x by sqrt(1 - y^2/2 - z^2/2 + y^2 z^2/3)."""
    s = 2.0 * greville_grid(n) - 1.0
    x2, y2, z2 = np.moveaxis(s**2, -1, 0)
    factors = [1 - y2 / 2 - z2 / 2 + y2 * z2 / 3, 1 - x2 / 2 - z2 / 2 + x2 * z2 / 3, 1 - x2 / 2 - y2 / 2 + x2 * y2 / 3]
    knots = open_uniform_knots(n, 3)
    inverse = np.linalg.inv(collocation(knots, 3, greville(knots, 3)).toarray())
    values = s * np.sqrt(np.stack(factors, axis=-1))
    return BSplineVolume.uniform(np.einsum("ai,bj,ck,ijkx->abcx", inverse, inverse, inverse, values))


def rotations(n, seed=0):
    q, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, 3, 3)))
    return q * np.sign(np.linalg.det(q))[:, None, None]


def test_distortion_agrees_with_the_singular_values_of_lapack():
    matrices = np.random.default_rng(0).standard_normal((4, 500, 3, 3))
    sigma = np.linalg.svd(matrices, compute_uv=False)
    sigma[..., 2] *= np.sign(np.linalg.det(matrices))
    np.testing.assert_allclose(arap(matrices), np.sum((sigma - 1.0) ** 2, axis=-1), rtol=1e-12)
    graded = rotations(100) @ np.diag([1.0, 1e-3, 1e-10]) @ rotations(100, 2)
    np.testing.assert_allclose(arap(graded), (1.0 - 1e-3) ** 2 + (1.0 - 1e-10) ** 2, rtol=1e-14)


@pytest.mark.parametrize("size", [1e-200, 1e100])
def test_distortion_is_right_in_any_unit(size):
    assert arap(size * np.diag([3.0, 2.0, 1.0])) == pytest.approx(np.sum((size * np.array([3.0, 2.0, 1.0]) - 1.0) ** 2))
    assert arap(np.zeros((3, 3))) == 3.0


@pytest.mark.parametrize(
    ("bad", "message"), [(np.zeros((3, 2)), r"shape \(..., 3, 3\)"), (np.full((3, 3), np.nan), "finite")]
)
def test_bad_jacobians_are_refused(bad, message):
    with pytest.raises(ValueError, match=message):
        arap(bad)


def test_arap_by_hand():
    assert arap(np.diag([2.0, 1.0, 0.5])) == pytest.approx(1.25)  # 1 + 0 + 1/4
    assert arap(np.diag([0.5, 3.0, -1.0])) == pytest.approx(0.0 + 4.0 + 2.25)  # the smallest, 0.5, takes the sign
    np.testing.assert_allclose(arap(rotations(20)), 0.0, atol=1e-28)
    np.testing.assert_allclose(arap(-rotations(20)), 4.0, rtol=1e-14)  # mirrored: (-1 - 1)^2


def test_arap_agrees_with_the_polar_rotation():
    rng = np.random.default_rng(3)
    matrices = rng.standard_normal((200, 3, 3))
    u, _, vt = np.linalg.svd(matrices)
    u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
    closest = u @ vt  # rotation closest to J: ARAP is the squared distance to it
    np.testing.assert_allclose(arap(matrices), np.sum((matrices - closest) ** 2, axis=(1, 2)), rtol=1e-9)


def test_scaled_jacobian():
    assert scaled_jacobian(np.diag([2.0, 5.0, 0.1])) == pytest.approx(1.0)
    assert scaled_jacobian(np.diag([2.0, 5.0, -0.1])) == pytest.approx(-1.0)
    assert scaled_jacobian(np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])) == pytest.approx(0.5**0.5)
    assert scaled_jacobian(np.diag([1.0, 1.0, 0.0])) == 0.0


def test_arap_grid_integrates_over_the_cube():
    points = greville_grid(5)
    points[..., 0] += 0.5 * np.linspace(0.0, 1.0, 5)[:, None, None] ** 2  # x = x(u): ARAP is (x' - 1)^2
    (u, v, w), (values,), weights = arap_grid(BSplineVolume.uniform(points), n_gauss=4)
    assert values.shape == weights.shape == (8, 8, 8) == (len(u), len(v), len(w))
    assert weights.sum() == pytest.approx(1.0, rel=1e-14)
    rate = BSplineVolume.uniform(points).grid_jacobian(u, [0.5], [0.5])[:, 0, 0, 0, 0]
    np.testing.assert_allclose(values, np.broadcast_to((rate[:, None, None] - 1.0) ** 2, values.shape), atol=1e-13)
    _, (plain, scaled), _ = arap_grid(BSplineVolume.uniform(points), n_gauss=1, scales=(1.0, 3.0))
    np.testing.assert_allclose(plain, arap_grid(BSplineVolume.uniform(points), n_gauss=1)[1][0], rtol=1e-12)
    np.testing.assert_allclose(scaled, arap_grid(BSplineVolume.uniform(3.0 * points), n_gauss=1)[1][0], rtol=1e-12)


def test_slabs_do_not_show(monkeypatch):
    volume = ball(8)
    whole = arap_grid(volume)[1]
    monkeypatch.setattr("parameterize.quality.quality._SLAB_POINTS", 500)
    np.testing.assert_allclose(arap_grid(volume)[1], whole, rtol=1e-13)


def to_boundary(points, volume, boundary):
    where, distances = nearest_on_boundary(points, volume, boundary)
    np.testing.assert_allclose(np.linalg.norm(volume(where) - points, axis=1), distances, atol=1e-14)
    assert np.all(np.any((where == 0.0) | (where == 1.0), axis=1))
    return distances


def test_distances_by_hand():
    distances = Distances.of(np.array([3.0, 4.0, 0.0, 0.0]))
    assert (distances.rms, distances.mean, distances.max) == (2.5, 1.75, 4.0)
    assert distances.scaled(2.0) == Distances(5.0, 3.5, 8.0)
    assert Distances.of(np.array([3.0, 4.0, 0.0]), np.array([0.0, 0.25, 0.75])) == Distances(2.0, 1.0, 4.0)
    with pytest.raises(ValueError, match="empty"):
        Distances.of(np.zeros(0))


def test_sampled_boundary_is_the_cube():
    sampled = SampledBoundary.on(affine(np.eye(3)), *[np.linspace(0.0, 1.0, 4)] * 3)
    np.testing.assert_allclose(sampled.points, sampled.parameters, atol=1e-14)
    assert len(sampled.points) == 96 and len(sampled.triangles) == 108
    corners = sampled.points[sampled.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2.0
    assert areas.sum() == pytest.approx(6.0)
    with pytest.raises(ValueError, match="at least 2"):
        SampledBoundary.of(affine(np.eye(3)), samples=1)


def test_each_span_is_sampled_alike():
    knots = open_uniform_knots(5, 3), np.array([0.0, 0.0, 0.1, 0.2, 1.0, 1.0]), open_uniform_knots(4, 3)
    rows = [greville(row, p) for row, p in zip(knots, (3, 1, 3), strict=True)]
    volume = BSplineVolume((3, 1, 3), knots, np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1))
    sampled = SampledBoundary.of(volume, samples=8)
    u, v, w = (np.unique(column) for column in sampled.parameters.T)
    assert len(u) == 2 * 4 + 1 and len(w) == 7 + 1
    np.testing.assert_allclose(
        v, [0.0, 0.1 / 3, 0.2 / 3, 0.1, 0.4 / 3, 0.5 / 3, 0.2, 1.4 / 3, 2.2 / 3, 1.0], atol=1e-14
    )
    assert len(sampled.triangles) == len(sampled.cube_faces) == 4 * (8 * 9 + 9 * 7 + 8 * 7)
    corners = sampled.parameters[sampled.triangles]
    axis, side = sampled.cube_faces // 2, sampled.cube_faces % 2
    for k in range(3):
        np.testing.assert_array_equal(corners[np.arange(len(axis)), k, axis], side)


def test_cube_inside_a_larger_cube():
    gap = 0.125
    larger = (1.0 + 2.0 * gap) * CORNERS - gap
    volume = affine(np.eye(3))
    sampled = SampledBoundary.of(volume, samples=5)
    np.testing.assert_allclose(distance_to_mesh(sampled.points, larger, CUBE_FACES), gap, rtol=1e-12)
    np.testing.assert_allclose(to_boundary(larger, volume, sampled), gap * 3.0**0.5, rtol=1e-12)


def test_inner_points_see_the_nearest_face():
    points = np.random.default_rng(4).uniform(0.05, 0.95, (200, 3))
    volume = affine(np.eye(3))
    expected = np.minimum(points, 1.0 - points).min(axis=1)
    np.testing.assert_allclose(to_boundary(points, volume, SampledBoundary.of(volume, 3)), expected, rtol=1e-10)


def test_foot_points_are_on_the_spline_not_on_its_triangles():
    volume = ball()
    on_it, coarse = (SampledBoundary.on(volume, *[np.linspace(0.0, 1.0, count)] * 3) for count in (23, 12))
    on_it = on_it.points
    assert distance_to_mesh(on_it, coarse.points, coarse.triangles).max() > 1e-3
    assert to_boundary(on_it, volume, coarse).max() < 1e-9
    outside = 1.1 * on_it / np.linalg.norm(on_it, axis=1, keepdims=True)
    np.testing.assert_allclose(to_boundary(outside, volume, coarse), 0.1, atol=2e-4)


def icosphere(levels):
    """A subdivided octahedron with its vertices on the unit sphere."""
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    vertices, faces = igl.upsample(vertices, faces.astype(np.int64), levels)
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), faces


def proofs(volume):
    return certify(volume), check_boundary(volume)


def test_report_on_a_ball():
    volume = ball()
    vertices, faces = icosphere(4)
    parameters = SampledBoundary.of(volume, 14).parameters
    boundary = BoundaryMap(1.25 * volume(parameters), parameters, np.zeros((0, 3), dtype=int))
    scale = (4.0 * np.pi / 3.0) ** (-1.0 / 3.0)
    certificate = certify(volume)
    report = measure(volume, vertices, faces, scale, boundary, certificate, check_boundary(volume)).as_dict()
    assert json.loads(json.dumps(report)) == report
    assert report["control_points"] == [14, 14, 14] and report["degrees"] == [3, 3, 3]
    assert report["bijective"] == certificate.verdict and report["det_lower_bound"] == certificate.lower_bound
    assert report["boundary_injective"] is True and report["boundary_meeting"] is None
    assert report["points"]["arap"] == 33**3 and report["points"]["spline_to_mesh"] == 6 * (11 * 15 + 1) ** 2
    assert report["points"]["mesh_to_spline"] >= len(vertices) == report["points"]["boundary"]
    assert report["boundary"]["as_given"]["max"] == pytest.approx(0.25, abs=1e-4)  # 0.25 |F|, |F| = 1
    (_, (unit, values), weights), given = arap_grid(volume, scales=(scale, 1.0)), report["arap"]["as_given"]
    assert given == {"mean": pytest.approx(np.sum(weights * values)), "max": pytest.approx(values.max())}
    assert report["arap"]["unit_volume"]["mean"] == pytest.approx(np.sum(unit * weights))
    assert report["arap"]["unit_volume"]["mean"] < 0.4 < given["mean"]
    for pair in (report["boundary"], *report["surface_distance"].values()):
        for name in ("rms", "mean", "max"):
            assert pair["unit_volume"][name] == pytest.approx(scale * pair["as_given"][name], rel=1e-12)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sagitta = 1.0 - np.sum(normals * corners[:, 0], axis=1)  # how deep the flat triangles lie below the sphere
    for distances in report["surface_distance"].values():  # the vertices are on the sphere, the triangles are not
        assert distances["as_given"]["max"] == pytest.approx(sagitta.max(), rel=0.1)
    both = report["surface_distance"]["two_sided"]
    assert both["of_diagonal"]["rms"] == pytest.approx(both["as_given"]["rms"] / 12.0**0.5, rel=1e-12)


def test_affine_report_by_hand():
    volume = affine(np.diag([2.0, 1.0, 0.5]))
    boundary = BoundaryMap(CORNERS * [2.0, 1.0, 0.5] + [0.0, 0.0, 0.25], CORNERS, CUBE_FACES)
    report = measure(volume, CORNERS * [2.0, 1.0, 0.5], CUBE_FACES, 2.0, boundary, *proofs(volume))
    section = report.as_dict()
    assert section["bijective"] == "certified" and section["witness"] is None
    assert section["arap"]["as_given"] == {"mean": pytest.approx(1.25), "max": pytest.approx(1.25)}
    assert section["arap"]["unit_volume"]["mean"] == pytest.approx(9.0 + 1.0 + 0.0)  # sigma = 4, 2, 1
    for scale, size in (("as_given", 0.25), ("unit_volume", 0.5)):
        assert section["boundary"][scale] == {name: pytest.approx(size) for name in ("rms", "mean", "max")}
    for pair in section["surface_distance"].values():
        assert pair["as_given"]["max"] < 1e-12
    assert report.diagonal == pytest.approx(5.25**0.5)
    text = str(report)
    assert "certified" in text and "1.25, 1.25" in text and "10, 10" in text


def test_a_left_handed_volume_is_as_good_as_its_mirror_image():
    volume = affine(np.diag([-1.0, 1.0, 1.0]))
    mirrored = CORNERS * [-1.0, 1.0, 1.0]
    report = measure(volume, mirrored, CUBE_FACES, 1.0, BoundaryMap(mirrored, CORNERS, CUBE_FACES), *proofs(volume))
    section = report.as_dict()
    assert section["arap"]["as_given"]["max"] < 1e-20
    assert (section["bijective"], section["orientation"]) == ("certified", "left-handed")


def test_folded_report_names_the_witness():
    volume = affine(np.eye(3))
    volume.control_points[2, 2, 2, 0] += 5.0
    report = measure(volume, CORNERS, CUBE_FACES, 1.0, BoundaryMap(CORNERS, CORNERS, CUBE_FACES), *proofs(volume))
    assert report.as_dict()["orientation"] == "right-handed"
    assert report.as_dict()["witness"] == list(report.certificate.witness)
    assert "folded at (" in str(report)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan")])
def test_scale_must_be_positive(scale):
    volume = affine(np.eye(3))
    boundary = BoundaryMap(CORNERS, CORNERS, CUBE_FACES)
    with pytest.raises(ValueError, match="scale must be positive"):
        measure(volume, CORNERS, CUBE_FACES, scale, boundary, *proofs(volume))
