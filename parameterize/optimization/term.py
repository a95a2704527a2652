"""Defines the protocol of the terms of a map's energy, their weights, and the sum of a term over blocks."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from ..arrays import Array, Floats
from ..spline.spline_map import ControlNets
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


T = TypeVar("T", bound=Term)


class Blockwise(Generic[T]):
    """Sum the terms of the blocks; `terms` has one for each block, as a function of (3, n_u, n_v, n_w)."""

    def __init__(self, nets: ControlNets, terms: Sequence[T]) -> None:
        self.nets, self.terms = nets, tuple(terms)

    def weight(self, weights: RoundWeights) -> float:
        """Return the weight of the term in a round, the same for all blocks."""
        return self.terms[0].weight(weights)

    def energy_and_gradient(self, control: Array) -> tuple[float, Array]:
        """Return the term at control points (3, n), and its gradient of the same shape."""
        found = [term.energy_and_gradient(self.nets.of_block(control, k)) for k, term in enumerate(self.terms)]
        return sum(energy for energy, _ in found), self.nets.joined([gradient for _, gradient in found])

    def curvature(self, control: Array) -> PiecewiseOperator:
        """Return the second derivative at `control` as an operator in single precision."""
        parts = [term.curvature(self.nets.of_block(control, k)) for k, term in enumerate(self.terms)]
        return side_by_side(self.nets, parts)


def side_by_side(nets: ControlNets, operators: Sequence[PiecewiseOperator]) -> PiecewiseOperator:
    """Return the operator on control points (3, n) that applies to each block the operator of this block."""

    def apply(piece: Callable[[Floats], Any], block: int, x: Floats) -> Any:
        return piece(nets.of_block(x, block))

    def add(found: list[Any], x: Floats) -> Floats:
        rest = iter(found)
        shares = [list(islice(rest, len(operator.pieces))) for operator in operators]
        each = zip(operators, shares, strict=True)
        return nets.joined(
            [operator.add(share, nets.of_block(x, block)) for block, (operator, share) in enumerate(each)]
        )

    pieces: list[Callable[[Floats], Any]] = [
        partial(apply, piece, block) for block, operator in enumerate(operators) for piece in operator.pieces
    ]

    def diagonal(like: Floats) -> Floats:
        each = (operator.diagonal(nets.of_block(like, block)) for block, operator in enumerate(operators))
        return np.concatenate([blocks.reshape(6, -1) for blocks in each], axis=1)

    return PiecewiseOperator(pieces, add, diagonal)
