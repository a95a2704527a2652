"""Smooth curves through the vertices of polylines, by arc length: cubics whose tangents are those of circles.

A step that is much longer than the next is straight, as lines go on into arcs; chords of arcs are about as long as
their neighbours.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array, IntArray, Mask

_STRAIGHT = 4.0  # times as long as the next, a step is straight
_BENT = 2e-3  # radians, as files hold numbers in single precision


@dataclass(frozen=True, eq=False)
class Curves:
    """Smooth curves, all in one.

    controls: (k, 4, 3), the Bezier points of all pieces, curve after curve. spans: (k,), their arc lengths.
    curvatures: (k,). pieces: (c,), the first piece of each curve. closed: (c,).
    """

    controls: Array
    spans: Array
    curvatures: Array
    pieces: IntArray
    closed: Mask

    @cached_property
    def starts(self) -> Array:
        """Return the arc length (k,) at which each piece starts, going on from curve to curve."""
        return np.cumsum(self.spans) - self.spans

    @cached_property
    def first(self) -> Array:
        """Return the arc length (c,) at which each curve starts, going on from curve to curve."""
        return self.starts[self.pieces]

    @cached_property
    def lengths(self) -> Array:
        """Return the arc length (c,) of each curve."""
        return np.diff(np.append(self.first, self.spans.sum()))

    def _pieces(self, curves: IntArray, places: Array) -> tuple[IntArray, Array]:
        """Return the pieces (n,) at arc lengths (n,) of curves (n,), and where they are in these, from 0 to 1."""
        length = self.lengths[curves]
        own = np.where(self.closed[curves], np.mod(places, length), np.clip(places, 0.0, length))
        whole = self.first[curves] + own
        last = np.append(self.pieces[1:], len(self.starts))[curves] - 1
        pieces = np.minimum(np.searchsorted(self.starts, whole, side="right") - 1, last)
        return pieces, np.clip((whole - self.starts[pieces]) / self.spans[pieces], 0.0, 1.0)

    def at(self, curves: IntArray, places: Array) -> Array:
        """Return the points (n, 3) at arc lengths (n,) of curves (n,); closed ones go on after their ends."""
        pieces, shares = self._pieces(curves, places)
        u, v = shares[:, None], 1.0 - shares[:, None]
        a, b, c, d = np.moveaxis(self.controls[pieces], 1, 0)
        return np.asarray(v**3 * a + 3.0 * v**2 * u * b + 3.0 * v * u**2 * c + u**3 * d)

    def tangents(self, curves: IntArray, places: Array) -> Array:
        """Return the unit tangents (n, 3) at arc lengths (n,) of curves (n,)."""
        pieces, shares = self._pieces(curves, places)
        u, v = shares[:, None], 1.0 - shares[:, None]
        a, b, c = np.moveaxis(np.diff(self.controls[pieces], axis=1), 1, 0)
        slopes = v**2 * a + 2.0 * u * v * b + u**2 * c
        return np.asarray(slopes / np.linalg.norm(slopes, axis=1)[:, None])

    def curvature(self, curves: IntArray, places: Array) -> Array:
        """Return the curvatures (n,) at arc lengths (n,) of curves (n,)."""
        return self.curvatures[self._pieces(curves, places)[0]]


def curves_through(points: Array, chains: Sequence[IntArray]) -> Curves:
    """Return the smooth curves through the vertices of chains; a closed chain ends where it begins."""
    closed = np.array([chain[0] == chain[-1] for chain in chains], dtype=bool)
    found = [_pieces_of(points[chain], bool(loop)) for chain, loop in zip(chains, closed, strict=True)]
    if not found:
        return Curves(np.empty((0, 4, 3)), np.empty(0), np.empty(0), np.empty(0, dtype=np.int64), closed)
    counts = np.array([len(spans) for _, spans, _ in found])
    controls, spans, curvatures = map(np.concatenate, zip(*found, strict=True))
    return Curves(controls, spans, curvatures, np.cumsum(counts) - counts, closed)


def _pieces_of(polyline: Array, closed: bool) -> tuple[Array, Array, Array]:
    """Return Bezier points (k, 4, 3), lengths (k,) and curvatures (k,) of the pieces of one curve."""
    steps = np.diff(polyline, axis=0)
    chords = np.linalg.norm(steps, axis=1)
    ways = steps / chords[:, None]
    tangents = _tangents(ways, chords, closed)
    halves = [np.arccos(np.clip(np.sum(ways * at, axis=1), 0.5, 1.0)) for at in (tangents[:-1], tangents[1:])]
    half = 0.5 * (halves[0] + halves[1])  # of the angle of the arc
    lengths = chords * half / np.sin(np.maximum(half, 1e-12)) + chords * (half < 1e-12)
    handles = (chords / (3.0 * np.cos(0.5 * half) ** 2))[:, None]
    controls = np.stack(
        [polyline[:-1], polyline[:-1] + handles * tangents[:-1], polyline[1:] - handles * tangents[1:], polyline[1:]],
        axis=1,
    )
    return controls, lengths, 2.0 * half / lengths


def _tangents(ways: Array, chords: Array, closed: bool) -> Array:
    """Return the tangents (k + 1, 3) at the vertices between steps of directions (k, 3) and lengths (k,)."""
    before, after = (np.roll(ways, 1, axis=0), ways) if closed else (ways[:-1], ways[1:])
    runs = _runs(ways, chords, closed)
    left, right = (np.roll(runs, 1), runs) if closed else (runs[:-1], runs[1:])
    lengths = (np.roll(chords, 1), chords) if closed else (chords[:-1], chords[1:])
    inner = before / lengths[0][:, None] + after / lengths[1][:, None]
    inner = np.where((left > _STRAIGHT * right)[:, None], before, inner)
    inner = np.where((right > _STRAIGHT * left)[:, None], after, inner)
    inner /= np.linalg.norm(inner, axis=1)[:, None]
    if closed:
        return np.concatenate([inner, inner[:1]])
    if not len(inner):
        return np.concatenate([ways, ways])
    first, last = (2.0 * (way @ at) * way - at for way, at in ((ways[0], inner[0]), (ways[-1], inner[-1])))
    return np.concatenate([[first], inner, [last]])


def _runs(ways: Array, chords: Array, closed: bool) -> Array:
    """Return the lengths (k,) of the straight runs of steps in which each step lies."""
    bent = np.linalg.norm(np.diff(ways, axis=0), axis=1) > _BENT
    runs = np.concatenate([[0], np.cumsum(bent)])
    if closed and np.linalg.norm(ways[-1] - ways[0]) <= _BENT:
        runs[runs == runs[-1]] = 0
    return np.bincount(runs, chords)[runs]
