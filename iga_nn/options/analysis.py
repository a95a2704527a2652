"""Holds the options of convergence studies and of modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import InputError, input_errors
from ..type_check import Checked
from . import texts
from .space_check import check_level, check_space

if TYPE_CHECKING:
    from solve import Ask, Elasticity


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
        density: mass per volume, in units that agree with those of E and of the volume, as young.
        number: number of modes, from the lowest frequency on.
        fix: regions of the boundary that are held, as in `run elasticity`: "nz < -0.9", "face(x, y, z)", group:NAME,
            u0; without any the body is free, and its rigid motions are left out.
        roller: regions held along their normal only.
        refine: number of times that every knot span of the map is halved.
        degree: degree of the trial space; the degree of the map by default.
        solve_anyway: solve also on a map that folds, or that is too far from its surface to stand for the part.
        ask: frequencies to answer with intervals, each as "frequency 1".
    """

    young: float | str = 1.0
    poisson_ratio: float | str = 0.3
    density: float | str = 1.0
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
        return texts.numbers("--density", self.density)

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
            young, ratio = texts.numbers("--young", self.young), texts.numbers("--poisson-ratio", self.poisson_ratio)
            return Elasticity(
                traction=free, young=young, poisson_ratio=ratio, fix=self.fix or None, roller=self.roller or None
            )


def _range(text: str) -> list[int]:
    """Return a level, or all levels from the first to the last of "0..4". Raises InputError."""
    first, dots, last = text.partition("..")
    if not (first.isdecimal() and (last.isdecimal() or not dots)):
        raise InputError(f"refine {text!r}: write levels such as 0 1 2, or a range such as 0..2")
    check_level(int(last or first))  # before the list is made
    if int(last or first) < int(first):
        raise InputError(f"refine {text!r}: the range ends before it begins; write {last}..{first}")
    return list(range(int(first), int(last or first) + 1))
