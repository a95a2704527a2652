"""Holds what the options of every boundary value problem share: its meshes, its asks and its units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, asdict, dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ..errors import InputError, input_errors
from ..type_check import Checked
from . import texts

if TYPE_CHECKING:
    from parameterize.checkpoint import Checkpoints
    from parameterize.spline.body import BodyLike
    from solve import Ask, Solution, SolveOptions
    from solve.forms.boundary_value_problem import BoundaryValueProblem
    from solve.forms.conditions import Condition

Formula = str  # one that starts with a minus is written --option=-x

LONGEST_UNIT = 20  # letters


@dataclass(frozen=True)
class Units:
    """Hold the units of a solution, of stresses and of lengths, None for a unit that is not given."""

    displacement: str | None = None
    stress: str | None = None
    length: str | None = None


NO_UNITS = Units()
UNITS = ("unit", "stress_unit")  # options that are free text and change no number

Row = tuple[str, str]  # a name, and the formula or number; of data of the exact solution, or zero, the number is ""


@dataclass(frozen=True)
class Sheet:
    """Hold the form of one problem on the live page, beside the options with data on regions.

    title: name of the problem. equation: text above the fields. fields: of each field the option, its label, and the
    value of an empty field. signs: symbols of options in a line of text.
    """

    title: str
    equation: str
    fields: tuple[tuple[str, str, str], ...]
    signs: Mapping[str, str]


@dataclass(frozen=True)
class ProblemOptions(Checked, ABC):
    """Hold the options of every PDE of the command line: its exact solution, its meshes, and its quadrature.

    A new PDE is a subclass with options of its own, entered in PROBLEMS. It becomes a command of `run`, `solve`,
    `study`, `batch` and `app`. An option that lists regions has the name of its class of conditions.

    Attributes:
        refine: levels to solve on; level n halves every knot span of the map n times.
        degree: degree of the trial space; the degree of the map by default.
        quadrature: quadrature rule of the operator: "gauss+1", degree + 1 Gauss points a span; "gauss", degree points a
            span; "spline", the fewest points with the same error as "gauss+1".
        solve_anyway: solve also on a map that folds, or that is too far from its surface to stand for the part.
        unit: unit of lengths, such as mm; free text that is shown behind lengths and places and changes no number but
            those of a material, which are in mm and MPa, or in m and Pa.
        ask: quantities to answer with intervals, which reports show first, each as "ux at (10, 0, 0)", "von_mises max
            over REGION", "mean T over REGION", "integral u", "reaction z of REGION", "flow over REGION" or "energy". A
            region that is a condition on position alone is a part of the body, any other a part of its boundary.
        accuracy: refine where it counts, from the first level on, until half of every asked interval is less than this
            share of its value, such as 2% or 0.02; without asks, until the estimated error in the energy norm is.
    """

    exact: Formula | None = None
    _: KW_ONLY
    refine: tuple[int, ...] = (0, 1)
    degree: int | None = None
    quadrature: Literal["spline", "gauss", "gauss+1"] = "spline"
    solve_anyway: bool = False
    unit: str | None = None
    ask: tuple[str, ...] = ()
    accuracy: str | float | None = None

    section: ClassVar[str]  # its name on the command line and in report.json
    title: ClassVar[str]
    essential: ClassVar[Row]  # words on a page, and the option, of values on the faces of the cube
    natural: ClassVar[Row]  # the same of the flux on faces that are named
    on_faces: ClassVar[tuple[str, ...]]  # options that list faces of the cube
    sheet: ClassVar[Sheet]

    @abstractmethod
    def problem(self) -> BoundaryValueProblem:
        """Return the problem of these options. Raises InputError."""

    def check_law(self) -> None:
        """Raise InputError as `problem`, but for loads and supports that are missing: a form may add these."""
        self.problem()

    def solved(
        self, body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions, checkpoints: Checkpoints
    ) -> Solution:
        """Return the solution on one level.

        A law with load steps keeps each of them as the checkpoint "steps", and goes on from the one that is there.
        """
        from solve import solve_with

        return solve_with(body, problem, options)

    @classmethod
    @abstractmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the equation and the coefficients of a section of report.json, as a page shows them."""

    @classmethod
    def on_regions(cls) -> list[str]:
        """Return the names of the options that list regions with their data."""
        lists = (field.name for field in fields(cls) if field.type == "tuple[str, ...]")
        return [name for name in lists if name not in (*cls.on_faces, "ask")]

    def asks(self, problem: BoundaryValueProblem) -> tuple[Ask, ...]:
        """Return the asks of a problem. Raises InputError for one that is refused or does not fit the law."""
        from solve.ask import asks_of
        from solve.asked.named import demand_fit

        with input_errors():
            found = asks_of(self.ask)
            for one in found:
                demand_fit(one, problem)
        return found

    def conditions(self, components: int) -> list[Condition]:
        """Return the conditions on regions, of a problem with c components of u. Raises InputError."""
        from solve.forms.conditions import KINDS

        found = []
        for name in self.on_regions():
            kind = KINDS[name]
            read = partial(texts.datum, kind, kind.entries or components)
            stated = texts.on_regions(name, getattr(self, name), read)
            found += [kind.of(region, data) for region, data in stated.items()]
        return found

    def values(self, *left_out: str) -> dict[str, Any]:
        """Return the options by name, without those that are named, and without `solve_anyway`, which no number has."""
        return {name: value for name, value in asdict(self).items() if name not in ("solve_anyway", *left_out)}

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in UNITS:
            text = getattr(self, name, None)
            if text is not None and not (text.strip() and text.isprintable() and len(text) <= LONGEST_UNIT):
                flag = "--" + name.replace("_", "-")
                raise InputError(f"{flag} {text!r:.80}: give a short text such as mm, at most {LONGEST_UNIT} letters")
        if self.accuracy is not None:
            texts.share("--accuracy", self.accuracy)

    @property
    def wanted(self) -> float | None:
        """Return the accuracy as a number, None where none is wanted."""
        return None if self.accuracy is None else texts.share("--accuracy", self.accuracy)

    @property
    def levels(self) -> tuple[int, ...]:
        """Return the levels that are solved on, coarsest first; where an accuracy is wanted, the first alone."""
        return tuple(sorted(self.refine)) if self.accuracy is None else (min(self.refine),)

    @property
    def units(self) -> Units:
        """Return the units for colour bars and places."""
        return Units(length=self.unit)

    def solve_options(self) -> SolveOptions:
        """Return the options of the solve on the finest mesh. Raises InputError for an ask that is refused."""
        from solve import SolveOptions
        from solve.ask import asks_of

        with input_errors():
            return SolveOptions(
                refine=max(self.levels), degree=self.degree, quadrature=self.quadrature, ask=asks_of(self.ask)
            )


def by_patch(flag: str, text: str | None, read: Callable[[str], Any]) -> Any:
    """Return a datum, or the data of each patch or solid; None where it is not given. Raises InputError."""
    return None if text is None else texts.by_patch(flag, text, read)
