"""Holds the options of hyperelastic laws for large strains."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ..errors import InputError
from .load_steps import LoadStepOptions
from .problem import Formula, Row, Sheet  # noqa: F401  # Formula is in the annotations of the base class

if TYPE_CHECKING:
    from solve.forms.hyperelasticity import Hyperelastic

Name = Literal["neo-hookean", "mooney-rivlin", "yeoh"]
NUMBERS = {  # of each law, with the volumetric one last
    "neo-hookean": ("shear", "bulk"),
    "mooney-rivlin": ("c10", "c01", "bulk"),
    "yeoh": ("c10", "c20", "c30", "bulk"),
}
ENERGIES = {
    "neo-hookean": "W = μ/2 (Ī₁ − 3) + K/2 (J − 1)²",
    "mooney-rivlin": "W = c10 (Ī₁ − 3) + c01 (Ī₂ − 3) + K/2 (J − 1)²",
    "yeoh": "W = c10 (Ī₁ − 3) + c20 (Ī₁ − 3)² + c30 (Ī₁ − 3)³ + K/2 (J − 1)²",
}


@dataclass(frozen=True)
class FiniteOptions(LoadStepOptions):
    """State an elastic body under large strains, such as rubber, and its load steps; loads are dead.

    Attributes:
        law: "neo-hookean" of --shear and --bulk, "mooney-rivlin" of --c10, --c01 and --bulk, or "yeoh" of --c10,
            --c20, --c30 and --bulk; docs/nonlinear.md has their energies.
        shear: shear modulus of neo-hookean.
        bulk: bulk modulus, the factor of the change of volume; about 1000 times the shear modulus for rubber;
            with more the load steps may end early.
        c10: first constant of mooney-rivlin and of yeoh.
        c01: second constant of mooney-rivlin.
        c20: second constant of yeoh.
        c30: third constant of yeoh.

    Examples:
        >>> import iga_nn
        >>> options = iga_nn.FiniteOptions(shear=0.5, bulk=50.0, fix=("u0",), load=("u1=0.1;0;0",))
        >>> options.problem().bulk
        50.0
    """

    law: Name = "neo-hookean"
    shear: float = 1.0
    bulk: float = 100.0
    c10: float = 0.0
    c01: float = 0.0
    c20: float = 0.0
    c30: float = 0.0

    section: ClassVar[str] = "finite"
    title: ClassVar[str] = "large strains"
    sheet: ClassVar[Sheet] = Sheet(
        "a body of rubber",
        "−div P = f, neo-Hookean, large strains. Click a face of the part for its region; the rest is free.",
        (
            ("shear", "Shear modulus μ", "1"),
            ("bulk", "Bulk modulus K", "100"),
            ("body_force", "Force per volume, three formulas", "0;0;0"),
            ("stress_unit", "Unit of stresses, such as MPa", "none"),
        ),
        {"shear": "μ", "bulk": "K", "body_force": "f"},
    )

    @classmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the energy with the material and the force."""
        name = section.get("law", cls.law)
        said = ", ".join(f"{one} = {section.get(one, getattr(cls, one)):g}" for one in NUMBERS[name])
        return [
            ("equation", f"−∇·P = f, P = ∂W/∂F, F = I + ∇u, {ENERGIES[name]}"),
            ("material", f"{name}, {said}"),
            ("force f per volume", section.get("body_force", "")),
        ]

    def of_material(self, **data: Any) -> Hyperelastic:
        """Return the problem of supports and loads with its law. Raises InputError for numbers of another law."""
        from solve.forms.hyperelasticity import MooneyRivlin, NeoHookean, Yeoh

        laws: dict[str, type[Hyperelastic]]
        laws = {"neo-hookean": NeoHookean, "mooney-rivlin": MooneyRivlin, "yeoh": Yeoh}
        own = NUMBERS[self.law]
        for name in dict.fromkeys(one for numbers in NUMBERS.values() for one in numbers):
            if name not in own and getattr(self, name) != getattr(type(self), name):
                raise InputError(f"--{name}: {self.law} has {', '.join(f'--{one}' for one in own)} alone")
        return laws[self.law](**{name: getattr(self, name) for name in own}, **data)
