"""Sums a term over blocks: the term of each block acts on the control points of that block."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Generic, TypeVar

from ..arrays import Array, Floats
from ..spline.control_nets import ControlNets
from .operators import PiecewiseOperator
from .term import RoundWeights, Term

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
        parts, begin = [], 0
        for block, operator in enumerate(operators):
            end = begin + len(operator.pieces)
            parts.append(operator.add(found[begin:end], nets.of_block(x, block)))
            begin = end
        return nets.joined(parts)

    pieces: list[Callable[[Floats], Any]] = [
        partial(apply, piece, block) for block, operator in enumerate(operators) for piece in operator.pieces
    ]
    return PiecewiseOperator(pieces, add)
