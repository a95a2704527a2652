"""Defines the law of the mass matrix, and laws with a multiple of the mass added."""

from typing import Any

import numpy as np

from parameterize.arrays import Array

from .form import Form, reaction


class Mass(Form):
    """Define the law of the mass matrix: int factor u . v."""

    def __init__(self, factor: float = 1.0) -> None:
        self.factor = factor

    def tensor(self, x: Array, component: int = 0) -> Array:
        """Return zero (6, ...), because there is no flux."""
        return np.zeros((6, *x.shape[1:]))

    def react(self, u: Any, grad: Any, x: Any) -> Any:
        """Return `factor` times u."""
        return self.factor * u


class WithMass(Form):
    """Define a law plus `factor` times the mass."""

    def __init__(self, law: Form, factor: float) -> None:
        self.law, self.factor = law, factor
        self.components, self.symmetric = law.components, law.symmetric

    @property
    def has_reaction(self) -> bool:
        """Return True, because the mass is a reaction."""
        return True

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the flux of the law."""
        return self.law.flux(u, grad, x)

    def react(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the law's reaction plus `factor` times u."""
        return reaction(self.law, u, grad, x) + self.factor * u

    def tensor(self, x: Array, component: int = 0) -> Array:
        """Return the tensor of the law."""
        return self.law.tensor(x, component)

    def mass(self, x: Array, component: int = 0) -> Array:
        """Return the law's factor of a component plus `factor`."""
        return self.law.mass(x, component) + self.factor
