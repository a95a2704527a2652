"""Random solids around graphs in space: trees with limbs and forks, and graphs with loops.

The rods keep clear of one another: where two have no end in common there is a gap, and where they meet, an angle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from distance_fields import Array, Field, capsule, ellipsoid, joined
from scipy.spatial.distance import cdist, pdist

GAP = 0.6  # between rods that do not meet, over the sum of their radii
OPENING = np.radians(50.0)  # between rods that meet
MOST = 4  # rods at a node of a graph with loops
FILLET = 0.12  # where rods meet
DRAWS = 60  # of a rod, before all is begun anew
TRIES = 500  # of all rods
WAVE = 1.5  # radians a unit of length
STATIONS = np.linspace(0.0, 1.0, 24)[:, None]  # on a rod, where its distance from others is taken


class Crowded(ValueError):
    """No room was found for another rod."""


@dataclass
class Rods:
    """Rods between nodes, each tapered from the radius of the one node to that of the other."""

    nodes: list[Array] = field(default_factory=list)
    radii: list[float] = field(default_factory=list)
    pairs: list[tuple[int, int]] = field(default_factory=list)

    def add(self, place: Array, radius: float) -> int:
        """Add a node without rods and return its number."""
        self.nodes.append(place)
        self.radii.append(radius)
        return len(self.nodes) - 1

    def drop_last(self) -> None:
        """Remove the last node, which has no rods."""
        self.nodes.pop()
        self.radii.pop()

    def join(self, a: int, b: int) -> bool:
        """Add a rod between two nodes where it keeps clear of all others, and return whether it does."""
        if clear := all(self._apart((a, b), other) for other in self.pairs):
            self.pairs.append((a, b))
        return clear

    def _apart(self, new: tuple[int, int], old: tuple[int, int]) -> bool:
        shared = set(new) & set(old)
        if len(shared) == 2:
            return False
        if shared:
            (joint,) = shared
            ways = [self.nodes[sum(pair) - joint] - self.nodes[joint] for pair in (new, old)]
            return bool(ways[0] @ ways[1] < np.cos(OPENING) * np.linalg.norm(ways[0]) * np.linalg.norm(ways[1]))
        lines = [self.nodes[a] + STATIONS * (self.nodes[b] - self.nodes[a]) for a, b in (new, old)]
        radii = sum(max(self.radii[a], self.radii[b]) for a, b in (new, old))
        return bool(cdist(*lines).min() > (1.0 + GAP) * radii)

    def degree(self, node: int) -> int:
        """Return the number of rods at a node."""
        return sum(node in pair for pair in self.pairs)

    def fields(self) -> list[Field]:
        """Return the fields of the rods."""
        return [capsule(self.nodes[a], self.nodes[b], self.radii[a], self.radii[b]) for a, b in self.pairs]


def limbed(rng: np.random.Generator, severity: float) -> Field:
    """A body with 4 to 8 limbs, bent and tapered, a third of them forked."""
    count, body = int(rng.integers(4, 9)), rng.uniform(0.5, 0.7)
    trunk = ellipsoid(np.zeros(3), body * rng.uniform(0.85, 1.15, 3))
    rods = _drawn(lambda: _tree(rng, severity, count, body))
    return _waved(rng, severity, joined(FILLET, trunk, *rods.fields()))


def _tree(rng: np.random.Generator, severity: float, count: int, body: float) -> Rods:
    """Return limbs of two rods, or of one that forks, around a body whose middle is node 0."""
    rods = Rods()
    rods.add(np.zeros(3), 0.5 * body)
    for _ in range(count):
        radius = rng.uniform(0.28, 0.4) * body
        knee = _grown(rods, rng, 0, body + rng.uniform(0.4, 0.8), radius, np.pi)
        forks = rng.uniform() < 1.0 / 3.0
        for _ in range(2 if forks else 1):
            turn = OPENING if forks else severity
            _grown(rods, rng, knee, rng.uniform(0.6, 1.1), rng.uniform(0.6, 0.9) * radius, turn)
    return rods


def _grown(rods: Rods, rng: np.random.Generator, start: int, length: float, radius: float, turn: float) -> int:
    """Add a rod from a node, at most `turn` radians off the way outward, and return its end."""
    middle = rods.nodes[start]
    outward = middle / np.linalg.norm(middle) if start else np.array([0.0, 0.0, 1.0])
    for _ in range(DRAWS):
        aside = np.cross(outward, rng.normal(size=3))
        cosine = rng.uniform(np.cos(turn), 1.0)
        way = cosine * outward + np.sqrt(1.0 - cosine**2) * aside / np.linalg.norm(aside)
        end = rods.add(middle + length * way, radius)
        if rods.join(start, end):
            return end
        rods.drop_last()
    raise Crowded


def graph(rng: np.random.Generator, severity: float, genus: int) -> Field:
    """Rods around a connected graph with so many loops, up to four at a node; some end loose."""
    rods = _drawn(lambda: _net(rng, genus))
    return _waved(rng, severity, joined(FILLET, *rods.fields()))


def _net(rng: np.random.Generator, genus: int) -> Rods:
    """Return random nodes joined to their neighbours: first to one piece, then by more rods that close loops."""
    rods, count = Rods(), int(rng.integers(genus // 2 + 4, genus + 6))
    half = 0.7 * count ** (1.0 / 3.0) * np.array([1.2, 1.2, 0.8])
    while len(rods.nodes) < count:
        place = rng.uniform(-half, half)
        if not rods.nodes or cdist([place], rods.nodes).min() > 0.8:
            rods.add(place, rng.uniform(0.13, 0.2))
    pairs = np.array(list(combinations(range(count), 2)))
    lengths = pdist(rods.nodes) * rng.uniform(0.7, 1.3, len(pairs))
    pairs = pairs[np.argsort(lengths)]
    piece = np.arange(count)
    for loops in (False, True):
        for a, b in pairs.tolist():
            missing = count - 1 + genus - len(rods.pairs) if loops else piece[a] != piece[b]
            if missing and max(rods.degree(a), rods.degree(b)) < MOST and rods.join(a, b):
                piece[piece == piece[a]] = piece[b]
    if len(rods.pairs) < count - 1 + genus or np.ptp(piece):
        raise Crowded
    return rods


def _drawn(draw: Callable[[], Rods]) -> Rods:
    """Return the first draw with room for all rods."""
    for _ in range(TRIES):
        try:
            return draw()
        except Crowded:
            continue
    raise Crowded(f"no room for all rods in {TRIES} tries")


def _waved(rng: np.random.Generator, severity: float, distance: Field) -> Field:
    """Return the field in a space bent by long waves."""
    waves, phases = rng.normal(size=(3, 3)), rng.uniform(0.0, 2.0 * np.pi, 3)
    waves *= WAVE / np.linalg.norm(waves, axis=1, keepdims=True)
    return lambda points: distance(points + 0.15 * severity * np.sin(points @ waves.T + phases))
