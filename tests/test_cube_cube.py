import numpy as np

from parameterize.cube.cube import (
    CORNERS,
    EDGES,
    VARYING_AXES,
    axis_and_side,
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
