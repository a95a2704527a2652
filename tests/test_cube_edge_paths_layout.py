import numpy as np
import pytest
from shapes import rounded_cube, turned

from parameterize.cube.cube import CORNERS, CubeLayout, snap
from parameterize.cube.edge_paths import PathError, choose_corners, lay_out
from parameterize.cube.flips import flipped


def crumpled(noise, seed=0):
    """A surface mapped near the cube, so roughly that triangles of its projection are turned over."""
    points, faces = rounded_cube(1500, 8.0)
    return turned(points) + noise * np.random.default_rng(seed).normal(size=points.shape), points, faces


@pytest.mark.parametrize("seed", range(4))
def test_no_triangle_is_flipped_where_the_projection_flips_many(seed):
    mapped, points, faces = crumpled(0.02, seed)
    assert flipped(snap(mapped), faces).sum() > 20
    layout = lay_out(CubeLayout(points, faces, mapped, len(points)), choose_corners(mapped))
    assert not flipped(layout.places, layout.faces).any()
    assert np.abs(layout.places - 0.5).max(axis=1) == pytest.approx(0.5)


def test_the_surface_stays_the_same_and_its_vertices_come_first():
    mapped, points, faces = crumpled(0.02)
    layout = lay_out(CubeLayout(points, faces, mapped, len(points)), choose_corners(mapped))
    assert np.array_equal(layout.points[: len(points)], points)

    def area(x, f):
        return np.linalg.norm(np.cross(x[f[:, 1]] - x[f[:, 0]], x[f[:, 2]] - x[f[:, 0]]), axis=1).sum()

    assert area(layout.points, layout.faces) == pytest.approx(area(points, faces))


def test_corners_go_to_the_corners():
    mapped, points, faces = crumpled(0.01)
    corners = choose_corners(mapped)
    assert lay_out(CubeLayout(points, faces, mapped, len(points)), corners).places[corners] == pytest.approx(CORNERS)


def test_places_that_are_one_to_one_are_kept():
    points, faces = rounded_cube(1500, 8.0)
    mapped = snap(points)
    layout = lay_out(CubeLayout(points, faces, mapped, len(points)), choose_corners(mapped))
    moved = np.abs(layout.places[: len(points)] - mapped).max(axis=1)
    assert np.median(moved) < 2e-3 and moved.max() < 0.2  # the paths go to the edges, the rest follows a little


def test_even_a_wild_map_is_laid_out_where_paths_are_found():
    _, points, faces = crumpled(0.0)
    wild = 0.5 + np.random.default_rng(0).normal(size=points.shape)
    layout = lay_out(CubeLayout(points, faces, wild, len(points)), choose_corners(wild))
    assert not flipped(layout.places, layout.faces).any()


def test_a_map_without_room_for_twelve_paths_is_refused():
    points, faces = rounded_cube(10)
    with pytest.raises(PathError):
        lay_out(CubeLayout(points, faces, points, len(points)), np.arange(8))
