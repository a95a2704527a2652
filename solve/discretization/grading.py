"""Defines Grading: the breakpoints of a trial space that is finer where it counts, one row a sheet of a body.

A new knot runs through a whole sheet of patches (parameterize/spline/sheets.py), so that both sides of an interface
keep the same functions. Places along a sheet are counted in spans of the map: the map's own knots are whole numbers,
and halving gives dyadic fractions, which double precision holds exactly, whichever way a direction runs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array, IntArray
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.bspline import breakpoints
from parameterize.spline.sheets import Sheets

from .space import Places

MOST_HALVINGS = 24  # of a span of the map: places are exact then, and knots stay apart


@dataclass(frozen=True, eq=False)
class Grading:
    """Hold the breakpoints of the trial space of a body: of each sheet its own.

    Attributes
    ----------
    sheets : Sheets
        Of the body: to which sheet each direction of each patch belongs.
    rows : tuple of arrays (n,)
        The breakpoints of each sheet, along its first direction, in spans of the map: 0, 0.25, 0.5, 1, 2 are those of
        a map of two spans of which the first is halved, and its first half again.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> volume = benchmark_volume(2)
    >>> towards = iga_nn.Grading.of(volume).refined({0: [2, 0]})
    >>> towards.rows[0], towards.spans
    (array([0.  , 0.25, 0.5 , 0.75, 1.  , 2.  ]), (5, 2, 2))
    >>> iga_nn.solve(volume, iga_nn.Poisson(exact="x*y*z"), grading=towards).report.elements
    20
    """

    sheets: Sheets
    rows: tuple[Array, ...]

    @classmethod
    def of(cls, body: BodyLike) -> "Grading":
        """Return the map's own spans."""
        glued = as_body(body)
        sheets = Sheets.of(glued)
        counts = [len(breakpoints(glued.patches[i // 3].knots[i % 3])) for i in sheets.first.tolist()]
        return cls(sheets, tuple(np.arange(float(count)) for count in counts))

    @property
    def spans(self) -> tuple[int, ...]:
        """Return the number of spans of each sheet."""
        return tuple(len(row) - 1 for row in self.rows)

    def refined(self, times: Mapping[int, ArrayLike]) -> "Grading":
        """Return a grading with some spans of some sheets halved.

        times: by the number of the sheet, how often each of its spans (spans,) is halved, as whole numbers or truth
        values. Where a sheet is tied to itself in reverse, the larger of the numbers of two mirrored spans counts.
        Raises ValueError for other numbers, and for a span that would be halved more than MOST_HALVINGS times.
        """
        rows = list(self.rows)
        for sheet, given in times.items():
            if not 0 <= sheet < len(rows):
                raise ValueError(f"there is no sheet {sheet}: the body has {len(rows)}, from 0 on")
            wanted = np.asarray(given).astype(np.int64)
            if wanted.shape != (self.spans[sheet],) or wanted.min() < 0:
                raise ValueError(f"sheet {sheet} has {self.spans[sheet]} spans, got {given!r:.80} as their halvings")
            if self.sheets.mirrored[sheet]:
                wanted = np.maximum(wanted, wanted[::-1])
            if (np.diff(rows[sheet]) * 0.5**wanted).min() < 0.5**MOST_HALVINGS:
                raise ValueError(f"sheet {sheet}: a span of the map is halved {MOST_HALVINGS} times at most")
            rows[sheet] = _divided(rows[sheet], wanted)
        return replace(self, rows=tuple(rows))

    def uniform(self, times: int = 1) -> "Grading":
        """Return a grading with every span halved so many times."""
        return self.refined({sheet: np.full(count, times) for sheet, count in enumerate(self.spans)})

    def contains(self, other: "Grading") -> bool:
        """Return whether every breakpoint of another grading of the body is one of this grading."""
        return all(np.isin(theirs, own).all() for own, theirs in zip(self.rows, other.rows, strict=True))

    def places(self, patch: int) -> Places:
        """Return the breakpoints of the three directions of a patch, in spans of its map."""
        u, v, w = (self._along(patch, axis) for axis in range(3))
        return u, v, w

    def _along(self, patch: int, axis: int) -> tuple[float, ...]:
        row = self.rows[self.sheets.numbers[patch, axis]]
        return tuple((row[-1] - row[::-1] if self.sheets.flipped[patch, axis] else row).tolist())

    def collected(self, of_patches: Sequence[tuple[Array, Array, Array]]) -> list[Array]:
        """Return for each sheet the sums (spans,) of numbers that stand at the spans of each patch's directions.

        of_patches: for each patch three arrays, (spans of u,), (spans of v,), (spans of w,).
        """
        found = [np.zeros(count) for count in self.spans]
        for numbers, flips, rows in zip(self.sheets.numbers, self.sheets.flipped, of_patches, strict=True):
            for sheet, is_flipped, row in zip(numbers, flips, rows, strict=True):
                found[sheet] += row[::-1] if is_flipped else row
        for sheet in np.flatnonzero(self.sheets.mirrored):
            found[sheet] = found[sheet] + found[sheet][::-1]
        return found

    @property
    def as_dict(self) -> dict[str, Any]:
        """Return the grading as numbers and lists, for JSON; sheets that are as the map has them are left out."""
        kept = {s: row.tolist() for s, row in enumerate(self.rows) if len(row) != row[-1] + 1}
        return {"sheets": len(self.rows), "rows": {str(s): row for s, row in kept.items()}}

    @classmethod
    def from_dict(cls, body: BodyLike, found: Mapping[str, Any]) -> "Grading":
        """Return the grading of `as_dict` on its body. Raises ValueError for that of another body."""
        plain = cls.of(body)
        rows = list(plain.rows)
        try:
            given = {int(s): np.array(row, dtype=np.float64) for s, row in found["rows"].items()}
            if found["sheets"] != len(rows) or not all(_is_finer(row, rows[s]) for s, row in given.items()):
                raise ValueError("other sheets")
        except (KeyError, TypeError, AttributeError, ValueError, IndexError):
            raise ValueError(f"{found!r:.80} is no grading of this body, of {len(rows)} sheets") from None
        for sheet, row in given.items():
            rows[sheet] = row
        return replace(plain, rows=tuple(rows))

    def check(self, body: BodyLike) -> None:
        """Raise ValueError where the grading is that of another body."""
        glued = as_body(body)
        plain = Grading.of(glued)
        same = len(plain.rows) == len(self.rows) and np.array_equal(plain.sheets.numbers, self.sheets.numbers)
        if not same or not all(map(_is_finer, self.rows, plain.rows)):
            raise ValueError("grading is that of another body: Grading.of(body) has this body's sheets")


def _is_finer(row: Array, plain: Array) -> bool:
    """Return whether a row of places ascends and contains the map's own."""
    return row.ndim == 1 and bool((np.diff(row) > 0.0).all() and np.isin(plain, row).all() and row[-1] == plain[-1])


def _divided(row: Array, times: IntArray) -> Array:
    """Return places (n,) with each span in 2^times equal parts, which are exact."""
    parts = [a + (b - a) * np.arange(2**k) / 2**k for a, b, k in zip(row, row[1:], times, strict=False)]
    return np.concatenate([*parts, row[-1:]])
