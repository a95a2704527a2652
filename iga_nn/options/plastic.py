"""Holds the options of plasticity for small strains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from .load_steps import LoadStepOptions
from .problem import Formula, Row, Sheet  # noqa: F401  # Formula is in the annotations of the base class
from .texts import numbers

if TYPE_CHECKING:
    from solve.forms.plasticity import Plasticity

GIVEN = ("young", "poisson_ratio", "yield_stress", "hardening")


@dataclass(frozen=True)
class PlasticOptions(LoadStepOptions):
    """State a body that yields by von Mises' condition and hardens, for small strains, and its load steps.

    Attributes:
        young: Young's modulus E; of several solids also one for each by its name, "steel: 210000, pad: 8", and of
            several patches "p0: 210, p1: 70".
        poisson_ratio: Poisson's ratio nu, as young.
        yield_stress: stress at which a rod in tension yields, as young.
        hardening: slope of the yield stress over the plastic strain, as young; 0 is perfect plasticity.
        quadrature: "gauss+1", degree + 1 Gauss points a span, or "gauss", degree points a span; they keep the plastic
            strain, and "spline", whose points are too few for that, stands for "gauss+1".

    Examples:
        >>> import iga_nn
        >>> iga_nn.PlasticOptions(yield_stress=235.0, fix=("u0",), load=("u1=1;0;0",)).problem().yield_stress
        235.0
    """

    young: float | str = 1.0
    poisson_ratio: float | str = 0.3
    yield_stress: float | str = 1.0
    hardening: float | str = 0.0
    quadrature: Literal["spline", "gauss", "gauss+1"] = "gauss+1"

    section: ClassVar[str] = "plastic"
    title: ClassVar[str] = "plasticity"
    sheet: ClassVar[Sheet] = Sheet(
        "a body that yields",
        "−div σ = f, J2 plasticity, small strains. Click a face of the part for its region; the rest is free.",
        (
            ("young", "Young's modulus E", "1"),
            ("poisson_ratio", "Poisson's ratio ν", "0.3"),
            ("yield_stress", "Yield stress", "1"),
            ("hardening", "Hardening, slope over the plastic strain", "0"),
            ("body_force", "Force per volume, three formulas", "0;0;0"),
            ("stress_unit", "Unit of stresses, such as MPa", "none"),
        ),
        {"young": "E", "poisson_ratio": "ν", "yield_stress": "σy", "hardening": "H", "body_force": "f"},
    )

    @classmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the equation with the material and the force."""
        given = [section.get(name, getattr(cls, name)) for name in GIVEN]
        said = (f"{value:g}" if isinstance(value, float | int) else value for value in given)
        material = "Young's modulus E = {}, Poisson's ratio ν = {}, yield stress σy = {}, hardening H = {}"
        return [
            ("equation", "−∇·σ = f, von Mises stress at most σy + H α, α the equivalent plastic strain; small strains"),
            ("material", material.format(*said)),
            ("force f per volume", section.get("body_force", "")),
        ]

    def law(self, **data: Any) -> Plasticity:
        """Return the law with its supports and loads. Raises ValueError."""
        from solve.forms.plasticity import Plasticity

        given = {name: numbers(f"--{name.replace('_', '-')}", getattr(self, name)) for name in GIVEN}
        return Plasticity(**given, **data)
