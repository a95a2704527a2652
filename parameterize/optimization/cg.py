"""Preconditioned conjugate gradients on torch tensors of any shape."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor

Operator = Callable[[Tensor], Tensor]


def conjugate_gradients(
    operator: Operator, right: Tensor, precondition: Operator, *, tolerance: float, max_iterations: int
) -> tuple[Tensor, int]:
    """Solve operator(x) = right from x = 0 until |r| <= tolerance |right|; returns x and the iterations done."""
    x = torch.zeros_like(right)
    residual = right.clone()
    goal = tolerance * float(right.norm())
    direction = precondition(residual)
    product = float((residual * direction).sum())
    for iteration in range(max_iterations):
        if float(residual.norm()) <= goal:
            return x, iteration
        image = operator(direction)
        step = product / float((direction * image).sum())
        x += step * direction
        residual -= step * image
        scaled = precondition(residual)
        new_product = float((residual * scaled).sum())
        direction = scaled + (new_product / product) * direction
        product = new_product
    return x, max_iterations
