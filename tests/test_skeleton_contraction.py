"""Nodes with too many arcs are divided, near ones contracted, and the number of loops and pieces stays."""

from __future__ import annotations

import numpy as np
import pytest

from parameterize.layouts.skeleton.contraction import MOST, contract, divide, drop_stubs
from parameterize.layouts.skeleton.lattice import Depth
from parameterize.layouts.skeleton.web import Arc, Web

MIDDLE = np.full(3, 20.0)


def in_a_cube():
    return Depth(np.pad(np.ones((39, 39, 39), dtype=bool), 1))


def line(start, end):
    return np.linspace(start, end, int(np.abs(np.asarray(end) - start).max()) + 1)


def star(directions, length):
    web = Web()
    middle = web.add_node(MIDDLE)
    for direction in directions:
        path = line(MIDDLE, MIDDLE + length * np.asarray(direction))
        web.arcs.append(Arc(middle, web.add_node(path[-1]), path))
    return web


@pytest.mark.parametrize("count", [7, 8, 12, 26])
def test_nodes_of_many_arcs_are_divided(count):
    grid = np.stack(np.meshgrid(*[(-1, 0, 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    directions = grid[np.any(grid != 0, axis=1)][:count]
    web = star(directions, 18)
    divide(web, in_a_cube())
    degrees = [web.degree(key) for key in web.nodes]
    assert max(degrees) <= MOST and degrees.count(1) == count
    assert web.pieces() == 1 and web.betti() == 0
    for arc in web.arcs:
        assert np.all(arc.path[0] == web.nodes[arc.first]) and np.all(arc.path[-1] == web.nodes[arc.last])


def test_two_near_junctions_are_one_and_their_common_loop_stays():
    web = star([(1, 0, 0), (0, 1, 0)], 15)
    other = web.add_node(MIDDLE + (0, 0, 6))
    for direction in ((0, -1, 0), (-1, 0, 0)):
        path = line(web.nodes[other], web.nodes[other] + 15 * np.asarray(direction))
        web.arcs.append(Arc(other, web.add_node(path[-1]), path))
    web.arcs.append(Arc(0, other, line(MIDDLE, web.nodes[other])))
    detour = MIDDLE + (10, 10, 3)
    web.arcs.append(Arc(0, other, np.concatenate([line(MIDDLE, detour), line(detour, web.nodes[other])[1:]])))
    assert web.betti() == 1
    contract(web, in_a_cube())
    assert web.betti() == 1 and web.pieces() == 1
    assert sorted(web.degree(key) for key in web.nodes) == [1, 1, 1, 1, 6]


def test_an_end_inside_the_ball_of_its_junction_is_dropped():
    web = star([(1, 0, 0), (0, 1, 0), (0, 0, 1)], 18)
    path = line(MIDDLE, MIDDLE - (0, 0, 3))
    web.arcs.append(Arc(0, web.add_node(path[-1]), path))
    depth = in_a_cube()
    depth.values = np.minimum(depth.values, 6.0)
    stub = path[-1].astype(int)
    depth.values[tuple(stub)] = 2.0
    drop_stubs(web, depth)
    assert sorted(web.degree(key) for key in web.nodes) == [1, 1, 1, 3]
