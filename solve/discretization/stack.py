"""Defines PatchStack: patches of one shape, whose maps, bases and quadrature rules are arrays with a leading dimension.

Work on a stack comes in pieces: whole patches where these are small, otherwise a patch's planes of points with a fixed
u. Sums over a patch have one order, whatever the number of threads.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import in_parallel

from ..field import Points
from ..forms.jets import PAIRS
from . import group_kernels, kernels
from .quadrature import GaussRule, divide
from .space import TrialSpace

SHARES = 4  # of the pieces of one colour a thread: some wait less where others take longer
LAYERS = 4  # of elements in a piece of work, where the degree allows so few
LARGE = 2**13  # points of a patch from which on its planes are shared out
POINTS = 2**12  # of a plane of several patches that are evaluated at once: their arrays fit into a processor's cache

Piece = tuple[IntArray, IntArray]  # the numbers of some patches of a stack, and those of some points of u


class Stacked(NamedTuple):
    """State a patch that may be stacked with others.

    same: equal for patches with the same law and data. shape: equal for patches that may be in one stack, beside equal
    degrees and numbers of control points, functions and points.
    """

    volume: BSplineVolume
    space: TrialSpace
    rule: GaussRule
    same: Hashable = None
    shape: Hashable = None


def stacks_of(patches: Sequence[Stacked], threads: int) -> Iterator[tuple[list[int], PatchStack]]:
    """Yield the stacks of patches with the numbers of their patches, those with the same data one after another."""
    found: dict[Any, dict[Any, list[int]]] = defaultdict(lambda: defaultdict(list))
    points = {id(rule): _bytes(*rule.points) for rule in {id(patch.rule): patch.rule for patch in patches}.values()}
    for number, (volume, space, rule, same, shape) in enumerate(patches):
        of_map = volume.degrees, volume.shape, volume.weights is None
        found[of_map, space.degrees, space.shape, rule.shape, shape][same].append(number)
    for runs in found.values():
        numbers = [number for own in runs.values() for number in sorted(own, key=lambda i: points[id(patches[i].rule)])]
        ends = np.cumsum([0, *map(len, runs.values())]).tolist()
        volumes, spaces, of_points, _, _ = zip(*(patches[number] for number in numbers), strict=True)
        yield numbers, PatchStack(spaces, of_points, threads, volumes, ends)


@dataclass(frozen=True, eq=False)
class PatchStack:
    """Hold k patches of equal degrees and equal numbers of control points, functions and quadrature points.

    runs: the ends of runs of patches with the same law and data, which are evaluated together: from 0 to k.
    """

    spaces: Sequence[TrialSpace]
    rules: Sequence[GaussRule]
    threads: int = 1
    volumes: Sequence[BSplineVolume] = ()
    runs: Sequence[int] = ()

    def __len__(self) -> int:
        return len(self.spaces)

    @property
    def space(self) -> TrialSpace:
        """Return the space of the first patch: its degrees and its shape are those of all."""
        return self.spaces[0]

    @property
    def shape(self) -> tuple[int, ...]:
        """Return the number of points per direction."""
        return self.rules[0].shape

    @property
    def plane_shape(self) -> tuple[int, int]:
        """Return the shape (q_w, q_v) of a plane of points."""
        return self.rules[0].plane_shape

    @cached_property
    def _of_spaces(self) -> tuple[IntArray, kernels.Tables]:
        return self._tabulated(self.spaces)

    @cached_property
    def _of_maps(self) -> tuple[IntArray, kernels.Tables]:
        return self._tabulated(self.volumes)

    def _tabulated(self, splines: Sequence[BSplineVolume | TrialSpace]) -> tuple[IntArray, kernels.Tables]:
        """Return for each patch the number (k,) of its rule and knots among different ones, and tables of each number.

        splines: the maps or the trial spaces.
        """
        objects: dict[Any, int] = {}  # most patches share rules and spaces
        keys: dict[Any, int] = {}
        numbers = []
        for rule, spline in zip(self.rules, splines, strict=True):
            known = id(rule), *map(id, spline.knots)
            if known not in objects:
                objects[known] = keys.setdefault(_bytes(*rule.points, *spline.knots), len(keys))
            numbers.append(objects[known])
        kinds = np.array(numbers, dtype=np.int64)
        firsts = np.unique(kinds, return_index=True)[1].tolist()
        return kinds, _joined([self.rules[i].tabulate(splines[i].degrees, splines[i].knots) for i in firsts])

    @property
    def kinds(self) -> IntArray:
        """Return for each patch the number (k,) of its rule and knots among different ones."""
        return self._of_spaces[0]

    @property
    def tables(self) -> kernels.Tables:
        """Return the tables of the trial bases at the points, with a leading dimension of kinds."""
        return self._of_spaces[1]

    @cached_property
    def _nets(self) -> Array:
        """Return the control points (k, 3, n_u, n_v, n_w), of rational volumes the homogeneous ones (k, 4, ...)."""
        is_rational = self.volumes[0].weights is not None
        nets = [volume.homogeneous if is_rational else volume.control_points for volume in self.volumes]
        return np.ascontiguousarray(np.moveaxis(np.stack(nets), -1, 1))

    def plane_weights(self, q: int) -> Array:
        """Return the weights (kinds, q_w, q_v) of the planes of point `q` of the first direction."""
        firsts = np.unique(self.kinds, return_index=True)[1]
        return np.stack([self.rules[i].plane_weights(q) for i in firsts])

    @property
    def is_small(self) -> bool:
        """Return whether patches are worked on as a whole."""
        return len(self) > 1 and math.prod(self.shape) < LARGE

    def on_pieces(self, task: Callable[[Piece], None]) -> None:
        """Run a task on all patches and points of u. It may add to the coefficients of the functions at its points."""
        every = np.arange(self.shape[0])
        if self.is_small:
            in_parallel(task, [(own, every) for own in self._patches()], self.threads)
            return
        first, degree = self.tables[0][0], self.space.degrees[0]
        turns = [colours(first[kind], degree, self.threads) for kind in self.kinds]
        for half in range(2):
            in_parallel(
                task,
                [(np.array([i]), points) for i, halves in enumerate(turns) for points in halves[half]],
                self.threads,
            )

    @property
    def pieces(self) -> list[Piece]:
        """Return pieces that make up all patches and points of u; each has whole layers of elements."""
        every = np.arange(self.shape[0])
        if self.is_small:
            return [(own, every) for own in self._patches()]
        turns = (colours(self.tables[0][0][kind], self.space.degrees[0], 1) for kind in self.kinds)
        return [(np.array([i]), points) for i, halves in enumerate(turns) for half in halves for points in half]

    def _patches(self) -> list[IntArray]:
        """Return the numbers of the patches in pieces; those of a piece have the same law and data."""
        size = max(1, min(POINTS // math.prod(self.plane_shape), -(-len(self) // (SHARES * self.threads))))
        ends = sorted({*self.runs, *range(0, len(self), size)})
        return [np.arange(a, b) for a, b in zip(ends, ends[1:], strict=False)]

    def planes(self, piece: Piece) -> Iterator[tuple[int, Array, Points]]:
        """Yield for every point q of u: q, the maps on its planes, and their points in space.

        The maps are (m, 3, 4, q_w, q_v) for the m patches of the piece: values and gradients of their components; the
        points are (3, q_w, q_v) with their parameters for one patch, (3, m, q_w, q_v) for several. The arrays are
        reused from one step to the next. A rational volume is the quotient of splines that the kernels evaluate.
        """
        patches, points = piece
        splines = np.empty((len(patches), self._nets.shape[1], 4, *self.plane_shape))
        fields = splines[:, :3]
        u, v, w = self.rules[patches[0]].points
        kinds, tables = self._of_maps
        for q in points:
            group_kernels.evaluate_splines(self._nets, patches, kinds[patches], q, tables, splines)
            if splines.shape[1] > 3:
                for own in splines:
                    divide(own[:3], own[3])
            x = fields[:, :, 0]
            if len(patches) == 1:
                yield q, fields, Points.of(x[0], (u[q : q + 1], v, w), (2, 1))
            else:
                yield q, fields, np.moveaxis(x, 0, 1).view(Points)

    def geometry(self, piece: Piece) -> Iterator[tuple[int, Array, Array, Points]]:
        """Yield as `planes` does: q, rows R (m, 3, 3, q_w, q_v), w det J (m, q_w, q_v), and the points in space.

        R is J^-1 times the root of w |det J|; docs/solver.md explains how gradients and fluxes are multiplied by it.
        """
        patches, _ = piece
        rows = np.empty((len(patches), 3, 3, *self.plane_shape))
        measure = np.empty((len(patches), *self.plane_shape))
        for q, fields, x in self.planes(piece):
            group_kernels.rows_of_maps(fields, self.plane_weights(q), self.kinds[patches], rows, measure)
            yield q, rows, measure, x

    def add_integrals(
        self,
        patches: IntArray,
        q: int,
        fields: Array,
        result: Array,
        tables: kernels.Tables | None = None,
        slopes: tuple[int, int, int] = (0, 0, 0),
    ) -> None:
        """Add integrals over the planes of point `q` of u, of fields times each function, to an array of all patches.

        fields: (m, c, q_w, q_v), with weights, of m patches. result: (k, c, n_u, n_v, n_w). tables: in place of the
        stack's own. slopes: for each direction, 0 for the values in its table and 1 for the derivatives.
        """
        own = np.ascontiguousarray(fields), patches, self.kinds, q, tables or self.tables
        group_kernels.add_integrals(*own, slopes, result)

    def diagonals(self, factors: Array) -> Array:
        """Return the diagonals (k, n_u, n_v, n_w) of scalar operators: squared functions take the place of functions.

        factors: (k, q_u, 6 or 7, q_w, q_v), as in `operator.Operator`.
        """
        result = np.zeros((len(self), 1, *self.space.shape))
        u, v, w = (  # (kinds, 3, q, degree + 1): values of B B, B B' and B' B' at the index of the sum of derivatives
            (first, np.stack([b[:, 0] ** 2, b[:, 0] * b[:, 1], b[:, 1] ** 2], axis=1), functions)
            for first, b, functions in self.tables
        )

        def add(piece: Piece) -> None:
            patches, points = piece
            for q in points:
                for entry, pair in zip(range(factors.shape[2]), (*PAIRS, ()), strict=False):
                    twice = 2.0 if len(set(pair)) == 2 else 1.0
                    of_u, of_v, of_w = (pair.count(a) for a in range(3))
                    field = twice * factors[patches, q, entry][:, None]
                    self.add_integrals(patches, q, field, result, (u, v, w), (of_u, of_v, of_w))

        self.on_pieces(add)
        return result[:, 0]


def of_law(fields: Array) -> Array:
    """Return fields (m, c, .., q_w, q_v) of m patches as a law takes them: (c, .., m, q_w, q_v), for one without m."""
    return fields[0] if len(fields) == 1 else np.moveaxis(fields, 0, -3)


def of_patches(found: Array, measure: Array) -> Array:
    """Return what a law gives for fields of `of_law` as (m, c, .., q_w, q_v); measure: (m, q_w, q_v)."""
    lead = found.shape[: found.ndim - 2 - (len(measure) > 1)]
    return np.moveaxis(found.reshape(*lead, *measure.shape), -3, 0)


def _bytes(*rows: Array) -> tuple[bytes, ...]:
    return tuple(row.tobytes() for row in rows)


def _joined(tables: Sequence[kernels.Tables]) -> kernels.Tables:
    """Return tables with a leading dimension."""
    u, v, w = (
        (np.stack([first for first, _, _ in each]), np.stack([basis for _, basis, _ in each]), each[0][2])
        for each in zip(*tables, strict=True)
    )
    return u, v, w


def colours(first: IntArray, degree: int, threads: int) -> list[list[IntArray]]:
    """Return consecutive points in pieces, as two lists that take the pieces by turns.

    first: (q,), the number of the first function that is not zero at each point. A piece covers at least as many layers
    of elements as the degree, so that no two pieces of one list share a basis function: these pieces may be added to
    the same array at the same time, and each sum has one order. The pieces of one list are joined to a few shares a
    thread, or to one share for a single thread.
    """
    layers = np.unique(first, return_inverse=True)[1]
    pieces = np.split(np.arange(len(first)), np.flatnonzero(np.diff(layers // max(degree, LAYERS))) + 1)
    shares = SHARES * threads if threads > 1 else 1
    halves = pieces[0::2], pieces[1::2]
    return [[np.concatenate(half[i::shares]) for i in range(min(len(half), shares))] for half in halves]
