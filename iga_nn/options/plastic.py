"""Holds the options of plasticity for small strains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ..errors import InputError
from .load_steps import LoadStepOptions
from .materials import POISSON_RATIO, YOUNG, MaterialOptions, Unstated, demand_unstated, materials_of, of_all
from .problem import Formula, Row, Sheet, Units  # noqa: F401  # Formula is in the annotations of the base class
from .texts import numbers

if TYPE_CHECKING:
    from solve import Material
    from solve.forms.plasticity import Plasticity

OF_LIBRARY = ("young", "poisson_ratio", "yield_strength")
YIELD_STRENGTH = Unstated(1.0)
GIVEN = (*OF_LIBRARY, "hardening")


@dataclass(frozen=True)
class PlasticOptions(LoadStepOptions):
    """State a body that yields by von Mises' condition and hardens, for small strains, and its load steps.

    Attributes:
        material: material of the library by its name, such as steel (`iga-nn materials` lists them), in place of young,
            poisson_ratio and yield_strength; of several solids also one for each, "body: steel, pad: aluminium".
        young: Young's modulus E; of several solids also one for each by its name, "steel: 210000, pad: 8", and of
            several patches "p0: 210, p1: 70".
        poisson_ratio: Poisson's ratio nu, as young.
        yield_strength: stress at which a rod in tension yields, as young.
        hardening: slope of the yield stress over the plastic strain, as young; 0 is perfect plasticity.
        quadrature: "gauss+1", degree + 1 Gauss points a span, or "gauss", degree points a span; they keep the plastic
            strain, and "spline", whose points are too few for that, stands for "gauss+1".

    Examples:
        >>> import iga_nn
        >>> iga_nn.PlasticOptions(yield_strength=235.0, fix=("u0",), load=("u1=1;0;0",)).problem().yield_strength
        235.0
    """

    material: str | None = None
    young: float | str = YOUNG
    poisson_ratio: float | str = POISSON_RATIO
    yield_strength: float | str = YIELD_STRENGTH
    hardening: float | str = 0.0
    quadrature: Literal["spline", "gauss", "gauss+1"] = "gauss+1"

    section: ClassVar[str] = "plastic"
    title: ClassVar[str] = "plasticity"
    sheet: ClassVar[Sheet] = Sheet(
        "a body that yields",
        "−div σ = f, J2 plasticity, small strains. Click a face of the part for its region; the rest is free.",
        (
            ("material", "Material by name, such as steel", "none"),
            ("young", "Young's modulus E", "1"),
            ("poisson_ratio", "Poisson's ratio ν", "0.3"),
            ("yield_strength", "Yield stress", "1"),
            ("hardening", "Hardening, slope over the plastic strain", "0"),
            ("body_force", "Force per volume, three formulas", "0;0;0"),
            ("stress_unit", "Unit of stresses, such as MPa", "none"),
        ),
        {
            "material": "material",
            "young": "E",
            "poisson_ratio": "ν",
            "yield_strength": "σy",
            "hardening": "H",
            "body_force": "f",
        },
    )

    @classmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the equation with the material and the force."""
        given = [section.get(name, getattr(cls, name)) for name in GIVEN]
        said = [f"{value:g}" if isinstance(value, float | int) else value for value in given]
        material = "Young's modulus E = {}, Poisson's ratio ν = {}, yield strength σy = {}".format(*said)
        return [
            ("equation", "−∇·σ = f, von Mises stress at most σy + H α, α the equivalent plastic strain; small strains"),
            *MaterialOptions.material_rows({"materials": section.get("materials", ())}),
            *([] if section.get("materials") else [("material", material)]),
            ("hardening H", said[-1]),
            ("force f per volume", section.get("body_force", "")),
        ]

    @property
    def units(self) -> Units:
        """Return the units for colour bars; those of a material where none are given."""
        if self.material is None:
            return super().units
        first = next(iter(self._materials.values()))
        return Units(first.unit, self.stress_unit or first.stress_unit)

    def values(self, *left_out: str) -> dict[str, Any]:
        """Return the options by name, with the units and the numbers of materials."""
        found = super().values(*left_out)
        if self.material is None:
            return found
        own = {"unit": self.units.displacement, "stress_unit": self.units.stress}
        numbers = [one.as_dict() for one in self._materials.values()]
        own = {name: unit for name, unit in own.items() if name in found} | dict.fromkeys(OF_LIBRARY)
        return {**found, **own, "materials": numbers}

    def density_given(self) -> Any:
        """Return the density, or that of each patch or solid; by default that of the material. Raises InputError."""
        if self.material is None or self.density is not None:
            return super().density_given()
        return of_all({who: one.density for who, one in self._materials.items()})

    @property
    def _materials(self) -> dict[Any, Material]:
        """Return the material of each solid or patch; of all of them by the key None. Raises InputError."""
        return materials_of(self.material, self.unit, self.stress_unit)

    def of_material(self, **data: Any) -> Plasticity:
        """Return the problem of supports and loads with its material. Raises InputError."""
        from solve.forms.plasticity import Plasticity

        given = {name: numbers(f"--{name.replace('_', '-')}", getattr(self, name)) for name in GIVEN}
        return Plasticity(**given | self._of_library(), **data)

    def _of_library(self) -> dict[str, Any]:
        """Return the numbers of a material by its name. Raises InputError where it does not yield."""
        if self.material is None:
            return {}
        demand_unstated(self, OF_LIBRARY)
        found = self._materials
        for one in found.values():
            if not isinstance(one.young, float) or one.yield_strength is None:
                raise InputError(f"--material {one.name}: has no yield strength, or differs along its axes")
        return {name: of_all({who: getattr(one, name) for who, one in found.items()}) for name in OF_LIBRARY}
