"""Defines the protocol of the terms of a map's energy, and their weights."""

from dataclasses import dataclass
from typing import Protocol

from ..arrays import Array
from .operators import PiecewiseOperator


@dataclass(frozen=True)
class Weights:
    """Hold the weights of a map in a domain of volume 1; a start or a refinement may set other values.

    fairness: the weight of the integral of the squared Hessians. surface: the weight of the mean squared distance from
    the surface along its normals. least_floor: the smallest share to which the floors of det J are lowered where det J
    is small all around.
    """

    fairness: float = 1e-3
    surface: float = 1.2e5
    least_floor: float = 1.0


@dataclass(frozen=True)
class RoundWeights:
    """Hold the weights of one round: `penalty` for the penalties on folds, `surface` for the surface's data."""

    penalty: float
    surface: float


class Term(Protocol):
    """Define a term of the energy as a function of control points (3, n), in double precision."""

    def weight(self, weights: RoundWeights) -> float:
        """Return the weight of the term in a round."""

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the unweighted term at `control`, and its gradient (3, n)."""

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return a positive semidefinite second derivative at `control`, as an operator in single precision."""
