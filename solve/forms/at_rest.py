"""Defines the linear laws beside a law that is not linear: its derivative at rest, and the law without a flux."""

from typing import Any

import numpy as np

from .form import Form
from .tangent import derivative


class AtRest(Form):
    """Define the linear law whose flux is the derivative of a law's flux at u = 0, for a gradient that is zero there.

    It says how stiff a body is before any load: supports are as many times stiffer.
    """

    def __init__(self, law: Form) -> None:
        self.law, self.components, self.symmetric = law, law.components, law.symmetric

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the product of the derivative (c, 3, c, 3, ...) and the gradient (c, 3, ...)."""
        slopes = derivative(self.law, np.zeros_like(u), np.zeros_like(grad), x)[:, 1:, :, 1:]
        return np.einsum("aibj...,bj...->ai...", slopes, grad)


class Still(Form):
    """Define the law whose flux is zero: on faces of this law, supports act by their stiffness alone."""

    def __init__(self, components: int) -> None:
        self.components = components

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return zero (c, 3, ...)."""
        return np.zeros_like(grad)
