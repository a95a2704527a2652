"""Defines the trial space: tensor-product splines on a volume's own knots, refined and raised in degree."""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Hashable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import numpy as np

from parameterize.arrays import Array, Knots
from parameterize.spline.bspline import apply_along, breakpoints, halved, insertion_into
from parameterize.spline.patch_groups import groups_of
from parameterize.spline.volume import AXES, FACE_NAMES, BSplineVolume

Window = tuple[slice, slice, slice]
Place = tuple[float, ...]  # the breakpoints of a direction, in spans of the map: from 0 to their number
Places = tuple[Place, Place, Place]  # of a patch, see `grading.Grading`
Made = TypeVar("Made")

LAYERS = 8  # of elements that are measured at a time: their arrays stay in the cache
MOST_ELEMENTS = 1e12  # of a trial space: no computer solves on more, and endless halving would not return
MOST_DEGREE = 8


@dataclass(frozen=True, eq=False)
class TrialSpace:
    """Describe scalar trivariate splines on the unit cube, of three degrees on three open knot vectors on [0, 1].

    dirichlet: names of the cube's faces on which boundary data fix the coefficients. outer: names of the faces on the
    body's boundary; the others are glued to faces of patches.

    The operators ask a space for the rows of their process, which are functions of u, and for sums over all processes.
    A single process has all rows and sends nothing; `Slab` is the space of a process that has some of the rows.
    """

    degrees: tuple[int, int, int]
    knots: Knots
    dirichlet: Collection[str] = FACE_NAMES
    outer: Collection[str] = FACE_NAMES

    @property
    def whole(self) -> "TrialSpace":
        """Return the space that all processes share."""
        return self

    @cached_property
    def key(self) -> Hashable:
        """Return what is equal for spaces of the same functions, whatever the data on their faces."""
        return self.degrees, *(row.tobytes() for row in self.knots)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """Return the number of basis functions per direction, in u the number of `rows`."""
        return tuple(len(k) - p - 1 for k, p in zip(self.knots, self.degrees, strict=True))

    @property
    def dofs(self) -> int:
        """Return the number of basis functions, with those that boundary data fix."""
        return int(np.prod(self.whole.shape))

    @property
    def elements(self) -> int:
        """Return the number of non-empty knot spans."""
        return int(np.prod([len(breakpoints(k)) - 1 for k in self.whole.knots]))

    @property
    def gauss_points(self) -> tuple[int, ...]:
        """Return the number of Gauss points per span and direction for the operator with Gauss' rule on every span.

        `degree` points keep the full order of convergence (they are exact for degree 2 p - 1) and cost 2.2 times less
        than degree + 1 points in three dimensions. One point more is taken where the space is only continuous
        somewhere, as for degree 1, because `degree` points would admit hourglass modes; and on a single span, because
        there would be fewer points than functions, and a singular mass matrix.
        """
        return tuple(
            degree + int(_is_only_continuous(knots, degree) or len(breakpoints(knots)) == 2)
            for knots, degree in zip(self.whole.knots, self.degrees, strict=True)
        )

    @property
    def glued_ends(self) -> list[tuple[bool, bool]]:
        """Return for each direction whether its first and its last face is glued to another face."""
        return [(f"{axis}0" not in self.outer, f"{axis}1" not in self.outer) for axis in AXES]

    @property
    def is_only_continuous(self) -> bool:
        """Return whether the functions' derivatives jump somewhere inside."""
        return any(map(_is_only_continuous, self.whole.knots, self.degrees))

    @cached_property
    def free(self) -> Window:
        """Return the coefficients of the whole space that boundary data leave free, a box of indices."""
        low, high = ([name in self.dirichlet for name in FACE_NAMES[side::2]] for side in (0, 1))
        u, v, w = (slice(int(a), n - int(b)) for a, b, n in zip(low, high, self.whole.shape, strict=True))
        return u, v, w

    @property
    def rank(self) -> int:
        """Return the number of this process, 0 for the first."""
        return 0

    @cached_property
    def breaks(self) -> tuple[Array, Array, Array]:
        """Return the ends of the spans over which this process integrates, one array a direction."""
        u, v, w = map(breakpoints, self.knots)
        return u, v, w

    @property
    def rows(self) -> slice:
        """Return the rows of the whole space that this process has."""
        return slice(0, self.shape[0])

    @property
    def own(self) -> slice:
        """Return the rows of this process's arrays that it owns; each row has one owner."""
        return slice(0, self.shape[0])

    @property
    def window(self) -> Window:
        """Return the free coefficients that this process owns, as indices of its arrays."""
        return self.free

    @property
    def place(self) -> slice:
        """Return the own rows of this process among all free rows."""
        u, _, _ = self.free
        return slice(0, u.stop - u.start)

    @property
    def columns(self) -> slice:
        """Return the free functions of v that this process has after `to_columns`."""
        _, v, _ = self.free
        return slice(0, v.stop - v.start)

    def agreed(self) -> AbstractContextManager[None]:
        """Return a context that raises an error of one process on all processes."""
        return nullcontext()

    def shared(self, value: Any) -> list[Any]:
        """Return the value of every process, in the order of their ranks."""
        return [value]

    def total(self, value: Any) -> Any:
        """Return the sum of the values of all processes, the same on each."""
        return sum(self.shared(value))

    def traffic(self) -> Counter[str]:
        """Return the number of bytes that all processes have sent so far, by purpose."""
        return Counter()

    def fill(self, coefficients: Array) -> None:
        """Overwrite the copies of rows (.., n_u, n_v, n_w) by the values of their owners."""

    def add(self, integrals: Array) -> None:
        """Add to own rows (.., n_u, n_v, n_w) the parts that other processes have integrated."""

    def gather(self, own: Array) -> Array:
        """Return the rows (c, m_u, ..) of all processes, one after another."""
        return own

    def to_columns(self, x: Any) -> Any:
        """Return all free rows of this process's columns, (m_u, columns, m_w), from own free rows (rows, m_v, m_w)."""
        return x

    def to_rows(self, x: Any) -> Any:
        """Return own free rows (rows, m_v, m_w) from columns: the inverse of `to_columns`."""
        return x

    def receive(self, part: Array, after: bool = False) -> bool:
        """Overwrite `part` by the message of the neighbouring process; return False where there is no such process.

        The neighbour has the free rows before own rows, or after own rows with `after`.
        """
        return False

    def send(self, part: Array, after: bool = False) -> None:
        """Send `part` to the process with the free rows before own rows, or after them, where there is one."""


