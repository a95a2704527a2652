"""Defines Elasticity: -div sigma(u) = f for an isotropic body, with displacement or traction on each face."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from copy import copy
from dataclasses import KW_ONLY, dataclass, field
from numbers import Real
from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array

from .conditions import OF_BODIES, Condition, GivenRegions, OnFaces
from .data import LARGEST, SMALLEST, Data
from .form import Quantity
from .inertia import with_inertia
from .owners import Owner, entry_of
from .problem import LawWithData

NONE = ("0", "0", "0")  # of a vector


NEARLY_RIGID = 0.45  # Poisson's ratio from which on the estimate of the error was 30 to 500 times too large


@dataclass(frozen=True)
class Elasticity(LawWithData):
    """Linear elasticity of an isotropic body: -div sigma = f, sigma = lambda div(u) I + mu (grad u + grad u^T).

    Each vector is given as three entries: formulas in x, y, z and X, Y, Z (as in `Poisson`), functions of three arrays
    x, y, z of equal shape, or fields on the same volume.

    Parameters
    ----------
    exact : three entries, optional
        The displacement u, where it is known. As formulas it gives force and boundary data, and the report's errors;
        functions need them beside it, and leave the H1 seminorm out.
    body_force : three entries, optional
        f, per volume; overrides the force of `exact`, and is zero without it where `displacement` or `traction`
        are given.
    displacement : three entries, optional
        Values of u on the faces that are not in `traction`; default: `exact`, or zero.
    traction : dict of face name to three entries or None
        sigma n, n the outward unit normal; None: from `exact`. A solve leaves one face at least to displacement;
        `iga_nn.modes` takes a free body, too.
    young : float
        E > 0. On several patches or solids also a dictionary: a number for each patch, or for the name of each solid.
    poisson_ratio : float
        -1 < nu < 1/2, or a dictionary as `young`. `lame` converts from lambda and mu.
    conditions : sequence of conditions such as Fix or Load, optional
        Supports and loads on regions of the boundary. Where a region is given, the rest of the boundary is free, or has
        the traction of `exact`; `displacement` and `traction` are left out then.
    fix, roller, symmetry, turn, spring, total_spring, foundation : dict of region to data, optional
        Short forms of the supports of these names, such as `spring={"u0": 50}`; also regions alone, `fix="u0"`.
    load, pressure, hydrostatic, total_force, moment, remote_force, bearing : dict of region to data, optional
        Short forms of the loads of these names, such as `total_force={"u1": (0, 0, -500)}`. Data with a point are a
        pair: `remote_force={"u1": ((0, 0, -500), (10, 0, 50))}`.
    density : float, optional
        Mass per volume, by which `gravity`, `acceleration` and `spin` act; or a dictionary as `young`.
    gravity : three numbers, optional
        The acceleration of gravity, such as (0, 0, -9810) in mm/s².
    acceleration : three numbers, optional
        The acceleration of the body, whose mass resists it: the load is minus the density times it.
    spin : pair of three numbers each, optional
        The angular velocity, in radians per time, and a point on the axis: ((0, 0, 314), (0, 0, 0)).
    force : three entries, optional
        The former name of `body_force`.

    Raises
    ------
    ExpressionError
        For a formula that is refused.
    ValueError
        Where data cannot be known or do not fit.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> body = iga_nn.Elasticity(exact=("x*y", "0", "z"), young=210.0, traction={"u1": None})
    >>> iga_nn.solve(benchmark_volume(2), body).report.l2_relative < 1e-2
    True
    """

    exact: Data | None = None
    body_force: Data | None = None
    displacement: Data | None = None
    traction: OnFaces = field(default_factory=dict)
    young: float | Mapping[Owner, float] = 1.0
    poisson_ratio: float | Mapping[Owner, float] = 0.3
    _: KW_ONLY
    conditions: Sequence[Condition] = ()  # type: ignore[assignment]  # a tuple once the problem is made
    fix: GivenRegions | None = None
    roller: GivenRegions | None = None
    symmetry: GivenRegions | None = None
    load: GivenRegions | None = None
    pressure: GivenRegions | None = None
    turn: GivenRegions | None = None
    spring: GivenRegions | None = None
    total_spring: GivenRegions | None = None
    foundation: GivenRegions | None = None
    hydrostatic: GivenRegions | None = None
    total_force: GivenRegions | None = None
    moment: GivenRegions | None = None
    remote_force: GivenRegions | None = None
    bearing: GivenRegions | None = None
    density: float | Mapping[Owner, float] | None = None
    gravity: Sequence[float] | None = None
    acceleration: Sequence[float] | None = None
    spin: tuple[Sequence[float], Sequence[float]] | None = None
    force: Data | None = None

    components = 3
    constant = True
    labels: ClassVar = {"source": "body_force", "boundary": "displacement", "neumann": "traction"}
    keywords: ClassVar = OF_BODIES

    def __post_init__(self) -> None:
        for young in _values(self.young):
            if not (isinstance(young, Real) and SMALLEST <= young <= LARGEST):
                raise ValueError(f"young must be a positive number from {SMALLEST:g} to {LARGEST:g}, got {young!r:.80}")
        for ratio in _values(self.poisson_ratio):
            if not (isinstance(ratio, Real) and -1.0 < ratio < 0.5):
                raise ValueError(f"poisson_ratio must lie between -1 and 1/2, got {ratio!r:.80}")
        self._read_keywords()
        if self.force is not None:
            if self.body_force is not None:
                raise ValueError("force is the former name of body_force: give body_force alone")
            self._assign(body_force=self.force, force=None)
        is_loaded = self.displacement is not None or bool(self.traction) or bool(self.conditions)
        mass = self.density, self.gravity, self.acceleration, self.spin
        force = with_inertia(self.body_force, *mass, has_exact=self.exact is not None)
        force = NONE if force is None and self.exact is None and is_loaded else force
        self._set({"exact": self.exact, "source": force}, self.displacement, self.traction)

    def demand_held(self) -> None:
        """Raise ValueError where traction on all six faces leaves the body free to move."""
        if not self.dirichlet and not self.conditions:
            raise ValueError("traction on all six faces leaves the body free to move: leave one face to displacement")

    @staticmethod
    def lame(first: float, shear: float) -> dict[str, float]:
        """Return `young` and `poisson_ratio`, as keywords, from Lame's constants lambda (`first`) and mu (`shear`)."""
        if not (shear > 0.0 and 3.0 * first + 2.0 * shear > 0.0):
            raise ValueError(f"Lame's constants must have mu > 0 and 3 lambda + 2 mu > 0, got {first} and {shear}")
        total = first + shear
        return {"young": shear * (3.0 * first + 2.0 * shear) / total, "poisson_ratio": first / (2.0 * total)}

    @property
    def constants(self) -> tuple[float, float]:
        """Return Lame's constants lambda and mu; where they are given by patch or solid, those of the first."""
        young, nu = _values(self.young)[0], _values(self.poisson_ratio)[0]
        return young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu))

    @property
    def by_patch(self) -> dict[str, Collection[Owner]]:
        """Return the patches or solids for which data are given one by one, by the name of the datum."""
        given = {name: getattr(self, name) for name in ("young", "poisson_ratio")}
        return super().by_patch | {name: own.keys() for name, own in given.items() if isinstance(own, Mapping)}

    def of_patch(self, patch: int, solid: str = "") -> Self:
        """Return the problem with the data and the material of a patch and its solid."""
        own = {name: entry_of(getattr(self, name), patch, solid) for name in ("young", "poisson_ratio")}
        return super().of_patch(patch, solid)._assign(**own)

    @property
    def in_volume(self) -> Hashable:
        """Return what the law and its data in the volume are made of: the same for patches where they are the same."""
        return super().in_volume, self.constants

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the stress sigma (3, 3, ...): 2 mu eps - p I, p the pressure of the points x or -lambda div u."""
        lam, mu = self.constants
        stress = grad + np.swapaxes(grad, 0, 1)
        stress *= mu
        known = getattr(x, "pressure", None)
        pull = lam * (grad[0, 0] + grad[1, 1] + grad[2, 2]) if known is None else -known
        for i in range(3):
            stress[i, i] += pull
        return stress

    def without_volume(self) -> Self:
        """Return the law 2 mu eps, which a pressure completes; its data are those of this law."""
        return copy(self)._assign(young=2.0 * self.constants[1], poisson_ratio=0.0)

    @property
    def caveat(self) -> str:
        """Return why a nearly incompressible body is hard to solve and its error not estimated; "" for other bodies."""
        nu = max(_values(self.poisson_ratio))
        return (
            f"Poisson's ratio {nu:g} is near 1/2, where a body hardly changes its volume" if nu > NEARLY_RIGID else ""
        )

    def free_motions(self, x: Array) -> Array:
        """Return the six rigid motions (6, 3, m) of a body: along x, y, z, and about x, y, z."""
        shifts = np.eye(3)[:, :, None] * np.ones(x.shape[1])
        turns = [np.cross(axis, x, axisb=0).T for axis in np.eye(3)]
        return np.concatenate([shifts, np.stack(turns)])

    @property
    def quantities(self) -> Mapping[str, Quantity]:
        """Return the quantities of a solution by name.

        Beside those of every law these are strain and stress (3, 3, ...), von Mises' stress (...), the pressure
        (...), which is minus a third of the stresses' sum, the principal stresses (3, ...), and the first and the third
        principal stress (...).
        """
        return {
            **super().quantities,
            "strain": lambda u, grad, x: 0.5 * (grad + np.swapaxes(grad, 0, 1)),
            "stress": self.flux,
            "von_mises": lambda u, grad, x: von_mises(self.flux(u, grad, x)),
            "pressure": lambda u, grad, x: -np.trace(self.flux(u, grad, x)) / 3.0,
            "principal": lambda u, grad, x: principal(self.flux(u, grad, x)),
            "first_principal": lambda u, grad, x: outer_principal(self.flux(u, grad, x))[0],
            "third_principal": lambda u, grad, x: outer_principal(self.flux(u, grad, x))[1],
        }

    @property
    def reported(self) -> tuple[str, ...]:
        """Return the names: the displacement's length, von Mises' stress, the first and the third principal stress."""
        return ("magnitude", "von_mises", "first_principal", "third_principal")

    def symbol(self, wave: Array, x: Array) -> Array:
        """Return mu (k . k), the factor of shear waves, which is the least factor, for wave vectors k (3, ...)."""
        found: Array = self.constants[1] * (wave * wave).sum(axis=0)
        return found


def _values(material: float | Mapping[Owner, float]) -> list[float]:
    """Return a number of the material as a list, or the numbers of the patches or solids."""
    return list(material.values()) if isinstance(material, Mapping) else [material]


def von_mises(stress: Array) -> Array:
    """Return von Mises' equivalent stress (...) of a stress tensor (3, 3, ...): sqrt(3/2 s : s), s its deviator."""
    deviator = stress - _mean_pressure(stress)
    return np.asarray(np.sqrt(1.5 * (deviator * deviator).sum(axis=(0, 1))))


