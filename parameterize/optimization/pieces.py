"""Linear operators made of pieces of work, so that the pieces of a whole sum run on all threads together."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from ..threads import in_parallel


@dataclass(frozen=True, eq=False)
class PiecewiseOperator:
    """x -> add(what every piece makes of x, x); `add` takes these in the order of the pieces."""

    pieces: list[Callable[[Tensor], Any]]
    add: Callable[[list[Any], Tensor], Tensor]

    def __call__(self, x: Tensor) -> Tensor:
        """Apply the operator to control points: (3, n_u, n_v, n_w) -> the same shape."""
        return self.add(in_parallel(lambda piece: piece(x), self.pieces), x)


def weighted_sum(terms: list[tuple[float, PiecewiseOperator]]) -> PiecewiseOperator:
    """Return the sum of operators times their weights: one call runs all their pieces."""

    def add(found: list[Any], x: Tensor) -> Tensor:
        total, begin = torch.zeros_like(x), 0
        for weight, operator in terms:
            end = begin + len(operator.pieces)
            total.add_(operator.add(found[begin:end], x), alpha=weight)
            begin = end
        return total

    return PiecewiseOperator([piece for _, operator in terms for piece in operator.pieces], add)
