"""Finds the waves that make up the error of a solution: their lengths on each span, and the slowest ones of a patch."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy.special import zeta

from parameterize.arrays import Array, IntArray
from parameterize.spline.bspline import between, breakpoints, collocation, gauss_points, with_full_knots
from parameterize.spline.volume import AXES, FACE_NAMES, UNITS, BSplineVolume

from ..forms.boundary_value_problem import BoundaryValueProblem
from ..forms.frame import face_geometry
from .residual import Residual, Spans, dot, quadratic

ON_FACE = np.linspace(0.05, 0.95, 7)  # parameters a direction at which Robin's alpha is evaluated
SIGNS = tuple(product((1.0,), (1.0, -1.0), (1.0, -1.0)))  # of the waves that make up a standing one
MODEL = 8  # spans of the model at an end; beyond half of them the length is that of the span within 3 %
# The error of a solution of wave number k has the wave numbers 2 pi / h - k and 2 pi / h + k. The longer wave counts,
# for solutions with four spans a wave length, or more.
LONGER = 4.0 / 3.0

Directions = Sequence[bool]  # whether a part of a residual oscillates along each parameter


@dataclass(frozen=True, eq=False)
class Waves:
    """Hold the waves that make up the error on k patches, in their parameters.

    residual: that of the patches. lengths: the length (s,) of a wave on each span of each direction. lowest: (k,) for
    each direction, the wave number of the slowest wave that the data on its two faces admit. is_body: whether patches
    are glued.
    """

    residual: Residual
    lengths: list[Array]
    lowest: list[Array]
    is_body: bool

    @classmethod
    def of(cls, residual: Residual, is_body: bool) -> "Waves":
        """Return the waves on the patches of a residual. On one cube a wave has the length of its span."""
        space = residual.space
        lengths = list(map(wave_lengths, space.knots, space.degrees)) if is_body else list(map(np.diff, space.breaks))
        lowest = np.array([lowest_waves(own.volume, own.problem, own.space.outer) for own in residual.patches])
        return cls(residual, lengths, list(lowest.T), is_body)

    @property
    def problem(self) -> BoundaryValueProblem:
        """Return a problem with the law of the patches."""
        return self.residual.problem

    def factor(self, spans: Spans, oscillates: Directions, places: IntArray, **where: Any) -> Array:
        """Return the least factor of the law (k, s_u, s_v, s_w) for the waves of `vectors`."""
        waves = self.vectors(spans, oscillates, places, **where)
        least: Array = np.min([self.problem.form.symbol(wave, spans.middle) for wave in waves], axis=0)
        return least

    def inverses(self, spans: Spans, oscillates: Directions, places: IntArray, **where: Any) -> Iterator[Array]:
        """Yield the inverse of the law's matrix (k, s_u, s_v, s_w, c, c) for each of the waves of `vectors`."""
        for wave in self.vectors(spans, oscillates, places, **where):
            yield np.asarray(np.linalg.inv(self.problem.form.matrix_of_wave(wave, spans.middle)))

    def vectors(
        self,
        spans: Spans,
        oscillates: Directions,
        places: IntArray,
        layer: slice = slice(None),
        across: int | None = None,
    ) -> list[Array]:
        """Return the wave vectors (3, k, s_u, s_v, s_w) of one period a length in the oscillating directions.

        The other directions have their slowest waves, and a direction across a face has none. Together the waves are a
        standing one. places: (k,), the patches' places in the residual. layer: the spans in u.
        """
        lengths = self.lengths[0][layer][:, None, None], self.lengths[1][:, None], self.lengths[2]
        lowest = [low[places][:, None, None, None] for low in self.lowest]
        waves = [
            slope * (0.0 if axis == across else 2.0 * np.pi / lengths[axis] if oscillates[axis] else lowest[axis])
            for axis, slope in enumerate(spans.slopes)
        ]
        return [dot(signs, waves) for signs in SIGNS]


def wave_lengths(knots: Array, degree: int) -> Array:
    """Return the length (s,) of the wave that the error is on each span of a direction of a glued patch.

    Far from ends and from knots where splines are only continuous the error is nearly a wave of one period a span. Near
    to such knots it is shorter from degree 3 on. Its length there is that of a model in one dimension: of the best
    approximation of t^(p + 1) in the energy norm, times what makes it the span's size far from such knots. All lengths
    are LONGER than that.
    """
    values, counts = np.unique(knots, return_counts=True)
    ends = values[[0, *(np.flatnonzero(counts[1:-1] >= degree) + 1), -1]]
    found = []
    for low, high in pairwise(ends.tolist()):
        part = between(knots, degree, low, high)[1]
        found.append((high - low) * np.minimum(np.diff(breakpoints(part)), _lengths_near_ends(part, degree)))
    return LONGER * np.concatenate(found)


