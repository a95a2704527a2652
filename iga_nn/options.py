"""Holds the options of the pipeline and of the command line, and checks their values."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import KW_ONLY, dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from parameterize.config import MAX_CONTROL_POINTS

from .errors import InputError, input_errors
from .kinds import Checked

if TYPE_CHECKING:
    from parameterize.config import Config
    from parameterize.spline.volume import BSplineVolume
    from solve import Elasticity, Poisson, SolveOptions
    from solve.forms.problem import BoundaryValueProblem

Formula = str  # one that starts with a minus is written --option=-x

LONGEST_UNIT = 20  # letters
MAX_REFINE = 6
MAX_DOFS = 20_000_000  # some 15 GB at degree 3
MOST_ITERATIONS = 3000  # of an elastic body; a bracket held at one end takes 680, and some 1600 after a refinement
MAX_WORKERS = 256  # on one machine
_LOCAL = ("workers", "threads_per_worker", "memory_limit")  # mean nothing for the workers of another scheduler


@dataclass(frozen=True, kw_only=True)
class SurfaceOptions(Checked):
    """Say which surface is taken from a file.

    Attributes:
        component: number of the connected component to take, counted from 0.
        max_faces: refuse surfaces with more faces.
        decimate: reduce surfaces with more faces to max_faces instead; a notice says how far they moved.
    """

    component: int | None = None
    max_faces: int = 500_000
    decimate: bool = False

    def reading(self) -> dict[str, Any]:
        """Return the keywords of `models.resolve`."""
        return {field.name: getattr(self, field.name) for field in fields(SurfaceOptions)}


@dataclass(frozen=True)
class MapOptions(SurfaceOptions):
    """Say how a surface becomes a volume.

    Attributes:
        preset: "fast", made for two CPU cores; "grown", where every map grows from a cube, also of easy shapes; or
            "paper", the paper's own settings.
        seed: equal seeds give equal volumes, bit for bit.
        device: where the network is trained; "auto" takes CUDA where it is available.
        control_points: number of control points per direction; "auto" starts with 30 and adds more where the surface is
            not met, each direction its own, until the tolerance is met or there are max_control_points.
        corners: JSON file with a list of eight corners, in the order (0,0,0), (0,0,1), (0,1,0), ..., (1,1,1) of the
            cube's: points of three coordinates in the surface's units, or vertex numbers counted from 0; or an object
            {"XYZ": [...]} with eight points in X, Y, Z, scaled to volume 1 about the middle of the bounding box.
        resume: continue from the checkpoint in the output folder.
        steps_factor: multiply the steps of every stage by this factor; a small one gives a quick look.
        tolerance: of control_points "auto": root mean square distance between surface and spline, taken both ways, over
            the diagonal of the surface's bounding box.
        max_control_points: of control_points "auto": at most so many per direction, 30 or more, with which it starts.

    Examples:
        >>> import iga_nn
        >>> iga_nn.MapOptions(control_points=20, steps_factor=0.5).config().spline.control_points
        20
    """

    preset: Literal["fast", "grown", "paper"] = "fast"
    seed: int = 0
    device: Literal["auto", "cpu", "cuda"] = "auto"
    control_points: int | Literal["auto"] = 30
    corners: Path | None = None
    resume: bool = False
    steps_factor: float = 1.0
    tolerance: float = 5e-4
    max_control_points: int = 60

    def config(self) -> Config:
        """Return the configuration of these options. Raises InputError for values that cannot be run."""
        from parameterize.config import preset

        if self.seed < 0:
            raise InputError(f"seed {self.seed}: must not be negative")
        with input_errors():
            config = preset(self.preset).scaled(self.steps_factor)
            if self.control_points == "auto":
                first = config.spline.control_points
                _check_count("max control points", self.max_control_points, first, f"; auto starts with {first}")
                return config.refined(self.tolerance, self.max_control_points)
            _check_count("control points", self.control_points, config.spline.degree + 1)
            for name in ("tolerance", "max_control_points"):
                if getattr(self, name) != getattr(MapOptions, name):
                    raise InputError(f"{name.replace('_', ' ')}: has a meaning with --control-points auto alone")
            return config.with_control_points(self.control_points)

    @property
    def most_control_points(self) -> int:
        """Return how many control points a direction may get."""
        return self.max_control_points if self.control_points == "auto" else self.control_points


@dataclass(frozen=True)
class Units:
    """Hold the texts that stand behind the values of a solution and behind stresses, None where none is given."""

    displacement: str | None = None
    stress: str | None = None


NO_UNITS = Units()


@dataclass(frozen=True)
class ProblemOptions(Checked, ABC):
    """Hold what every PDE of the command line is told: its exact solution, the meshes it is solved on, and how.

    A new PDE is a subclass with options of its own, entered in PROBLEMS.

    Attributes:
        refine: levels to solve on; level n halves every knot span of the map n times.
        degree: degree of the trial space; that of the map by default.
        quadrature: rule of the operator: "spline", the fewest points that keep the error of "gauss+1", degree + 1 Gauss
            points a span; "gauss", degree points a span.
        unit: of lengths, such as mm: free text, which stands behind lengths and places and changes no number.
    """

    exact: Formula | None = None
    _: KW_ONLY
    refine: tuple[int, ...] = (0, 1)
    degree: int | None = None
    quadrature: Literal["spline", "gauss", "gauss+1"] = "spline"
    unit: str | None = None

    section: ClassVar[str]  # its name on the command line and in report.json
    title: ClassVar[str]

    @abstractmethod
    def problem(self) -> BoundaryValueProblem:
        """Return the problem of these options. Raises InputError."""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("unit", "stress_unit"):
            text = getattr(self, name, None)
            if text is not None and not (text.strip() and text.isprintable() and len(text) <= LONGEST_UNIT):
                flag = "--" + name.replace("_", "-")
                raise InputError(f"{flag} {text!r:.80}: give a short text such as mm, at most {LONGEST_UNIT} letters")

    @property
    def units(self) -> Units:
        """Return what stands beside colour bars."""
        return NO_UNITS

    def solve_options(self) -> SolveOptions:
        """Return the options of the solve on the finest mesh."""
        from solve import SolveOptions

        return SolveOptions(refine=max(self.refine), degree=self.degree, quadrature=self.quadrature)


@dataclass(frozen=True)
class PoissonOptions(ProblemOptions):
    """State -div(kappa grad u) + c u = f on the volume, with data on its six faces, and the meshes it is solved on.

    A formula may use x, y, z, in the input's units, and X, Y, Z, the same scaled to volume 1 about the middle of the
    volume's bounding box: X = (x - c) / V^(1/3). A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and
    so on.

    Attributes:
        exact: exact solution, a formula, from which f and g follow; errors are reported. It is exp(X+Z)*sin(Y) where
            neither f nor g is given. A formula that starts with a minus is written --exact=-x.
        source: f, a formula.
        boundary: g, the values of u, a formula.
        kappa: one formula, or six separated by commas for a symmetric tensor: xx,xy,xz,yy,yz,zz.
        reaction: c, a formula.
        neumann: faces with a given flux kappa du/dn, each as FACE=FORMULA, or FACE for that of the exact solution.
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

    def problem(self) -> Poisson:
        """Return the problem of these options. Raises InputError."""
        from solve import Poisson

        check_space(self.refine, self.degree)
        robin = {}
        for face, text in _faces("robin", self.robin).items():
            alpha, colon, g = (text or "").partition(":")
            if not alpha.strip():
                raise InputError(f"robin {face}: write {face}=ALPHA or {face}=ALPHA:FORMULA")
            robin[face] = (alpha, g if colon else None)
        with input_errors():
            return Poisson(
                exact=self.exact,
                source=self.source,
                boundary=self.boundary,
                kappa=None if self.kappa is None else self.kappa.split(","),
                reaction=self.reaction,
                neumann=_faces("neumann", self.neumann),
                robin=robin,
                value=_on_regions("value", self.value, str),
                inflow=_on_regions("flux", self.flux, str),
                exchange=_on_regions("exchange", self.exchange, _pair),
            )


