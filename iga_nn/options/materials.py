"""Holds the options of an elastic body's material, and reads materials of the library by name."""

from __future__ import annotations

import json
from abc import ABC
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal  # noqa: F401  # Literal is in the annotations of ProblemOptions

from ..errors import InputError, input_errors
from . import texts
from .bodies import BodyOptions
from .problem import Formula, Row, Units

if TYPE_CHECKING:
    from solve import Material

MEGAPASCAL = ("MPa", "N/mm²", "N/mm^2", "N/mm2")
PASCAL = ("Pa", "N/m²", "N/m^2", "N/m2")
SYSTEMS = {"mm": MEGAPASCAL, "m": PASCAL}  # unit of lengths -> units of stresses that agree with it
OWN = ("young", "poisson_ratio", "shear_modulus", "alpha", "yield_strength")  # in whose place a material stands
PARAMETERS = ("u", "v", "w")


class Unstated(float):
    """Hold the number of an option that is not given; the same number, given, is another object."""


YOUNG, POISSON_RATIO = Unstated(1.0), Unstated(0.3)


def demand_unstated(options: Any, names: Iterable[str]) -> None:
    """Raise InputError for an option that is given beside a material, in whose place the material stands."""
    for name in names:
        value = getattr(options, name)
        if value is not None and not isinstance(value, Unstated):
            raise InputError(f"--material and --{_flag(name)}: give one of them, the material has its own")


