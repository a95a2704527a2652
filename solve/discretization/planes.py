"""A volume's geometry on planes of quadrature points, which assembly, products and error norms go through."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import midpoints
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from . import kernels
from .quadrature import GaussRule, operator_rule
from .space import TrialSpace

SAMPLES = 6  # places a direction, each three neighbouring spans
LIMIT = 0.03  # trained maps reach 0.06 and more after two refinements, the twisted cube 0.02 with 14 elements
TIMES = (1.0, 2.0, 2.0, 1.0, 2.0, 1.0)  # how often each of the six entries stands in a symmetric matrix


def map_planes(
    volume: BSplineVolume, rule: GaussRule, points: Iterable[int] | None = None
) -> Iterator[tuple[int, Array, Points]]:
    """Yield for every point q of direction u: q, the map on its plane, and its points in space, (3, q_w, q_v).

    The map is (3, 4, q_w, q_v): components x value and gradient. points: the q wanted, default all. The arrays are
    reused from one step to the next.
    """
    (first, basis, functions), table_v, table_w = rule.tabulate(volume.degrees, volume.knots)
    tables = (np.zeros_like(first), basis, functions), table_v, table_w
    row, components = -1, np.empty((3, 0, 0, 0))
    fields = np.empty((3, 4, *rule.plane_shape))
    u, v, w = rule.points
    for q in range(rule.shape[0]) if points is None else points:
        if first[q] != row:  # the rows of control points that are not zero on a span: all at once would be a second map
            row = int(first[q])
            rows = volume.control_points[row : row + len(functions)]
            components = np.ascontiguousarray(np.moveaxis(rows, -1, 0))  # (3, p + 1, n_v, n_w)
        for component, out in zip(components, fields, strict=True):
            kernels.evaluate_plane(component, q, tables, out)
        yield q, fields, Points.of(fields[:, 0], (u[q : q + 1], v, w), (2, 1))


def geometry_planes(
    volume: BSplineVolume, rule: GaussRule, points: Iterable[int] | None = None
) -> Iterator[tuple[int, Array, Array, Points]]:
    """Yield as `map_planes` does: q, rows R (3, 3, q_w, q_v), w det J (q_w, q_v), and the points in space.

    R is J^-1 times the root of w |det J|: docs/solver.md says how gradients and fluxes go through it.
    """
    rows, measure = np.empty((3, 3, *rule.plane_shape)), np.empty(rule.plane_shape)
    for q, fields, x in map_planes(volume, rule, points):
        kernels.plane_rows(fields, rule.plane_weights(q), rows, measure)
        yield q, rows, measure, x


def rule_of(volume: BSplineVolume, space: TrialSpace, tensor: Callable[[Points], Array], quadrature: str) -> GaussRule:
    """Return the rule of a law's operator on a volume; tensor as in `is_rough`, quadrature as in `operator_rule`."""
    return operator_rule(space, quadrature, quadrature == "spline" and is_rough(volume, space.whole, tensor))


def is_rough(volume: BSplineVolume, space: TrialSpace, tensor: Callable[[Points], Array]) -> bool:
    """Return whether G = det J J^-1 kappa J^-T varies much from span to span of a trial space.

    Measured are second differences of G between the middles of three neighbouring spans, relative to G, at SAMPLES^3
    places. G is rough where their root mean square exceeds LIMIT in a direction, and on fewer than three spans.
    tensor: takes points (3, ...) and returns the six entries of kappa (6, ...).
    """
    u, v, w = (_stencils(knots) for knots in space.knots)
    rule = GaussRule((u, v, w), (np.ones_like(u), np.ones_like(v), np.ones_like(w)))
    factors = np.empty((len(u), 6, *rule.plane_shape))
    with np.errstate(all="ignore"):  # of a map without an inverse the assembly speaks
        for q, rows, _, x in geometry_planes(volume, rule):
            kernels.tensor_factors(rows, np.ascontiguousarray(tensor(x)), factors[q])
        return not all(_bend(factors, axis) <= LIMIT for axis in (0, 2, 3))


def _stencils(knots: Array) -> Array:
    """Return the middles of SAMPLES times three neighbouring spans, of all spans where there are fewer than three."""
    middles = midpoints(knots)
    if len(middles) < 3:
        return middles
    centers = np.linspace(1, len(middles) - 2, SAMPLES).round().astype(int)
    return middles[(centers[:, None] + [-1, 0, 1]).ravel()]


def _bend(factors: Array, axis: int) -> float:
    """Return the root mean square of relative second differences along an axis of triples; infinite without triples."""
    if factors.shape[axis] < 3:
        return np.inf
    low, middle, high = (np.moveaxis(factors, (1, axis), (-1, 0))[i::3] for i in range(3))  # (triples, .., .., 6)
    squares = ((low - 2.0 * middle + high) ** 2 @ TIMES) / (middle**2 @ TIMES)
    return float(np.sqrt(squares.mean()))