@dataclass(frozen=True)
class ElasticityOptions(ProblemOptions):
    """State linear elasticity of the volume as an isotropic body, and the meshes it is solved on.

    A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and so on. A vector is three formulas in x, y, z
    or X, Y, Z (scaled to volume 1 about the middle), separated by semicolons, in quotes: "x*y;0;sin(z)"; 0 is the zero
    vector.

    Attributes:
        exact: exact displacement, a vector, from which force and boundary data follow; errors are reported. One that
            starts with a minus is written --exact="-x;0;0".
        body_force: force per volume, a vector; zero where neither it nor exact is given.
        displacement: displacement on the faces without traction, a vector; zero where neither it nor exact is given.
        traction: faces where a traction is given, each as "FACE=VECTOR", FACE=0 for a face that is free, or FACE for
            that of the exact solution.
        young: Young's modulus E.
        poisson_ratio: Poisson's ratio nu.
        fix: regions of the boundary that are held, each as REGION, or "REGION=VECTOR" for a given displacement; an
            entry of the vector that is left out is free: "x < 1=0;;". A region is a condition on position and outward
            normal, "nz > 0.9 and x < 2", a face of the part, "face(x, y, z)", a group of the mesh, group:NAME, a
            box(x0, y0, z0, x1, y1, z1) or a face of the cube. Where regions are given, all else of the boundary is
            free.
        roller: regions held along their normal alone.
        symmetry: the same: where a plane of symmetry cuts the body.
        load: regions with a force per area, each as "REGION=VECTOR".
        pressure: regions with a force per area against the outward normal, each as "REGION=FORMULA".
        spring: regions on an elastic foundation, force per area and displacement, each as "REGION=FORMULA".
        stress_unit: of stresses, such as MPa: free text, which stands behind stresses and changes no number.

    Examples:
        >>> import iga_nn
        >>> iga_nn.ElasticityOptions(body_force="0;0;-1", young=210.0).problem().force
        ['0', '0', '-1']
    """

    body_force: Formula | None = None
    displacement: Formula | None = None
    traction: tuple[str, ...] = ()
    young: float = 1.0
    poisson_ratio: float = 0.3
    fix: tuple[str, ...] = ()
    roller: tuple[str, ...] = ()
    symmetry: tuple[str, ...] = ()
    load: tuple[str, ...] = ()
    pressure: tuple[str, ...] = ()
    spring: tuple[str, ...] = ()
    stress_unit: str | None = None

    section: ClassVar[str] = "elasticity"
    title: ClassVar[str] = "linear elasticity"

    def solve_options(self) -> SolveOptions:
        """Return the options of the solve on the finest mesh: a slender body takes more iterations than a scalar."""
        return replace(super().solve_options(), max_iterations=MOST_ITERATIONS)

    @property
    def units(self) -> Units:
        """Return what stands beside colour bars."""
        return Units(self.unit, self.stress_unit)

    def problem(self) -> Elasticity:
        """Return the problem of these options. Raises InputError."""
        from solve import Elasticity

        check_space(self.refine, self.degree)
        loads = self.exact, self.body_force, self.displacement, self.traction, self.load, self.pressure, self.fix
        if not any(loads):
            raise InputError(
                "no load is given: --load 'nz > 0.9=0;0;-1', --pressure, --body-force '0;0;-1' or --traction"
            )
        traction = _faces("traction", self.traction)
        with input_errors():
            body = Elasticity(
                exact=_vector("--exact", self.exact),
                force=_vector("--body-force", self.body_force),
                displacement=_vector("--displacement", self.displacement),
                traction={face: _vector(f"--traction {face}", text) for face, text in traction.items()},
                young=self.young,
                poisson_ratio=self.poisson_ratio,
                fix=_on_regions("fix", self.fix, _parts),
                roller=_on_regions("roller", self.roller, str),
                symmetry=_on_regions("symmetry", self.symmetry, str),
                load=_on_regions("load", self.load, partial(_vector, "--load")),
                pressure=_on_regions("pressure", self.pressure, str),
                spring=_on_regions("spring", self.spring, str),
            )
            body.demand_held()
            return body


