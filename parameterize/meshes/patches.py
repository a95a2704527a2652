"""Makes Bezier patches of elements: one of a hexahedron, four of a tetrahedron, exactly.

A tetrahedron is cut into four hexahedra at the middles of its edges and faces and at its centre. The barycentric
coordinates are trilinear in the parameters of such a hexahedron, so that an element of degree p is one of degree p.
"""

from fractions import Fraction
from functools import cache
from itertools import product

import numpy as np

from ..arrays import Array
from .bezier import bernstein_of_values, net_matrix, simplex_bernstein, simplex_indices
from .kinds import ElementKind

# Of each part of a tetrahedron its vertex, then those towards which u, v and w lead; all parts are right-handed.
PARTS = np.array([(0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)])


@cache
def patch_matrices(kind: ElementKind) -> Array:
    """Return the matrices (parts, n_u, n_v, n_w, nodes) from nodes to the control points of each part."""
    if kind.shape == "hexahedron":
        net = np.array([[float(x) for x in row] for row in net_matrix(kind)])
        return net.reshape(1, *(p + 1 for p in kind.degrees), -1)
    return np.array([_part(kind, part) for part in range(len(PARTS))])


def _part(kind: ElementKind, part: int) -> Array:
    """Return the matrix (p + 1, p + 1, p + 1, nodes) to the control points of a part of a tetrahedron."""
    p = kind.degrees[0]
    own, *others = PARTS[part].tolist()
    net, indices = net_matrix(kind), simplex_indices(p)
    values = np.zeros((p + 1,) * 3 + (len(net[0]),), dtype=object)
    for place in product(range(p + 1), repeat=3):
        shares = [Fraction(0)] * 4
        for corner in product((0, 1), repeat=3):
            vertices = [own, *(other for other, step in zip(others, corner, strict=True) if step)]
            weight = Fraction(1, len(vertices))
            for i, step in zip(place, corner, strict=True):
                weight *= Fraction(i if step else p - i, p)
            for vertex in vertices:
                shares[vertex] += weight
        weights = [simplex_bernstein(p, index, shares[1:]) for index in indices]
        for weight, row in zip(weights, net, strict=True):
            if weight:
                values[place] += weight * np.array(row, dtype=object)
    one = np.array(bernstein_of_values(p), dtype=object)
    for _ in range(3):  # each time along the axis that is first, which becomes the last of the three
        values = np.moveaxis(np.tensordot(one, values, axes=(1, 0)), 0, 2)
    return values.astype(np.float64)
