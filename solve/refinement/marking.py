"""Chooses the spans to halve: those that gain most for each unknown that they add.

A halved span runs through a sheet of patches and adds a layer of unknowns. Spans are taken in the order of gain over
added unknowns, and what is left of them is predicted, until the space has grown by a factor. So a span at an edge may
be halved many times in one step, towards the edge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array, IntArray, Mask

from ..discretization.grading import MOST_HALVINGS, Grading

TOGETHER = 0.5  # of the largest gain: spans with as much are halved together
EVEN = 0.999  # of a score: as much counts as equal, so that what is symmetric stays so
LEAST_GAIN = 0.2  # of a span's number that halving is believed to take away
LEFT, RIGHT, BOTH = 0, 1, 2


@dataclass(frozen=True, eq=False)
class SheetSpans:
    """Hold the spans of all sheets, with what each one misses and what halving leaves of it.

    sheet: (n,). low, high: (n,), the ends of the spans. value: (n,), what each misses. kept: (n,), the part of it that
    the worse half keeps. side: (n,), which half that is; of smooth solutions BOTH keep as much.
    """

    sheet: IntArray
    low: Array
    high: Array
    value: Array
    kept: Array
    side: IntArray

    @classmethod
    def of(cls, grading: Grading, values: Array, degree: int, before: SheetSpans | None = None) -> SheetSpans:
        """Return the spans of a grading with their numbers (n,), those of one sheet after another.

        before: those of the step before: what its halves have kept is expected of the next ones.
        """
        sheet = np.repeat(np.arange(len(grading.rows)), grading.spans)
        low, high = (np.concatenate([row[part] for row in grading.rows]) for part in (slice(-1), slice(1, None)))
        count = len(sheet)
        plain = cls(sheet, low, high, values, np.full(count, smooth_part(degree)), np.full(count, BOTH))
        return plain if before is None else plain._after(before, degree)

    def _after(self, before: SheetSpans, degree: int) -> SheetSpans:
        """Return the same spans with what is learnt from the step before."""
        kept, side = self.kept.copy(), self.side.copy()
        parent = before._holding(self.sheet, self.low)
        same = (before.low[parent] == self.low) & (before.high[parent] == self.high)
        kept[same], side[same] = before.kept[parent[same]], before.side[parent[same]]
        worst = np.zeros(len(before.sheet))
        np.maximum.at(worst, parent, self.value)
        is_worst = (self.value == worst[parent]) & (self.value > 0.0) & ~same
        times = np.log2((before.high - before.low)[parent] / (self.high - self.low))
        whole = np.maximum(before.value[parent], self.value)
        part = np.divide(self.value, whole, out=np.zeros_like(whole), where=whole > 0.0)
        part **= 1.0 / np.maximum(times, 1.0)
        at_left, at_right = before.low[parent] == self.low, before.high[parent] == self.high
        rough = is_worst & (part > 2.0 * smooth_part(degree)) & (at_left | at_right)
        kept[rough], side[rough] = part[rough], np.where(at_left[rough], LEFT, RIGHT)
        return replace(self, kept=kept, side=side)

    def _holding(self, sheet: IntArray, low: Array) -> IntArray:
        """Return the numbers of the spans in which other spans of the same breakpoints, or more, begin."""
        order = np.lexsort((self.low, self.sheet))
        stretch = 1.0 + max(self.high.max(), low.max())
        keys = self.sheet[order] * stretch + self.low[order]
        return order[np.searchsorted(keys, sheet * stretch + low, side="right") - 1]

    @property
    def gain(self) -> Array:
        """Return what halving is expected to take away of each span's number."""
        left = np.where(self.side == BOTH, 2.0 * self.kept, self.kept)
        return self.value * np.maximum(1.0 - left, LEAST_GAIN)

    def halved(self, chosen: Mask, degree: int) -> SheetSpans:
        """Return the spans with some of them halved, and what is expected of the halves."""
        one = self._chosen(chosen)
        middle = 0.5 * (one.low + one.high)
        rest = smooth_part(degree)
        halves = []
        for side in (LEFT, RIGHT):
            is_worse = one.side == side
            is_better = one.side == 1 - side
            halves.append(
                replace(
                    one,
                    low=one.low if side == LEFT else middle,
                    high=middle if side == LEFT else one.high,
                    value=one.value * np.where(is_better, np.minimum(rest, one.kept), one.kept),
                    kept=np.where(is_better, rest, one.kept),
                    side=np.where(is_worse, side, BOTH),
                )
            )
        return self._chosen(~chosen)._with(*halves)

    def _chosen(self, chosen: Mask) -> SheetSpans:
        return SheetSpans(*(getattr(self, name)[chosen] for name in _NAMES))

    def _with(self, *others: SheetSpans) -> SheetSpans:
        return SheetSpans(*(np.concatenate([getattr(own, name) for own in (self, *others)]) for name in _NAMES))


_NAMES = ("sheet", "low", "high", "value", "kept", "side")


def smooth_part(degree: int) -> float:
    """Return the part of an energy on a span that each half keeps where the solution is smooth."""
    return 0.5 ** (2 * degree + 1)


def marked(grading: Grading, spans: SheetSpans, counts: IntArray, degree: int, growth: float, target: float) -> Grading:
    """Return the grading with spans halved until the unknowns have grown by a factor, or the target is expected.

    counts: (patches, 3), the functions of each patch along its directions. target: of the sum of all numbers.
    """
    sheets, first = grading.sheets, np.array(grading.spans)
    now, most = counts, growth * unknowns_of(counts)
    while (left := most - unknowns_of(now)) > 0.0 and spans.value.sum() > target:
        can = spans.high - spans.low > 0.5**MOST_HALVINGS
        added = _added(now, sheets.numbers)[spans.sheet]
        score = np.where(can, spans.gain / added, 0.0)
        if score.max() <= 0.0:
            break
        spans = spans.halved(_best(score, added, left), degree)
        now = counts + (np.bincount(spans.sheet, minlength=len(first)) - first)[sheets.numbers]
    return _with_spans(grading, spans)


def _best(score: Array, added: Array, left: float) -> Mask:
    """Return which spans (n,) are halved together: those with the best scores, until they add as much as is left."""
    order = np.argsort(-score, kind="stable")
    last = int(np.searchsorted(np.cumsum(added[order]), left))
    least = score[order[min(last, len(order) - 1)]] * EVEN
    return np.asarray(score >= max(TOGETHER * score.max(), least))


def _with_spans(grading: Grading, spans: SheetSpans) -> Grading:
    """Return a grading with the given spans; of a sheet that is tied to itself in reverse, with those of both ways."""
    rows = []
    for sheet, row in enumerate(grading.rows):
        places = np.append(spans.low[spans.sheet == sheet], row[-1])
        rows.append(np.unique([*places, *(row[-1] - places if grading.sheets.mirrored[sheet] else ())]))
    return replace(grading, rows=tuple(rows))


def unknowns_of(counts: IntArray) -> float:
    """Return about how many unknowns a body has; those on glued faces count once."""
    return float((counts - 1).prod(axis=1, dtype=float).sum())


def _added(counts: IntArray, sheets: IntArray) -> Array:
    """Return how many unknowns one more span of each sheet adds."""
    inner = (counts - 1).astype(float)
    layers = np.stack([inner[:, 1] * inner[:, 2], inner[:, 0] * inner[:, 2], inner[:, 0] * inner[:, 1]], axis=1)
    return np.asarray(np.bincount(sheets.ravel(), layers.ravel()), dtype=np.float64)