PROBLEMS: dict[str, type[ProblemOptions]] = {kind.section: kind for kind in (PoissonOptions, ElasticityOptions)}


@dataclass(frozen=True)
class StudyOptions(Checked):
    """Give an exact solution of Poisson's problem, and the trial spaces it is approximated in.

    Attributes:
        exact: the solution, a formula in x, y, z or X, Y, Z (scaled to volume 1 about the middle); exp(X+Z)*sin(Y) by
            default. One that starts with a minus is written --exact=-x.
        degree: one or more degrees; that of the map by default.
        refine: levels to solve on, 0 1 2 or 0..2; level n halves every knot span of the map n times.
    """

    exact: Formula | None = None
    degree: tuple[int, ...] = ()
    refine: tuple[str, ...] = ("0..2",)

    command: ClassVar[str] = "study"

    def problem(self) -> BoundaryValueProblem:
        """Return the problem of these options. Raises InputError."""
        return PoissonOptions(exact=self.exact).problem()

    def levels(self) -> list[int]:
        """Return the refinement levels in order. Raises InputError, also for degrees that cannot be run."""
        levels = [level for text in self.refine for level in _range(text)]
        if len(set(self.degree)) != len(self.degree):
            raise InputError(f"degree {self.degree}: give distinct degrees")
        for degree in self.degree or (None,):
            check_space(levels, degree)
        return sorted(levels)


