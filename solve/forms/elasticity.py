"""Defines Elasticity: -div sigma(u) = f for an elastic body, with displacement or traction on each face."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import KW_ONLY, dataclass, field
from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike

from .axes import PARAMETERS, Tangents, frame
from .boundary_value_problem import BoundaryValueProblem
from .conditions import OF_BODIES, Condition, GivenRegions, OnFaces
from .data import NOT_SMOOTH, ByPatch, Data, Datum, PerPatch, parse
from .form import Quantity
from .hooke import Axes, Hooke, Lame
from .inertia import with_inertia
from .library import material as of_library
from .material import Constants, Material
from .owners import Owner, entry_of
from .problem import LawWithData
from .stresses import outer_principal, principal, von_mises

NONE = ("0", "0", "0")  # of a vector


NEARLY_RIGID = 0.45  # Poisson's ratio from which on the estimate of the error was 30 to 500 times too large
MOST_SAFE = 1e6  # the largest safety that is told: that of no stress, and of solids without a yield strength
CONSTANTS = ("young", "poisson_ratio", "shear_modulus", "expansion", "yield_strength")  # of a material
AXES = ("first_axis", "second_axis")
ALONG_X, ALONG_Y = (parse(name, axis, 3) for name, axis in zip(AXES, (("1", "0", "0"), ("0", "1", "0")), strict=True))


@dataclass(frozen=True)
class Elasticity(LawWithData):
    """Linear elasticity of a body: -div sigma = f, sigma = lambda div(u) I + mu (grad u + grad u^T).

    An orthotropic material has sigma = C : eps; thermal strain is subtracted from eps in both.

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
        Three numbers E1, E2, E3 are those of an orthotropic material.
    poisson_ratio : float
        -1 < nu < 1/2, or a dictionary as `young`. `lame` converts from lambda and mu. Of an orthotropic material nu12,
        nu13, nu23; nu12 is the contraction along axis 2 of a pull along axis 1.
    conditions : sequence of conditions such as Fix or Load, optional
        Supports and loads on regions of the boundary. Where a region is given, the rest of the boundary is free, or has
        the traction of `exact`; `displacement` and `traction` are left out then.
    fix, roller, symmetry, turn, rigid, spring, total_spring, foundation : dict of region to data, optional
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
    material : str or Material, optional
        A material of `iga_nn.material` by its name, or one of your own, in place of its constants; or a dictionary as
        `young`. Lengths are millimetres and stresses MPa then, unless the material is in metres.
    shear_modulus : three float, optional
        G12, G13, G23 of an orthotropic material, or a dictionary as `young`.
    first_axis, second_axis : "u", "v", "w" or three entries, optional
        The material's axis 1, and a vector towards axis 2, in space: a parameter stands for the direction of its lines.
        By default x and y; a first axis alone serves where the material is the same all around it.
    expansion : float or three, optional
        Thermal strain per kelvin, or three along the axes; or a dictionary as `young`.
    temperature_change : entry, optional
        The temperature above that without thermal strain; a field as of a heat problem's solution, too.
    yield_strength : float, optional
        The stress that `safety` divides by von Mises' stress, or a dictionary as `young`, None for a solid without one.
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
    young: Constants | Mapping[Owner, Constants] = 1.0
    poisson_ratio: Constants | Mapping[Owner, Constants] = 0.3
    _: KW_ONLY
    conditions: Sequence[Condition] = ()  # type: ignore[assignment]  # a tuple once the problem is made
    fix: GivenRegions | None = None
    roller: GivenRegions | None = None
    symmetry: GivenRegions | None = None
    load: GivenRegions | None = None
    pressure: GivenRegions | None = None
    turn: GivenRegions | None = None
    rigid: GivenRegions | None = None
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
    material: str | Material | Mapping[Owner, str | Material] | None = None
    shear_modulus: Constants | Mapping[Owner, Constants | None] | None = None
    first_axis: PerPatch | None = None
    second_axis: PerPatch | None = None
    expansion: Constants | Mapping[Owner, Constants | None] | None = None
    temperature_change: PerPatch | None = None
    yield_strength: float | Mapping[Owner, float | None] | None = None
    force: Data | None = None

    hooke: Hooke = field(init=False, repr=False, compare=False)  # of several solids, that of the first

    components = 3
    _is_by_material: ClassVar[bool] = False  # whether constants are those of a material for each solid
    labels: ClassVar = {"source": "body_force", "boundary": "displacement", "neumann": "traction"}
    keywords: ClassVar = OF_BODIES

    def __post_init__(self) -> None:
        self._read_material()
        self._read_keywords()
        if self.force is not None:
            if self.body_force is not None:
                raise ValueError("force is the former name of body_force: give body_force alone")
            self._assign(body_force=self.force, force=None)
        is_loaded = self.displacement is not None or bool(self.traction) or bool(self.conditions)
        mass = self.density, self.gravity, self.acceleration, self.spin
        force = with_inertia(self.body_force, *mass, has_exact=self.exact is not None)
        force = NONE if force is None and self.exact is None and is_loaded else force
        given = {"exact": self.exact, "source": force, "temperature_change": self.temperature_change}
        vectors = {role: getattr(self, role) for role in AXES if role not in self._along_parameters}
        self._assign(data={})
        self._assign(hooke=self._first_hooke())
        self._set(given | vectors, self.displacement, self.traction, temperature_change=1, first_axis=3, second_axis=3)
        self._assign(hooke=self._first_hooke())  # along its axes, which are data

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
    def constants(self) -> Lame:
        """Return Lame's constants lambda and mu; where they are given by patch or solid, those of the first.

        Of an orthotropic material they are those of the nearest isotropic one.
        """
        return self.hooke.lame

    def _read_material(self) -> None:
        """Turn materials into their constants, and numbers in a row into tuples.

        Raises ValueError for a material beside constants of its own, and for thermal data without the other one.
        """
        if self.material is not None:
            if beside := [name for name in CONSTANTS if getattr(self, name) != getattr(Elasticity, name)]:
                raise ValueError(f"material and {beside[0]}: give one of them, the material has its own {beside[0]}")
            owners = self.material if isinstance(self.material, Mapping) else {None: self.material}
            found = {who: own if isinstance(own, Material) else of_library(own) for who, own in owners.items()}
            if len(units := {own.unit for own in found.values()}) > 1:
                raise ValueError(f"material: the solids' units differ, {' and '.join(sorted(units))}: use in_unit")
            for name in CONSTANTS:
                own = {who: getattr(one, name) for who, one in found.items()}
                self._assign(**{name: own if isinstance(self.material, Mapping) else own[None]})
            if self.density is None:
                mass = {who: one.density for who, one in found.items()}
                self._assign(density=mass if isinstance(self.material, Mapping) else mass[None])
            self._assign(material=None, _is_by_material=isinstance(self.material, Mapping))
        for name in CONSTANTS[:-1]:
            given = getattr(self, name)
            by_owner = {who: _row(own) for who, own in given.items()} if isinstance(given, Mapping) else _row(given)
            self._assign(**{name: by_owner})
        if self.temperature_change is not None and all(own in (None, 0.0) for own in _values(self.expansion)):
            raise ValueError("temperature_change needs the material's thermal strain per kelvin: give expansion=12e-6")
        for strength in _values(self.yield_strength):
            if strength is not None and not 0.0 < strength < np.inf:
                raise ValueError(f"yield_strength must be a positive number, got {strength!r:.80}")

    @property
    def _along_parameters(self) -> dict[str, str]:
        """Return the axes that are given as parameters of the map."""
        given = {role: getattr(self, role) for role in AXES}
        return {role: own for role, own in given.items() if isinstance(own, str) and own in PARAMETERS}

    def _first_hooke(self) -> Hooke:
        """Return the law of a patch, or of the first one where several are given. Raises ValueError for any of them."""
        every = [getattr(self, name) for name in CONSTANTS[:-1]]
        owners = {who: None for own in every if isinstance(own, Mapping) for who in own}
        each = _of_owners(every, owners)
        found = [Hooke(young, nu, shear, growth, self._fixed_axes) for young, nu, shear, growth in each]
        for hooke in found:
            if hooke.shear_modulus is not None and self.first_axis is not None and self.second_axis is None:
                hooke.demand_the_same_across()
        return found[0]

    @property
    def _fixed_axes(self) -> Axes | None:
        """Return the axes where they are the same at all points, and other ones than x, y, z; otherwise None."""
        if self.first_axis is None and self.second_axis is None or self._axes_change:
            return None
        rows = self._axes_at(np.zeros((3, 1)))
        return tuple(tuple(float(np.ravel(entry)[0]) for entry in row) for row in rows)  # type: ignore[return-value]

    @property
    def _axes_change(self) -> bool:
        """Return whether the axes of the material may differ from point to point, or from patch to patch."""
        data = [self.data[role] for role in AXES if role in self.data]
        fixed = [not isinstance(own, ByPatch) and own.is_constant for own in data]
        return bool(self._along_parameters) or not all(fixed)

    def _axes_at(self, x: Any) -> Any:
        """Return the axes, three rows of entries (...), at points x (3, ...) or at jets of points."""
        first = self.data.get("first_axis", ALONG_X)
        default = ALONG_Y if "first_axis" not in self.data else None
        return frame(first, self.data.get("second_axis", default), x)

    def _moving_axes(self, x: Any) -> Any:
        """Return the axes at points; None where the law knows them, or needs none."""
        return self._axes_at(x) if self._turns else None

    @property
    def _turns(self) -> bool:
        return not self.hooke.is_isotropic and self._axes_change

    @property
    def constant(self) -> bool:  # type: ignore[override]
        """Return whether the stiffness is the same at all points of a patch."""
        return not self._turns

    @property
    def by_patch(self) -> dict[str, Collection[Owner]]:
        """Return the patches or solids for which data are given one by one, by the name of the datum."""
        given = {name: getattr(self, name) for name in CONSTANTS}
        owners = {name: own.keys() for name, own in given.items() if isinstance(own, Mapping)}
        if self._is_by_material and owners:
            owners = {"material": next(iter(owners.values()))}
        return super().by_patch | owners

    def on(self, body: BodyLike) -> Self:
        """Return the same problem on a body, along whose parameters the axes of a material may be."""
        if not self._along_parameters:
            return super().on(body)
        others = {role: own for role, own in self.data.items() if role not in self._along_parameters}
        found = BoundaryValueProblem.on(copy(self)._assign(data=others), body)
        lines = {role: Datum(role, (Tangents.of(body, own),), 3) for role, own in self._along_parameters.items()}
        return copy(found)._assign(data={**found.data, **lines})

    def of_patch(self, patch: int, solid: str = "") -> Self:
        """Return the problem with the data and the material of a patch and its solid."""
        own = {name: entry_of(getattr(self, name), patch, solid) for name in CONSTANTS}
        if isinstance(self.yield_strength, Mapping) and own["yield_strength"] is None:
            own["yield_strength"] = np.inf
        found = super().of_patch(patch, solid)._assign(**own)
        return found._assign(hooke=found._first_hooke())

    @property
    def in_volume(self) -> Hashable:
        """Return what the law and its data in the volume are made of: the same for patches where they are the same."""
        return super().in_volume, self.hooke, self.yield_strength if not isinstance(self.yield_strength, Mapping) else 0

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the stress sigma (3, 3, ...) without its thermal part.

        Of an isotropic material it is 2 mu eps - p I, p the pressure of the points x or -lambda div u.
        """
        return self.hooke.stress(grad, getattr(x, "pressure", None), self._moving_axes(x))

    @property
    def has_initial_flux(self) -> bool:
        """Return whether the body has thermal stress."""
        return "temperature_change" in self.data

    def initial_flux(self, x: Any) -> Any:
        """Return the stress (3, 3, ...) of a body at rest, which holds its thermal strain back."""
        change = self.data["temperature_change"].at(x)[0]
        return -self.hooke.of_change(self.hooke.hold, change, self._moving_axes(x))

    def energy(self, u: Any, grad: Any, x: Any) -> Any:
        """Return half of stress : (strain - thermal strain), (...)."""
        if not self.has_initial_flux:
            return super().energy(u, grad, x)
        change = self.data["temperature_change"].at(x)[0]
        growth = self.hooke.of_change(self.hooke.growth, change, self._moving_axes(x))
        return 0.5 * (self.whole_flux(u, grad, x) * (grad - growth)).sum(axis=(0, 1))

    @property
    def not_differentiable(self) -> str:
        """Return why the derivatives of the temperature or of the axes are unknown; "" where they are known."""
        for role in ("temperature_change", *AXES):
            if role in self._along_parameters:
                return f"{role} is along a parameter, whose derivatives are not taken"
            if role in self.data and not self.data[role].is_formula:
                return f"{role} is {NOT_SMOOTH}"
        return super().not_differentiable

    @property
    def loads(self) -> list[str]:
        """Return the names of what acts on the body."""
        return [*super().loads, *(["temperature_change"] if self.has_initial_flux else [])]

    def without_volume(self) -> Self:
        """Return the law 2 mu eps, which a pressure completes; its data are those of this law."""
        return copy(self)._assign(hooke=self.hooke.without_volume())

    @property
    def caveat(self) -> str:
        """Return why a nearly incompressible body is hard to solve and its error not estimated; "" for other bodies."""
        nu = max((own for own in _values(self.poisson_ratio) if isinstance(own, float)), default=0.0)
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
        principal stress (...). With a yield strength there is its quotient by von Mises' stress, the safety (...).
        """
        return {
            **super().quantities,
            "strain": lambda u, grad, x: 0.5 * (grad + np.swapaxes(grad, 0, 1)),
            "stress": self.whole_flux,
            "von_mises": lambda u, grad, x: von_mises(self.whole_flux(u, grad, x)),
            "pressure": lambda u, grad, x: -np.trace(self.whole_flux(u, grad, x)) / 3.0,
            "principal": lambda u, grad, x: principal(self.whole_flux(u, grad, x)),
            "first_principal": lambda u, grad, x: outer_principal(self.whole_flux(u, grad, x))[0],
            "third_principal": lambda u, grad, x: outer_principal(self.whole_flux(u, grad, x))[1],
            **({} if self.yield_strength is None else {"safety": self._safety}),
        }

    def _safety(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the yield strength over von Mises' stress (...), up to MOST_SAFE."""
        strength = float(_values(self.yield_strength)[0] or np.inf)
        equivalent = von_mises(self.whole_flux(u, grad, x))
        with np.errstate(over="ignore"):  # of a body at rest
            return np.minimum(MOST_SAFE, strength / np.maximum(equivalent, np.finfo(float).tiny))

    @property
    def reported(self) -> tuple[str, ...]:
        """Return the names: the displacement's length, von Mises' stress, the outer principal stresses."""
        more = () if self.yield_strength is None else ("safety",)
        return ("magnitude", "von_mises", "first_principal", "third_principal", *more)

    def symbol(self, wave: Array, x: Array) -> Array:
        """Return the least factor (...) for wave vectors k (3, ...); of an isotropic body mu (k . k)."""
        if not self.hooke.is_isotropic:
            return super().symbol(wave, x)
        found: Array = self.constants[1] * (wave * wave).sum(axis=0)
        return found


def _values(given: Any) -> list[Any]:
    """Return a constant of the material as a list, or the constants of the patches or solids."""
    return list(given.values()) if isinstance(given, Mapping) else [given]


def _row(given: Any) -> Any:
    """Return three numbers as a tuple, and one number, or None, as it is."""
    return tuple(given) if isinstance(given, Sequence) and not isinstance(given, str) else given


def _of_owners(every: Sequence[Any], owners: Mapping[Owner, None]) -> Iterator[list[Any]]:
    """Yield the constants of each patch or solid that all dictionaries name; of none, the constants themselves."""
    if not owners:
        yield list(every)
    for who in owners:
        if all(who in own for own in every if isinstance(own, Mapping)):
            yield [own[who] if isinstance(own, Mapping) else own for own in every]
