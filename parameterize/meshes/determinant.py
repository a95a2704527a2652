"""det J of elements of one kind in Bernstein form, with a bound of the rounding errors.

The nodes, relative to the first one, are brought to the control points of the three derivatives by one matrix each.
Their triple product is formed with the product rule for Bernstein polynomials, as certificate/determinant.py does:
of degree 3 p - 1 a direction on hexahedra, of degree 3 (p - 1) on tetrahedra (Johnen, Remacle, Geuzaine,
"Geometrical validity of curvilinear finite elements", J. Comput. Phys. 233, 2013).
"""

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

from ..arrays import Array, IntArray
from ..spline.bernstein import cross_products, dot_products, split
from ..threads import in_parallel
from .bezier import (
    multinomial,
    scales,
    simplex_indices,
    slope_matrices,
    slope_shapes,
)
from .kinds import ElementKind, Triple

CHUNK = 128  # elements at a time: their data fit into the cache
_UNIT_ROUNDOFF = 2.0**-53
_EDGES_AT_CORNERS = np.array([[0, 1, 2], [0, 3, 4], [1, 3, 5], [2, 4, 5]])  # u, v, w, then v - u, w - u, w - v
_UNDERFLOW = 1e-280  # more than a coefficient can lose to underflow, where elements are scaled to magnitude 1


@dataclass(frozen=True, eq=False)
class Coefficients:
    """det J of elements in Bernstein form, each scaled by a power of two.

    values: (k, d_u, d_v, d_w) of hexahedra, (k, d) of tetrahedra. errors: (k,) bounds of what they are off by.
    permanents: (k,) bounds of their magnitudes. exponents: (k,), det J = 2**exponent * value. sizes: (k,) bounds of
    |F_u| |F_v| |F_w| on the element, scaled alike; of tetrahedra the largest for the edges at any corner.
    """

    values: Array
    errors: Array
    permanents: Array
    exponents: IntArray
    sizes: Array


def _gamma(roundings: int) -> float:
    """Return a bound of the relative error of a chain of roundings; one percent, for the bound itself is rounded."""
    return 1.01 * roundings * _UNIT_ROUNDOFF / (1.0 - roundings * _UNIT_ROUNDOFF)


def _permanent(columns: list[Array]) -> Array:
    """Return the permanents (k,) of matrices with these columns (3, k)."""
    (a, b, c), (d, e, f), (g, h, i) = np.stack(columns, axis=1)
    return np.asarray(a * (e * i + f * h) + b * (d * i + f * g) + c * (d * h + e * g))


