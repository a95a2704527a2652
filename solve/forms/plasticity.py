"""Defines Plasticity: small strains of a body that yields by von Mises' condition and hardens (J2 flow theory)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from parameterize.arrays import Array

from .form import Quantity
from .jets import PAIRS, SYMMETRIC
from .nonlinear_body import NonlinearBody, Number, stress_quantities

ROOT = np.sqrt(2.0 / 3.0)
UNIT = np.eye(3)
# (3, 3, 3, 3): the unit tensor times itself, and the projection onto symmetric tensors without a trace
VOLUME = np.einsum("ij,kl->ijkl", UNIT, UNIT)
DEVIATOR = 0.5 * (np.einsum("ik,jl->ijkl", UNIT, UNIT) + np.einsum("il,jk->ijkl", UNIT, UNIT)) - VOLUME / 3.0


@dataclass(frozen=True, kw_only=True)
class Plasticity(NonlinearBody):
    """State a body that yields where von Mises' stress reaches sigma_y + H alpha, alpha its plastic strain (J2).

    Strains are small. Stress follows plastic flow by the radial return of Simo and Hughes, *Computational
    Inelasticity* (1998), box 3.2, and its consistent tangent. The plastic strain and alpha are kept at the Gauss points
    from one load step to the next, so that unloading is elastic.

    Parameters
    ----------
    young, poisson_ratio : float
        E > 0 and -1 < nu < 1/2, as of `Elasticity`.
    yield_strength : float
        sigma_y > 0, in tension.
    hardening : float
        H >= 0, the slope of the yield stress over the plastic strain; zero by default, which is perfect plasticity.
    body_force : three entries, optional
        Force per volume.
    density, gravity, acceleration, spin : optional
        The body's mass per volume, and what acts on it, as of `Elasticity`.
    conditions : sequence of Fix, Roller, Symmetry, Load, Pressure or Spring
        Supports and loads on regions; the rest of the boundary is free.
    fix, roller, symmetry, load, pressure, spring : dict of region to data, optional
        Short forms of these.

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
    >>> bar = iga_nn.Plasticity(young=200.0, poisson_ratio=0.3, yield_strength=0.2, hardening=20.0,
    ...     conditions=[iga_nn.Fix("u0"), iga_nn.Load("u1", (0.1, 0, 0))])
    >>> iga_nn.solve(benchmark_volume(2), bar, load_steps=2).report.load_factor
    1.0
    """

    young: Number = 1.0
    poisson_ratio: Number = 0.3
    yield_strength: Number = 1.0
    hardening: Number = 0.0

    history = 7  # the plastic strain xx, xy, xz, yy, yz, zz, and alpha
    numbers: ClassVar = ("young", "poisson_ratio", "yield_strength", "hardening")

    def check_number(self, name: str, value: float) -> None:
        """Raise ValueError for a number of the material that is out of range."""
        if name == "poisson_ratio":
            if not -1.0 < value < 0.5:
                raise ValueError(f"poisson_ratio must lie between -1 and 1/2, got {value:g}")
        elif not (value > 0.0 or name == "hardening" and value == 0.0):
            raise ValueError(f"{name} must be {'positive' if name != 'hardening' else 'zero or more'}, got {value:g}")

    @property
    def moduli(self) -> tuple[float, float]:
        """Return the bulk modulus K and the shear modulus mu of one material."""
        young: Any = self.young
        nu: Any = self.poisson_ratio
        return young / (3.0 * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu))

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the stress (3, 3, ...) after plastic flow from the history at the points x, `x.state`."""
        bulk, shear = self.moduli
        trial, flow, direction = self._returned(grad, x)
        trace = bulk * (grad[0, 0] + grad[1, 1] + grad[2, 2])
        stress = trial - 2.0 * shear * flow * direction
        for i in range(3):
            stress[i, i] += trace
        return stress

    def tangent(self, u: Array, grad: Array, x: Any) -> Array:
        """Return the consistent tangent (3, 4, 3, 4, ...), the derivative of `flux`; see `tangent.derivative`."""
        bulk, shear = self.moduli
        trial, flow, direction = self._returned(grad, x)
        size = np.sqrt((trial * trial).sum(axis=(0, 1)))
        flows = flow > 0.0
        keep = 1.0 - np.divide(2.0 * shear * flow, size, out=np.zeros_like(size), where=flows)
        hard: Any = self.hardening
        turn = np.where(flows, 1.0 / (1.0 + hard / (3.0 * shear)) - (1.0 - keep), 0.0)
        found = np.zeros((3, 4, 3, 4, *flow.shape))
        own = np.multiply.outer(2.0 * shear * DEVIATOR, keep)
        own += (bulk * VOLUME).reshape(3, 3, 3, 3, *(1,) * flow.ndim)
        own -= np.einsum("ij...,kl...->ijkl...", 2.0 * shear * turn * direction, direction)
        found[:, 1:, :, 1:] = own
        return found

    def advanced(self, grad: Array, x: Any) -> Array:
        """Return the history (7, ...) at the end of a load step."""
        _, flow, direction = self._returned(grad, x)
        before = _state(x, flow.shape)
        strain = [before[i] + flow * direction[pair] for i, pair in enumerate(PAIRS)]
        return np.stack([*strain, before[6] + ROOT * flow])

    def shown(self, grad: Array, x: Any) -> Array:
        """Return the deviator of the elastic strain xx, xy, xz, yy, yz, zz and alpha (7, ...) at Gauss points.

        The plastic strain is a thousand times as large, and errors of splines fitted to it would be stresses.
        """
        state = np.asarray(x.state, dtype=np.float64)
        trial, _, _ = self._returned(grad, x)
        return np.stack([*(trial[pair] / (2.0 * self.moduli[1]) for pair in PAIRS), state[6]])

    @property
    def bounded(self) -> Sequence[int]:
        """Return the place of alpha: no more strength is shown than the Gauss points have."""
        return (6,)

    def shown_stress(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the stress (3, 3, ...) of a solution, whose von Mises stress is at most sigma_y + H alpha.

        The deviator follows from what is known of the Gauss points (`shown`) and is taken back to the yield surface of
        alpha; the mean stress follows from the displacement. Where nothing is known it is `flux`, that of a body that
        has not flowed.
        """
        known = getattr(x, "state", None)
        if known is None:
            return self.flux(u, grad, x)
        bulk, shear = self.moduli
        limit: Any = self.yield_strength
        hard: Any = self.hardening
        deviator = 2.0 * shear * known[np.array(SYMMETRIC)]
        third = (deviator[0, 0] + deviator[1, 1] + deviator[2, 2]) / 3.0
        for i in range(3):
            deviator[i, i] -= third
        size = np.sqrt((deviator * deviator).sum(axis=(0, 1)))
        most = ROOT * (limit + hard * np.maximum(known[6], 0.0))
        stress = deviator * np.minimum(1.0, most / np.where(size > 0.0, size, most))
        for i in range(3):
            stress[i, i] += bulk * (grad[0, 0] + grad[1, 1] + grad[2, 2])
        return stress

    def _returned(self, grad: Array, x: Any) -> tuple[Array, Array, Array]:
        """Return the trial deviator (3, 3, ...), the plastic flow (...), at least zero, and its direction."""
        shear = self.moduli[1]
        limit: Any = self.yield_strength
        hard: Any = self.hardening
        shape = grad.shape[2:]
        before = _state(x, shape)
        trial = 0.5 * (grad + np.swapaxes(grad, 0, 1))
        third = (grad[0, 0] + grad[1, 1] + grad[2, 2]) / 3.0
        for i in range(3):
            trial[i, i] -= third
        trial -= before[np.array(SYMMETRIC)]
        trial *= 2.0 * shear
        size = np.sqrt((trial * trial).sum(axis=(0, 1)))
        beyond = size - ROOT * (limit + hard * np.maximum(before[6], 0.0))
        flow = np.maximum(beyond, 0.0) / (2.0 * shear + 2.0 / 3.0 * hard)
        direction = np.divide(trial, size, out=np.zeros_like(trial), where=size > 0.0)
        return trial, flow, direction

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Return the quantities of a solution by name; `plastic_strain` is alpha, the equivalent plastic strain (...).

        Stresses are those of `shown_stress`. The plastic strain is fitted to that of the Gauss points by splines on
        each patch, and nowhere exceeds it.
        """
        return {
            **super().quantities,
            "flux": self.shown_stress,
            "flux_magnitude": lambda u, grad, x: np.sqrt((self.shown_stress(u, grad, x) ** 2).sum(axis=(0, 1))),
            "strain": lambda u, grad, x: 0.5 * (grad + np.swapaxes(grad, 0, 1)),
            **stress_quantities(self.shown_stress),
            "plastic_strain": lambda u, grad, x: np.maximum(_state(x, grad.shape[2:])[6], 0.0),
        }

    @property
    def reported(self) -> tuple[str, ...]:
        """Return the names of quantities whose extremes a report shows."""
        return ("magnitude", "von_mises", "plastic_strain", "first_principal", "third_principal")


def _state(x: Any, shape: tuple[int, ...]) -> Array:
    """Return the history (7, ...) at points; zero where none is known."""
    state = getattr(x, "state", None)
    return np.zeros((7, *shape)) if state is None else state
