"""Holds the options of a boundary value problem: its law, its data, and the meshes it is solved on."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, asdict, dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from ..errors import InputError, input_errors
from ..type_check import Checked
from . import texts
from .space_check import check_space

if TYPE_CHECKING:
    from solve import Ask, Elasticity, Poisson, SolveOptions
    from solve.forms.boundary_value_problem import BoundaryValueProblem
    from solve.forms.conditions import Condition

Formula = str  # one that starts with a minus is written --option=-x

LONGEST_UNIT = 20  # letters
MOST_ITERATIONS = 3000  # of an elastic body; a bracket held at one end takes 680, and some 1600 after a refinement


@dataclass(frozen=True)
class Units:
    """Hold the units of a solution and of stresses, None for a unit that is not given."""

    displacement: str | None = None
    stress: str | None = None


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
        unit: unit of lengths, such as mm; free text that is shown behind lengths and places and changes no number.
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
        """Return the units for colour bars."""
        return NO_UNITS

    def solve_options(self) -> SolveOptions:
        """Return the options of the solve on the finest mesh. Raises InputError for an ask that is refused."""
        from solve import SolveOptions
        from solve.ask import asks_of

        with input_errors():
            return SolveOptions(
                refine=max(self.levels), degree=self.degree, quadrature=self.quadrature, ask=asks_of(self.ask)
            )


@dataclass(frozen=True)
class PoissonOptions(ProblemOptions):
    """State -div(kappa grad u) + c u = f on the volume, with data on its six faces, and the meshes it is solved on.

    A formula may use x, y, z, in the input's units, and X, Y, Z, the same scaled to volume 1 about the middle of the
    volume's bounding box: X = (x - c) / V^(1/3). A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and
    so on.

    Attributes:
        exact: exact solution, a formula, from which f and g follow; errors are reported. It is exp(X+Z)*sin(Y) where
            neither f nor g is given. A formula that starts with a minus is written --exact=-x.
        source: f, a formula; of several solids also one for each, as kappa.
        boundary: g, the values of u, a formula.
        kappa: one formula, or six separated by commas for a symmetric tensor: xx,xy,xz,yy,yz,zz; of several solids also
            an entry for each by its name, "steel: 50, pad: 0.2+x", and of several patches "p0: 1, p1: 2+x". The second
            solid is solid2 if it has no name; a name with a comma or a colon stands in quotes.
        reaction: c, a formula; of several solids also one for each, as kappa.
        neumann: faces with a given flux kappa du/dn, each as FACE=FORMULA, or FACE for the flux of the exact solution.
        robin: faces where kappa du/dn + alpha u = g, each as FACE=ALPHA:FORMULA, or FACE=ALPHA for the g of the exact
            solution.
        value: regions of the boundary with given values of u, each as "REGION=FORMULA", or REGION for zero or the exact
            solution. A region is a condition on position and outward normal, "nz > 0.9 and x < 2", a face of the part,
            "face(x, y, z)", a group of the mesh, group:NAME, a box(x0, y0, z0, x1, y1, z1) or a face of the cube. Where
            regions are given, all else of the boundary has no flux, and the source is zero unless it is given.
        flux: regions with a given flux kappa du/dn into the body, each as "REGION=FORMULA".
        exchange: regions where kappa du/dn = alpha (outside - u), each as "REGION=ALPHA:OUTSIDE".

    Examples:
        >>> import iga_nn
        >>> iga_nn.PoissonOptions(source="1", robin=("u1=2:0",), refine=(0,)).problem().robin
        {'u1': ('2', '0')}
    """

    source: Formula | None = None
    boundary: Formula | None = None
    kappa: Formula | None = None
    reaction: Formula | None = None
    neumann: tuple[str, ...] = ()
    robin: tuple[str, ...] = ()
    value: tuple[str, ...] = ()
    flux: tuple[str, ...] = ()
    exchange: tuple[str, ...] = ()

    section: ClassVar[str] = "poisson"
    title: ClassVar[str] = "Poisson's equation"
    essential: ClassVar[Row] = ("u", "boundary")
    natural: ClassVar[Row] = ("flux κ ∂u/∂n", "neumann")
    on_faces: ClassVar[tuple[str, ...]] = ("neumann", "robin")
    sheet: ClassVar[Sheet] = Sheet(
        title,
        "−div(κ grad u) + c u = f. Formulas use x, y, z, in the surface's units, or X, Y, Z, scaled to volume 1.",
        (
            ("kappa", "Coefficient κ, one formula or six: xx,xy,xz,yy,yz,zz", "1"),
            ("reaction", "Reaction c", "0"),
            ("exact", "Exact solution u, from which empty data follow", "none; without a source exp(X+Z)*sin(Y)"),
            ("source", "Source f", "that of the exact solution"),
            ("boundary", "Values of u on the faces", "those of the exact solution, or 0"),
        ),
        {"kappa": "κ", "reaction": "c", "exact": "u", "source": "f", "boundary": "u on the faces"},
    )

    @classmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the equation with kappa, the reaction and the source."""
        reaction = section.get("reaction")
        rows = [("equation", f"−∇·(κ ∇u){' + c u' if reaction is not None else ''} = f")]
        rows += [("κ", section.get("kappa", "1")), *([] if reaction is None else [("c", reaction)])]
        return [*rows, ("f", section.get("source", ""))]

    def problem(self) -> Poisson:
        """Return the problem of these options. Raises InputError."""
        from solve import Poisson

        check_space(self.refine, self.degree)
        robin = {}
        for face, text in texts.faces("robin", self.robin).items():
            alpha, colon, g = (text or "").partition(":")
            if not alpha.strip():
                raise InputError(f"robin {face}: write {face}=ALPHA or {face}=ALPHA:FORMULA")
            robin[face] = (alpha, g if colon else None)
        with input_errors():
            problem = Poisson(
                exact=self.exact,
                source=_by_patch("--source", self.source, str),
                boundary=self.boundary,
                kappa=_by_patch("--kappa", self.kappa, _entries),
                reaction=_by_patch("--reaction", self.reaction, str),
                neumann=texts.faces("neumann", self.neumann),
                robin=robin,
                conditions=self.conditions(1),
            )
        self.asks(problem)
        return problem


