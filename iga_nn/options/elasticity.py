"""Holds the options of linear elasticity."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ..errors import InputError, input_errors
from . import texts
from .bodies import BodyOptions
from .materials import MaterialOptions
from .problem import Formula, Row, Sheet
from .space_check import check_space

if TYPE_CHECKING:
    from solve import Elasticity, SolveOptions

MOST_ITERATIONS = 3000  # of an elastic body; a bracket held at one end takes 680, and some 1600 after a refinement


@dataclass(frozen=True)
class ElasticityOptions(MaterialOptions):
    """State linear elasticity of the volume, and the meshes it is solved on.

    A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and so on. A vector is three formulas in x, y, z
    or X, Y, Z (scaled to volume 1 about the middle), separated by semicolons, in quotes: "x*y;0;sin(z)"; 0 is the zero
    vector.

    Attributes:
        exact: exact displacement, a vector, from which force and boundary data follow; errors are reported. A vector
            that starts with a minus is written --exact="-x;0;0".
        displacement: displacement on the faces without traction, a vector; zero where neither it nor exact is given.
        traction: faces where a traction is given, each as "FACE=VECTOR", FACE=0 for a face that is free, or FACE for
            the traction of the exact solution.
        formulation: "mixed" solves for displacement and pressure, as bodies that hardly change their volume need,
            "displacement" for the displacement alone; by default mixed where Poisson's ratio exceeds 0.45.

    Examples:
        >>> import iga_nn
        >>> iga_nn.ElasticityOptions(body_force="0;0;-1", young=210.0).problem().body_force
        ['0', '0', '-1']
    """

    displacement: Formula | None = None
    traction: tuple[str, ...] = ()
    formulation: Literal["mixed", "displacement"] | None = None

    section: ClassVar[str] = "elasticity"
    title: ClassVar[str] = "linear elasticity"
    on_faces: ClassVar[tuple[str, ...]] = ("traction",)
    sheet: ClassVar[Sheet] = Sheet(
        "an elastic body",
        "−div σ = f, small displacements. Click a face of the part for its region; the rest of its boundary is free.",
        (
            *MaterialOptions.material_fields,
            ("body_force", "Force per volume, three formulas", "0;0;0"),
            *BodyOptions.mass_fields,
            ("stress_unit", "Unit of stresses, such as MPa", "none"),
        ),
        {"young": "E", "poisson_ratio": "ν", "body_force": "f", "gravity": "g", "acceleration": "a", "spin": "ω"},
    )

    @classmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the equation with the material, Lame's constants too if there is one material, and the force."""
        rows = [] if section.get("materials") else [("material", _constants(section, cls))]
        rows += cls.material_rows(section)
        isotropic = "λ (∇·u) I + μ (∇u + ∇uᵀ)"
        law = "C : ε" if any("shear_modulus" in own for own in (section, *section.get("materials", ()))) else isotropic
        thermal = " − C : α ΔT" if section.get("temperature_change") else ""
        equation = f"−∇·σ = f,  σ = {law}{thermal}"
        rows = [("equation", equation), *rows, ("force f per volume", section.get("body_force", ""))]
        return [*rows, *cls.mass_rows(section)]

    def solve_options(self) -> SolveOptions:
        """Return the options of the solve on the finest mesh; a slender body needs more iterations than a scalar."""
        return replace(super().solve_options(), max_iterations=MOST_ITERATIONS, formulation=self.formulation)

    def problem(self) -> Elasticity:
        """Return the problem of these options. Raises InputError."""
        check_space(self.refine, self.degree)
        if not (self.is_loaded or any((self.exact, self.displacement, self.traction))):
            raise InputError(
                "nothing acts on the body, no load is given: --total-force 'nz > 0.9=0;0;-1', --load, --pressure, "
                "--body-force '0;0;-1', --gravity, --traction or a displacement"
            )
        body = self._unchecked()
        with input_errors():
            body.demand_held()
        return body

    def check_law(self) -> None:
        """Raise InputError for all but loads and supports that are missing."""
        check_space(self.refine, self.degree)
        replace(self, body_force=self.body_force or "0")._unchecked()

    def _unchecked(self) -> Elasticity:
        """Return the problem, whether the body is held or not. Raises InputError."""
        from solve import Elasticity

        traction = texts.faces("traction", self.traction)
        with input_errors():
            body = Elasticity(
                exact=texts.vector("--exact", self.exact),
                displacement=texts.vector("--displacement", self.displacement),
                traction={face: texts.vector(f"--traction {face}", text) for face, text in traction.items()},
                **self.of_material(),
                **self.of_body(),
            )
        self.asks(body)
        return body


def _constants(section: Mapping[str, Any], kind: type[ElasticityOptions]) -> str:
    """Return the constants of a section of report.json in one line, with Lame's constants of one isotropic material."""
    young, ratio = (section.get(name, getattr(kind, name)) for name in ("young", "poisson_ratio"))
    said = (f"{value:g}" if isinstance(value, float | int) else value for value in (young, ratio))
    material = "Young's modulus E = {}, Poisson's ratio ν = {}".format(*said)
    if not isinstance(young, str) and not isinstance(ratio, str):
        first, shear = young * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), young / (2.0 * (1.0 + ratio))
        material += f"; λ = {first:.6g}, μ = {shear:.6g}"
    return material
