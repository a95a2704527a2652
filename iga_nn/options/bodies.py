"""Holds the options that every elastic body shares, whatever its material: its supports and its loads."""

from __future__ import annotations

from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal  # noqa: F401  # Literal is in the annotations of ProblemOptions

from ..errors import InputError, input_errors
from .problem import Formula, ProblemOptions, Row, Units, by_patch
from .texts import at_point, numbers, vector

ON_REGIONS = ("load", "pressure", "hydrostatic", "total_force", "moment", "remote_force", "bearing")
LOADS = ("body_force", *ON_REGIONS, "gravity", "acceleration", "spin")


@dataclass(frozen=True)
class BodyOptions(ProblemOptions, ABC):
    """State the supports and the loads of a body whose displacement is sought.

    "VECTOR at POINT" is three numbers with semicolons between them, and a point: "0;0;-500 at (10, 0, 50)".

    Attributes:
        body_force: force per volume, a vector; zero where neither it nor exact is given; also one for each solid.
        fix: regions of the boundary that are held, each as REGION, or "REGION=VECTOR" for a given displacement; an
            entry of the vector that is left out is free: "x < 1=0;;". A region is a condition on position and outward
            normal, "nz > 0.9 and x < 2", a face of the part, "face(x, y, z)", a group of the mesh, group:NAME, a
            box(x0, y0, z0, x1, y1, z1) or a face of the cube. Where regions are given, all else of the boundary is
            free.
        roller: regions held along their normal only.
        symmetry: regions where a plane of symmetry cuts the body; held along their normal as by a roller.
        cyclic: two cuts of a sector, as "REGION, REGION about z", or "about (0, 0, 1) through (1, 2, 3)": displacements
            on the second cut are those on the first, turned. The angle follows from the regions.
        turn: regions turned by a small angle in radians about an axis through a point, each as
            "REGION=VECTOR at POINT".
        rigid: regions that move as rigid bodies, each as REGION; total forces, moments and remote forces on the same
            region act on the rigid body. "REGION=VECTOR" gives its displacement without a turn; an entry that is left
            out stays free.
        spring: regions held by springs, force per area and displacement, each as "REGION=FORMULA".
        total_spring: regions held by a spring, force per displacement, shared out over the area, each as
            "REGION=NUMBER".
        foundation: regions on an elastic foundation, pressure per displacement along the normal, each as
            "REGION=FORMULA".
        load: regions with a force per area, each as "REGION=VECTOR".
        pressure: regions with a force per area against the outward normal, each as "REGION=FORMULA".
        hydrostatic: regions under the pressure of a fluid at rest, its weight per volume and a point on its surface,
            each as "REGION=VECTOR at POINT"; above the surface there is none.
        total_force: regions with a force in total, shared out evenly over the area, each as "REGION=VECTOR".
        moment: regions with a moment in total and no force, shared out over the area, each as "REGION=VECTOR".
        remote_force: regions with a force that acts at a point beside the body, each as "REGION=VECTOR at POINT".
        bearing: bores with a force in total as of a pin, a pressure on the half that the force points to, each as
            "REGION=VECTOR".
        density: mass per volume, by which gravity, acceleration and spin act, in units that agree with the others; with
            N, mm and s it is t/mm³, 7.85e-9 of steel; also one for each solid or patch, as young.
        gravity: acceleration of gravity, a vector, such as "0;0;-9810" in mm/s².
        acceleration: acceleration of the body, a vector; its mass loads it against that.
        spin: angular velocity of the body in radians per second, about an axis through a point, "VECTOR at POINT".
        stress_unit: unit of stresses, such as MPa; free text that is shown behind stresses and changes no number.
    """

    body_force: Formula | None = None
    fix: tuple[str, ...] = ()
    roller: tuple[str, ...] = ()
    symmetry: tuple[str, ...] = ()
    cyclic: tuple[str, ...] = ()
    turn: tuple[str, ...] = ()
    rigid: tuple[str, ...] = ()
    spring: tuple[str, ...] = ()
    total_spring: tuple[str, ...] = ()
    foundation: tuple[str, ...] = ()
    load: tuple[str, ...] = ()
    pressure: tuple[str, ...] = ()
    hydrostatic: tuple[str, ...] = ()
    total_force: tuple[str, ...] = ()
    moment: tuple[str, ...] = ()
    remote_force: tuple[str, ...] = ()
    bearing: tuple[str, ...] = ()
    density: float | str | None = None
    gravity: Formula | None = None
    acceleration: Formula | None = None
    spin: Formula | None = None
    stress_unit: str | None = None

    essential: ClassVar[Row] = ("displacement u", "displacement")
    natural: ClassVar[Row] = ("traction σ n", "traction")
    on_faces: ClassVar[tuple[str, ...]] = ()
    mass_fields: ClassVar[tuple[tuple[str, str, str], ...]] = (
        ("density", "Density, in t/mm³ with N and mm, of the loads below", "none"),
        ("gravity", "Acceleration of gravity, three numbers", "none"),
        ("acceleration", "Acceleration of the body, three numbers", "none"),
        ("spin", "Angular velocity at a point of the axis, such as 0;0;314 at (0, 0, 0)", "none"),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rigid and self.accuracy is not None:
            raise InputError("--rigid: its meshes are not refined by --accuracy; leave one of them out")

    @property
    def units(self) -> Units:
        """Return the units for colour bars and places."""
        return Units(self.unit, self.stress_unit, self.unit)

    @property
    def is_loaded(self) -> bool:
        """Return whether a force or a given displacement acts on the body."""
        return any(getattr(self, name) for name in (*LOADS, "fix", "turn", "rigid"))

    @classmethod
    def mass_rows(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return what a page says of the forces of the body's mass, from a section of report.json."""
        names = {"density": "density ρ", "gravity": "gravity g", "acceleration": "acceleration a", "spin": "spin ω"}
        rows = ((words, section.get(name)) for name, words in names.items())
        return [(words, f"{value:g}" if isinstance(value, float) else value) for words, value in rows if value]

    def density_given(self) -> Any:
        """Return the density, or that of each patch or solid; None where it is not given. Raises InputError."""
        return self.density if self.density is None else numbers("--density", self.density)

    def of_body(self) -> dict[str, Any]:
        """Return the keywords of the problem that these options state: its force per volume and its conditions.

        The force has that of gravity, acceleration and spin in it. Raises InputError for text that is refused.
        """
        if self.density is not None and not (self.gravity or self.acceleration or self.spin):
            raise InputError("--density alone does nothing: give --gravity, --acceleration or --spin, too")
        force = by_patch("--body-force", self.body_force, lambda text: vector("--body-force", text))
        mass = {
            "density": self.density_given(),
            "gravity": vector("--gravity", self.gravity),
            "acceleration": vector("--acceleration", self.acceleration),
            "spin": None if self.spin is None else at_point("--spin", self.spin),
        }
        with input_errors():
            from solve.forms.inertia import with_inertia

            force = with_inertia(force, **mass, has_exact=self.exact is not None)
        return {"body_force": force, "conditions": self.conditions(3)}
