"""Defines Interface: two faces of patches that are one surface, with the names and the layers of faces."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ..arrays import Floats
from .patch_groups import PatchGroup
from .volume import FACE_NAMES, BSplineVolume

KNOT_TOLERANCE = 1e-9  # of the interval [0, 1]: files give knots in decimals, and reversed ones are rounded
WEIGHT_TOLERANCE = (
    1e-9  # relative: files give weights in decimals, and a common factor of all, which is free, is rounded
)

Face = tuple[int, str]  # the number of a patch, and the name of one of its faces


@dataclass(frozen=True)
class Interface:
    """Two faces of patches that are one surface, with the same trace.

    A face has two directions, in the order u, v, w. An array of the second face, such as its control points, lies on
    that of the first after its two axes have been exchanged (`swapped`) and then reversed (`flipped`).

    Attributes
    ----------
    first, second : (int, str)
        The number of the patch and the name of its face. A patch may be glued to itself.
    swapped : bool
        Whether the first direction of the one face is the second direction of the other.
    flipped : two bool
        Whether the two faces run in opposite ways along the first and the second direction of the first face.

    Examples
    --------
    >>> import iga_nn
    >>> halves = [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (u + a, v, w), 4) for a in (0, 1)]
    >>> print(iga_nn.Body(tuple(halves), (iga_nn.Interface((0, "u1"), (1, "u0")),)).interfaces[0])
    p0_u1 = p1_u0
    """

    first: Face
    second: Face
    swapped: bool = False
    flipped: tuple[bool, bool] = (False, False)

    def __post_init__(self) -> None:
        for face in (self.first, self.second):
            if not (isinstance(face, tuple) and len(face) == 2 and isinstance(face[0], int) and face[1] in FACE_NAMES):
                raise ValueError(f'a face is the number of a patch and a name, as (0, "u1"), got {face!r:.80}')
        if not (isinstance(self.flipped, tuple) and len(self.flipped) == 2):
            raise ValueError(f"flipped must be two truth values, got {self.flipped!r:.80}")

    def __str__(self) -> str:
        return f"{face_label(*self.first)} = {face_label(*self.second)}"

    @property
    def directions(self) -> tuple[tuple[int, int, bool], ...]:
        """Return each direction of the first face, that of the second one along it, and whether they are opposite."""
        second = varying(self.second[1])
        return tuple(zip(varying(self.first[1]), second[::-1] if self.swapped else second, self.flipped, strict=True))

    def turned(self, second: Floats) -> Floats:
        """Return an array (m_a, m_b, ...) of the second face in the order of the first."""
        array = second.swapaxes(0, 1) if self.swapped else second
        steps = (slice(None, None, -1 if flip else 1) for flip in self.flipped)
        return array[tuple(steps)]


def face_label(patch: int, face: str) -> str:
    """Return the name of a patch's face, such as "p2_u0"."""
    return f"p{patch}_{face}"


def axis_side(face: str) -> tuple[int, int]:
    """Return the constant direction of a face, and its value there, 0 or 1."""
    return divmod(FACE_NAMES.index(face), 2)


def varying(face: str) -> tuple[int, int]:
    """Return the two directions along a face, in ascending order."""
    a, b = (axis for axis in range(3) if axis != axis_side(face)[0])
    return a, b


def face_layer(array: Floats, face: str) -> Floats:
    """Return the layer (m_a, m_b, ...) of an array (n_u, n_v, n_w, ...) of a patch that belongs to a face."""
    axis, side = axis_side(face)
    return array[(slice(None),) * axis + (-side,)]


def outward(layer: Floats, face: str) -> Floats:
    """Return the layer (m_a, m_b, ...) of a face so that its two directions and the way out are right-handed.

    The patch is right-handed. Where the order of its directions points inward, the two are exchanged.
    """
    axis, side = axis_side(face)
    return layer if bool(side) != (axis == 1) else layer.swapaxes(0, 1)


def orientations(first: Face, second: Face) -> Iterator[Interface]:
    """Yield the eight ways in which two faces may lie on each other."""
    for swapped, a, b in product((False, True), repeat=3):
        yield Interface(first, second, swapped, (a, b))


def knots_agree(patches: Sequence[BSplineVolume] | Sequence[PatchGroup], interface: Interface) -> bool:
    """Return whether degrees and knots along the two faces of an interface are the same, up to KNOT_TOLERANCE.

    Of groups of patches, the numbers in the interface are those of the groups.
    """
    p, q = interface.first[0], interface.second[0]
    for axis_p, axis_q, flip in interface.directions:
        row, other = patches[p].knots[axis_p], patches[q].knots[axis_q]
        if patches[p].degrees[axis_p] != patches[q].degrees[axis_q] or len(row) != len(other):
            return False
        if np.abs(row - (1.0 - other[::-1] if flip else other)).max() > KNOT_TOLERANCE:
            return False
    return True
