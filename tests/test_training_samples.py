import tracemalloc
from itertools import product

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree
from shapes import ball, enclosed_volume, rounded_cube, turned

from parameterize.training.samples import (
    OFFSETS,
    TriangleSampler,
    gather,
    interior_points,
    near_or_inside,
    signed_distance,
    stencils,
)

CELL = 0.1
CPU = torch.device("cpu")


def make_stencils(vertices, faces):
    return stencils(vertices, faces, CELL, device=CPU, dtype=torch.float64)


def test_offsets_are_the_centre_the_axes_and_the_plane_diagonals():
    sizes = np.count_nonzero(OFFSETS, axis=1)
    assert sizes.tolist() == [0] + [1] * 6 + [2] * 12
    assert len(np.unique(OFFSETS, axis=0)) == 19


def test_every_stencil_is_its_centre_plus_the_offsets():
    found = make_stencils(*rounded_cube(300))
    nodes = found.nodes[found.index]  # (r, 19, 3)
    assert (nodes - nodes[:, :1]).numpy() == pytest.approx(np.broadcast_to(CELL * OFFSETS, nodes.shape), abs=1e-14)
    assert len(torch.unique(found.index[:, 0])) == len(found.index)
    assert len(torch.unique(found.index)) == len(found.nodes)  # no node is computed in vain


def test_stencils_cover_the_domain_under_every_shift():
    vertices, faces = rounded_cube(600)
    found = make_stencils(vertices, faces)
    centres = found.nodes[found.index[:, 0]].numpy()
    points = CELL / 3.0 * near_or_inside(vertices, faces, CELL / 3.0, 0.0)
    points = np.concatenate([points[signed_distance(points, vertices, faces) < 0.0], vertices])
    for corner in product((-0.5, 0.5), repeat=3):
        reach, _ = cKDTree(centres + CELL * np.array(corner)).query(points, p=np.inf)
        assert (reach <= CELL).mean() > 0.999  # a stencil reaches one cell from its centre
        assert reach.max() < 1.2 * CELL
    assert signed_distance(centres, vertices, faces).max() < CELL  # and not far beyond the surface


def test_shifts_move_all_nodes_together_within_half_a_cell():
    found = make_stencils(*rounded_cube(300))
    generator = torch.Generator().manual_seed(0)
    shifts = []
    for _ in range(200):
        shift = found.shifted(generator) - found.nodes
        assert (shift - shift[0]).abs().max() < 1e-12
        shifts.append(shift[0])
    shifts = torch.stack(shifts) / CELL
    assert shifts.abs().max() <= 0.5 and shifts.min() < -0.4 and shifts.max() > 0.4
    again = found.shifted(torch.Generator().manual_seed(0)) - found.nodes
    assert again[0] / CELL == pytest.approx(shifts[0])


def test_interior_points_fill_the_volume():
    vertices, faces = ball(1500)
    points = interior_points(vertices, faces, 0.1)
    assert np.linalg.norm(points, axis=1).max() < 1.0
    assert len(points) * 0.1**3 == pytest.approx(4.0 / 3.0 * np.pi, rel=0.02)
    assert signed_distance(np.zeros((1, 3)), vertices, faces)[0] == pytest.approx(-1.0, abs=0.01)
    assert signed_distance(np.array([[0.0, 2.0, 0.0]]), vertices, faces)[0] == pytest.approx(1.0, abs=0.01)


def strip(widths):
    """Triangles side by side in a plane, height 1, of these widths: areas are half of them."""
    x = np.concatenate([[0.0], np.cumsum(widths)])
    vertices = np.array([[v, y, 0.0] for v in x for y in (0.0, 1.0)])
    faces = np.array([[2 * i, 2 * i + 2, 2 * i + 1] for i in range(len(widths))])
    return vertices, faces


def test_triangles_are_drawn_by_area():
    widths = np.array([1.0, 2.0, 0.0, 5.0, 2.0] * 10)
    vertices, faces = strip(widths)
    sampler, generator = TriangleSampler(vertices, faces, 10, CPU), torch.Generator().manual_seed(0)
    counts = torch.zeros(len(widths))
    draws = 2000
    for _ in range(draws):
        picks = sampler.draw(generator)
        assert picks.shape == (10,)
        counts += torch.bincount(picks, minlength=len(widths))
    expected = 10 * draws * widths / widths.sum()
    assert counts.numpy() == pytest.approx(expected, rel=0.15, abs=1e-9)  # none of the triangles without area


def test_every_triangle_is_drawn_where_the_count_covers_the_mesh():
    vertices, faces = strip(np.ones(7))
    picks = TriangleSampler(vertices, faces, 100, CPU).draw(torch.Generator().manual_seed(0))
    assert picks.tolist() == list(range(7))


def test_draws_depend_on_the_generator_alone():
    sampler = TriangleSampler(*ball(200), 20, CPU)
    first, second = (sampler.draw(torch.Generator().manual_seed(3)) for _ in range(2))
    assert torch.equal(first, second)
    assert not torch.equal(first, sampler.draw(torch.Generator().manual_seed(4)))


def test_gathered_rows_have_a_repeatable_gradient():
    generator = torch.Generator().manual_seed(0)
    rows = torch.randn(4000, 3, generator=generator).requires_grad_()
    index = torch.randint(0, 4000, (2500, 19), generator=generator)
    weights = torch.randn(2500, 19, 3, generator=generator)
    assert torch.equal(gather(rows, index), rows[index])
    (first,) = torch.autograd.grad((gather(rows, index) * weights).sum(), rows)
    for _ in range(300):  # plain indexing differs about once in 70 times on two threads
        (again,) = torch.autograd.grad((gather(rows, index) * weights).sum(), rows)
        assert torch.equal(first, again)


def whole_lattice(vertices, cell, margin):
    low, high = np.floor((vertices.min(0) - margin) / cell), np.ceil((vertices.max(0) + margin) / cell)
    return np.stack(np.meshgrid(*map(np.arange, low, high + 1.0), indexing="ij"), axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (3.0, 1.0, 0.5), (6.0, 0.4, 0.4)])
def test_nothing_inside_is_left_out_of_the_lattice(stretch):
    vertices, faces = ball(500)
    vertices = turned(vertices * stretch, (0.5, 0.9, -0.4))
    everywhere = whole_lattice(vertices, CELL, CELL / 2.0)
    distances = signed_distance(CELL * everywhere, vertices, faces)
    inside = everywhere[distances < 0.0]
    assert interior_points(vertices, faces, CELL) == pytest.approx(CELL * inside)
    close = everywhere[distances < CELL / 2.0]
    found = near_or_inside(vertices, faces, CELL, CELL / 2.0)
    assert {tuple(row) for row in close.astype(int).tolist()} <= {tuple(row) for row in found.tolist()}
    assert np.array_equal(found, np.unique(found, axis=0))  # each once, in their order


@pytest.mark.parametrize("count", [pytest.param(12, marks=pytest.mark.slow), 400])
def test_a_needle_askew_takes_the_memory_of_what_is_in_it(count):
    """Of the box around it, 16 cubed, the lattice has 4 million points, and the needle some 5000 of them."""
    vertices, faces = ball(count)
    vertices = turned(vertices * [14.0, 0.35, 0.35], (0.0, -0.62, 0.79))
    assert np.ptp(vertices, axis=0).min() > 14.0
    tracemalloc.start()
    points = interior_points(vertices, faces, CELL)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(points) * CELL**3 == pytest.approx(enclosed_volume(vertices, faces), rel=0.1)
    assert taken < 50e6  # the coordinates of all would take 75 and more, and there were several arrays
