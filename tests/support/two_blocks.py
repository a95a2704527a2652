"""Two unit cubes side by side, glued, of two solids: as two patches, and as hexahedra of tetrahedra."""

from itertools import permutations

import numpy as np
from cube_grids import box

from iga_nn import Body
from parameterize.layouts.complex import Complex, spline_of
from parameterize.spline.solids import PatchSolids

NAMES = ("steel", "pad")


def two_patches():
    """Two patches of two spans a direction, from x = 0 to 1 and from 1 to 2."""
    return Body.from_patches([box((0, 0, 0)), box((1, 0, 0))], solids=NAMES)


def two_of_hexahedra(cells=2, degree=2):
    """Each cube in `cells` cubes a direction, each of these in six tetrahedra, each of them in four hexahedra."""
    places, tetrahedra = _kuhn(cells)
    points, hexahedra = _hexahedra(places, tetrahedra)
    body = spline_of(Complex(points, hexahedra), degree).body
    middles = points[hexahedra.reshape(len(hexahedra), 8)].mean(axis=1)
    return Body(body.patches, body.interfaces, PatchSolids((middles[:, 0] > 1.0).astype(int), NAMES))


def _kuhn(cells):
    """Return points (n, 3) of a grid of 2 by 1 by 1 and its tetrahedra (t, 4), six for each cell."""
    shape = (2 * cells + 1, cells + 1, cells + 1)
    points = np.stack(np.unravel_index(np.arange(np.prod(shape)), shape), axis=1)
    corners = points[(points < np.array(shape) - 1).all(axis=1)]
    paths = np.cumsum(
        [[np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]] for order in permutations(range(3))], axis=1
    )
    paths = np.array([path if _sign(path) > 0 else path[[0, 2, 1, 3]] for path in paths])
    numbers = np.ravel_multi_index(np.moveaxis(corners[:, None, None] + paths, -1, 0), shape)
    return points / cells, numbers.reshape(-1, 4)


def _sign(path):
    return np.linalg.det(path[1:] - path[0])


def _hexahedra(points, tetrahedra):
    """Return points and hexahedra (k, 2, 2, 2), one at each vertex of each tetrahedron; middles are new points."""
    members = [(0,), (1,), (2,), (3,), (0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    members += [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3), (0, 1, 2, 3)]
    keys = np.concatenate([np.sort(np.pad(tetrahedra[:, m], ((0, 0), (0, 4 - len(m))), mode="edge")) for m in members])
    own = np.concatenate([points[tetrahedra[:, m]].mean(axis=1) for m in members])
    _, first, numbers = np.unique(_sets(keys), axis=0, return_index=True, return_inverse=True)
    table = dict(zip(members, numbers.reshape(len(members), -1), strict=True))
    found = []
    for a, b, c, d in [(0, 1, 2, 3), (1, 0, 3, 2), (2, 3, 0, 1), (3, 2, 1, 0)]:  # even permutations
        at = [
            table[tuple(sorted(m))]
            for m in ((a,), (a, d), (a, c), (a, c, d), (a, b), (a, b, d), (a, b, c), (a, b, c, d))
        ]
        found.append(np.stack(at, axis=1).reshape(-1, 2, 2, 2))
    return own[first], np.concatenate(found)


def _sets(keys):
    """Return sorted rows whose repeated entries are -1."""
    return np.sort(np.where(np.diff(keys, axis=1, prepend=-1) == 0, -1, keys), axis=1)
