"""Quality reports and distances, on maps whose values can be worked out by hand."""

import json
from dataclasses import replace

import igl
import numpy as np
import pytest
from blocks import outer_surface
from patches import patch as from_function
from patches import plate_with_hole
from shapes import CORNERS, CUBE_FACES

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.quality.distances import Distances, nearest_on_boundary, two_sided
from parameterize.quality.distortion import BoxDistortion, Distortion, arap_grid
from parameterize.quality.quality import MOST_LINES, _lines_of, measure
from parameterize.spline.body import Body
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


def to_boundary(points, volume, boundary):
    patches, where, distances = nearest_on_boundary(points, volume, boundary)
    assert not patches.any()
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
    solid = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    assert report["volume"]["mesh"] == pytest.approx(solid, rel=1e-12)
    assert report["volume"]["spline"] == pytest.approx(4.0 * np.pi / 3.0, rel=1e-3)
    assert report["volume"]["difference"] == pytest.approx(report["volume"]["spline"] / solid - 1.0)
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
    assert section["volume"] == pytest.approx({"spline": 1.0, "mesh": 1.0, "difference": 0.0}, abs=1e-12)
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


def test_a_body_of_patches_by_hand():
    """Two straight bars of 2 x 1 x 1 and 1 x 1 x 1 are not distorted; their surface is moved by 0.1 along z."""
    bars = [from_function(lambda u, v, w: (2.0 * u, v, w)), from_function(lambda u, v, w: (2.0 + w, v, 1.0 - u))]
    body = Body.from_patches(bars)
    outer = outer_surface(body)
    moved = replace(outer, vertices=outer.vertices + [0.0, 0.0, 0.1])
    report = measure(body, moved.vertices, moved.faces, 2.0, moved, certify(body), check_boundary(body))
    section = report.as_dict()
    assert json.loads(json.dumps(section)) == section
    assert section["control_points"] == report.control_points == 2 * 4**3 - 4**2 and report.degrees == (3,)
    assert (section["bijective"], section["boundary_injective"], section["euler_number"]) == ("certified", True, 2)
    for scale in ("unit_volume", "as_given"):
        assert section["arap"][scale]["max"] < 1e-20
    assert [part["own_box"] for part in section["patches"]] == [pytest.approx([2, 1, 1]), pytest.approx([1, 1, 1])]
    assert [part["volume"] for part in section["patches"]] == pytest.approx([2.0, 1.0])
    assert section["volume"] == pytest.approx({"spline": 3.0, "mesh": 3.0, "difference": 0.0}, abs=1e-12)
    assert [part["bijective"] for part in section["patches"]] == ["certified"] * 2
    assert section["boundary"]["as_given"] == {name: pytest.approx(0.1) for name in ("rms", "mean", "max")}
    for pair in section["surface_distance"].values():
        assert pair["as_given"]["max"] == pytest.approx(0.1) and pair["unit_volume"]["max"] == pytest.approx(0.2)
    # the surface's top is 0.1 above the body's; its bottom is inside, near the walls closer to them; a strip sticks out
    top, bottom, strip = 0.03, 2.8 * 0.8 * 0.01 + 8.0 * (0.001 / 3.0 - 0.0001 / 4.0), 8.0 * 0.001 / 3.0
    there = section["surface_distance"]["mesh_to_spline"]["as_given"]
    assert there["rms"] == pytest.approx(((top + bottom + strip) / 14.0) ** 0.5, rel=5e-3)
    text = str(report)
    assert "112 control points of degree 3 in 2 patches: certified, |det J| >=" in text and "2 x 1 x 1" in text


def test_the_distortion_of_a_body_is_weighted_by_volume():
    bars = [from_function(lambda u, v, w: (2.0 * u, v, w)), from_function(lambda u, v, w: (2.0 + u, v + u / 2.0, w))]
    body = Body.from_patches(bars)
    outer = outer_surface(body)
    report = measure(body, outer.vertices, outer.faces, 1.0, outer, certify(body), check_boundary(body))
    sheared = report.patches[1].arap
    assert sheared.mean > 0.05 and report.arap.as_given.max == sheared.max
    assert report.arap.as_given.mean == pytest.approx(sheared.mean / 3.0)
    assert [part["scaled_jacobian"] for part in report.as_dict()["patches"]] == pytest.approx([1.0, 1.25**-0.5])
    assert report.surface_distance.as_given.max < 1e-9 and report.boundary.as_given.max < 1e-12


def test_distances_of_a_body_know_their_patch():
    body = plate_with_hole()
    found = two_sided(body, *surface_arrays(outer_surface(body, 9)))
    for way in (found.mesh_to_spline, found.spline_to_mesh):
        assert set(way.patches.tolist()) == set(range(8)) and way.shares.sum() == pytest.approx(1.0)
        for number, names in enumerate(body.outer):
            where = way.parameters[way.patches == number]
            faces = np.stack([where[:, "uvw".index(name[0])] == float(name[1]) for name in names])
            assert faces.any(axis=0).all()
    assert len(SampledBoundary.of(body).points) < 1.2 * 6 * 160**2  # as many as on a cube, though the faces are 32


def surface_arrays(boundary):
    return boundary.vertices, boundary.faces


def test_what_is_no_body_with_its_boundary_is_refused():
    body = Body.from_patches([from_function(lambda u, v, w, a=a: (a + u, v, w)) for a in (0, 1)])
    outer = outer_surface(body)
    given = (outer.vertices, outer.faces, 1.0)
    with pytest.raises(TypeError, match=r"certificate is not that of this body"):
        measure(body, *given, outer, certify(body.patches[0]), check_boundary(body))
    inside = replace(outer, parameters=np.where(outer.patches[:, None] == 0, [1.0, 0.5, 0.5], outer.parameters))
    with pytest.raises(ValueError, match=r"no outer face of their patch, the first is vertex 0 at \(1, 0.5, 0.5\)"):
        measure(body, *given, inside, certify(body), check_boundary(body))
    with pytest.raises(ValueError, match="there is no patch 2"):
        measure(body, *given, replace(outer, patches=outer.patches + 1), certify(body), check_boundary(body))


def test_nearest_places_on_edges_do_not_leave_the_cube_by_rounding():
    volume = BSplineVolume.from_function(lambda u, v, w: (u + 0.1 * v, v - 0.2 * w, w + 0.05 * u), 7, 3)
    places, rows = np.random.default_rng(0).uniform(size=(20_000, 3)), np.arange(20_000)
    places[rows, rows % 3], places[rows, (rows + 1) % 3] = np.round(places[rows, rows % 3]), 1.0
    found = nearest_on_boundary(volume(places), volume, SampledBoundary.of(volume))[1]
    assert found.min() == 0.0 and found.max() == 1.0


def test_of_many_patches_the_most_distorted_are_printed():
    patches = [BoxDistortion((1.0, 1.0, 1.0), 1.0, Distortion(0.0, float(number)), 1.0, 27) for number in range(50)]
    lines = _lines_of(patches)
    assert [line.split()[0] for line in lines[1:-1]] == [f"p{number}" for number in range(50 - MOST_LINES, 50)]
    assert lines[-1].strip() == f"the {50 - MOST_LINES} other patches are less distorted"
    assert len(_lines_of(patches[:3])) == 4 and _lines_of([]) == []
