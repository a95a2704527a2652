"""Chooses the factor of drawn displacements, so that a deformation is seen."""

import math

import numpy as np

from solve.field import FieldOnBody

from .fields import is_spatial, quantities_of, solution_of
from .ranges import SMALLEST

SHARE = 0.08  # of the diagonal of the body's box: the largest displacement as drawn
DIGITS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)  # first digits of a factor; each is at most 1.5 times the one before


def is_displacement(solution: FieldOnBody) -> bool:
    """Return whether a solution is a vector of three components whose law gives von Mises' stress, or is not known."""
    quantities = quantities_of(solution)
    return is_spatial(solution) and (quantities is None or "von_mises" in quantities)


def warp_of(solution: FieldOnBody, size: float) -> float:
    """Return the factor at which the largest displacement is drawn as 5 to 8 % of a size, 0 for no displacement.

    size: the diagonal of the body's box.
    """
    if not is_displacement(solution):
        return 0.0
    return factor_for(size, max(float(values.max()) for values in solution_of(solution).everywhere))


def factor_for(size: float, largest: float) -> float:
    """Return the round factor at which `largest` is drawn as 5 to 8 % of a size; 0 where it is zero or not finite."""
    if not SMALLEST < largest < np.inf:
        return 0.0
    decade = 10.0 ** math.floor(math.log10(SHARE * size / largest))
    return max((digit for digit in DIGITS if digit * decade * largest <= SHARE * size), default=1.0) * decade


def in_words(factor: float) -> str:
    """Return a factor as text, such as "300" or "2e+06"."""
    return f"{factor:.6g}" if 1e-3 <= factor < 1e6 else f"{factor:.1e}"
