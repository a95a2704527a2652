"""Holds the spans of a trial space, which say how far a singular place reaches."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import Array, Knots
from parameterize.spline.bspline import breakpoints


@dataclass(frozen=True, eq=False)
class SpanLengths:
    """Hold the breakpoints of each direction of each patch, and the first and last span, (patches, 3, 2)."""

    inner: Sequence[Sequence[Array]]
    outer: Array

    @classmethod
    def of(cls, knots: Sequence[Knots]) -> "SpanLengths":
        """Return the spans of the knots of each patch."""
        known: dict[bytes, Array] = {}
        inner = []
        for rows in knots:
            names = [row.tobytes() for row in rows]
            known |= {name: breakpoints(row) for name, row in zip(names, rows, strict=True) if name not in known}
            inner.append([known[name] for name in names])
        ends = {id(row): (row[1] - row[0], row[-1] - row[-2]) for row in known.values()}
        return cls(inner, np.array([[ends[id(row)] for row in rows] for rows in inner]))

    @property
    def most(self) -> int:
        """Return the largest number of spans in a direction."""
        return max(len(row) - 1 for rows in self.inner for row in rows)
