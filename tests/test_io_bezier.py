"""Tests iga_nn.io.bezier by a reader of its own, written from the format's description."""

from math import comb

import numpy as np
import pytest
from bodies import ring
from rational_shapes import quarter_ring
from test_io_calculix import bar

from iga_nn.errors import InputError
from iga_nn.io.bezier import write_bezier_extraction
from iga_nn.io.mfem_writer import right_handed
from parameterize.spline.body import as_body
from solve import benchmark_volume


def read(path):
    """Return control points (n, 3), and the elements: degrees, control points, and coefficient vectors (m, m)."""
    lines = iter(path.read_text().splitlines())
    assert next(lines) == "B E X T 2.0"
    _, nodes, elements, vectors, weighted = map(int, next(lines).split())
    assert weighted == 0
    points = np.array([list(map(float, next(lines).split())) for _ in range(nodes)])
    assert (points[:, 3] == 1.0).all()
    heads = [list(map(int, next(lines).split())) for _ in range(int(next(lines)))]

    def taken(count, most, kind):
        found = []
        while len(found) < count:
            row = next(lines).split()
            assert len(row) == min(most, count - len(found))
            found += map(kind, row)
        return found

    found = []
    for kind, count, functions, own, *degrees in heads:
        assert kind == 1
        found += [(degrees, taken(functions, 10, int), taken(own, 10, int)) for _ in range(count)]
    assert len(found) == elements
    dense, sparse = map(int, next(lines).split())
    assert sparse == 0
    blocks = [list(map(int, next(lines).split())) for _ in range(dense)]
    table = [np.array(taken(length, 5, float)) for count, length in blocks for _ in range(count)]
    assert len(table) == vectors and next(lines, None) is None
    return points[:, :3], [(d, np.array(n) - 1, np.array([table[v - 1] for v in own])) for d, n, own in found]


def at(element, points, where):
    """Return the point of an element at a place (3,) of the unit cube."""
    degrees, nodes, vectors = element
    rows = [[comb(p, k) * t**k * (1 - t) ** (p - k) for k in range(p + 1)] for p, t in zip(degrees, where, strict=True)]
    bernstein = np.einsum("a,b,c->cba", *rows).ravel()
    return (vectors @ bernstein) @ points[nodes]


@pytest.mark.parametrize("make", [lambda: benchmark_volume(4, amplitude=0.1), lambda: ring(3), bar])
def test_a_reader_of_its_own_finds_the_points_of_the_body(tmp_path, make):
    body = as_body(make())
    write_bezier_extraction(tmp_path / "body.bext", body)
    points, elements = read(tmp_path / "body.bext")
    upright = right_handed(body)
    assert len(points) == body.numbering[1]
    for where in ((0.5, 0.5, 0.5), (0.1, 0.8, 0.3)):
        found = np.array([at(element, points, where) for element in elements])
        ours = []
        for patch in upright:
            breaks = map(np.unique, patch.knots)
            u, v, w = (row[:-1] + t * np.diff(row) for row, t in zip(breaks, where, strict=True))
            ours.append(patch.grid(u, v, w).transpose(2, 1, 0, 3).reshape(-1, 3))
        assert np.abs(found - np.concatenate(ours)).max() < 1e-13


def test_a_rational_body_is_refused(tmp_path):
    with pytest.raises(InputError, match="rational body is not written"):
        write_bezier_extraction(tmp_path / "ring.bext", quarter_ring())
