"""Solves roughly with a matrix: by conjugate gradients, or by a factor where these cost more."""

import math
from collections.abc import Callable

import numpy as np

from parameterize.arrays import Array
from parameterize.conjugate_gradients import conjugate_gradients

TOLERANCE, MOST = 0.1, 500  # of a rough solve
NOT_POSITIVE = (
    "the energy of some motion is not positive, so that there are no modes: a law with a negative reaction has motions "
    "that grow, and rounding hides the energies of a body that is 100 000 times longer than thick"
)

Product = Callable[[Array], Array]


class RoughInverse:
    """Apply an approximate inverse of a matrix to columns (N, m).

    It begins with conjugate gradients. When these have made as many products as a factor costs, the factor takes their
    place, so that neither a hard matrix nor an easy one takes more than about twice the time of the better way.
    """

    def __init__(
        self, product: Product, preconditioner: Product, factorize: Callable[[], Product | None], price: float
    ):
        """Take products with the matrix and with its preconditioner, of vectors (N,).

        factorize: returns the solve with a factor for columns (N, m), None where there is no factor. price: the number
        of products that it costs, infinite where it is not to be tried.
        """
        self._product, self._preconditioner, self._factorize = product, preconditioner, factorize
        self._left = price
        self._exact: Product | None = None

    @property
    def is_exact(self) -> bool:
        """Return whether there is a factor."""
        return self._exact is not None

    def __call__(self, columns: Array) -> Array:
        """Return the approximate inverse times columns (N, m). Raises ValueError where the matrix has no factor."""
        found = np.empty_like(columns)
        for i, column in enumerate(columns.T):
            if self._left <= 0:
                self._exact, self._left = self._factorize(), math.inf
                if self._exact is None:
                    raise ValueError(NOT_POSITIVE)
            if self._exact is not None:
                return self._exact(columns)
            solved = conjugate_gradients(self._product, column, self._preconditioner, TOLERANCE, MOST)
            found[:, i] = solved.x
            self._left -= solved.iterations
            if solved.breakdown and self._left < math.inf:
                self._left = 0
        return found