@dataclass(frozen=True)
class MaterialOptions(BodyOptions, ABC):
    """Give the material of an elastic body, by its name or by its constants, and its temperature.

    Attributes:
        material: material of the library by its name, such as steel (`iga-nn materials` lists them), in place of its
            constants; of several solids also one for each, "body: steel, pad: rubber". Lengths are in mm and stresses
            in MPa then, or in m and Pa with --unit m.
        young: Young's modulus E; of several solids also one for each by its name, "steel: 210000, pad: 8", and of
            several patches "p0: 210, p1: 70". The second solid is solid2 if it has no name; a name with a comma or a
            colon stands in quotes. Three numbers E1;E2;E3 are those of an orthotropic material.
        poisson_ratio: Poisson's ratio nu, as young; nu12;nu13;nu23 of an orthotropic material, nu12 the contraction
            along axis 2 of a pull along axis 1.
        shear_modulus: shear moduli G12;G13;G23 of an orthotropic material, as young.
        first_axis: axis 1 of a material that differs along its axes, a vector such as "1;1;0" or "-y;x;0", or u, v or w
            for the direction of the map's lines; x by default.
        second_axis: vector towards axis 2, as first_axis; it is needed where the material differs across its first
            axis, and is y by default.
        alpha: thermal strain per kelvin, as young; three numbers along the axes.
        temperature_change: temperature above the one without thermal strain, a formula, or the folder of a finished
            heat problem on the same volume.
        yield_strength: stress at which the material yields, as young; its quotient by von Mises' stress is the safety.
    """

    material: str | None = None
    young: float | str = YOUNG
    poisson_ratio: float | str = POISSON_RATIO
    shear_modulus: str | None = None
    first_axis: Formula | None = None
    second_axis: Formula | None = None
    alpha: float | str | None = None
    temperature_change: Formula | None = None
    yield_strength: float | str | None = None

    material_fields: ClassVar[tuple[tuple[str, str, str], ...]] = (
        ("material", "Material by name, such as steel", "none"),
        ("young", "Young's modulus E", "1"),
        ("poisson_ratio", "Poisson's ratio ν", "0.3"),
        ("alpha", "Thermal strain per kelvin α", "none"),
        ("temperature_change", "Temperature above that without strain", "none"),
        ("yield_strength", "Yield strength, for the safety", "none"),
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.material is not None:
            demand_unstated(self, OWN)
            self.materials()
        elif self.temperature_change is not None and self.alpha is None:
            raise InputError(
                "--temperature-change needs the thermal strain per kelvin: give --alpha 12e-6, or --material"
            )
        if self.alpha is not None and self.temperature_change is None:
            raise InputError("--alpha does nothing without a temperature: give --temperature-change 80, too")

    def materials(self) -> dict[Any, Material]:
        """Return the material of each solid or patch in the units of these options; of all of them by the key None.

        Raises InputError for names and units that are refused.
        """
        return materials_of(self.material, self.unit, self.stress_unit)

    @property
    def units(self) -> Units:
        """Return the units for colour bars; those of a material where none are given."""
        if self.material is None:
            return super().units
        first = next(iter(self.materials().values()))
        return Units(first.unit, self.stress_unit or first.stress_unit)

    def values(self, *left_out: str) -> dict[str, Any]:
        """Return the options by name, with the units and the numbers of materials."""
        found = super().values(*left_out)
        if self.material is None:
            return found
        own = {"unit": self.units.displacement, "stress_unit": self.units.stress}
        numbers = [one.as_dict() for one in self.materials().values()]
        own = {name: unit for name, unit in own.items() if name in found} | dict.fromkeys(OWN)
        return {**found, **own, "materials": numbers}

    @property
    def is_loaded(self) -> bool:
        """Return whether a force, a given displacement or a temperature acts on the body."""
        return super().is_loaded or self.temperature_change is not None

    def density_given(self) -> Any:
        """Return the density, or that of each patch or solid; by default that of the material. Raises InputError."""
        if self.material is None or self.density is not None:
            return super().density_given()
        return of_all({who: one.density for who, one in self.materials().items()})

    def of_material(self) -> dict[str, Any]:
        """Return the keywords of the problem that these options state. Raises InputError for text that is refused."""
        axes = self.first_axis, self.second_axis
        warm = {} if self.temperature_change is None else {"temperature_change": _warm(self.temperature_change)}
        if self.material is not None:
            found = self.materials()
            return {"material": of_all(found), **axes_of(*axes, found.values()), **warm}
        constants = {name: texts.constants(f"--{_flag(name)}", getattr(self, name)) for name in OWN}
        constants["expansion"] = constants.pop("alpha")
        differ = constants["shear_modulus"] is not None or ";" in str(self.alpha)
        return {**constants, **axes_of(*axes, (), differ=differ), **warm}

    @classmethod
    def material_rows(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return what a page says of the material, from a section of report.json."""
        rows = [(f"material {one['name']}", _said(one)) for one in section.get("materials", ())]
        more = {
            "shear_modulus": "shear moduli G12; G13; G23",
            "first_axis": "axis 1",
            "second_axis": "towards axis 2",
            "alpha": "thermal strain per kelvin α",
            "temperature_change": "temperature change",
            "yield_strength": "yield strength",
        }
        found = ((words, section.get(name)) for name, words in more.items())
        return rows + [(words, f"{value:g}" if isinstance(value, float) else value) for words, value in found if value]


def materials_of(text: str | None, unit: str | None, stress_unit: str | None = None) -> dict[Any, Material]:
    """Return the material of each solid or patch in a system of units; of a text with one name by the key None.

    Raises InputError for names that the library does not have, and for units other than mm and MPa, or m and Pa.
    """
    from solve import material

    length = unit or next((one for one, stresses in SYSTEMS.items() if stress_unit in stresses), "mm")
    if length not in SYSTEMS or stress_unit not in (None, *SYSTEMS[length]):
        given = f"--unit {unit or 'mm'}" + (f" --stress-unit {stress_unit}" if stress_unit else "")
        raise InputError(
            f"--material knows its numbers in mm and MPa, or in m and Pa, and {given} is neither: write --unit mm "
            "--stress-unit MPa, or give --young and its like"
        )
    with input_errors():
        found = texts.by_patch("--material", text or "", lambda name: material(name).in_unit(length))
    return found if isinstance(found, dict) else {None: found}


def axes_of(
    first: str | None, second: str | None, materials: Iterable[Material], *, differ: bool = False
) -> dict[str, Any]:
    """Return the axes of materials as keywords of a problem. differ: whether constants differ along the axes.

    Raises InputError for axes of materials that are the same in all directions.
    """
    differ = differ or any(not one.is_isotropic for one in materials)
    for name, text in (("first-axis", first), ("second-axis", second)):
        if text is not None and not differ:
            raise InputError(
                f"--{name} does nothing: the material is the same in all directions; give --young, --poisson-ratio and "
                "--shear-modulus with three numbers each"
            )
    return {"first_axis": _axis("--first-axis", first), "second_axis": _axis("--second-axis", second)}


def listed() -> str:
    """Return the table of the library for a terminal."""
    from solve.forms.library import MATERIALS, QUOTED

    rows: list[tuple[str, ...]] = [("", "E", "nu", "density", "alpha", "conductivity", "yield")]
    rows += [("", "MPa", "", "t/mm^3", "1/K", "W/(mm K)", "MPa")]
    for one in MATERIALS:
        numbers = (one.young, one.poisson_ratio, one.density, one.expansion, one.conductivity, one.yield_strength)
        rows.append((one.name, *map(_number, numbers)))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    table = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    more = [f"{one.name}: G = {_number(one.shear_modulus)} MPa" for one in MATERIALS if not one.is_isotropic]
    sources = [f"{one.name}: {one.source}" for one in MATERIALS]
    return "\n".join([*table, "", *more, "", f"Sources: {QUOTED}", *sources])


def _number(value: Any) -> str:
    if value is None:
        return "-"
    return "; ".join(f"{part:g}" for part in value) if isinstance(value, tuple | list) else f"{value:g}"


def _said(one: Mapping[str, Any]) -> str:
    """Return a material of report.json in one line."""
    signs = {
        "young": "E",
        "poisson_ratio": "ν",
        "shear_modulus": "G",
        "density": "ρ",
        "expansion": "α",
        "conductivity": "k",
        "yield_strength": "yield",
    }
    numbers = ", ".join(f"{sign} = {_number(one[name])}" for name, sign in signs.items() if one.get(name) is not None)
    return f"{numbers} ({one['units']}; {one['source']})"


def of_all(found: Mapping[Any, Any]) -> Any:
    """Return what belongs to each solid or patch, or to all of them."""
    return found[None] if None in found else dict(found)


def _flag(name: str) -> str:
    return name.replace("_", "-")


def _axis(flag: str, text: str | None) -> Any:
    """Return an axis: a parameter, or three formulas, also those of each solid. Raises InputError."""
    if text is None or text.strip() in PARAMETERS:
        return text and text.strip()
    return texts.by_patch(flag, text, partial(texts.vector, flag))


def _warm(text: str) -> Any:
    """Return a temperature: a formula, those of each solid, or the field of a folder. Raises InputError."""
    folder = Path(text)
    if not folder.is_dir():
        return texts.by_patch("--temperature-change", text, str)
    from parameterize.spline.body import Body
    from solve import BodyField

    files = [folder / "solution.npz", _volume_of(folder)]
    if missing := [path for path in files if not path.is_file()]:
        raise InputError(
            f"--temperature-change {text}: {missing[0]} is not there; name the folder of a solved heat problem"
        )
    with input_errors():
        field, body = BodyField.load(files[0]), Body.load(files[1])
        if len(field.patches) != len(body.patches):
            raise InputError(f"--temperature-change {text}: solution.npz and volume.npz do not belong together")
        pairs = zip(field.patches, body.patches, strict=True)
        return BodyField(tuple(replace(own, geometry=volume) for own, volume in pairs), body)


def _volume_of(folder: Path) -> Path:
    """Return the volume that a folder's solution lives on: its own one, or the file that its report names."""
    own, report = folder / "volume.npz", folder / "report.json"
    if own.is_file() or not report.is_file():
        return own
    with input_errors():
        given = json.loads(report.read_text(encoding="utf-8"))
        return Path(str(given.get("input", {}).get("file", own)))
