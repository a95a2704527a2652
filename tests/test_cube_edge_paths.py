import numpy as np
import pytest
from scipy.spatial import ConvexHull
from shapes import ball, rounded_cube, turned

from parameterize.cube.cube import CORNERS, EDGES, CubeLayout
from parameterize.cube.edge_paths import PathError, choose_corners, cut_surface, edge_targets


def near_cube(seed, power=8.0, noise=0.005):
    points, faces = rounded_cube(1200, power)
    rng = np.random.default_rng(seed)
    return turned(points, rng.uniform(-0.08, 0.08, 3)) + noise * rng.normal(size=points.shape), faces


def mapped_surface(mapped, faces):
    """The layout of a surface that is its own map."""
    return CubeLayout(mapped, faces, mapped, len(mapped))


def nearest_face(points):
    """Index of the cube face each point looks at from the centre."""
    centred = points - 0.5
    axis = np.abs(centred).argmax(axis=1)
    return 2 * axis + (centred[np.arange(len(points)), axis] > 0.0)


def test_corner_and_edge_numbers():
    assert CORNERS[1].tolist() == [0.0, 0.0, 1.0] and CORNERS[4].tolist() == [1.0, 0.0, 0.0]
    assert len(EDGES) == 12 and len(set(EDGES)) == 12
    assert all(np.abs(CORNERS[i] - CORNERS[j]).sum() == 1.0 for i, j in EDGES)


@pytest.mark.parametrize("seed", range(3))
def test_paths_bound_six_discs_with_the_right_corners(seed):
    mapped, faces = near_cube(seed)
    corners = choose_corners(mapped)
    assert np.linalg.norm(mapped[corners] - CORNERS, axis=1).max() < 0.3
    surface = cut_surface(mapped_surface(mapped, faces), corners)
    position, cut_faces = surface.layout.places, surface.layout.faces
    for label in range(6):
        patch = cut_faces[surface.face_labels == label]
        edges = np.unique(np.sort(patch[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
        assert len(np.unique(patch)) - len(edges) + len(patch) == 1  # Euler: a disc
        inside = np.isin(corners, patch)
        assert np.array_equal(inside, CORNERS[:, label // 2] == label % 2)
    middles = position[cut_faces].mean(axis=1)
    assert (nearest_face(middles) == surface.face_labels).mean() > 0.97
    clear = np.sort(np.abs(middles - 0.5), axis=1)
    clear = clear[:, 2] - clear[:, 1] > 0.1  # well inside a face
    assert (nearest_face(middles) == surface.face_labels)[clear].all()


def test_paths_are_disjoint_walks_along_mesh_edges():
    mapped, faces = near_cube(0)
    corners = choose_corners(mapped)
    surface = cut_surface(mapped_surface(mapped, faces), corners)
    edges = {tuple(e) for e in np.sort(surface.layout.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1).tolist()}
    inner = []
    for (i, j), path in zip(EDGES, surface.paths, strict=True):
        assert path[0] == corners[i] and path[-1] == corners[j]
        assert all(tuple(sorted(pair)) in edges for pair in zip(path[:-1].tolist(), path[1:].tolist(), strict=True))
        inner += path[1:-1].tolist()
    assert len(set(inner)) == len(inner) and not set(inner) & set(corners.tolist())


def test_edge_targets_follow_the_edges_by_arc_length():
    mapped, faces = near_cube(2)
    surface = cut_surface(mapped_surface(mapped, faces), choose_corners(mapped))
    position = surface.layout.places
    vertices, targets, following = edge_targets(position, surface.paths)
    start = 0
    for (i, j), path in zip(EDGES, surface.paths, strict=True):
        part = slice(start, start + len(path))
        assert np.array_equal(vertices[part], path)
        share = (targets[part] - CORNERS[i]) @ (CORNERS[j] - CORNERS[i])
        steps = np.linalg.norm(np.diff(position[path], axis=0), axis=1)
        assert np.diff(share) == pytest.approx(steps / steps.sum(), abs=1e-12)
        assert targets[start] == pytest.approx(CORNERS[i]) and targets[part][-1] == pytest.approx(CORNERS[j])
        start += len(path)
    assert len(following) == sum(len(path) - 1 for path in surface.paths)
    assert (following[:, 1] == following[:, 0] + 1).all() and following.max() == len(vertices) - 1


def test_corners_are_eight_different_vertices():
    points, _ = ball(40)
    squeezed = 0.5 + points * [1e-3, 1e-3, 1.0]  # two vertices are the farthest towards four corners each
    corners = choose_corners(squeezed)
    assert len(set(corners.tolist())) == 8
    octahedron = 0.5 + np.concatenate([np.eye(3), -np.eye(3), [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]])
    assert sorted(choose_corners(octahedron).tolist()) == list(range(8))


def test_choose_corners_of_a_cube():
    mapped, _ = near_cube(0)
    mapped[:8] = CORNERS[::-1] + 0.05 * (CORNERS[::-1] - 0.5)
    assert choose_corners(mapped).tolist() == list(range(7, -1, -1))


def test_no_way_between_the_corners_is_said():
    faces = ConvexHull(CORNERS).simplices.astype(np.int64)
    swapped = np.array([1, 0, 2, 3, 4, 5, 6, 7])  # needs both diagonals of the face u0; a mesh has one
    with pytest.raises(PathError, match="no path left"):
        cut_surface(mapped_surface(CORNERS, faces), swapped)


def test_mirrored_corners_are_refused():
    mapped, faces = near_cube(0)
    corners = choose_corners(mapped)
    turned_cube = corners[[0, 2, 4, 6, 1, 3, 5, 7]]  # (u, v, w) -> (v, w, u): a rotation
    assert len(cut_surface(mapped_surface(mapped, faces), turned_cube).paths) == 12
    with pytest.raises(PathError, match="mirrored"):
        cut_surface(mapped_surface(mapped, faces), corners[[4, 5, 6, 7, 0, 1, 2, 3]])
