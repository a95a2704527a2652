"""Defines Samples: a linear functional of a function on a body, as a sum over points."""

from dataclasses import dataclass

from parameterize.arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class Samples:
    """State a linear functional J(v) = sum over m points of of_u . v + of_grad : grad v, with the gradient in space.

    patches: (m,), of the points. places: (m, 3), their parameters. of_u: (c, m); of a nearly incompressible body it may
    have one more row, for the pressure. of_grad: (c, 3, m).
    """

    patches: IntArray
    places: Array
    of_u: Array
    of_grad: Array
