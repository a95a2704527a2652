import numpy as np
import pytest
from shapes import area, ball, is_closed, turned

from parameterize.cube.boundary_map import BoundaryMap, boundary_map
from parameterize.cube.cube import CubeLayout
from parameterize.cube.cutting import cut_along_rays
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.volume import BSplineVolume


def identity_volume():
    row = greville(open_uniform_knots(5, 3), 3)
    return BSplineVolume.uniform(np.stack(np.meshgrid(row, row, row, indexing="ij"), axis=-1))


def onto_cube(points):
    centred = points - 0.5
    return 0.5 + centred / (2.0 * np.abs(centred).max(axis=1, keepdims=True))


def placed_ball(seed, count=400, noise=0.0):
    """A mesh of the cube's boundary itself, its vertices at random, and parameters that are a little off."""
    points, faces = ball(count)
    rng = np.random.default_rng(seed)
    vertices = onto_cube(turned(0.5 + points, rng.uniform(-1.0, 1.0, 3)))
    return vertices, onto_cube(vertices + noise * rng.normal(size=vertices.shape)), faces


def assert_valid(result, vertices, faces):
    assert len(result.flipped()) == 0
    assert len(result.cube_faces) == len(result.faces)  # every triangle lies on one face of the cube
    assert np.array_equal(result.vertices[: len(vertices)], vertices)
    assert is_closed(result.faces)
    assert area(result.vertices, result.faces) == pytest.approx(area(vertices, faces), rel=1e-9)
    assert area(result.parameters, result.faces) == pytest.approx(6.0, rel=1e-9)  # the cube, covered once
    new = result.parameters[len(vertices) :]
    sizes = np.sort(np.abs(new - 0.5), axis=1)
    on_edge = sizes[:, 1] == 0.5
    assert on_edge.mean() > 0.8 and (sizes[:, 2] == 0.5).all()


@pytest.mark.parametrize("seed", range(3))
def test_the_surface_is_cut_along_the_cubes_edges(seed):
    vertices, parameters, faces = placed_ball(seed)
    result = boundary_map(identity_volume(), CubeLayout(vertices, faces, parameters, len(vertices)))
    assert_valid(result, vertices, faces)
    assert result.parameters[: len(vertices)] == pytest.approx(parameters, abs=1e-12)
    share = np.bincount(result.cube_faces, minlength=6) / len(result.faces)
    assert share.min() > 0.1


@pytest.mark.parametrize("seed", range(3))
def test_flipped_triangles_are_laid_out_anew(seed):
    vertices, parameters, faces = placed_ball(seed, noise=0.04)
    before = len(BoundaryMap(vertices, parameters, faces).flipped())
    assert before > 10
    assert_valid(
        boundary_map(identity_volume(), CubeLayout(vertices, faces, parameters, len(vertices))), vertices, faces
    )


def test_one_flipped_vertex_moves_and_the_rest_stays():
    vertices, parameters, faces = placed_ball(5)
    wrong = 57
    ring = np.setdiff1d(faces[(faces == wrong).any(axis=1)], [wrong])
    parameters[wrong] = onto_cube(2.0 * parameters[ring[:1]] - parameters[[wrong]])[0]  # across a neighbour
    assert len(BoundaryMap(vertices, parameters, faces).flipped()) > 0
    result = boundary_map(identity_volume(), CubeLayout(vertices, faces, parameters, len(vertices)))
    assert_valid(result, vertices, faces)
    moved = np.linalg.norm(result.parameters[: len(vertices)] - parameters, axis=1) > 1e-9
    assert moved[wrong] and moved.sum() < 20


@pytest.mark.parametrize("seed", range(4))
def test_parameters_that_coincide_with_edges_and_corners(seed):
    vertices, parameters, faces = placed_ball(seed)
    parameters = onto_cube(np.round(parameters * 20.0) / 20.0)  # many exactly on edges, cuts meet vertices and corners
    assert_valid(
        boundary_map(identity_volume(), CubeLayout(vertices, faces, parameters, len(vertices))), vertices, faces
    )


def test_cut_vertices_are_fitted_where_the_volume_puts_them():
    vertices, parameters, faces = placed_ball(2)
    fitted = boundary_map(identity_volume(), CubeLayout(vertices, faces, parameters, len(vertices)))
    off = np.linalg.norm(fitted.vertices - fitted.parameters, axis=1)  # the volume is the identity
    assert off[: len(vertices)].max() < 1e-12
    cut = cut_along_rays(parameters, faces, 0.0)
    plain = cut.carry(vertices)
    unfitted = np.linalg.norm(plain - onto_cube(cut.carry(parameters)), axis=1)
    assert off[len(vertices) :].mean() < unfitted[len(vertices) :].mean()
    assert off.max() <= unfitted.max()
