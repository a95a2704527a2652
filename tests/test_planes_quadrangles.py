"""Polygons in convex quadrangles."""

import numpy as np
import pytest
from plane_bodies import ring

from parameterize.layouts.planar.quadrangles import LEAST, quadrangles_of

SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
POLYGONS = {  # the outer polygon and those around holes, and the number of quadrangles
    "square": ([SQUARE], 1),
    "triangle": ([[(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)]], 3),
    "pentagon": ([ring(5, 1.0)], 2),
    "L": ([[(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]], 2),
    "square with a square hole": ([SQUARE, [(1, 1), (1, 3), (3, 3), (3, 1)]], 4),
    "square with four holes in a row and a column": (
        [SQUARE, *[[(x, y), (x, y + 0.5), (x + 0.5, y + 0.5), (x + 0.5, y)] for x in (1, 2.5) for y in (1, 2.5)]],
        None,
    ),
}


def area(corners):
    x, y = np.transpose(corners)
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


@pytest.mark.parametrize("name", POLYGONS)
def test_quadrangles_are_convex_fill_the_polygon_and_have_whole_edges_in_common(name):
    polygons, count = POLYGONS[name]
    starts = np.cumsum([0, *map(len, polygons)])
    loops = [tuple(range(a, b)) for a, b in zip(starts, starts[1:], strict=False)]
    points = np.concatenate([np.array(polygon, dtype=float) for polygon in polygons])
    found = quadrangles_of(points, loops)
    pieces = [found.points[list(corners)] for corners in found.corners]
    assert count is None or len(pieces) == count
    assert sum(map(area, pieces)) == pytest.approx(sum(map(area, polygons)))
    for piece in pieces:
        ahead, behind = np.roll(piece, -1, axis=0) - piece, np.roll(piece, 1, axis=0) - piece
        sines = (ahead[:, 0] * behind[:, 1] - ahead[:, 1] * behind[:, 0]) / (
            np.linalg.norm(ahead, axis=1) * np.linalg.norm(behind, axis=1)
        )
        assert sines.min() >= LEAST
    sides = [frozenset(side) for one in found.corners for side in zip(one, one[1:] + one[:1], strict=True)]
    single = [side for side in sides if sides.count(side) == 1]
    length = sum(np.linalg.norm(np.subtract(*found.points[list(side)])) for side in single)
    outline = sum(np.linalg.norm(np.roll(p, -1, axis=0) - p, axis=1).sum() for p in map(np.array, polygons))
    assert length == pytest.approx(outline)  # each other edge belongs to two


def test_points_on_edges_know_their_edge():
    found = quadrangles_of(np.array([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)]), [(0, 1, 2)])
    ends = [sorted(parents) for parents in found.parents]
    assert ends.count([]) == 1 and [0, 1] in ends and [1, 2] in ends and [0, 2] in ends
