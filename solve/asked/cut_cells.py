"""Integrates over the part of a body in which a condition on the position holds: spans that its rim cuts get lines.

A span in which the condition holds at all samples has Gauss points. In one that is cut, lines run in the direction in
which the condition changes most often; the changes on each line are found by bisection, and every piece between two of
them has Gauss points, as on faces (`discretization/surface_rule.py`). Where lines of a cell differ, as at an edge of
the part, the cell is first halved in all directions.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np

from parameterize.arrays import Array, IntArray, Knots, Mask
from parameterize.spline.bspline import breakpoints, divided_spans
from parameterize.spline.spline_stack import SplineStack

SAMPLES = 5  # points a direction at which the condition is evaluated in a span, its ends included
FEWEST = 40  # of these a direction on a cube, so that few spans are sampled as finely as many
PIECES = 8  # intervals of a line, each searched for a change
BISECTIONS = 20
HALVINGS = 4  # of cells in which lines differ, at most: of a box in a span some 1e-5 of its volume is then wrong
MOST_CELLS = 4000  # of these at once, else lines are taken: there are so many that their errors cancel
MOST = 2**18  # points at once

Holds = Callable[[Array], Mask]  # of points (3, m)
Points = tuple[IntArray, Array, Array]  # patches (m,), parameters (m, 3) and weights (m,) in the parameters


def spans_of(maps: SplineStack, knots: Knots, holds: Holds) -> tuple[Mask, Mask]:
    """Return in which spans (k, s_u, s_v, s_w) of k patches a condition holds at all samples, and at some of them."""
    breaks = [breakpoints(row) for row in knots]
    cells = len(maps) * math.prod(len(row) - 1 for row in breaks)
    pieces = max(SAMPLES, math.ceil(FEWEST / cells ** (1.0 / 3.0))) - 1
    rows = [divided_spans(row, pieces) for row in knots]
    x = np.moveaxis(maps.grid(*rows), -1, 0)  # (3, k, .., .., ..)
    seen = np.asarray(holds(np.ascontiguousarray(x)))
    every, some = seen, seen
    for axis, row in enumerate(breaks, start=1):
        places = np.arange(len(row) - 1)[:, None] * pieces + np.arange(pieces + 1)
        every = np.take(every, places, axis=axis).all(axis=axis + 1)
        some = np.take(some, places, axis=axis).any(axis=axis + 1)
    return every, some


def points_in(maps: SplineStack, knots: Knots, spans: Mask, holds: Holds, count: int) -> Iterator[Points]:
    """Yield points at which a condition holds in the spans (k, s_u, s_v, s_w) that are cut.

    count: Gauss points a direction.
    """
    owners, *places = np.nonzero(spans)
    rows = [breakpoints(row) for row in knots]
    ends = [[row[place + side] for row, place in zip(rows, places, strict=True)] for side in (0, 1)]
    cells = np.stack([np.stack(side, axis=-1) for side in ends], axis=1)  # (n, 2, 3)
    yield from _in_cells(maps, owners, cells, holds, count, SAMPLES, HALVINGS)


def _in_cells(
    maps: SplineStack, owners: IntArray, cells: Array, holds: Holds, count: int, samples: int, halvings: int
) -> Iterator[Points]:
    """Yield the points in cells (n, 2, 3), which may be halved so many times. samples: of the condition a direction."""
    t = np.linspace(0.0, 1.0, samples)
    grid = np.stack(np.meshgrid(t, t, t, indexing="ij"), axis=-1).reshape(-1, 3)
    step = max(1, MOST // len(grid))
    for start in range(0, len(cells), step):
        own, some = owners[start : start + step], cells[start : start + step]
        seen = _held(maps, own, _placed(some, grid), holds)
        inside = seen.all(axis=1)
        if inside.any():
            yield from _gauss(own[inside], some[inside], count)
        cut = np.flatnonzero(seen.any(axis=1) & ~inside)
        if not len(cut):
            continue
        marks = seen[cut].reshape(-1, *(samples,) * 3)
        direction, differ = _lines_of(marks)
        if halvings == 0 or np.count_nonzero(differ) > MOST_CELLS:
            differ[:] = False
        if differ.any():
            closer = max(SAMPLES, samples // 2 + 1)
            parts = _eighths(some[cut[differ]])
            yield from _in_cells(maps, np.repeat(own[cut[differ]], 8), parts, holds, count, closer, halvings - 1)
        if not differ.all():
            rest = cut[~differ]
            yield from _on_lines(maps, own[rest], some[rest], direction[~differ], holds, count)


def _lines_of(seen: Mask) -> tuple[IntArray, Mask]:
    """Return the direction (n,) in which a condition changes most often in cells, and whether lines along it differ.

    seen: (n, k, k, k), where the condition holds at samples.
    """
    changes = [np.diff(seen, axis=1 + a) for a in range(3)]
    direction = np.argmax([np.count_nonzero(change, axis=(1, 2, 3)) for change in changes], axis=0)
    differ = np.zeros(len(seen), dtype=bool)
    for axis in range(3):
        own = np.flatnonzero(direction == axis)
        first = np.take(seen[own], 0, axis=1 + axis).reshape(len(own), seen.shape[1] ** 2)
        often = np.count_nonzero(changes[axis][own], axis=1 + axis).reshape(first.shape)
        differ[own] = ((first != first[:, :1]) | (often != often[:, :1])).any(axis=1)
    return direction, differ


def _eighths(cells: Array) -> Array:
    """Return the parts (8 n, 2, 3) of cells (n, 2, 3), those of a cell one after another."""
    ends = np.stack([cells[:, 0], cells.mean(axis=1), cells[:, 1]], axis=1)  # (n, 3, 3)
    corners = np.stack(np.meshgrid(*[[0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    low, high = (ends[:, corners + side, np.arange(3)] for side in (0, 1))  # (n, 8, 3)
    return np.asarray(np.stack([low, high], axis=2).reshape(-1, 2, 3))


def _held(maps: SplineStack, owners: IntArray, places: Array, holds: Holds) -> Mask:
    """Return whether the condition holds (n, k) at parameters (n, k, 3) of patches (n,)."""
    x = maps.at(np.repeat(owners, places.shape[1]), places.reshape(-1, 3))
    return np.asarray(holds(np.ascontiguousarray(x.T))).reshape(places.shape[:2])


def _gauss(owners: IntArray, cells: Array, count: int) -> Iterator[Points]:
    """Yield Gauss points of whole cells (n, 2, 3)."""
    t, weights = _unit_rule(count)
    grid = np.stack(np.meshgrid(t, t, t, indexing="ij"), axis=-1).reshape(-1, 3)
    each = np.einsum("i,j,k->ijk", weights, weights, weights).ravel()
    step = max(1, MOST // len(grid))
    for start in range(0, len(cells), step):
        some = cells[start : start + step]
        sizes = np.prod(some[:, 1] - some[:, 0], axis=1)
        yield (
            np.repeat(owners[start : start + step], len(grid)),
            _placed(some, grid).reshape(-1, 3),
            np.multiply.outer(sizes, each).ravel(),
        )


def _on_lines(
    maps: SplineStack, owners: IntArray, cells: Array, direction: IntArray, holds: Holds, count: int
) -> Iterator[Points]:
    """Yield points on lines through cells that are cut, in the direction (n,) of each."""
    t, weights = _unit_rule(count)
    across = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    each = np.multiply.outer(weights, weights).ravel()
    step = max(1, MOST // (len(across) * (PIECES + 1)))
    for axis in range(3):
        chosen = np.flatnonzero(direction == axis)
        others = [a for a in range(3) if a != axis]
        for start in range(0, len(chosen), step):
            some = chosen[start : start + step]
            own, ends = np.repeat(owners[some], len(across)), np.repeat(cells[some], len(across), axis=0)
            size = ends[:, 1] - ends[:, 0]
            fixed = ends[:, 0][:, others] + np.tile(across, (len(some), 1)) * size[:, others]
            scale = np.tile(each, len(some)) * np.prod(size, axis=1)
            lines = _Lines(maps, own, axis, fixed, ends[:, 0, axis], size[:, axis], holds)
            yield from lines.points(scale, t, weights)


class _Lines:
    """Cut n lines of patches where a condition changes.

    fixed: (n, 2), the parameters of the two directions across. low, size: (n,), of the intervals along.
    """

    def __init__(
        self, maps: SplineStack, owners: IntArray, axis: int, fixed: Array, low: Array, size: Array, holds: Holds
    ) -> None:
        self.maps, self.owners, self.axis, self.fixed = maps, owners, axis, fixed
        self.low, self.size, self.holds = low, size, holds

    def _places(self, line: IntArray, s: Array) -> Array:
        """Return the parameters (k, 3) at places s (k,), from 0 to 1, of lines (k,)."""
        return np.insert(self.fixed[line], self.axis, self.low[line] + s * self.size[line], axis=1)

    def _at(self, line: IntArray, s: Array) -> Mask:
        return _held(self.maps, self.owners[line], self._places(line, s)[:, None], self.holds)[:, 0]

    def points(self, scale: Array, t: Array, weights: Array) -> Iterator[Points]:
        """Yield the points between changes. scale: (n,), the weight of each line; t, weights: a rule on [0, 1]."""
        count = len(self.owners)
        s, every = np.linspace(0.0, 1.0, PIECES + 1), np.arange(count)
        seen = self._at(np.repeat(every, len(s)), np.tile(s, count)).reshape(count, -1)
        line, piece = np.nonzero(np.diff(seen, axis=1))
        left, right, first = s[piece], s[piece + 1], seen[line, piece]
        for _ in range(BISECTIONS if len(line) else 0):
            middle = 0.5 * (left + right)
            same = self._at(line, middle) == first
            left, right = np.where(same, middle, left), np.where(same, right, middle)
        of_line, ends = np.concatenate([every, line, every]), np.concatenate([0.0 * every, left, 0.0 * every + 1.0])
        order = np.lexsort((ends, of_line))
        of_line, ends = of_line[order], ends[order]
        begins = np.flatnonzero(of_line[:-1] == of_line[1:])
        own, start, length = of_line[begins], ends[begins], np.diff(ends)[begins]
        kept = (length > 0.0) & self._at(own, start + 0.5 * length)
        own, start, length = own[kept], start[kept], length[kept]
        if len(own):
            lines = np.repeat(own, len(t))
            places = self._places(lines, (start[:, None] + np.multiply.outer(length, t)).ravel())
            yield self.owners[lines], places, np.multiply.outer(scale[own] * length, weights).ravel()


def _placed(cells: Array, places: Array) -> Array:
    """Return points (n, k, 3) of cells (n, 2, 3) at places (k, 3) of the unit cube."""
    return np.asarray(cells[:, None, 0] + places * (cells[:, None, 1] - cells[:, None, 0]))


def _unit_rule(count: int) -> tuple[Array, Array]:
    """Return Gauss points and weights on [0, 1]."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1.0), 0.5 * weights