def _lengths_near_ends(knots: Array, degree: int) -> Array:
    """Return the lengths (s,) of `wave_lengths` for smooth splines: those of MODEL spans at the ends, half of them."""
    breaks = breakpoints(knots)
    if len(breaks) - 1 <= MODEL:
        return _modelled(knots, degree)
    found = np.diff(breaks)
    for low, high, part in (
        (0.0, breaks[MODEL], slice(MODEL // 2)),
        (breaks[-1 - MODEL], 1.0, slice(-(MODEL // 2), None)),
    ):
        row = with_full_knots(knots, degree, [cut for cut in (low, high) if 0.0 < cut < 1.0])
        found[part] = (high - low) * _modelled(between(row, degree, low, high)[1], degree)[part]
    return found


def _modelled(knots: Array, degree: int) -> Array:
    """Return the lengths (s,) of `wave_lengths` of a model with these knots."""
    t, weights = gauss_points(knots, degree + 2)
    value, slope, bend = (collocation(knots, degree, t.ravel(), order).toarray() for order in range(3))
    power, w = degree + 1, weights.ravel()
    stiffness, load = slope.T @ (w[:, None] * slope), slope.T @ (w * power * t.ravel() ** degree)
    best = np.zeros(len(load))
    best[-1] = 1.0
    best[1:-1] = np.linalg.solve(stiffness[1:-1, 1:-1], load[1:-1] - stiffness[1:-1, -1])
    error = t**power - (value @ best).reshape(t.shape)
    residual = power * degree * t ** (degree - 1) - (bend @ best).reshape(t.shape)
    residual -= (weights * residual).sum(axis=1, keepdims=True) / weights.sum(axis=1, keepdims=True)
    squares = ((weights * part**2).sum(axis=1) for part in (error, residual))
    number = (zeta(2 * degree - 2) / zeta(2 * degree + 2)) ** 0.25  # of periods a span far from the ends
    return 2.0 * np.pi * number * np.divide(*squares) ** 0.25


def lowest_waves(
    volume: BSplineVolume, problem: BoundaryValueProblem, outer: Collection[str] = FACE_NAMES
) -> list[float]:
    """Return for each direction the wave number, on [0, 1], of the slowest wave that the data on its two faces admit.

    The number is pi between two faces with given values, pi / 2 where one of the faces has a given flux, and 0 where
    both have a given flux. With Robin data, du/dn = -b u on a face, waves cos(k t - s) have k = arctan(b_0 / k) +
    arctan(b_1 / k). outer: the faces that are not glued; glued ones count as those with a given flux.
    """
    return [_slowest(*(_hold(volume, problem, axis, side, outer) for side in (0, 1))) for axis in range(3)]


@lru_cache(maxsize=64)  # thousands of patches have few numbers
def _slowest(low: float, high: float) -> float:
    from scipy.optimize import brentq  # of all runs, those that estimate an error alone need it

    b = np.array([low, high])
    return float(brentq(lambda k: k - np.arctan2(b, k).sum(), 0.0, np.pi)) if b.any() else 0.0


def _hold(volume: BSplineVolume, problem: BoundaryValueProblem, axis: int, side: int, outer: Collection[str]) -> float:
    """Return b of du/dn = -b u on a face, n a parameter: infinite where u is given, 0 where its flux is given.

    With Robin data b is an average of alpha over kappa, in the length of the parameter.
    """
    face = f"{AXES[axis]}{side}"
    if face not in outer or not problem.is_held(face):
        return 0.0
    if face in problem.dirichlet:
        return np.inf
    x, area = face_geometry(volume, (ON_FACE,) * 3, axis, side)
    if (factor := problem.factor_on(face, x)) is None:
        return 0.0
    u, v, w = (np.array([float(side)]) if a == axis else ON_FACE for a in range(3))
    tangent = np.moveaxis(np.squeeze(volume.grid(u, v, w, UNITS[axis]), axis), -1, 0)
    det = np.abs(dot(area, tangent))
    alpha = factor * det * np.linalg.norm(area, axis=0)
    through = float(quadratic(problem.form.tensor(x), area).sum())
    return float(alpha.sum()) / through if through > 0.0 else 0.0
