"""A start in the making: junctions and rods from a skeleton, made thinner where they are folded or leave the body."""

import numpy as np

from ..arrays import Array
from ..skeleton.graph import Branch, Skeleton
from ..spline.interface import axis_side, face_layer
from .checks import folded
from .frames import arc_lengths, at_lengths, unit
from .inside import Body
from .junctions import Junction, junction
from .rings import ring
from .rods import Rod, ends_turned, rod

_TIP = 0.8  # radii of a limb: from its last section to the surface in front of it
_BACK = 1.5  # radii of a limb: how far before its end its direction is taken
_THINNER = 0.8  # a factor of sections and junctions that are folded or leave the body
_SQUARER = 0.2  # share of a plain box by which a junction that is folded comes closer to one
_SLOPE = 1.25  # the ratio of the factors of neighbouring sections, at most
_LEAST = 0.05  # the factor below which a section is given up


class Draft:
    """The sections of all blocks, with a factor for the size of each section and each junction.

    Parameters
    ----------
    skeleton : Skeleton
        Of nodes with one, or three to six branches; or a circle.
    body : Body
    """

    def __init__(self, skeleton: Skeleton, body: Body) -> None:
        self._skeleton, self._body = skeleton, body
        self.junctions: dict[int, Junction] = {
            node: junction(skeleton, node, body) for node, degree in enumerate(skeleton.degrees) if degree > 2
        }
        self._size = dict.fromkeys(self.junctions, 1.0)
        self._regular = dict.fromkeys(self.junctions, 0.0)
        self.factors: dict[int, Array] = {}
        self._lay()

    def sections(self, number: int) -> Array:
        """Return the sections (m, 2, 2, 3) of a branch."""
        found = self.rods[number].sections(self.factors[number])
        for place, face in zip((0, -1), self.faces[number], strict=True):
            if face is not None:
                found[place] = face
        if number in self.quarters:
            found[-1] = np.rot90(found[0], self.quarters[number])
        return found

    def corners(self, node: int) -> Array:
        """Return the corners (2, 2, 2, 3) of a junction, [u][v][w]."""
        return self.junctions[node].corners(self._size[node], self._regular[node])

    def repaired(self) -> list[str]:
        """Make thinner what is folded or leaves the body; return what was: nothing is left to do when it is empty."""
        faults = [*self._junction_faults(), *(fault for i in self.rods for fault in self._rod_faults(i))]
        self._lay()
        return faults

    def _junction_faults(self) -> list[str]:
        faults = []
        for node in self.junctions:
            corners = self.corners(node)
            if folded(np.moveaxis(corners, 2, 0)).any():
                self._regular[node] = min(1.0, self._regular[node] + _SQUARER)
                faults.append(f"junction {node} is folded")
            if not self._body.contains(corners).all():
                self._size[node] *= _THINNER
                faults.append(f"junction {node} leaves the body")
        return faults

    def _rod_faults(self, number: int) -> list[str]:
        sections, factors = self.sections(number), self.factors[number]
        bad = folded(sections)
        outside = ~self._body.contains(sections).all(axis=(1, 2))
        touched = outside | np.append(bad, False) | np.append(False, bad)
        for place, node in zip((0, -1), self._skeleton.branches[number].ends, strict=True):
            if bad[place] and node in self._size:
                self._size[node] *= np.sqrt(_THINNER)
        factors[touched] *= _THINNER
        for k in range(1, len(factors)):
            factors[k] = min(factors[k], _SLOPE * factors[k - 1])
        for k in range(len(factors) - 2, -1, -1):
            factors[k] = min(factors[k], _SLOPE * factors[k + 1])
        if number in self.quarters:
            factors[0] = factors[-1] = min(factors[0], factors[-1])
        words = [("is folded", bad.any()), ("leaves the body", outside.any())]
        return [f"branch {number} {what}" for what, so in words if so]

    def _lay(self) -> None:
        """Lay all rods between the faces of the junctions as these are now."""
        self.rods: dict[int, Rod] = {}
        self.quarters: dict[int, int] = {}
        self.faces: dict[int, tuple[Array | None, Array | None]] = {}
        for number, branch in enumerate(self._skeleton.branches):
            if branch.ends[0] == branch.ends[1] and branch.ends[0] not in self.junctions:
                self.rods[number], self.quarters[number] = ring(branch.points, branch.radii, self._body)
                self.faces[number] = (None, None)
            else:
                self._lay_rod(number, branch)
            self.factors.setdefault(number, np.ones(len(self.rods[number].centers)))

    def _lay_rod(self, number: int, branch: Branch) -> None:
        first, last = (self._face(number, end) for end in (0, 1))
        total = branch.length
        start, stop = (
            self.junctions[node].exits[number, end].length if node in self.junctions else self._tip(branch, end)
            for end, node in enumerate(branch.ends)
        )
        span = (start, total - stop)
        if last is not None:
            last = last.swapaxes(0, 1)
            if first is not None:
                last = ends_turned(first, last, at_lengths(branch.points, np.linspace(*span, 100)))
        self.rods[number] = rod(branch.points, branch.radii, span, first, last, self._body)
        self.faces[number] = (first, last)

    def _face(self, number: int, end: int) -> Array | None:
        """Return the corners (2, 2, 3) of the face through which a branch end leaves a junction, right-handed."""
        node = self._skeleton.branches[number].ends[end]
        if node not in self.junctions:
            return None
        name = self.junctions[node].exits[number, end].face
        axis, side = axis_side(name)
        corners = face_layer(self.corners(node), name)
        return corners if bool(side) != (axis == 1) else corners.swapaxes(0, 1)

    def _tip(self, branch: Branch, end: int) -> float:
        """Return the length from the end of a limb back to its last section; negative where the limb goes on."""
        points, radii = branch.points[:: 1 if end else -1], branch.radii[:: 1 if end else -1]
        along = arc_lengths(points)
        radius = float(np.median(radii[along >= 0.5 * along[-1]]))
        base = max(0.5 * along[-1], along[-1] - _BACK * radius)
        place = at_lengths(points, np.array([base]))[0]
        reach = float(self._body.rays(place, unit(points[-1] - place)))
        return float(along[-1] - max(base + 0.2 * radius, base + reach - _TIP * radius))
