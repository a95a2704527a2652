"""How patches lie beside each other: points that interfaces make one, and patches on opposite sides of an interface."""

import numpy as np

from ..arrays import IntArray, Mask
from ..cube.cube import VARYING_AXES
from ..spline.body import Body, shared_numbers
from ..spline.bspline import breakpoints
from ..spline.interface import axis_side
from ..spline.volume import FACE_NAMES

# Whether the outward direction of each face, then the two along it are right-handed in the cube: 1, else -1.
_OUTWARD = np.array([(1 if side else -1) * (-1 if axis == 1 else 1) for axis, side in map(axis_side, FACE_NAMES)])
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
        self._spans: IntArray = np.empty((len(body), 3), dtype=np.int64)
        for group in body.groups:
            self._spans[group.numbers] = [len(breakpoints(row)) - 1 for row in group.knots]

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


def on_one_side(rows: IntArray, signs: IntArray) -> Mask:
    """Return whether the two patches of interfaces lie on the same side, (k,): one is folded back over the other.

    rows: (k, 7), see interface_rows.py. signs: of det J of each patch, 1 or -1, which must be that of every point of
    its face. Both outward directions are compared with one normal of the common surface.
    """
    first, second = (signs[rows[:, side]] * _OUTWARD[rows[:, side + 1]] for side in (0, 2))
    return np.asarray(first == second * (-1) ** rows[:, 4:].sum(axis=1))
