"""Chooses the quadrature rules of operators: more points where their factors vary much from span to span."""

from collections import defaultdict
from collections.abc import Callable, Hashable, Sequence
from typing import Any, NamedTuple

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.bspline import breakpoints, midpoints
from parameterize.spline.volume import BSplineVolume

from ..field import Points
from . import kernels
from .quadrature import GaussRule, operator_rule
from .space import TrialSpace, of_each
from .stack import PatchStack, Piece

SAMPLES = 6  # places a direction, each three neighbouring spans, at which a map is measured
LIMIT = 0.03  # trained maps reach 0.06 and more after two refinements, the twisted cube 0.02 with 14 elements
TIMES = (1.0, 2.0, 2.0, 1.0, 2.0, 1.0)  # number of times that each of the six entries stands in a symmetric matrix
PATCHES = 64  # that are measured at a time: the factors of one take a quarter of a megabyte

Tensor = Callable[[Points], Array]


class Measured(NamedTuple):
    """Hold what the rule of a patch depends on.

    tensor: a function of points (3, ...) that returns the six entries of kappa (6, ...). law: equal for patches whose
    tensors are the same function of the points.
    """

    volume: BSplineVolume
    space: TrialSpace
    tensor: Tensor
    law: Hashable = None


def rules_of(patches: Sequence[Measured], quadrature: str) -> list[GaussRule]:
    """Return the quadrature rules of a law's operator on patches, the same object where they are equal.

    quadrature: a name, as in `operator_rule`.
    """
    spaces = [patch.space for patch in patches]
    rough = roughness(patches) if quadrature == "spline" else [False] * len(patches)
    known: dict[Any, GaussRule] = {}
    keys = of_each(lambda space: (space.key, *(row.tobytes() for row in space.breaks), *space.glued_ends), spaces)
    for space, key, is_rough in zip(spaces, keys, rough, strict=True):
        if (key, is_rough) not in known:
            known[key, is_rough] = operator_rule(space, quadrature, is_rough)
    return [known[key] for key in zip(keys, rough, strict=True)]


def rule_of(volume: BSplineVolume, space: TrialSpace, tensor: Tensor, quadrature: str) -> GaussRule:
    """Return the quadrature rule of a law's operator on a volume, as `rules_of` does."""
    return rules_of([Measured(volume, space, tensor)], quadrature)[0]


def roughness(patches: Sequence[Measured]) -> list[bool]:
    """Return for each patch whether G = det J J^-1 kappa J^-T varies much from span to span of its trial space.

    The measure is the second difference of G between the midpoints of three neighbouring spans, relative to G, at
    SAMPLES^3 places. G is rough where the root mean square of these exceeds LIMIT in a direction, and on fewer than
    three spans.
    """
    rules: dict[Any, GaussRule] = {}
    groups, spaces = defaultdict(list), [patch.space for patch in patches]
    many = of_each(lambda space: all(len(breakpoints(knots)) > 3 for knots in space.whole.knots), spaces)
    for number, ((volume, space, _, law), is_many) in enumerate(zip(patches, many, strict=True)):
        if is_many:
            key = tuple(row.tobytes() for row in space.whole.knots)
            if key not in rules:
                u, v, w = (_stencils(knots) for knots in space.whole.knots)
                rules[key] = GaussRule((u, v, w), (np.ones_like(u), np.ones_like(v), np.ones_like(w)))
            groups[volume.degrees, volume.shape, volume.weights is None, law].append((number, rules[key]))
    found = [True] * len(patches)
    for members in groups.values():
        for start in range(0, len(members), PATCHES):
            numbers, own = zip(*members[start : start + PATCHES], strict=True)
            for number, is_rough in zip(numbers, _are_rough([patches[i] for i in numbers], own), strict=True):
                found[number] = is_rough
    return found


def _are_rough(patches: Sequence[Measured], rules: Sequence[GaussRule]) -> list[bool]:
    """Return whether each of some patches of one shape and law is rough, from the rules of their stencils."""
    volumes, spaces, tensors, _ = zip(*patches, strict=True)
    stack = PatchStack([space.whole for space in spaces], rules, 1, volumes, (0, len(patches)))
    factors = np.empty((len(patches), stack.shape[0], 6, *stack.plane_shape))

    def fill(piece: Piece) -> None:
        for q, rows, _, x in stack.geometry(piece):
            kappa = tensors[0](x).reshape(6, -1, *stack.plane_shape)
            for i, own, tensor in zip(piece[0], rows, np.moveaxis(kappa, 1, 0), strict=True):
                kernels.tensor_factors(own, np.ascontiguousarray(tensor), factors[i, q])

    with np.errstate(all="ignore"):  # of a map without an inverse the assembly speaks
        stack.on_pieces(fill)
        return [not all(_bend(own, axis) <= LIMIT for axis in (0, 2, 3)) for own in factors]


def _stencils(knots: Array) -> Array:
    """Return the midpoints of SAMPLES times three neighbouring spans, of three spans or more."""
    middles = midpoints(knots)
    centers = np.linspace(1, len(middles) - 2, SAMPLES).round().astype(int)
    return middles[(centers[:, None] + [-1, 0, 1]).ravel()]


def _bend(factors: Array, axis: int) -> float:
    """Return the root mean square of relative second differences along an axis of triples."""
    low, middle, high = (np.moveaxis(factors, (1, axis), (-1, 0))[i::3] for i in range(3))  # (triples, .., .., 6)
    squares = ((low - 2.0 * middle + high) ** 2 @ TIMES) / (middle**2 @ TIMES)
    return float(np.sqrt(squares.mean()))
