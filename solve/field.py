"""SplineField: a scalar or vector-valued trivariate spline on the unit cube, as solution.npz holds it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from parameterize.bspline import Array, check_knots, evaluate_at, evaluate_grid
from parameterize.files import load_arrays, save_arrays
from parameterize.volume import AXES


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
        for axis, degree, knots, n in zip(AXES, self.degrees, self.knots, shape[:3], strict=True):
            if len(check_knots(knots, degree)) != n + degree + 1:
                raise ValueError(f"direction {axis}: {n} coefficients of degree {degree} need {n + degree + 1} knots")

    def __call__(self, points: ArrayLike) -> Array:
        """Values (m,) or (m, 3) at parameters (m, 3)."""
        return evaluate_at(self.degrees, self.knots, self.coefficients, points)

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Values (len(u), len(v), len(w)) or (len(u), len(v), len(w), 3) on a tensor grid of parameters."""
        return evaluate_grid(self.degrees, self.knots, self.coefficients, (u, v, w))

    def save(self, path: str | Path) -> None:
        """Write solution.npz (degrees, knots_u, knots_v, knots_w, coefficients); atomic."""
        named = {f"knots_{a}": k for a, k in zip(AXES, self.knots, strict=True)}
        save_arrays(path, degrees=np.array(self.degrees), **named, coefficients=self.coefficients)

    @staticmethod
    def load(path: str | Path) -> SplineField:
        """Read solution.npz: the field alone, without map and report.

        Raises FileNotFoundError, or ValueError naming what is wrong with the file.
        """
        data = load_arrays(path, ("degrees", "knots_u", "knots_v", "knots_w", "coefficients"))
        if data["degrees"].shape != (3,) or data["degrees"].dtype.kind not in "iu":
            raise ValueError(f"{path}: degrees must be three integers")
        if data["coefficients"].dtype.kind != "f" or not np.all(np.isfinite(data["coefficients"])):
            raise ValueError(f"{path}: coefficients must be finite numbers")
        p_u, p_v, p_w = data["degrees"].tolist()
        knots = (data["knots_u"], data["knots_v"], data["knots_w"])
        try:
            return SplineField((p_u, p_v, p_w), knots, data["coefficients"])
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None
