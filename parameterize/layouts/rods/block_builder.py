"""A start in the making: junctions and rods from a skeleton, made thinner where they are folded or leave the body."""

from collections.abc import Iterator, Mapping

import numpy as np

from ...arrays import Array, Floats, IntArray, Mask
from ...spline.interface import face_layer, outward
from ...surface.solid import Solid
from ..skeleton.graph import Branch, Skeleton
from .clearance import FLAT, Clearance
from .frames import at_lengths
from .junctions import Junction, junction
from .rods import Rod, folded, quarter_turns, ring, rod, tip
from .rows import LimbRow
from .splitting import End, stub
from .strips import BlockCuts, begun_at, row_face, strip_cuts

_THINNER = 0.8  # a factor of sections and junctions that are folded or leave the body
_SQUARER = 0.2  # share of a plain box by which a junction that is folded comes closer to one
_SLOPE = 1.25  # the ratio of the factors of neighbouring sections, at most
_NEAR = 1.5  # times the reach of a section: how far away from a meeting others are made thinner, too

_ENOUGH = 0.6  # a rod's end with a factor below: the junction gives way, too
_NEXT = {0: 1, -1: -2}  # the places of the sections beside the first and the last

Fault = tuple[str, Array]  # what is wrong, and the place (3,)


class BlockBuilder:
    """The sections of all blocks, with a factor for the size of each section and each junction.

    Parameters
    ----------
    skeleton : Skeleton
        Of nodes with one, or three to six branches; or a circle.
    body : Solid
    rows : mapping of int to LimbRow
        The nodes at which limbs begin side by side.
    """

    def __init__(self, skeleton: Skeleton, body: Solid, rows: Mapping[int, LimbRow]) -> None:
        self._skeleton, self._body, self._room, self._rows = skeleton, body, Clearance(skeleton, body), rows
        self._in_rows = {number for row in rows.values() for number, _ in row.limbs}
        self._size = {node: 1.0 for node, degree in enumerate(skeleton.degrees) if degree > 2}
        self._regular = dict.fromkeys(self._size, 0.0)
        self.junctions: dict[int, Junction] = {}
        self.rods: dict[int, Rod] = {}
        self.rings: dict[int, int] = {}  # the quarters by which the last section of a ring is the first one, turned
        self._turns: dict[int, int] = {}  # of the last face of each rod, by quarters
        self.faces: dict[int, tuple[Array | None, Array | None]] = {}
        self.factors: dict[int, Array] = {}
        self._lay(set(self._size))

    def sections(self, number: int) -> Array:
        """Return the sections (m, 2, 2, 3) of a branch."""
        sections = self.rods[number].sections(self.factors[number])
        for place, face in zip((0, -1), self.faces[number], strict=True):
            if face is not None:
                sections[place] = face
        if number in self.rings:
            sections[-1] = np.rot90(sections[0], self.rings[number])
        return sections

    def corners(self, node: int) -> Array:
        """Return the corners (2, 2, 2, 3) of a junction, [u][v][w]."""
        return self.junctions[node].corners(self._regular[node])

    def repaired(self) -> list[Fault]:
        """Make thinner what is folded or leaves the body, and return the faults: the draft had none if it is empty."""
        thinner: set[int] = set()
        squarer: set[int] = set()
        faults = self._junction_faults(thinner, squarer)
        for number in self.rods:
            faults += self._rod_faults(number, thinner)
        for node in thinner:
            self._size[node] *= _THINNER
        for node in squarer:
            self._regular[node] = min(1.0, self._regular[node] + _SQUARER)
        self._lay(thinner | squarer)
        return faults

    def thin_near(self, point: Array, blocks: tuple[int, ...]) -> None:
        """Make rods thinner around a point (3,) where the boundary meets itself, and junctions that meet there.

        blocks: the numbers of those that meet; the junctions come first.
        """
        met = {node for number, node in enumerate(self.junctions) if number in blocks}
        for number, laid in self.rods.items():
            near = _is_near(point, laid.centers, self.sections(number))
            self.factors[number][near] *= _THINNER
            for place, node in zip((0, -1), self._skeleton.branches[number].ends, strict=True):
                if near[place] and node in self._size and self.factors[number][place] < _ENOUGH:
                    met.add(node)  # whose face is the rod's end, which has no factor of its own
        for node in met:
            self._size[node] *= _THINNER
        self._lay(met)

    def _junction_faults(self, thinner: set[int], squarer: set[int]) -> list[Fault]:
        faults = []
        for node, block in self.junctions.items():
            corners = self.corners(node)
            if folded(np.moveaxis(corners, 2, 0)).any():
                squarer.add(node)
                faults.append(("a junction is folded", block.center))
            if not self._body.contains(corners).all():
                thinner.add(node)
                faults.append(("a junction leaves the body", block.center))
        for node in self._rows:
            if not self._body.contains(self._row_face(node)).all():
                thinner.add(node)
                faults.append(("the end of a flat part leaves the body", self._skeleton.nodes[node]))
        return faults

    def _rod_faults(self, number: int, thinner: set[int]) -> list[Fault]:
        sections, factors = self.sections(number), self.factors[number]
        bad = folded(sections)
        outside = ~self._body.contains(sections).all(axis=(1, 2))
        touched = outside | np.append(bad, False) | np.append(False, bad)
        for place, node in zip((0, -1), self._skeleton.branches[number].ends, strict=True):
            if bad[place] and node in self._size and _reach(sections)[place] > _reach(sections)[_NEXT[place]]:
                thinner.add(node)
        factors[touched] *= _THINNER
        for k in range(1, len(factors)):
            factors[k] = min(factors[k], _SLOPE * factors[k - 1])
        for k in range(len(factors) - 2, -1, -1):
            factors[k] = min(factors[k], _SLOPE * factors[k + 1])
        if number in self.rings:
            factors[0] = factors[-1] = min(factors[0], factors[-1])
        centers = self.rods[number].centers
        places = [("a rod is folded", np.flatnonzero(bad)), ("a rod leaves the body", np.flatnonzero(outside))]
        return [(what, centers[where[0]]) for what, where in places if len(where)]

    def _lay(self, nodes: set[int]) -> None:
        """Place the junctions at some nodes by their factors, and lay the rods between their faces."""
        for node in sorted(nodes.difference(self._rows)):
            self.junctions[node] = junction(self._skeleton, node, self._room, self._size[node])
        for number in sorted(range(len(self._skeleton.branches)), key=self._in_rows.__contains__):  # after their stems
            branch = self._skeleton.branches[number]
            if number in self.rods and number not in self._in_rows and not nodes.intersection(branch.ends):
                continue
            if branch.ends[0] == branch.ends[1] and branch.ends[0] not in self.junctions:
                self.rods[number], self.rings[number] = ring(branch.points, branch.radii, self._room)
                self.faces[number] = (None, None)
            else:
                self._lay_rod(number, branch)
            if len(self.factors.get(number, [])) != len(self.rods[number].centers):
                self.factors[number] = np.ones(len(self.rods[number].centers))

    def _lay_rod(self, number: int, branch: Branch) -> None:
        first, last = (self._face(number, end) for end in (0, 1))
        flat = FLAT
        if number in self._in_rows and first is not None:
            branch, flat = begun_at(first, branch), 0.0  # as wide as the others beside it leave room
        total = branch.length
        start, stop = (self._begin(number, end) for end in (0, 1))
        span = (start, total - stop)
        if last is not None:
            last, self._turns[number] = last.swapaxes(0, 1), 0
            if first is not None:
                turns = quarter_turns(first, last, at_lengths(branch.points, np.linspace(*span, 100)))
                last, self._turns[number] = np.rot90(last, turns), turns
        self.rods[number] = rod(branch.points, branch.radii, span, first, last, self._room, flat)
        self.faces[number] = (first, last)

    def _begin(self, number: int, end: int) -> float:
        """Return the length of a branch before its first section at one of its ends, negative beyond the end."""
        branch = self._skeleton.branches[number]
        node = branch.ends[end]
        if node in self._rows:
            return 0.0
        if node in self.junctions:
            return self.junctions[node].exits[number, end].length
        return tip(branch, end, self._body)

    def _face(self, number: int, end: int) -> Array | None:
        """Return the corners (2, 2, 3) of the face through which a branch end leaves a node, right-handed.

        There is none at a tip.
        """
        node = self._skeleton.branches[number].ends[end]
        if node in self._rows:
            return self._face_in_row(node, (number, end))
        return self._exit(number, end, self.corners(node)) if node in self.junctions else None

    def _exit(self, number: int, end: int, corners: Floats) -> Floats:
        """Return the part (2, 2, ...) of the corners (2, 2, 2, ...) of a junction through which a branch end leaves."""
        name = self.junctions[self._skeleton.branches[number].ends[end]].exits[number, end].face
        return outward(face_layer(corners, name), name)

    def ends(
        self, number: int, junctions: Mapping[int, IntArray], strips: Mapping[int, IntArray]
    ) -> list[IntArray | None]:
        """Return the vertices (2, 2) of a rod's first and last section; None where nothing is glued to it yet.

        junctions: the vertices (2, 2, 2) of each, by its node. strips: those (2, 2) of the strips where limbs of rows
        begin, by the limbs' branches.
        """
        nodes = self._skeleton.branches[number].ends
        first, last = (self._exit(number, k, junctions[n]) if n in junctions else None for k, n in enumerate(nodes))
        if last is not None:
            last = np.rot90(last.swapaxes(0, 1), self._turns[number])
        return [strips.get(number, first), last]

    def _row_face(self, node: int) -> Array:
        """Return the corners (2, 2, 3) of the end of a flat part where a row of limbs begins, right-handed outward."""
        limbs = [stub(self._skeleton.branches[number], end) for number, end in self._rows[node].limbs]
        return row_face(self._skeleton.nodes[node], limbs, self._room, self._size[node])

    def _face_in_row(self, node: int, branch_end: End) -> Array:
        """Return the face of the stem, or the part of it that one limb has."""
        row = self._rows[node]
        if branch_end == row.stem:
            return self._row_face(node).swapaxes(0, 1)
        cuts, order = self._cuts(node)
        strip = order.index(row.limbs.index(branch_end))
        return cuts.parts(self._laid_face(node))[strip]

    def _laid_face(self, node: int) -> Array:
        """Return the last section (2, 2, 3) of a row's stem as it is laid, right-handed outward."""
        number, end = self._rows[node].stem
        face = self.faces[number][end]
        assert face is not None, "a row's stem has a face"
        return face if end else face.swapaxes(0, 1)

    def strips(self) -> Iterator[tuple[End, BlockCuts, list[int]]]:
        """Yield of each row the stem, where its block is cut into strips, and the branch of the limb of each strip."""
        for node, row in self._rows.items():
            cuts, order = self._cuts(node)
            limbs = [row.limbs[k][0] for k in order]
            yield row.stem, cuts if row.stem[1] else cuts.along(1 - cuts.axis, flipped=False), limbs

    def _cuts(self, node: int) -> tuple[BlockCuts, list[int]]:
        """Return where a row's stem is cut into strips, seen along the limbs, and the limb of each strip."""
        begins = np.array([stub(self._skeleton.branches[number], end)[0] for number, end in self._rows[node].limbs])
        return strip_cuts(self._laid_face(node), begins)


def _is_near(point: Array, centers: Array, sections: Array) -> Mask:
    """Return which of the balls around sections (k, 2, 2, 3), a little larger than these, hold a point (3,)."""
    return np.asarray(np.linalg.norm(centers - point, axis=1) <= _NEAR * _reach(sections))


def _reach(sections: Array) -> Array:
    """Return the largest distance of the corners of sections (k, 2, 2, 3) from their middles: (k,)."""
    middles = sections.mean(axis=(1, 2), keepdims=True)
    return np.asarray(np.linalg.norm(sections - middles, axis=-1).max(axis=(1, 2)))