def of_each(make: Callable[[TrialSpace], Made], spaces: Sequence[TrialSpace]) -> list[Made]:
    """Return what a function makes of each space; patches share spaces, and it is called once for each of these."""
    different = {id(space): space for space in spaces}
    made = {number: make(space) for number, space in different.items()}
    return [made[id(space)] for space in spaces]


def _is_only_continuous(knots: Array, degree: int) -> bool:
    inner = np.unique(knots, return_counts=True)[1][1:-1]
    return degree == 1 or bool(np.any(inner == degree))


def trial_space(
    volume: BSplineVolume,
    refine: int = 0,
    degree: int | None = None,
    dirichlet: Collection[str] = FACE_NAMES,
    outer: Collection[str] = FACE_NAMES,
    places: Places | None = None,
) -> TrialSpace:
    """Return the trial space of a volume: every span halved `refine` times, in a degree, by default the map's degree.

    places: the breakpoints that are halved, by default the map's own. The space is as smooth as the map at the map's
    own knots, and as smooth as its degree allows at new knots. Raises
    ValueError for numbers that are not whole, a negative `refine`, a `refine` that gives more than MOST_ELEMENTS, or a
    degree below 1 or above MOST_DEGREE.
    """
    if not isinstance(refine, int | np.integer):
        raise ValueError(f"refine must be a whole number, 0 or more, got {refine!r:.80}")
    if degree is not None and not isinstance(degree, int | np.integer):
        raise ValueError(f"degree must be a whole number, 1 or more, got {degree!r:.80}")
    if refine < 0:
        raise ValueError(f"refine must be 0 or more (each level halves every span), got {refine}")
    own = [tuple(knots.tolist()) for knots in volume.knots]
    counts = map(_spans, own) if places is None else (len(row) - 1 for row in places)
    elements = math.prod(count << int(refine) for count in counts)
    if elements > MOST_ELEMENTS:
        raise ValueError(f"refine {refine} gives {elements:.1e} elements, more than {MOST_ELEMENTS:.0e}: lower it")
    if degree is not None and not 1 <= degree <= MOST_DEGREE:
        raise ValueError(
            f"degree must be at least 1 and at most {MOST_DEGREE}, got {degree}; leave it out for the map's own degree"
        )
    degrees = volume.degrees if degree is None else (degree,) * 3
    each = zip(own, volume.degrees, degrees, places or (None, None, None), strict=True)
    rows = [_refined(*direction, int(refine)) for direction in each]
    return TrialSpace(degrees, (rows[0], rows[1], rows[2]), dirichlet, outer)


