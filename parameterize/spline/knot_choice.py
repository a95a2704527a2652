"""Chooses the knot spans to halve, by what is found on them: other ones, and another number, in each direction."""

import numpy as np

from ..arrays import Array, IntArray, Knots
from .bspline import breakpoints, midpoints


def totals_along(places: Array, amounts: Array, knots: Knots) -> tuple[Array, Array, Array]:
    """Return for each direction the amounts (m,) at places (m, 3) of the cube, summed over each of its spans."""
    u, v, w = (np.histogram(places[:, axis], breakpoints(row), weights=amounts)[0] for axis, row in enumerate(knots))
    return u, v, w


def halved_where_most(
    knots: Knots,
    amounts: tuple[Array, Array, Array],
    counts: IntArray,
    *,
    most: int,
    share: float,
    growth: float,
    narrowest: float,
) -> Knots:
    """Return the knots with those spans halved on which most is found, the largest amounts of all directions first.

    amounts: of each span, a direction. counts (3,): control points a direction; none gets more than `most`. No span is
    halved any more once `share` of all amounts is on those that are, or the control points are `growth` times as many;
    none into halves below `narrowest`.
    """
    counts, total = counts.copy(), np.prod(counts)
    halves = np.concatenate([np.diff(breakpoints(row)) / 2.0 for row in knots])
    ranked = np.concatenate([np.stack([np.full(len(a), d), np.arange(len(a))], axis=1) for d, a in enumerate(amounts)])
    values = np.concatenate(amounts)
    chosen: tuple[list[int], ...] = ([], [], [])
    reached, wanted = 0.0, share * values.sum()
    for place in np.argsort(-values, kind="stable"):
        axis, span = ranked[place]
        if reached >= wanted or np.prod(counts + (np.arange(3) == axis)) > growth * total:
            break
        if counts[axis] < most and halves[place] >= narrowest:
            chosen[axis].append(span)
            counts[axis] += 1
        reached += values[place]
    u, v, w = (np.sort(np.concatenate([row, midpoints(row)[spans]])) for row, spans in zip(knots, chosen, strict=True))
    return u, v, w
