"""Holds the options of convergence studies and of modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from ..errors import InputError, input_errors
from ..type_check import Checked
from . import texts
from .materials import POISSON_RATIO, YOUNG, axes_of, demand_unstated, materials_of, of_all
from .space_check import check_level, check_space

if TYPE_CHECKING:
    from solve import Ask, Elasticity, Material

MODULI = ("young", "poisson_ratio")  # in whose place a material stands


@dataclass(frozen=True)
class StudyOptions(Checked):
    """Give the trial spaces in which an exact solution is approximated.

    Attributes:
        degree: one or more degrees; the degree of the map by default.
        refine: levels to solve on, 0 1 2 or 0..2; level n halves every knot span of the map n times.
    """

    degree: tuple[int, ...] = ()
    refine: tuple[str, ...] = ("0..2",)

    def levels(self) -> list[int]:
        """Return the refinement levels in order. Raises InputError, also for degrees that cannot be run."""
        levels = [level for text in self.refine for level in _range(text)]
        if len(set(self.degree)) != len(self.degree):
            raise InputError(f"degree {self.degree}: give distinct degrees")
        for degree in self.degree or (None,):
            check_space(levels, degree)
        return sorted(levels)


@dataclass(frozen=True)
class ModesOptions(Checked):
    """Hold the options of the vibrations of an elastic body: its material, its supports and the number of modes.

    Attributes:
        young: Young's modulus E; of several solids also one for each by its name, "steel: 210000, pad: 8", and of
            several patches "p0: 210, p1: 70".
        poisson_ratio: Poisson's ratio nu, as young.
        density: mass per volume, in units that agree with those of E and of the volume, as young; 1, or that of the
            material.
        material: material of the library by its name, such as steel (`iga-nn materials` lists them), in place of its
            constants; of several solids also one for each, "body: steel, pad: rubber". Lengths are in mm then,
            densities in t/mm³, and frequencies in hertz.
        unit: unit of lengths of a material's numbers, mm or m.
        first_axis: axis 1 of a material that differs along its axes, as in `run elasticity`.
        second_axis: vector towards its axis 2, as first_axis.
        number: number of modes, from the lowest frequency on.
        fix: regions of the boundary that are held, as in `run elasticity`: "nz < -0.9", "face(x, y, z)", group:NAME,
            u0; without any the body is free, and its rigid motions are left out.
        roller: regions held along their normal only.
        refine: number of times that every knot span of the map is halved.
        degree: degree of the trial space; the degree of the map by default.
        solve_anyway: solve also on a map that folds, or that is too far from its surface to stand for the part.
        ask: frequencies to answer with intervals, each as "frequency 1".
    """

    young: float | str = YOUNG
    poisson_ratio: float | str = POISSON_RATIO
    density: float | str | None = None
    material: str | None = None
    unit: Literal["mm", "m"] | None = None
    first_axis: str | None = None
    second_axis: str | None = None
    number: int = 6
    fix: tuple[str, ...] = ()
    roller: tuple[str, ...] = ()
    refine: int = 0
    degree: int | None = None
    solve_anyway: bool = False
    ask: tuple[str, ...] = ()

    def asks(self) -> tuple[Ask, ...]:
        """Return the asks. Raises InputError for one that is refused or asks for no frequency."""
        from solve.ask import asks_of
        from solve.modes import demand_frequencies

        with input_errors():
            found = asks_of(self.ask)
            demand_frequencies(found, self.number)
        return found

    @property
    def densities(self) -> Any:
        """Return the density, or that of each patch or solid. Raises InputError."""
        if self.density is None:
            found = self.materials()
            return of_all({who: one.density for who, one in found.items()}) if found else 1.0
        return texts.numbers("--density", self.density)

    def materials(self) -> dict[Any, Material]:
        """Return the material of each solid or patch, of all of them by the key None. Raises InputError."""
        return {} if self.material is None else materials_of(self.material, self.unit)

    def _of_material(self) -> dict[str, Any]:
        """Return the keywords of the law. Raises InputError for text that is refused, and for what does nothing."""
        if self.material is None:
            if self.first_axis or self.second_axis or self.unit:
                raise InputError("--first-axis, --second-axis and --unit belong to --material: give it, too")
            return {name: texts.numbers(f"--{name.replace('_', '-')}", getattr(self, name)) for name in MODULI}
        demand_unstated(self, MODULI)
        axes = axes_of(self.first_axis, self.second_axis, self.materials().values())
        return {"material": of_all(self.materials()), **axes}

    def problem(self) -> Elasticity:
        """Return the body, without loads. Raises InputError."""
        from parameterize.spline.volume import FACE_NAMES
        from solve import Elasticity
        from solve.modes import check_modes

        check_space([self.refine], self.degree)
        self.asks()
        free = {} if self.fix or self.roller else dict.fromkeys(FACE_NAMES, ["0"] * 3)
        with input_errors():
            check_modes(self.densities, self.number)
            return Elasticity(traction=free, fix=self.fix or None, roller=self.roller or None, **self._of_material())


def _range(text: str) -> list[int]:
    """Return a level, or all levels from the first to the last of "0..4". Raises InputError."""
    first, dots, last = text.partition("..")
    if not (first.isdecimal() and (last.isdecimal() or not dots)):
        raise InputError(f"refine {text!r}: write levels such as 0 1 2, or a range such as 0..2")
    check_level(int(last or first))  # before the list is made
    if int(last or first) < int(first):
        raise InputError(f"refine {text!r}: the range ends before it begins; write {last}..{first}")
    return list(range(int(first), int(last or first) + 1))