def _entries(text: str) -> list[str]:
    return text.split(",")


def _by_patch(flag: str, text: str | None, read: Callable[[str], Any]) -> Any:
    return None if text is None else texts.by_patch(flag, text, read)


@dataclass(frozen=True)
class ElasticityOptions(ProblemOptions):
    """State linear elasticity of the volume as an isotropic body, and the meshes it is solved on.

    A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and so on. A vector is three formulas in x, y, z
    or X, Y, Z (scaled to volume 1 about the middle), separated by semicolons, in quotes: "x*y;0;sin(z)"; 0 is the zero
    vector.

    Attributes:
        exact: exact displacement, a vector, from which force and boundary data follow; errors are reported. A vector
            that starts with a minus is written --exact="-x;0;0".
        body_force: force per volume, a vector; zero where neither it nor exact is given; also one for each solid.
        displacement: displacement on the faces without traction, a vector; zero where neither it nor exact is given.
        traction: faces where a traction is given, each as "FACE=VECTOR", FACE=0 for a face that is free, or FACE for
            the traction of the exact solution.
        young: Young's modulus E; of several solids also one for each by its name, "steel: 210000, pad: 8", and of
            several patches "p0: 210, p1: 70". The second solid is solid2 if it has no name; a name with a comma or a
            colon stands in quotes.
        poisson_ratio: Poisson's ratio nu, as young.
        formulation: "mixed" solves for displacement and pressure, as bodies that hardly change their volume need,
            "displacement" for the displacement alone; by default mixed where Poisson's ratio exceeds 0.45.
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

    Examples:
        >>> import iga_nn
        >>> iga_nn.ElasticityOptions(body_force="0;0;-1", young=210.0).problem().body_force
        ['0', '0', '-1']
    """

    body_force: Formula | None = None
    displacement: Formula | None = None
    traction: tuple[str, ...] = ()
    young: float | str = 1.0
    poisson_ratio: float | str = 0.3
    formulation: Literal["mixed", "displacement"] | None = None
    fix: tuple[str, ...] = ()
    roller: tuple[str, ...] = ()
    symmetry: tuple[str, ...] = ()
    load: tuple[str, ...] = ()
    pressure: tuple[str, ...] = ()
    spring: tuple[str, ...] = ()
    stress_unit: str | None = None

    section: ClassVar[str] = "elasticity"
    title: ClassVar[str] = "linear elasticity"
    essential: ClassVar[Row] = ("displacement u", "displacement")
    natural: ClassVar[Row] = ("traction σ n", "traction")
    on_faces: ClassVar[tuple[str, ...]] = ("traction",)
    sheet: ClassVar[Sheet] = Sheet(
        "an elastic body",
        "−div σ = f, small displacements. Click a face of the part for its region; the rest of its boundary is free.",
        (
            ("young", "Young's modulus E", "1"),
            ("poisson_ratio", "Poisson's ratio ν", "0.3"),
            ("body_force", "Force per volume, three formulas", "0;0;0"),
            ("stress_unit", "Unit of stresses, such as MPa", "none"),
        ),
        {"young": "E", "poisson_ratio": "ν", "body_force": "f"},
    )

    @classmethod
    def law_of(cls, section: Mapping[str, Any]) -> list[Row]:
        """Return the equation with the material, Lame's constants too if there is one material, and the force."""
        young, ratio = (section.get(name, getattr(cls, name)) for name in ("young", "poisson_ratio"))
        said = (f"{value:g}" if isinstance(value, float | int) else value for value in (young, ratio))
        material = "Young's modulus E = {}, Poisson's ratio ν = {}".format(*said)
        if not isinstance(young, str) and not isinstance(ratio, str):
            first, shear = young * ratio / ((1.0 + ratio) * (1.0 - 2.0 * ratio)), young / (2.0 * (1.0 + ratio))
            material += f"; λ = {first:.6g}, μ = {shear:.6g}"
        equation = "−∇·σ = f,  σ = λ (∇·u) I + μ (∇u + ∇uᵀ)"
        force = section.get("body_force", "")
        return [("equation", equation), ("material", material), ("force f per volume", force)]

    def solve_options(self) -> SolveOptions:
        """Return the options of the solve on the finest mesh; a slender body needs more iterations than a scalar."""
        return replace(super().solve_options(), max_iterations=MOST_ITERATIONS, formulation=self.formulation)

    @property
    def units(self) -> Units:
        """Return the units for colour bars."""
        return Units(self.unit, self.stress_unit)

    def problem(self) -> Elasticity:
        """Return the problem of these options. Raises InputError."""
        check_space(self.refine, self.degree)
        loads = self.exact, self.body_force, self.displacement, self.traction, self.load, self.pressure, self.fix
        if not any(loads):
            raise InputError(
                "nothing acts on the body, no load is given: --load 'nz > 0.9=0;0;-1', --pressure, "
                "--body-force '0;0;-1', --traction or a displacement"
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
                body_force=_by_patch("--body-force", self.body_force, partial(texts.vector, "--body-force")),
                displacement=texts.vector("--displacement", self.displacement),
                traction={face: texts.vector(f"--traction {face}", text) for face, text in traction.items()},
                young=modulus("--young", self.young),
                poisson_ratio=modulus("--poisson-ratio", self.poisson_ratio),
                conditions=self.conditions(3),
            )
        self.asks(body)
        return body


def modulus(flag: str, given: float | str) -> Any:
    """Return a number of a material, or the numbers of each patch or solid. Raises InputError."""
    return given if not isinstance(given, str) else texts.by_patch(flag, given, partial(texts.number, flag))


PROBLEMS: dict[str, type[ProblemOptions]] = {kind.section: kind for kind in (PoissonOptions, ElasticityOptions)}