class ElementForm:
    """Writes det J of elements of a kind in Bernstein form, and cuts it into eight."""

    def __init__(self, kind: ElementKind) -> None:
        self.kind = kind
        self.is_simplex = kind.shape == "tetra"
        self.shapes = slope_shapes(kind)
        matrices = slope_matrices(kind)
        factors = [scales(kind, shape) for shape in self.shapes]
        self.matrices = [m * f.reshape(-1, 1) for m, f in zip(matrices, factors, strict=True)]
        self.bounds = [np.abs(m) for m in matrices]
        p, q, r = (3 * degree - 2 * self.is_simplex for degree in kind.degrees)
        self.counts: Triple = (p, q, r)
        degree = self.counts[0] - 1
        if self.is_simplex:
            self.places = np.array(simplex_indices(degree))
            self.factors = np.array([float(multinomial(degree, row)) for row in simplex_indices(degree)])
        else:
            self.factors = scales(kind, self.counts)[..., None].astype(np.float64)
        self.corners = _corners(kind, degree)
        self.roundings = self._roundings()
        self.halving_roundings = len(self.factors) if self.is_simplex else sum(self.counts)

    def _roundings(self) -> int:
        """Return how many rounding errors a product of derivatives passes through, at most (Higham, lemma 3.1).

        A component of F_v x F_w is a sum of at most 2 min(n_v, n_w) products, and its dot product with F_u one of at
        most 3 n_u, n the numbers of coefficients; division by the scale has 1.
        """
        u, v, w = (int(np.prod(shape)) for shape in self.shapes)
        return (2 * min(v, w) + 1) + (3 * u + 1) + 1

    def halving_error(self, permanents: Array, depth: int) -> Array:
        """Return a bound (k,) of what `depth` halvings add to the rounding error in the coefficients."""
        return _gamma(depth * self.halving_roundings) * permanents

    def coefficients(self, nodes: Array) -> Coefficients:
        """Return det J of elements (k, nodes, 3) in Bernstein form."""
        chunks = [slice(i, i + CHUNK) for i in range(0, len(nodes), CHUNK)] or [slice(0, 0)]
        parts = in_parallel(lambda chunk: self._some(nodes[chunk]), chunks)
        joined = [np.concatenate(rows) for rows in zip(*parts, strict=True)]
        return Coefficients(*joined)

    def _some(self, nodes: Array) -> tuple[Array, Array, Array, IntArray, Array]:
        """Return the arrays of some elements.

        A control point of a derivative is a sum over the nodes. A relative place has 1 rounding, an entry of a matrix
        1 and with its scale 2, their product 1. A product of three is off by what one factor is off by, times the
        others, and by its own roundings. Over each of the six permutations in the determinant the weights of these
        products sum to 1, so that permanents of the largest magnitudes bound the sums.
        """
        count = len(nodes)
        local = np.moveaxis(nodes - nodes[:, :1], 0, -1)  # (nodes, 3, k)
        exponents = np.frexp(np.abs(local).max(axis=(0, 1), initial=0.0))[1].astype(np.int64)
        local = np.ldexp(local, -exponents).reshape(len(self.kind.lattice), -1)
        slopes, largest, errors, lengths = [], [], [], []
        own = _gamma(4 + len(self.kind.lattice))
        magnitudes = np.abs(local)
        for matrix, bound, shape in zip(self.matrices, self.bounds, self.shapes, strict=True):
            net = (matrix @ local).reshape(-1, 3, count)
            slopes.append(np.ascontiguousarray(np.moveaxis(net, 1, 0)).reshape(3, *shape, count))
            net = np.abs(net) / np.maximum(scales(self.kind, shape).reshape(-1, 1, 1), 1)
            errors.append(own * (bound @ magnitudes).reshape(-1, 3, count).max(axis=0))
            largest.append(net.max(axis=0) * (1.0 + 1e-15) + errors[-1])
            lengths.append(np.linalg.norm(net, axis=1).max(axis=0) + np.linalg.norm(errors[-1], axis=0))
        if self.is_simplex:
            lengths += self._other_lengths(slopes, lengths, errors)
        determinant = dot_products(slopes[0], cross_products(slopes[1], slopes[2]))
        if self.is_simplex:
            values = determinant[tuple(self.places.T)] / self.factors[:, None]
        else:
            values = determinant / self.factors
        permanents = _permanent(largest)
        error = _gamma(self.roundings) * permanents + _UNDERFLOW
        for b in range(3):
            error += _permanent([errors[a] if a == b else largest[a] for a in range(3)])
        corners = _EDGES_AT_CORNERS if self.is_simplex else _EDGES_AT_CORNERS[:1]
        product_of_lengths = np.prod(np.array(lengths)[corners], axis=1).max(axis=0) * (1.0 + 1e-12)
        return np.ascontiguousarray(np.moveaxis(values, -1, 0)), error, permanents, 3 * exponents, product_of_lengths

    def _other_lengths(self, slopes: list[Array], lengths: list[Array], errors: list[Array]) -> list[Array]:
        """Return bounds (k,) of the derivatives along the edges of a tetrahedron that do not meet its corner 0."""
        found = []
        scale = np.maximum(scales(self.kind, self.shapes[0]), 1)[..., None]
        for a, b in ((0, 1), (0, 2), (1, 2)):
            off = np.linalg.norm(errors[a] + errors[b], axis=0) + 1e-15 * (lengths[a] + lengths[b])
            net = np.linalg.norm(slopes[b] - slopes[a], axis=0) / scale
            found.append(net.reshape(-1, net.shape[-1]).max(axis=0) + off)
        return found

    def flat(self, values: Array) -> Array:
        """Return coefficients as rows (k, d)."""
        return values.reshape(len(values), -1)

    def parts(self, values: Array) -> Array:
        """Return coefficients on the eighths of pieces: (k, ...) -> (8 k, ...), the eight of one piece together."""
        if self.is_simplex:
            eighths = np.einsum("pij,kj->kpi", subdivision(self.counts[0] - 1), values, optimize=True)
            return np.ascontiguousarray(eighths).reshape(-1, values.shape[1])
        return split(values).reshape(-1, *values.shape[1:])

    def part_places(self, places: Array) -> Array:
        """Return the corners of the eighths of pieces with corners (k, c, 3): (8 k, c, 3), exact at depths below 50."""
        weights = _eighths(self.kind.shape)
        return np.einsum("pij,kjc->kpic", weights, places, optimize=False).reshape(-1, *places.shape[1:])


