"""Holds the options that every elastic body shares, whatever its material: its supports and its loads."""

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import Any, ClassVar, Literal  # noqa: F401  # Literal is in the annotations of ProblemOptions

from .problem import Formula, ProblemOptions, Row, Units, by_patch
from .texts import vector


@dataclass(frozen=True)
class BodyOptions(ProblemOptions, ABC):
    """State the supports and the loads of a body whose displacement is sought.

    Attributes:
        body_force: force per volume, a vector; zero where neither it nor exact is given; also one for each solid.
        fix: regions of the boundary that are held, each as REGION, or "REGION=VECTOR" for a given displacement; an
            entry of the vector that is left out is free: "x < 1=0;;". A region is a condition on position and outward
            normal, "nz > 0.9 and x < 2", a face of the part, "face(x, y, z)", a group of the mesh, group:NAME, a
            box(x0, y0, z0, x1, y1, z1) or a face of the cube. Where regions are given, all else of the boundary is
            free.
        roller: regions held along their normal only.
        symmetry: regions where a plane of symmetry cuts the body; held along their normal as by a roller.
        load: regions with a force per area, each as "REGION=VECTOR".
        pressure: regions with a force per area against the outward normal, each as "REGION=FORMULA".
        spring: regions on an elastic foundation, force per area and displacement, each as "REGION=FORMULA".
        stress_unit: unit of stresses, such as MPa; free text that is shown behind stresses and changes no number.
    """

    body_force: Formula | None = None
    fix: tuple[str, ...] = ()
    roller: tuple[str, ...] = ()
    symmetry: tuple[str, ...] = ()
    load: tuple[str, ...] = ()
    pressure: tuple[str, ...] = ()
    spring: tuple[str, ...] = ()
    stress_unit: str | None = None

    essential: ClassVar[Row] = ("displacement u", "displacement")
    natural: ClassVar[Row] = ("traction σ n", "traction")
    on_faces: ClassVar[tuple[str, ...]] = ()

    @property
    def units(self) -> Units:
        """Return the units for colour bars."""
        return Units(self.unit, self.stress_unit)

    @property
    def is_loaded(self) -> bool:
        """Return whether a force or a given displacement acts on the body."""
        return any((self.body_force, self.load, self.pressure, self.fix))

    def of_body(self) -> dict[str, Any]:
        """Return the keywords of the problem that these options state: its force per volume and its conditions.

        Raises InputError for text that is refused.
        """
        force = by_patch("--body-force", self.body_force, lambda text: vector("--body-force", text))
        return {"body_force": force, "conditions": self.conditions(3)}