def principal(stress: Array) -> Array:
    """Return the principal stresses (3, ...) of a stress tensor (3, 3, ...), the largest first."""
    values = np.linalg.eigvalsh(np.moveaxis(stress, (0, 1), (-2, -1)))
    return np.asarray(np.moveaxis(values[..., ::-1], -1, 0), dtype=np.float64)


def outer_principal(stress: Array) -> Array:
    """Return the largest and the smallest principal stress (2, ...) of a symmetric stress tensor (3, 3, ...).

    They follow from the cosines of the characteristic polynomial's angle: `principal` takes ten times as long. Where
    two principal stresses are equal, the results are accurate to 1e-8 of the deviator.
    """
    mean = (stress[0, 0] + stress[1, 1] + stress[2, 2]) / 3.0
    xx, yy, zz = (stress[i, i] - mean for i in range(3))
    xy, xz, yz = stress[0, 1], stress[0, 2], stress[1, 2]
    size = np.sqrt((xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    cube = np.where(size > 0.0, size, 1.0) ** 3
    angle = np.arccos(np.clip(determinant / (2.0 * cube), -1.0, 1.0)) / 3.0
    return np.stack([mean + 2.0 * size * np.cos(angle), mean + 2.0 * size * np.cos(angle + 2.0 * np.pi / 3.0)])


def _mean_pressure(stress: Array) -> Array:
    """Return a third of the trace times the unit tensor, (3, 3, ...)."""
    third = (stress[0, 0] + stress[1, 1] + stress[2, 2]) / 3.0
    return np.multiply.outer(np.eye(3), third)
