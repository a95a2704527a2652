"""CurveCuts chains into curves, each of which becomes one or more edges of quadrangles."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arrays import Array
from .plane_curves import WIDEST, Chain, Curve

_FEWEST = 3  # curves around a closed chain
_STRAIGHT = np.radians(10.0)  # a chain that turns less in all is not cut
_FIRST_NORMAL = np.pi / 4.0  # its direction at the first node of a closed chain


@dataclass(frozen=True, eq=False)
class PlanarGraph:
    """Curves between nodes in the plane, which meet at nodes alone.

    nodes: (n, 2) array. curves: tuple of Curve.
    """

    nodes: Array
    curves: tuple[Curve, ...]

    @cached_property
    def sides(self) -> dict[tuple[int, int], Curve]:
        """Return the curves by their two ends, in both directions."""
        sides = {curve.ends: curve for curve in self.curves}
        return sides | {curve.ends[::-1]: curve.reversed for curve in self.curves}


@dataclass(frozen=True)
class Cutting:
    """How chains are cut: into how many times the fewest curves, and where closed ones begin.

    finer: at least 1. radial: whether the direction of the normal at the first node of a closed chain is counted from
    that in which the middle of the body is seen from the chain's middle.
    facing: whether straight sides of regions may be cut opposite the middles of curved ones, too: a segment of a disc
    has no other places for its corners.
    """

    finer: float = 1.0
    radial: bool = False
    facing: bool = False


def network_of(corners: Array, chains: Sequence[Chain], cutting: Cutting) -> PlanarGraph:
    """Return the curves of chains between corners (c, 2) and new nodes; no two nodes have two curves between them."""
    nodes = list(corners)
    low, high = (np.array([f(chain.points, axis=0) for chain in chains]) for f in (np.min, np.max))
    middle = 0.5 * (low.min(axis=0) + high.max(axis=0))
    curves = [curve for chain in chains for curve in _cut(chain, nodes, cutting, middle)]
    ends = [frozenset(curve.ends) for curve in curves]
    for curve in [curve for curve, own in zip(curves, ends, strict=True) if ends.count(own) > 1]:
        one, other = curve.halves(len(nodes))
        nodes.append(one.points[-1])
        curves[curves.index(curve) : curves.index(curve) + 1] = [one, other]
    return PlanarGraph(np.array(nodes), tuple(curves))


def _cut(chain: Chain, nodes: list[Array], cutting: Cutting, middle: Array) -> list[Curve]:
    """Return the curves of a chain; its new nodes are added."""
    total = float(np.abs(chain.turns).sum())
    count = int(np.ceil(cutting.finer * total / WIDEST)) if total > _STRAIGHT else 1
    if not chain.ends:
        return _cut_closed(chain, nodes, max(count, _FEWEST), cutting, middle)
    count = max(count, _FEWEST) if chain.ends[0] == chain.ends[1] else count
    sums = np.cumsum(np.abs(chain.turns)) - 0.5 * np.abs(chain.turns)
    goals = np.arange(1, count) * total / count
    chosen = (
        np.unique(np.abs(sums[None, 1:-1] - goals[:, None]).argmin(axis=1) + 1)
        if len(sums) > 2
        else np.empty(0, dtype=int)
    )
    places = [0, *map(int, chosen), len(sums) - 1]
    whole = Curve((chain.ends[0], chain.ends[1]), chain.points, chain.tangents)
    numbers = [chain.ends[0], *_added(nodes, chain.points[places[1:-1]]), chain.ends[1]]
    return [whole.part(a, b, (m, n)) for a, b, m, n in zip(places, places[1:], numbers, numbers[1:], strict=False)]


def _cut_closed(chain: Chain, nodes: list[Array], count: int, cutting: Cutting, middle: Array) -> list[Curve]:
    """Return the curves of a closed chain, at least _FEWEST: the first begins where its normal has a direction."""
    size = len(chain.points)
    normals = np.arctan2(-chain.tangents[:, 0], chain.tangents[:, 1])
    towards = middle - 0.5 * (chain.points.min(axis=0) + chain.points.max(axis=0))
    start = _FIRST_NORMAL
    if cutting.radial and np.linalg.norm(towards) > 1e-3 * np.ptp(chain.points, axis=0).max():
        start = start + float(np.arctan2(towards[1], towards[0]))
    period = 2.0 * np.pi / count
    off = np.abs((normals - start + 0.5 * period) % period - 0.5 * period)
    first = int(np.round(off, 6).argmin())
    points, tangents, turns = (np.roll(row, -first, axis=0) for row in (chain.points, chain.tangents, chain.turns))
    sums = np.cumsum(np.abs(turns)) - np.abs(turns[0])
    total = float(np.abs(turns).sum())
    goals = np.arange(1, count) * total / count
    places = sorted({0, *np.abs(sums[None] - goals[:, None]).argmin(axis=1).tolist()})
    if len(places) < _FEWEST:
        places = sorted({0, size // 3, 2 * size // 3})
    numbers = _added(nodes, points[places])
    ring = Curve(
        (numbers[0], numbers[0]), np.concatenate([points, points[:1]]), np.concatenate([tangents, tangents[:1]])
    )
    ends = [*places, size]
    return [
        ring.part(a, b, (m, n)) for a, b, m, n in zip(ends, ends[1:], numbers, [*numbers[1:], numbers[0]], strict=False)
    ]


def _added(nodes: list[Array], points: Array) -> list[int]:
    """Add nodes, and return their numbers."""
    nodes += list(points)
    return list(range(len(nodes) - len(points), len(nodes)))
