from itertools import product

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapes import ball, rounded_cube

from parameterize.surface.solid import Solid
from parameterize.training.training_points import (
    OFFSETS,
    TriangleSampler,
    stencils,
)

CELL = 0.1


def make_stencils(vertices, faces):
    return stencils(vertices, faces, CELL)


def test_offsets_are_the_centre_the_axes_and_the_plane_diagonals():
    sizes = np.count_nonzero(OFFSETS, axis=1)
    assert sizes.tolist() == [0] + [1] * 6 + [2] * 12
    assert len(np.unique(OFFSETS, axis=0)) == 19


def test_every_stencil_is_its_centre_plus_the_offsets():
    found = make_stencils(*rounded_cube(300))
    nodes = found.nodes[found.index]  # (r, 19, 3)
    assert nodes - nodes[:, :1] == pytest.approx(np.broadcast_to(CELL * OFFSETS, nodes.shape), abs=1e-14)
    assert len(np.unique(found.index[:, 0])) == len(found.index)
    assert len(np.unique(found.index)) == len(found.nodes)  # no node is computed in vain


def test_stencils_cover_the_domain_under_every_shift():
    vertices, faces = rounded_cube(600)
    found = make_stencils(vertices, faces)
    centres = found.nodes[found.index[:, 0]]
    points = CELL / 3.0 * Solid(vertices, faces).lattice_near(CELL / 3.0, 0.0)
    points = np.concatenate([points[Solid(vertices, faces).signed_distances(points) < 0.0], vertices])
    for corner in product((-0.5, 0.5), repeat=3):
        reach, _ = cKDTree(centres + CELL * np.array(corner)).query(points, p=np.inf)
        assert (reach <= CELL).mean() > 0.999  # a stencil reaches one cell from its centre
        assert reach.max() < 1.2 * CELL
    assert Solid(vertices, faces).signed_distances(centres).max() < CELL  # and not far beyond the surface


def test_shifts_move_all_nodes_together_within_half_a_cell():
    found = make_stencils(*rounded_cube(300))
    generator = np.random.default_rng(0)
    shifts = []
    for _ in range(200):
        shift = found.shifted(generator) - found.nodes
        assert np.abs(shift - shift[0]).max() < 1e-12
        shifts.append(shift[0])
    shifts = np.stack(shifts) / CELL
    assert np.abs(shifts).max() <= 0.5 and shifts.min() < -0.4 and shifts.max() > 0.4
    again = found.shifted(np.random.default_rng(0)) - found.nodes
    assert again[0] / CELL == pytest.approx(shifts[0])


def strip(widths):
    """Triangles side by side in a plane, height 1, of these widths: areas are half of them."""
    x = np.concatenate([[0.0], np.cumsum(widths)])
    vertices = np.array([[v, y, 0.0] for v in x for y in (0.0, 1.0)])
    faces = np.array([[2 * i, 2 * i + 2, 2 * i + 1] for i in range(len(widths))])
    return vertices, faces


def test_triangles_are_drawn_by_area():
    widths = np.array([1.0, 2.0, 0.0, 5.0, 2.0] * 10)
    vertices, faces = strip(widths)
    sampler, generator = TriangleSampler(vertices, faces, 10), np.random.default_rng(0)
    counts = np.zeros(len(widths))
    draws = 2000
    for _ in range(draws):
        picks = sampler.draw(generator)
        assert picks.shape == (10,)
        counts += np.bincount(picks, minlength=len(widths))
    expected = 10 * draws * widths / widths.sum()
    assert counts == pytest.approx(expected, rel=0.15, abs=1e-9)  # none of the triangles without area


def test_every_triangle_is_drawn_where_the_count_covers_the_mesh():
    vertices, faces = strip(np.ones(7))
    picks = TriangleSampler(vertices, faces, 100).draw(np.random.default_rng(0))
    assert picks.tolist() == list(range(7))


def test_draws_depend_on_the_generator_alone():
    sampler = TriangleSampler(*ball(200), 20)
    first, second = (sampler.draw(np.random.default_rng(3)) for _ in range(2))
    assert np.array_equal(first, second)
    assert not np.array_equal(first, sampler.draw(np.random.default_rng(4)))