@dataclass(frozen=True)
class ElasticityStudyOptions(StudyOptions):
    """Give an exact displacement of an elastic body, and the trial spaces it is approximated in.

    Attributes:
        exact: the displacement, a vector: three formulas in x, y, z or X, Y, Z (scaled to volume 1 about the middle),
            separated by semicolons, in quotes: "x*y;0;sin(z)".
        traction: faces with the traction of that displacement; the others carry the displacement itself.
        young: Young's modulus E.
        poisson_ratio: Poisson's ratio nu.
    """

    traction: tuple[str, ...] = ()
    young: float = 1.0
    poisson_ratio: float = 0.3

    command: ClassVar[str] = "study elasticity"

    def problem(self) -> BoundaryValueProblem:
        """Return the problem of these options. Raises InputError."""
        if given := [entry for entry in self.traction if "=" in entry]:
            face = given[0].partition("=")[0]
            raise InputError(f"traction {given[0]}: a study takes that of the exact displacement: write {face} alone")
        if self.exact is None:
            raise InputError("no solution to compare with: give the displacement as --exact 'x*y;sin(z);x'")
        own = ElasticityOptions(self.exact, traction=self.traction, young=self.young, poisson_ratio=self.poisson_ratio)
        return own.problem()


@dataclass(frozen=True)
class ModesOptions(Checked):
    """State which vibrations of an elastic body are sought, what it is made of and where it is held.

    Attributes:
        young: Young's modulus E.
        poisson_ratio: Poisson's ratio nu.
        density: mass per volume, in units that agree with those of E and of the volume.
        number: how many modes, from the lowest frequency on.
        fix: regions of the boundary that are held, as in `run elasticity`: "nz < -0.9", "face(x, y, z)", group:NAME,
            u0; without any the body is free, and its rigid motions are left out.
        roller: regions held along their normal alone.
        refine: how often every knot span of the map is halved.
        degree: degree of the trial space; that of the map by default.
    """

    young: float = 1.0
    poisson_ratio: float = 0.3
    density: float = 1.0
    number: int = 6
    fix: tuple[str, ...] = ()
    roller: tuple[str, ...] = ()
    refine: int = 0
    degree: int | None = None

    def problem(self) -> Elasticity:
        """Return the body, without loads. Raises InputError."""
        from parameterize.spline.volume import FACE_NAMES
        from solve import Elasticity
        from solve.modes import check_modes

        check_space([self.refine], self.degree)
        free = {} if self.fix or self.roller else dict.fromkeys(FACE_NAMES, ["0"] * 3)
        held = {"fix": self.fix or None, "roller": self.roller or None}
        with input_errors():
            check_modes(self.density, self.number)
            return Elasticity(traction=free, young=self.young, poisson_ratio=self.poisson_ratio, **held)


@dataclass(frozen=True, kw_only=True)
class WorkerOptions(Checked):
    """Say which workers compute the surfaces of a batch.

    Attributes:
        workers: worker processes on this machine; each computes one surface at a time.
        threads_per_worker: threads that a surface is computed with; the result does not depend on them.
        memory_limit: memory of a worker, such as 4GiB; one that takes more is ended, and 0 sets no limit.
        retries: how often a surface goes on from its checkpoint after its worker was lost or its run failed.
        scheduler: address of a dask scheduler, such as tcp://host:8786, whose workers compute instead of workers on
            this machine; they must see the same folders under the same paths.

    Examples:
        >>> import iga_nn
        >>> iga_nn.WorkerOptions(workers=4, memory_limit="2GiB").retries
        1
    """

    workers: int = 2
    threads_per_worker: int = 1
    memory_limit: str = "4GiB"
    retries: int = 1
    scheduler: str | None = None

    def check(self) -> None:
        """Raise InputError for values that cannot be run; the memory limit is read where the workers start."""
        for name in ("workers", "threads_per_worker"):
            if not 1 <= getattr(self, name) <= MAX_WORKERS:
                flag = name.replace("_", " ")
                raise InputError(f"{flag} {getattr(self, name)}: must lie between 1 and {MAX_WORKERS}")
        if self.retries < 0:
            raise InputError(f"retries {self.retries}: must not be negative")
        if self.scheduler == "":
            raise InputError("scheduler is empty: give its address, such as tcp://host:8786")
        given = [field.name for field in fields(self) if getattr(self, field.name) != field.default]
        if self.scheduler is not None and (local := [name for name in _LOCAL if name in given]):
            flag = "--" + local[0].replace("_", "-")
            raise InputError(f"{flag}: is for workers on this machine; leave it out with --scheduler")


