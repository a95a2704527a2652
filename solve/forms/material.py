"""Defines Material: the constants of a material, with their source, in one system of units."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from difflib import get_close_matches
from typing import Any

Constants = float | tuple[float, float, float]  # of an isotropic material, or one a principal axis

UNITS = {  # of each number, by the unit of lengths: those of the library, and those of SI
    "mm": {
        "stress": "MPa",
        "density": "t/mm^3",
        "conductivity": "W/(mm K)",
        "expansion": "1/K",
    },
    "m": {
        "stress": "Pa",
        "density": "kg/m^3",
        "conductivity": "W/(m K)",
        "expansion": "1/K",
    },
}
TO_METRES = {  # factors from mm, N, MPa, t/mm^3 and W/(mm K) to m, N, Pa, kg/m^3 and W/(m K)
    "young": 1e6,
    "shear_modulus": 1e6,
    "yield_strength": 1e6,
    "density": 1e12,
    "conductivity": 1e3,
}


@dataclass(frozen=True)
class Material:
    """Hold the constants of a material at room temperature, in mm, N, MPa, t/mm^3, W/(mm K) and 1/K.

    Three numbers instead of one are those along the principal axes of an orthotropic material.

    Parameters
    ----------
    name : str
    young : float or three
        Young's modulus E, or E1, E2, E3.
    poisson_ratio : float or three
        Poisson's ratio nu, or nu12, nu13, nu23: nu12 is the contraction along 2 of a pull along 1.
    shear_modulus : three float, optional
        G12, G13, G23; None for an isotropic material.
    density : float, optional
        Mass per volume.
    expansion : float or three, optional
        Thermal strain per kelvin.
    conductivity : float or three, optional
        Of heat.
    yield_strength : float, optional
        Yield strength, or the stress at 0.1 % or 0.2 % of plastic strain; None for a material that does not yield.
    source : str
        What the numbers are quoted for.
    other_names : tuple of str
        Further names by which the library finds it.
    unit : str
        Unit of lengths, "mm" or "m", of which the other units follow.

    Raises
    ------
    ValueError
        For orthotropic constants that lack some of three, and for an unknown unit.

    Examples
    --------
    >>> import iga_nn
    >>> steel = iga_nn.material("steel")
    >>> steel.young, steel.yield_strength
    (210000.0, 235.0)
    >>> steel.in_unit("m").density
    7850.0
    """

    name: str
    young: Constants
    poisson_ratio: Constants
    shear_modulus: tuple[float, float, float] | None = None
    density: float | None = None
    expansion: Constants | None = None
    conductivity: Constants | None = None
    yield_strength: float | None = None
    source: str = ""
    other_names: tuple[str, ...] = ()
    unit: str = "mm"

    def __post_init__(self) -> None:
        demand_constants(self.young, self.poisson_ratio, self.shear_modulus)
        if self.unit not in UNITS:
            raise ValueError(f"material {self.name!r}: unit must be 'mm' or 'm', got {self.unit!r:.80}")

    @property
    def is_isotropic(self) -> bool:
        """Return whether the material is the same in all directions."""
        return self.shear_modulus is None

    @property
    def stress_unit(self) -> str:
        """Return the unit of stresses, MPa or Pa."""
        return UNITS[self.unit]["stress"]

    def in_unit(self, unit: str) -> Material:
        """Return the same material in mm, N, MPa and t/mm^3, or in m, N, Pa and kg/m^3.

        Raises ValueError for another unit of lengths than "mm" and "m".
        """
        if unit not in UNITS:
            raise ValueError(f"material {self.name!r}: unit must be 'mm' or 'm', got {unit!r:.80}")
        if unit == self.unit:
            return self
        factors = TO_METRES if unit == "m" else {name: 1.0 / factor for name, factor in TO_METRES.items()}
        changed = {name: _times(getattr(self, name), factor) for name, factor in factors.items()}
        return replace(self, unit=unit, **changed)

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers that are known, their units and their source, for report.json."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        del found["other_names"], found["unit"]
        return {name: value for name, value in found.items() if value not in (None, "")} | {"units": self.units}

    @property
    def units(self) -> str:
        """Return the units of the numbers in one line."""
        return f"{self.unit}, N, " + ", ".join(UNITS[self.unit].values())


def demand_constants(young: Constants, poisson_ratio: Constants, shear_modulus: Constants | None) -> None:
    """Raise ValueError for constants that are neither those of an isotropic nor those of an orthotropic material."""
    given = [young, poisson_ratio, *([] if shear_modulus is None else [shear_modulus])]
    counts = {len(value) if isinstance(value, tuple) else 1 for value in given}
    if counts != ({1} if shear_modulus is None else {3}):
        raise ValueError(
            "give one young and one poisson_ratio, or three numbers of young, poisson_ratio and shear_modulus each: "
            "E1, E2, E3, nu12, nu13, nu23 and G12, G13, G23"
        )


def _times(value: Any, factor: float) -> Any:
    """Return a number, three numbers or None, times a power of ten, rounded to 15 digits."""
    if value is None:
        return None
    if isinstance(value, tuple):
        return tuple(_times(part, factor) for part in value)
    return float(f"{value * factor:.15g}")


def find(name: str, library: tuple[Material, ...]) -> Material:
    """Return the material of a name or another name, in any case of letters.

    Raises ValueError for a name that the library does not have.
    """
    wanted = _plain(name)
    for one in library:
        if wanted in map(_plain, (one.name, *one.other_names)):
            return one
    known = [one.name for one in library]
    names = [other for one in library for other in (one.name, *one.other_names)]
    near = get_close_matches(name.lower(), names, 1)
    meant = f" (do you mean {near[0]!r}?)" if near else ""
    raise ValueError(f"material {name!r:.80} is not known{meant}; the library has {', '.join(known)}")


def _plain(name: str) -> str:
    return "".join(letter for letter in name.lower() if letter.isalnum())
