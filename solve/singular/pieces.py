"""Makes singular places of edges: of pieces that belong together, with points on them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from parameterize.arrays import IntArray
from parameterize.spline.body import numbers_of_classes

from .edges import ACROSS
from .held import Supports
from .judged_edges import SMOOTH, JudgedEdges
from .places import GAP, SPANS, SingularPlace
from .wedge import REGULAR

_MOST = 200_000  # points of all edges


@dataclass(frozen=True, eq=False)
class SingularPieces:
    """Hold judged edges, whose samples each stand for a piece: of edge e (m,) the one around sample s (m,)."""

    edges: JudgedEdges

    def places(self) -> Iterator[SingularPlace]:
        """Yield the places, each of pieces of edges that belong together."""
        if not len(self.edges.pairs[0]):
            return
        is_singular = self.edges.exponents < REGULAR
        e, s = np.nonzero(is_singular)
        if not len(e):
            return
        codes = self.edges.held[0]
        changed = codes[e, 0, s] ^ codes[e, 1, s]
        is_rim = self.edges.differ[e, s]
        for bit in range(len(self.edges.supports.names)):
            here = is_rim & ((changed & -changed) == 1 << bit)
            if here.any():
                yield self._place("rim", of_rim(self.edges.supports, bit), e[here], s[here])
        mixed = self.edges.is_mixed[e] & ~is_rim
        if mixed.any():
            yield self._place("materials", "the edge where materials meet the surface", e[mixed], s[mixed])
        sharp = ~mixed & ~is_rim
        for part in self._connected(e[sharp]):
            here = np.flatnonzero(sharp)[part]
            yield self._place("edge", self._of_edge(e[here], s[here]), e[here], s[here])

    def _connected(self, e: IntArray) -> Iterator[IntArray]:
        """Yield the places, in an array of edges (m,), of edges that have ends in common."""
        if not len(e):
            return
        ends = self.edges.of_patches.ends[self.edges.pairs[0][e, 0]]
        names, flat = np.unique(ends, return_inverse=True)
        labels = numbers_of_classes(len(names), flat.reshape(-1, 2).T)[flat.reshape(-1, 2)[:, 0]]
        for label in np.unique(labels):
            yield np.flatnonzero(labels == label)

    def _of_edge(self, e: IntArray, s: IntArray) -> str:
        """Return the words for pieces of re-entrant edges."""
        angles = self.edges.angles[e, s]
        low, high = angles.min(), angles.max()
        said = f"{high:.0f}" if high - low < SMOOTH / 2.0 else f"{low:.0f} to {high:.0f}"
        middle = len(e) // 2
        at = self.edges.of_patches.points[self.edges.pairs[0][e[middle], 0], s[middle]]
        size = np.where(np.abs(at) > 1e-6 * self.edges.body.size, at, 0.0)
        return f"the re-entrant edge of {said}° at ({', '.join(f'{value:.4g}' for value in size)})"

    def _place(self, kind: str, text: str, e: IntArray, s: IntArray) -> SingularPlace:
        """Return the place of pieces, each around a sample."""
        of, (rows, places) = self.edges.of_patches, self.edges.around(e)
        sides, pieces = self.edges.sides[rows, :, s[places]], of.along.shape[1]
        shortest = np.full(len(e), np.inf)
        np.minimum.at(shortest, places, np.linalg.norm(sides, axis=-1).min(axis=1))
        lengths = of.lengths[rows] / pieces
        counts = np.ceil(lengths / (GAP * SPANS * shortest[places])).astype(np.int64)
        counts = np.clip(counts, 1, max(1, _MOST // len(rows)))
        along = np.maximum(shortest[places], lengths / counts)[:, None] * of.tangents[rows, s[places]]
        owners = np.repeat(np.arange(len(rows)), counts)
        inside = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
        shift = ((inside + 0.5) / counts[owners] - 0.5) / pieces
        parameters, each, own = np.zeros((len(owners), 3)), np.arange(len(owners)), rows[owners]
        parameters[each[:, None], ACROSS[of.axes[own]]] = of.sides[own]
        parameters[each, of.axes[own]] = of.along[own, s[places[owners]]] + shift
        points = self.edges.body.points(of.patches[own], parameters)
        spans = np.stack([sides[:, 0], sides[:, 1], along], axis=-1)[owners]
        return SingularPlace(kind, text, points, spans, float(self.edges.exponents[e, s].min()))


def of_rim(supports: Supports, name: int) -> str:
    """Return the words for the rim of a condition."""
    return f"the rim of {supports.names[name]}"