def _corners(kind: ElementKind, degree: int) -> IntArray:
    """Return the places of the coefficients at the corners among all of them, in the order of the corners."""
    if kind.shape == "tetra":
        rows = simplex_indices(degree)
        return np.array([rows.index(row) for row in _tetra_corners(degree)])
    counts = [3 * p for p in kind.degrees]
    ends = [tuple(end * (n - 1) for end, n in zip(row, counts, strict=True)) for row in product((0, 1), repeat=3)]
    return np.array([np.ravel_multi_index(row, counts) for row in ends])


def _tetra_corners(degree: int) -> list[Triple]:
    return [(0, 0, 0), (degree, 0, 0), (0, degree, 0), (0, 0, degree)]


def reference_corners(kind: ElementKind) -> Array:
    """Return the parameters (c, 3) of the corners of the whole element."""
    if kind.shape == "tetra":
        return np.array(_tetra_corners(1), dtype=np.float64)
    return np.array(list(product((0.0, 1.0), repeat=3)))


_TETRA_PARTS = [  # the four at the corners, then the octahedron cut along one diagonal; ends of the edges halved
    [(0, 0), (0, 1), (0, 2), (0, 3)],
    [(0, 1), (1, 1), (1, 2), (1, 3)],
    [(0, 2), (1, 2), (2, 2), (2, 3)],
    [(0, 3), (1, 3), (2, 3), (3, 3)],
    [(0, 1), (0, 2), (0, 3), (1, 3)],
    [(0, 1), (1, 2), (0, 2), (1, 3)],
    [(0, 2), (0, 3), (1, 3), (2, 3)],
    [(0, 2), (1, 3), (1, 2), (2, 3)],
]


@cache
def _eighths(shape: str) -> Array:
    """Return the corners of the eight parts as means of those of the whole: (8, c, c)."""
    if shape == "tetra":
        found = np.zeros((8, 4, 4))
        for part, corners in enumerate(_TETRA_PARTS):
            for row, (a, b) in enumerate(corners):
                found[part, row, a] += 0.5
                found[part, row, b] += 0.5
        return found
    halves = np.array([[[1.0, 0.0], [0.5, 0.5]], [[0.5, 0.5], [0.0, 1.0]]])
    return np.einsum("pai,qbj,rck->pqrabcijk", halves, halves, halves).reshape(8, 8, 8)


@cache
def subdivision(degree: int) -> Array:
    """Return the matrices (8, d, d) to Bernstein coefficients on the eighths of a tetrahedron, no entry negative.

    A coefficient is the blossom at the corners of the part, each as often as its index says (Ramshaw, "Blossoms are
    polar forms", 1989). The entries are exact in double precision for degrees below 50, each row sums to 1.
    """
    parts = _eighths("tetra")
    matrices = np.zeros((8, len(simplex_indices(degree)), len(simplex_indices(degree))))
    for part, corners in enumerate(parts):
        for row, index in enumerate(simplex_indices(degree)):
            weights = {(0, 0, 0): 1.0}
            for corner, times in zip(corners, (degree - sum(index), *index), strict=True):
                for _ in range(times):
                    weights = _blossomed(weights, corner)
            for column, place in enumerate(simplex_indices(degree)):
                matrices[part, row, column] = weights.get(place, 0.0)
    return matrices


def _blossomed(weights: dict[Triple, float], corner: Array) -> dict[Triple, float]:
    """Return the weights of coefficients after one more step of de Casteljau's algorithm towards a corner."""
    found: dict[Triple, float] = {}
    for (i, j, k), weight in weights.items():
        steps = ((i, j, k), (i + 1, j, k), (i, j + 1, k), (i, j, k + 1))
        for place, share in zip(steps, corner.tolist(), strict=True):
            if share:
                found[place] = found.get(place, 0.0) + weight * share
    return found