def _check_count(name: str, count: int, fewest: int, reason: str = "") -> None:
    """Raise InputError for a number of control points that cannot be run."""
    if not fewest <= count <= MAX_CONTROL_POINTS:
        raise InputError(f"{name} {count}: at least {fewest}, at most {MAX_CONTROL_POINTS} per direction{reason}")


def check_space(refine: Sequence[int], degree: int | None) -> None:
    """Raise InputError for levels or a degree that cannot be run."""
    if not refine:
        raise InputError("refine is empty: give one or more levels, such as 0 1")
    if min(refine) < 0 or len(set(refine)) != len(refine):
        raise InputError(f"refine {refine}: give distinct levels, 0 or larger")
    _check_level(max(refine))
    from solve.discretization.space import MOST_DEGREE

    if degree is not None and not 1 <= degree <= MOST_DEGREE:
        raise InputError(f"degree {degree}: must lie between 1 and {MOST_DEGREE}")


def _check_level(level: int) -> None:
    if level > MAX_REFINE:
        raise InputError(f"refine {level}: at most {MAX_REFINE}; each level has 8 times the unknowns")


def check_size(volume: BSplineVolume, refine: int, degree: int | None, components: int = 1, processes: int = 1) -> int:
    """Return the number of unknowns on a mesh of the volume. Raises InputError where they are too many for as many
    processes.
    """
    from solve.discretization.space import trial_space

    dofs = components * trial_space(volume, refine, degree).dofs
    if dofs > (most := MAX_DOFS * processes):
        raise InputError(f"refine {refine} gives {dofs:,} unknowns, more than {most:,}: lower refine or degree")
    return dofs


def _range(text: str) -> list[int]:
    """Return a level, or all from the first to the last of "0..4". Raises InputError."""
    first, dots, last = text.partition("..")
    if not (first.isdecimal() and (last.isdecimal() or not dots)):
        raise InputError(f"refine {text!r}: write levels such as 0 1 2, or a range such as 0..2")
    _check_level(int(last or first))  # before the list is made
    if int(last or first) < int(first):
        raise InputError(f"refine {text!r}: the range ends before it begins; write {last}..{first}")
    return list(range(int(first), int(last or first) + 1))


def _faces(name: str, entries: Sequence[str]) -> dict[str, str | None]:
    """Return FACE=TEXT and FACE entries as a table. Raises InputError for a face named twice."""
    found: dict[str, str | None] = {}
    for entry in entries:
        face, equals, text = entry.partition("=")
        if face in found:
            raise InputError(f"{name}: face {face} is given twice")
        found[face] = text if equals else None
    return found


def _on_regions(kind: str, entries: Sequence[str], read: Callable[[str], Any]) -> dict[str, Any] | None:
    """Return REGION=DATA and REGION entries as a table, None without entries. Raises InputError for a region twice.

    read: makes data of their text; an entry without data has None. The = of <= and >=, and what stands between quotes,
    belongs to the region.
    """
    found: dict[str, Any] = {}
    for entry in entries:
        split = _EQUALS.search(_QUOTED.sub(lambda text: "." * len(text[0]), entry))
        region = (entry if split is None else entry[: split.start()]).strip()
        if not region:
            raise InputError(f"{kind} {entry!r:.80}: write a region before the =, such as 'nz > 0.9'")
        if region in found:
            raise InputError(f"{kind}: region {region!r:.80} is given twice")
        found[region] = None if split is None else read(entry[split.end() :].strip())
    return found or None


_EQUALS = re.compile("(?<![<>=])=(?!=)")
_QUOTED = re.compile("\"[^\"]*\"|'[^']*'")


def _pair(text: str) -> tuple[str, str]:
    """Return a factor and what the outside has, from ALPHA:OUTSIDE. Raises InputError."""
    factor, colon, outside = text.partition(":")
    if not (factor.strip() and colon and outside.strip()):
        raise InputError(f"exchange {text!r:.80}: write REGION=ALPHA:OUTSIDE, such as 'nz > 0.9=25:20'")
    return factor, outside


def _parts(text: str) -> list[str | None] | None:
    """Return the formulas of a vector, None for an entry that is left out."""
    entries = _vector("--fix", text)
    return None if entries is None else [entry if entry.strip() else None for entry in entries]


def _vector(flag: str, text: str | None) -> list[str] | None:
    """Return the formulas of a vector; "0" is the zero vector. Raises InputError where they are not three."""
    if text is None:
        return None
    entries = ["0"] * 3 if text.strip() == "0" else text.split(";")
    if len(entries) != 3:
        form = "write three formulas with semicolons between them, such as '0;0;-1', or 0 for none"
        raise InputError(f"{flag} {text!r:.80}: {form}")
    return entries
