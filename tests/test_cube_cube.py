import numpy as np
import pytest

from parameterize.cube.cube import (
    CORNERS,
    EDGES,
    VARYING_AXES,
    axis_and_side,
    damped_fit,
    face_number,
    nearest_faces,
    project_radially,
    tangent_axes,
)


def test_face_numbers_are_decoded_by_their_inverse():
    faces = np.arange(6)
    axis, side = axis_and_side(faces)
    assert axis.tolist() == [0, 0, 1, 1, 2, 2]
    assert side.tolist() == [0, 1, 0, 1, 0, 1]
    assert face_number(axis, side).tolist() == faces.tolist()


def test_tangent_axes_are_right_handed_and_the_varying_ones():
    for axis in range(3):
        a, b = tangent_axes(axis)
        assert np.linalg.det(np.eye(3)[[a, b, axis]]) == 1.0
        assert sorted((a, b)) == VARYING_AXES[axis].tolist()


def test_edges_join_corners_that_differ_in_one_coordinate():
    assert len(EDGES) == 12
    assert all(np.count_nonzero(CORNERS[i] != CORNERS[j]) == 1 for i, j in EDGES)


def test_points_are_projected_onto_the_face_that_their_ray_meets():
    centred = np.array([[0.1, 0.0, 0.05], [0.0, -2.0, 1.0]])
    projected = project_radially(centred)
    assert projected.tolist() == [[0.5, 0.0, 0.25], [0.0, -0.5, 0.25]]
    assert nearest_faces(projected + 0.5).tolist() == [1, 2]


def vectors(seed, scale=1.0):
    return scale * np.random.default_rng(seed).normal(size=(3, 50, 3))


@pytest.mark.parametrize("scale", [1.0, 1e-100, 1e100])
def test_fit_is_least_squares_in_any_unit(scale):
    first, second, right = vectors(0, scale)
    a, b = damped_fit(first, second, right, 0.0)
    for k in range(50):
        expected = np.linalg.lstsq(np.stack([first[k], second[k]], axis=1) / scale, right[k] / scale)[0]
        assert [a[k], b[k]] == pytest.approx(expected.tolist(), rel=1e-8)


def test_parallel_and_zero_vectors_have_a_finite_fit():
    first, second, right = vectors(1)
    second = 2.0 * first
    first[0] = second[0] = 0.0
    a, b = damped_fit(first, second, right, 1e-6)
    assert a[0] == b[0] == 0.0
    fitted = a[1:, None] * first[1:] + b[1:, None] * second[1:]
    along = (first[1:] * right[1:]).sum(1) / (first[1:] ** 2).sum(1)
    assert fitted == pytest.approx(along[:, None] * first[1:], rel=1e-4)