@lru_cache(maxsize=1024)
def _spans(knots: tuple[float, ...]) -> int:
    """Return the number of spans of a knot vector; patches share few of these."""
    return len(breakpoints(np.array(knots))) - 1


@lru_cache(maxsize=4096)
def _refined(knots: tuple[float, ...], old: int, new: int, place: Place | None, refine: int) -> Array:
    """Return the knot vector of degree `new` with its spans halved `refine` times, as smooth as `trial_space` says.

    place: the breakpoints of these spans; the map's own where it is None.
    """
    row = same_smoothness(np.array(knots), old, new)
    if place is not None:
        breaks = breakpoints(row)
        inserted = [_at(breaks, s) for s in place if s != int(s)]
        row = np.sort(np.concatenate([row, inserted]))
    for _ in range(refine):
        row = halved(row)
    return row


def _at(breaks: Array, place: float) -> float:
    """Return the parameter of a dyadic place, by halving its span: to the last bit what `halved` gives."""
    span, part = int(place), place % 1.0
    low, high = breaks[span : span + 2]
    while part:
        middle, part = (low + high) / 2.0, 2.0 * part
        low, high, part = (middle, high, part - 1.0) if part >= 1.0 else (low, middle, part)
    return float(low)


def embedded(coefficients: Array, degrees: tuple[int, int, int], knots: Knots, space: TrialSpace) -> Array:
    """Return the exact coefficients in `space` of a spline from a smaller space of the same degrees.

    The coefficients are those of the rows of this process. Raises ValueError where the smaller space is not contained
    in the larger space.
    """
    try:
        if degrees != space.degrees:
            raise ValueError("other degrees")
        for axis, (own, wanted) in enumerate(zip(knots, space.whole.knots, strict=True)):
            rows = space.rows if axis == 0 else slice(None)
            coefficients = apply_along(insertion_into(own, degrees[axis], wanted)[rows], coefficients, axis)
    except ValueError as error:
        raise ValueError(
            f"start: its space is not contained in the trial space ({error}); refine it by halving, same degree"
        ) from None
    return coefficients


def same_smoothness(knots: Array, old: int, new: int) -> Array:
    """Return a knot vector of degree `new` on the same breakpoints, with the smoothness of degree `old` at each."""
    values, repeats = np.unique(knots, return_counts=True)
    repeats = np.maximum(1, repeats + new - old)  # smoothness = degree - multiplicity
    repeats[[0, -1]] = new + 1
    return np.repeat(values, repeats)


def longest_edges(volumes: Sequence[BSplineVolume], spaces: Sequence[TrialSpace]) -> float:
    """Return h: the longest straight distance between neighbouring corners of an element, in the volumes' units."""
    longest, groups = 0.0, defaultdict(list)
    for volume, space in zip(volumes, spaces, strict=True):
        breaks = space.breaks
        groups[volume.degrees, *(row.tobytes() for row in (*breaks, *volume.knots))].append((volume, breaks))
    for members in groups.values():
        own, (u, v, w) = [volume for volume, _ in members], members[0][1]
        for group in groups_of(own):
            for start in range(0, len(u) - 1, LAYERS):
                corners = group.grid(u[start : start + LAYERS + 1], v, w)  # (k, LAYERS + 1, e_v + 1, e_w + 1, 3)
                edges = (np.diff(corners, axis=a) for a in (1, 2, 3))
                longest = max(longest, *(float(np.einsum("...i,...i->...", edge, edge).max()) for edge in edges))
    return max(spaces[0].shared(longest**0.5))
