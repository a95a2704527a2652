r"""Defines hyperelastic laws for large strains: neo-Hooke, Mooney and Rivlin, Yeoh, each with a volumetric part.

With F = 1 + grad u, J = det F and C = F^T F, the energy per volume at rest is a function of the invariants without
volume, i1 = J^(-2/3) tr C and i2 = J^(-4/3) (tr(C)^2 - tr(C^2)) / 2, and

    W = w(i1, i2) + K / 2 (J - 1)^2,        P = dW / dF.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from .form import Quantity
from .nonlinear_body import NonlinearBody, Number, stress_quantities


@dataclass(frozen=True, kw_only=True)
class Hyperelastic(NonlinearBody):
    """State a body of an elastic law for large strains; a subclass gives the derivatives of its energy w(i1, i2)."""

    bulk: Number = 1.0

    has_large_strains = True

    def slopes(self, first: Any, second: Any) -> tuple[Any, Any]:
        """Return the derivatives of w by i1 and i2, at i1 - 3 and i2 - 3."""
        raise NotImplementedError(f"{type(self).__name__}.slopes")

    @property
    def shear_at_rest(self) -> float:
        """Return the shear modulus for small strains, 2 (dw/di1 + dw/di2) at rest."""
        one, two = self.slopes(0.0, 0.0)
        return float(2.0 * (one + two))

    def check_number(self, name: str, value: float) -> None:
        """Raise ValueError for a bulk modulus that is not positive."""
        if name == "bulk" and value <= 0.0:
            raise ValueError(f"bulk must be positive, got {value:g}")

    def check_material(self) -> None:
        """Raise ValueError for a material that is not stiff at rest."""
        if not self.shear_at_rest > 0.0:
            said = ", ".join(f"{name} {getattr(self, name):g}" for name in self.numbers)
            raise ValueError(f"the shear modulus at rest must be positive, it is {self.shear_at_rest:g} for {said}")

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the first Piola stress P (3, 3, ...), force per area at rest.

        P = 2 a J^(-2/3) (F - tr C / 3 F^-T) + 2 b J^(-4/3) (tr C F - F C - 2/3 I2 F^-T) + K J (J - 1) F^-T, with
        a = dw/di1, b = dw/di2 and I2 = (tr(C)^2 - tr(C^2)) / 2 (Bonet and Wood, *Nonlinear Continuum Mechanics for
        Finite Element Analysis*, 2nd ed., chapter 6).
        """
        f = [[grad[i, j] + float(i == j) for j in range(3)] for i in range(3)]
        minor = _cofactors(f)
        det = sum(f[0][j] * minor[0][j] for j in range(3))
        right = [[sum(f[k][i] * f[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
        trace = right[0][0] + right[1][1] + right[2][2]
        root = det ** (-2.0 / 3.0)
        first = root * trace - 3.0
        squares = sum(right[i][j] * right[j][i] for i in range(3) for j in range(3))
        pairs = 0.5 * (trace * trace - squares)
        one, two = self.slopes(first, root * root * pairs - 3.0)
        bulk: Any = self.bulk
        along = bulk * (det - 1.0) - (2.0 / 3.0 * one * root * trace) / det
        if self.has_second:
            along = along - (4.0 / 3.0 * two * root * root * pairs) / det
        rows = []
        for i in range(3):
            row = []
            for j in range(3):
                entry = 2.0 * one * root * f[i][j] + along * minor[i][j]
                if self.has_second:
                    bent = trace * f[i][j] - sum(f[i][k] * right[k][j] for k in range(3))
                    entry = entry + 2.0 * two * root * root * bent
                row.append(entry)
            rows.append(np.stack(row))
        return np.stack(rows)

    has_second: ClassVar[bool] = False  # whether w depends on i2

    def cauchy(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the Cauchy stress (3, 3, ...), force per area of the deformed body: P F^T / J."""
        f = grad + np.eye(3).reshape(3, 3, *(1,) * (grad.ndim - 2))
        det = np.linalg.det(np.moveaxis(f, (0, 1), (-2, -1)))
        return np.einsum("ik...,jk...->ij...", self.flux(u, grad, x), f) / det

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Return the quantities of a solution by name: the stresses are Cauchy's, `volume_ratio` is J (...)."""
        return {
            **super().quantities,
            **stress_quantities(self.cauchy),
            "volume_ratio": lambda u, grad, x: np.linalg.det(np.moveaxis(grad, (0, 1), (-2, -1)) + np.eye(3)),
        }

    @property
    def reported(self) -> tuple[str, ...]:
        """Return the names of quantities whose extremes a report shows."""
        return ("magnitude", "von_mises", "volume_ratio", "first_principal", "third_principal")


@dataclass(frozen=True, kw_only=True)
class NeoHookean(Hyperelastic):
    """State a neo-Hookean body, w = mu / 2 (i1 - 3), with the volumetric part K / 2 (J - 1)^2.

    Parameters
    ----------
    shear, bulk : float
        mu > 0 and K > 0; for small strains those of a linear elastic body.
    body_force, density, gravity, acceleration, spin, conditions, fix, roller, symmetry, load, pressure, spring
        As of `Plasticity`. Loads are dead; a pressure is that per area at rest, along the normal at rest, and a spin
        pulls as at the body at rest.

    Raises
    ------
    ValueError
        For numbers out of range, and where no condition is given.
    ExpressionError
        For a formula that is refused.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> rubber = iga_nn.NeoHookean(shear=1.0, bulk=10.0, fix="u0", load={"u1": (0.5, 0, 0)})
    >>> iga_nn.solve(benchmark_volume(2), rubber, load_steps=2).report.load_factor
    1.0
    """

    shear: Number = 1.0

    numbers: ClassVar = ("shear", "bulk")

    def slopes(self, first: Any, second: Any) -> tuple[Any, Any]:
        """Return mu / 2 and zero."""
        return 0.5 * self.shear, 0.0  # type: ignore[operator]


@dataclass(frozen=True, kw_only=True)
class MooneyRivlin(Hyperelastic):
    """State a body of Mooney and Rivlin, w = c10 (i1 - 3) + c01 (i2 - 3), with K / 2 (J - 1)^2.

    Parameters
    ----------
    c10, c01, bulk : float
        c10 + c01 > 0, half of the shear modulus for small strains, and K > 0.
    body_force, density, gravity, acceleration, spin, conditions, fix, roller, symmetry, load, pressure, spring
        As of `NeoHookean`.

    Raises
    ------
    ValueError
        For numbers out of range, and where no condition is given.
    ExpressionError
        For a formula that is refused.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.MooneyRivlin(c10=0.4, c01=0.1, bulk=50.0, fix="u0").shear_at_rest
    1.0
    """

    c10: Number = 0.5
    c01: Number = 0.0

    numbers: ClassVar = ("c10", "c01", "bulk")
    has_second: ClassVar[bool] = True

    def slopes(self, first: Any, second: Any) -> tuple[Any, Any]:
        """Return c10 and c01."""
        return self.c10, self.c01


@dataclass(frozen=True, kw_only=True)
class Yeoh(Hyperelastic):
    """State a body of Yeoh, w = c10 (i1 - 3) + c20 (i1 - 3)^2 + c30 (i1 - 3)^3, with K / 2 (J - 1)^2.

    Yeoh, *Some forms of the strain energy function for rubber*, Rubber Chem. Technol. 66 (1993) 754.

    Parameters
    ----------
    c10, c20, c30, bulk : float
        c10 > 0, half of the shear modulus for small strains, and K > 0.
    body_force, density, gravity, acceleration, spin, conditions, fix, roller, symmetry, load, pressure, spring
        As of `NeoHookean`.

    Raises
    ------
    ValueError
        For numbers out of range, and where no condition is given.
    ExpressionError
        For a formula that is refused.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.Yeoh(c10=0.5, c20=-0.01, c30=0.001, bulk=50.0, fix="u0").shear_at_rest
    1.0
    """

    c10: Number = 0.5
    c20: Number = 0.0
    c30: Number = 0.0

    numbers: ClassVar = ("c10", "c20", "c30", "bulk")

    def slopes(self, first: Any, second: Any) -> tuple[Any, Any]:
        """Return c10 + 2 c20 (i1 - 3) + 3 c30 (i1 - 3)^2, and zero."""
        return self.c10 + first * (2.0 * self.c20 + 3.0 * self.c30 * first), 0.0  # type: ignore[operator]


def _cofactors(f: list[list[Any]]) -> list[list[Any]]:
    """Return the cofactors of a matrix of entries."""
    ring = (0, 1, 2, 0, 1)
    return [
        [
            f[ring[i + 1]][ring[j + 1]] * f[ring[i + 2]][ring[j + 2]]
            - f[ring[i + 1]][ring[j + 2]] * f[ring[i + 2]][ring[j + 1]]
            for j in range(3)
        ]
        for i in range(3)
    ]
