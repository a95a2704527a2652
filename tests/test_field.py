"""A field at points in space."""

import numpy as np
import pytest
from cube_grids import ring, two

import iga_nn
from solve import benchmark_volume
from solve.field import BodyField, SplineField


@pytest.fixture(scope="module")
def solution():
    return iga_nn.solve(benchmark_volume(4), iga_nn.Poisson(exact="1+x+2*y-z"), refine=1)


def plane(x):
    return 1.0 + x[..., 0] + 2.0 * x[..., 1] - x[..., 2]


def test_values_at_points_in_space(solution):
    points = solution.geometry(np.random.default_rng(0).random((200, 3)))
    np.testing.assert_allclose(solution.probe(points), plane(points), atol=1e-6)
    far = [[9.0, 9.0, 9.0], points[0]]
    values = solution.probe(far)
    assert np.isnan(values[0]) and values[1] == pytest.approx(plane(points[0]), abs=1e-6)


def test_points_outside_take_the_nearest_value(solution):
    volume = solution.geometry
    on_face = volume([[1.0, 0.5, 0.5]])
    normal = np.cross(volume.jacobian([[1.0, 0.5, 0.5]])[0, :, 1], volume.jacobian([[1.0, 0.5, 0.5]])[0, :, 2])
    outside = on_face + 0.05 * normal / np.linalg.norm(normal)
    assert np.isnan(solution.probe(outside)).all()
    assert solution.probe(outside, clip=True) == pytest.approx(plane(on_face), abs=1e-6)


def test_points_too_far_away_for_a_nearest_point(solution):
    assert np.isfinite(solution.probe([[1e3, 0.5, 0.5]], clip=True)).all()
    assert np.isnan(solution.probe([[1e300, 0.5, 0.5]])).all()
    with pytest.raises(ValueError, match="10000 times the volume's size away"):
        solution.probe([[1e9, 0.5, 0.5]], clip=True)


def test_vectors_have_rows():
    volume = benchmark_volume(2)
    field = SplineField(volume.degrees, volume.knots, volume.control_points, volume)
    points = volume([[0.2, 0.4, 0.6], [0.5, 0.5, 0.5]])
    np.testing.assert_allclose(field.probe(points), points, atol=1e-13)
    assert field.probe([[5.0, 5.0, 5.0]]).shape == (1, 3) and np.isnan(field.probe([[5.0, 5.0, 5.0]])).all()


def test_a_field_without_a_volume_says_so():
    volume = benchmark_volume(2)
    with pytest.raises(ValueError, match="geometry=volume"):
        SplineField(volume.degrees, volume.knots, volume.control_points[..., 0]).probe([[0.0, 0.0, 0.0]])


def test_a_solution_on_one_patch_has_the_parts_of_its_spline(solution):
    (patch,) = solution.patches
    places = [[0.2, 0.4, 0.6], [0.9, 0.1, 0.5]]
    assert solution.coefficients is patch.coefficients and solution.degrees == patch.degrees == (3, 3, 3)
    assert solution.knots is patch.knots and isinstance(solution.geometry, iga_nn.BSplineVolume)
    assert np.array_equal(solution(places), patch(places))
    assert np.array_equal(solution.grid([0.1], [0.2], [0.3]), patch.grid([0.1], [0.2], [0.3]))
    assert np.array_equal(solution.quantity("gradient", places), patch.quantity("gradient", places))
    assert solution.quantity_grid("gradient", [0.1], [0.2], [0.3]).shape == (1, 1, 1, 1, 3)


def test_a_solution_on_several_patches_names_the_way_to_one():
    solution = iga_nn.solve(two(), iga_nn.Poisson(exact="x"))
    assert isinstance(solution.geometry, iga_nn.Body)
    for ask in (
        lambda: solution.coefficients,
        lambda: solution([[0.5, 0.5, 0.5]]),
        lambda: solution.grid([0], [0], [0]),
    ):
        with pytest.raises(ValueError, match=r"this field has 2 patches: use field.patches\[i\], or probe"):
            ask()


def test_points_outside_of_several_patches_take_the_nearest_value():
    solution = iga_nn.solve(two(), iga_nn.Poisson(exact="x"))
    points = [[-1.0, 0.5, 0.5], [0.25, 2.0, 0.5], [1.75, 0.5, -3.0]]
    assert np.isnan(solution.probe(points)).all()
    np.testing.assert_allclose(solution.probe(points, clip=True), [0.0, 0.25, 1.75], atol=1e-6)


@pytest.mark.parametrize("body", [benchmark_volume(2), two(), ring()], ids=["one", "two", "ring"])
def test_a_file_of_a_solution_gives_its_field(body, tmp_path):
    solution = iga_nn.solve(body, iga_nn.Poisson(exact="x"))
    solution.save(tmp_path / "solution.npz")
    names = set(np.load(tmp_path / "solution.npz"))
    assert ("coefficients" in names) == isinstance(body, iga_nn.BSplineVolume)
    found = BodyField.load(tmp_path / "solution.npz")
    for patch, own in zip(solution.patches, found.patches, strict=True):
        assert np.array_equal(patch.coefficients, own.coefficients)
    with pytest.raises(ValueError, match=r"a field with a body: dataclasses.replace\(field, body=body\)"):
        found.probe([[0.5, 0.5, 0.5]])
