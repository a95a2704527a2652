"""SplineField: a scalar or vector-valued trivariate spline on the unit cube, as solution.npz holds it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array
from parameterize.spline.bspline import evaluate_at, evaluate_grid
from parameterize.spline.volume import checked_knots, load_spline, save_spline


@dataclass(frozen=True, eq=False)
class SplineField:
    """A function of the parameters.

    degrees: one per direction. knots: three open knot vectors on [0, 1]. coefficients: (m_u, m_v, m_w), with three
    components (m_u, m_v, m_w, 3).
    Raises ValueError where the parts do not fit together.
    """

    degrees: tuple[int, int, int]
    knots: tuple[Array, Array, Array]
    coefficients: Array

    def __post_init__(self) -> None:
        shape = np.shape(self.coefficients)
        if len(self.degrees) != 3 or len(self.knots) != 3 or len(shape) < 3 or shape[3:] not in ((), (3,)):
            raise ValueError(
                "a field has three degrees, three knot vectors, coefficients (m_u, m_v, m_w) or with (, 3)"
            )
        object.__setattr__(self, "knots", checked_knots(self.degrees, self.knots, shape[:3], "coefficients"))

    def __call__(self, points: ArrayLike) -> Array:
        """Values (m,) or (m, 3) at parameters (m, 3)."""
        return evaluate_at(self.degrees, self.knots, self.coefficients, points)

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Values (len(u), len(v), len(w)) or (len(u), len(v), len(w), 3) on a tensor grid of parameters."""
        return evaluate_grid(self.degrees, self.knots, self.coefficients, (u, v, w))

    def save(self, path: str | Path) -> None:
        """Write solution.npz (degrees, knots_u, knots_v, knots_w, coefficients); atomic."""
        save_spline(path, self.degrees, self.knots, coefficients=self.coefficients)

    @staticmethod
    def load(path: str | Path) -> SplineField:
        """Read solution.npz: the field alone, without map and report.

        Raises FileNotFoundError, or ValueError naming what is wrong with the file.
        """
        degrees, knots, coefficients = load_spline(path, "coefficients")
        if coefficients.dtype.kind != "f" or not np.all(np.isfinite(coefficients)):
            raise ValueError(f"{path}: coefficients must be finite numbers")
        try:
            return SplineField(degrees, knots, coefficients)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None
