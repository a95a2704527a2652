"""How patches lie beside each other: points that interfaces make one, and patches on opposite sides of an interface."""

from collections.abc import Sequence

import numpy as np

from ..arrays import IntArray
from ..cube.cube import VARYING_AXES
from ..spline.body import Body, shared_numbers
from ..spline.bspline import breakpoints
from ..spline.interface import Face, Interface, axis_side

_PLACES = [0, 1, 3]  # of the four lattice points a direction: the lower end, between the ends, the upper end


class SharedPoints:
    """Gives points on the outer faces of patches names, the same to points that interfaces make one.

    Each patch is a lattice of four points a direction, numbered through the interfaces. A point of its boundary belongs
    to the corner, the edge or the face whose lattice points have the same coordinates on the ends. Of an edge's two
    inner points, the one with the smaller number is nearer to its beginning, whichever patch it is looked at from.
    """

    def __init__(self, body: Body) -> None:
        labels: IntArray = np.stack(shared_numbers([(4, 4, 4)] * len(body), body.interfaces)[0])
        ways = [[[0, 2, 3] if axis == turned else _PLACES for axis in range(3)] for turned in range(3)]
        ahead, *further = (labels[:, rows[0]][:, :, rows[1]][..., rows[2]] for rows in ([_PLACES] * 3, *ways))
        self._numbers = np.minimum.reduce([ahead, *further])  # (patches, 3, 3, 3)
        self._backward = np.stack([other < ahead for other in further], axis=-1)  # (patches, 3, 3, 3, 3)
        self._spans = np.array([[len(breakpoints(row)) - 1 for row in patch.knots] for patch in body])

    def names(self, patches: IntArray, axes: IntArray, positions: IntArray, steps: int) -> IntArray:
        """Return the names (n, m, 3) of points of outer faces; different points have different ones.

        patches, axes: (n,) the patch, and the parameter that is constant on the face. positions: (n, m, 3) the places
        in the cube, a span of knots being `steps` long.
        """
        last = steps * self._spans[patches][:, None]
        cell = np.where(positions == 0, 0, np.where(positions == last, 2, 1))
        rows = (patches[:, None], *np.moveaxis(cell, -1, 0))
        along = np.where(self._backward[rows], last - positions, positions) * (cell == 1)
        first, second = np.moveaxis(np.take_along_axis(along, VARYING_AXES[axes][:, None], axis=2), -1, 0)
        on_face = (first > 0) & (second > 0)  # else one of the two is zero: an edge has one coordinate
        return np.stack([self._numbers[rows], first + second, second * on_face], axis=-1)


def on_one_side(interface: Interface, signs: Sequence[int]) -> bool:
    """Return whether the two patches of an interface lie on the same side of it: one is folded back over the other.

    signs: of det J of each patch, 1 or -1, which must be that of every point of its face. Both outward directions are
    compared with one normal of the common surface.
    """
    reversals = interface.swapped + sum(interface.flipped)
    first, second = (signs[face[0]] * _outward(face) for face in (interface.first, interface.second))
    return first == second * (-1) ** reversals


def _outward(face: Face) -> int:
    """Return whether the outward direction, then the two along a face are right-handed in the cube: 1, else -1."""
    axis, side = axis_side(face[1])
    return (1 if side else -1) * (-1 if axis == 1 else 1)
