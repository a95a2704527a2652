"""The extension of a surface's layout into the solid: values on its surface, sheets that are close, a folded sheet."""

import tracemalloc

import numpy as np
import pytest
import trimesh
from shapes import ball, turned

from parameterize.cube.cube import CubeLayout
from parameterize.extension import extended

CELL = 0.07


def box(low, high):
    mesh = trimesh.creation.box(bounds=[low, high])
    return np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64)


def test_values_that_are_linear_on_the_surface_are_linear_inside():
    points, faces = ball(400)
    matrix = np.array([[0.2, 0.1, 0.0], [-0.1, 0.3, 0.05], [0.0, 0.05, 0.2]])
    inside, places = extended(CubeLayout(points, faces, 0.5 + points @ matrix.T, len(points)), CELL)
    assert places == pytest.approx(0.5 + inside @ matrix.T, abs=1e-4)


def test_the_lattice_fills_the_solid_and_nothing_else():
    points, faces = ball(2000)
    inside, _ = extended(CubeLayout(points, faces, 0.5 + 0.1 * points, len(points)), CELL)
    assert np.linalg.norm(inside, axis=1).max() < 1.0
    volume = abs(trimesh.Trimesh(points, faces, process=False).volume)
    assert len(inside) * CELL**3 == pytest.approx(volume, rel=0.02)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_two_sheets_do_not_feel_each_other_through_a_gap_narrower_than_a_cell(axis):
    near, far = np.ones(3), np.ones(3)
    near[axis], far[axis] = 0.5, 0.5 + 0.3 * CELL
    start = np.zeros(3)
    start[axis] = far[axis]
    (lower, faces), (upper, more) = box(np.zeros(3), near), box(start, np.ones(3))
    values = np.repeat([[0.2] * 3, [0.8] * 3], [len(lower), len(upper)], axis=0)
    inside, places = extended(
        CubeLayout(np.vstack([lower, upper]), np.vstack([faces, more + len(lower)]), values, len(values)), CELL
    )
    sheet = np.where(inside[:, axis] < 0.5, 0.2, 0.8)
    assert set(sheet) == {0.2, 0.8}
    assert places == pytest.approx(np.repeat(sheet[:, None], 3, axis=1), abs=1e-4)


def test_where_two_parts_overlap_is_inside():
    (first, faces), (second, more) = box(np.zeros(3), [0.6, 1.0, 1.0]), box([0.4, 0.0, 0.0], np.ones(3))
    points = np.vstack([first, second])
    inside, _ = extended(CubeLayout(points, np.vstack([faces, more + len(first)]), np.full((16, 3), 0.5), 16), CELL)
    assert len(inside) * CELL**3 == pytest.approx(1.0, rel=0.1)
    for low in (0.1, 0.45, 0.65):  # in one, in both, in the other
        assert ((inside[:, 0] > low) & (inside[:, 0] < low + 0.15)).any()


def test_a_needle_askew_takes_the_memory_of_what_is_in_it():
    """Of the box around it, 40 cubed, the lattice has 64 million points, and the needle a ten thousandth of them."""
    points, faces = ball(400)
    points = turned(points * [35.0, 0.35, 0.35], (0.0, -0.62, 0.79))
    assert np.ptp(points, axis=0).min() > 35.0
    tracemalloc.start()
    inside, places = extended(CubeLayout(points, faces, points / 100.0, len(points)), 0.1)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    volume = abs(trimesh.Trimesh(points, faces, process=False).volume)
    assert len(inside) * 0.1**3 == pytest.approx(volume, rel=0.05)
    within = ((inside >= 0.0) & (inside <= 100.0)).all(axis=1)  # places are cut off at the cube's faces
    assert places[within] == pytest.approx(inside[within] / 100.0, abs=1e-4)
    assert taken < 250e6  # a number for each point of the box would take 500, and there were several
