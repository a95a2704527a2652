"""What a user may choose: the options of the pipeline and of the command line, and the check of their values."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from .errors import InputError, input_errors

if TYPE_CHECKING:
    import numpy as np

    from parameterize.config import Config
    from parameterize.spline.volume import BSplineVolume
    from solve import Elasticity, Poisson
    from solve.forms.frame import UnitFrame

_CORNERS_BYTES = 65_536
_LARGEST_COORDINATE = 1e100  # distances of larger ones overflow
_LARGEST_WHOLE = 2**53  # beyond it not every whole number is a float64
MAX_CONTROL_POINTS = 100  # per direction
MAX_STEPS_FACTOR = 100.0
MAX_REFINE = 6
MAX_DOFS = 20_000_000  # some 15 GB at degree 3


@dataclass(frozen=True)
class MapOptions:
    """How a surface becomes a volume.

    Attributes:
        preset: "fast", made for two CPU cores, or "paper", the paper's own settings.
        seed: equal seeds give equal volumes, bit for bit.
        device: where the network is trained; "auto" takes CUDA where there is one.
        control_points: per direction.
        corners: JSON file with a list of eight, one a corner of the cube in the order (0,0,0), (0,0,1), (0,1,0), ...,
            (1,1,1): points of three coordinates in the surface's units, or vertex numbers counted from 0; or an object
            {"XYZ": [...]} with eight points in X, Y, Z, scaled to volume 1 about the middle of the bounding box.
        resume: go on from the checkpoint in the output folder.
        component: which connected piece of the file to take, counted from 0.
        max_faces: refuse larger surfaces.
        decimate: bring larger surfaces down to max_faces instead; a notice says how far they moved.
        steps_factor: shorten (or lengthen) every stage by this factor; for a quick look.
    """

    preset: Literal["fast", "paper"] = "fast"
    seed: int = 0
    device: Literal["auto", "cpu", "cuda"] = "auto"
    control_points: int = 30
    corners: Path | None = None
    resume: bool = False
    component: int | None = None
    max_faces: int = 500_000
    decimate: bool = False
    steps_factor: float = 1.0

    def config(self) -> Config:
        """The configuration these options name. Raises InputError for values that cannot be run."""
        from parameterize.config import preset

        if self.seed < 0:
            raise InputError(f"seed {self.seed}: must not be negative")
        if not 0.0 < self.steps_factor <= MAX_STEPS_FACTOR:
            raise InputError(f"steps factor {self.steps_factor}: must be positive, at most {MAX_STEPS_FACTOR:g}")
        if self.control_points > MAX_CONTROL_POINTS:
            raise InputError(f"control points {self.control_points}: at most {MAX_CONTROL_POINTS} per direction")
        with input_errors():
            config = preset(self.preset).scaled(self.steps_factor).with_control_points(self.control_points)
        if self.control_points <= config.spline.degree:
            raise InputError(
                f"control points {self.control_points}: degree 3 needs at least {config.spline.degree + 1}"
            )
        return config


@dataclass(frozen=True)
class PoissonOptions:
    """-div(kappa grad u) + c u = f on the volume, data on its six faces, and the meshes it is solved on.

    A formula knows x, y, z, in the input's units, and X, Y, Z, the same scaled to volume 1 about the middle of the
    volume's bounding box: X = (x - c) / V^(1/3). A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and
    so on.

    Attributes:
        exact: solution as a formula; gives f and g, and errors are reported. exp(X+Z)*sin(Y) where neither f nor g is
            given. A formula that starts with a minus is written --exact=-x.
        source: f, a formula.
        boundary: g, the values of u, a formula.
        kappa: one formula, or six with commas between them for a symmetric tensor: xx,xy,xz,yy,yz,zz.
        reaction: c, a formula.
        neumann: faces with the flux kappa du/dn, each as FACE=FORMULA, or FACE alone for that of the exact solution.
        robin: faces with kappa du/dn + alpha u = g, each as FACE=ALPHA:FORMULA, or FACE=ALPHA for the g of the exact
            solution.
        refine: each level halves every span of the map's knots that many times.
        degree: of the trial space; the map's own by default.
    """

    exact: str | None = None
    source: str | None = None
    boundary: str | None = None
    kappa: str | None = None
    reaction: str | None = None
    neumann: tuple[str, ...] = ()
    robin: tuple[str, ...] = ()
    refine: tuple[int, ...] = (0, 1)
    degree: int | None = None

    section: ClassVar[str] = "poisson"

    def problem(self) -> Poisson:
        """The problem these options name. Raises InputError."""
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
                kappa=self.kappa.split(",") if self.kappa else None,
                reaction=self.reaction,
                neumann=_faces("neumann", self.neumann),
                robin=robin,
            )


@dataclass(frozen=True)
class ElasticityOptions:
    """Linear elasticity of the volume as an isotropic body, and the meshes it is solved on.

    A face is one of u0, u1, v0, v1, w0, w1: the image of u = 0, u = 1 and so on. A vector is three formulas in x, y, z
    or X, Y, Z (scaled to volume 1 about the middle) with semicolons between them, in quotes: "x*y;0;sin(z)".

    Attributes:
        exact: displacement as a vector; gives force and boundary data, and errors are reported. One that starts with
            a minus is written --exact="-x;0;0".
        body_force: force per volume, a vector.
        displacement: its values on the faces without traction, a vector; zero without it and without exact.
        traction: faces that are pulled, each as "FACE=VECTOR", or FACE alone for the traction of the exact solution.
        young: Young's modulus E.
        poisson_ratio: Poisson's ratio nu.
        refine: each level halves every span of the map's knots that many times.
        degree: of the trial space; the map's own by default.
    """

    exact: str | None = None
    body_force: str | None = None
    displacement: str | None = None
    traction: tuple[str, ...] = ()
    young: float = 1.0
    poisson_ratio: float = 0.3
    refine: tuple[int, ...] = (0, 1)
    degree: int | None = None

    section: ClassVar[str] = "elasticity"

    def problem(self) -> Elasticity:
        """The problem these options name. Raises InputError."""
        from solve import Elasticity

        check_space(self.refine, self.degree)
        with input_errors():
            return Elasticity(
                exact=_vector(self.exact),
                force=_vector(self.body_force),
                displacement=_vector(self.displacement),
                traction={face: _vector(text) for face, text in _faces("traction", self.traction).items()},
                young=self.young,
                poisson_ratio=self.poisson_ratio,
            )


@dataclass(frozen=True)
class StudyOptions:
    """A known solution of Poisson's problem, and the trial spaces it is approximated in.

    Attributes:
        exact: the solution, a formula in x, y, z or X, Y, Z (scaled to volume 1 about the middle); exp(X+Z)*sin(Y) by
            default. One that starts with a minus is written --exact=-x.
        degree: one or more; the map's own by default.
        refine: levels, each halves every span of the map's knots that many times: 0 1 2, or 0..2.
    """

    exact: str | None = None
    degree: tuple[int, ...] = ()
    refine: tuple[str, ...] = ("0..2",)

    def problem(self) -> Poisson:
        """The problem these options name. Raises InputError."""
        return PoissonOptions(exact=self.exact).problem()

    def levels(self) -> list[int]:
        """The refinement levels in order. Raises InputError, also for degrees that cannot be run."""
        levels = [level for text in self.refine for level in _range(text)]
        if len(set(self.degree)) != len(self.degree):
            raise InputError(f"degree {self.degree}: give distinct degrees")
        for degree in self.degree or (None,):
            check_space(levels, degree)
        return sorted(levels)


ProblemOptions = PoissonOptions | ElasticityOptions


def check_space(refine: Sequence[int], degree: int | None) -> None:
    """Raise InputError for levels or a degree that cannot be run."""
    if not refine or min(refine) < 0 or len(set(refine)) != len(refine):
        raise InputError(f"refine {refine}: give distinct levels, 0 or larger")
    if max(refine) > MAX_REFINE:
        raise InputError(f"refine {max(refine)}: at most {MAX_REFINE}; each level has 8 times the unknowns")
    if degree is not None and not 1 <= degree <= 8:
        raise InputError(f"degree {degree}: must lie between 1 and 8")


def check_size(volume: BSplineVolume, refine: int, degree: int | None, components: int = 1) -> int:
    """The unknowns of a mesh on a volume of these knots. Raises InputError where these are too many."""
    from solve.discretization.space import trial_space

    dofs = components * trial_space(volume, refine, degree).dofs
    if dofs > MAX_DOFS:
        raise InputError(f"refine {refine} gives {dofs:,} unknowns, more than {MAX_DOFS:,}: lower refine or degree")
    return dofs


def _range(text: str) -> list[int]:
    """A level, or all from the first to the last of "0..4"."""
    first, dots, last = text.partition("..")
    if not (first.isdecimal() and (last.isdecimal() or not dots)):
        raise InputError(f"refine {text!r}: write levels such as 0 1 2, or a range such as 0..2")
    low, high = int(first), int(last or first)
    if high > MAX_REFINE:
        raise InputError(f"refine {high}: at most {MAX_REFINE}; each level has 8 times the unknowns")
    return list(range(low, high + 1))


def _faces(name: str, entries: Sequence[str]) -> dict[str, str | None]:
    """FACE=TEXT and FACE entries as a table. Raises InputError for a face named twice."""
    found: dict[str, str | None] = {}
    for entry in entries:
        face, equals, text = entry.partition("=")
        if face in found:
            raise InputError(f"{name}: face {face} is given twice")
        found[face] = text if equals else None
    return found


def _vector(text: str | None) -> list[str] | None:
    return None if text is None else text.split(";")


def read_corners(path: Path, frame: UnitFrame | None = None) -> np.ndarray[Any, Any]:
    """Eight points (8, 3) in the surface's units or eight whole numbers (8,) from a JSON file. Raises InputError.

    frame: of the surface; where it is known, the file may hold {"XYZ": [...]}, points in scaled coordinates.
    """
    import numpy as np

    try:
        with path.open(encoding="utf-8") as stream:
            given = json.loads(stream.read(_CORNERS_BYTES))
        is_scaled = frame is not None and isinstance(given, dict) and list(given) == ["XYZ"]
        if is_scaled:
            given = given["XYZ"]
        rows = np.array(given, dtype=np.float64)
        if any(isinstance(number, bool) for number in np.array(given, dtype=object).flat):
            raise TypeError
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (ValueError, TypeError, OverflowError, RecursionError):
        expected = 'a JSON list of eight points or of eight vertex numbers, or {"XYZ": eight points}'
        raise InputError(f"{path}: corners must be {expected}") from None
    if rows.shape not in ((8, 3), (8,)) or not np.all(np.abs(rows) <= _LARGEST_COORDINATE):  # refuses NaN, too
        raise InputError(
            f"{path}: corners must be eight points of three finite coordinates or eight vertex numbers, "
            f"found an array of shape {rows.shape}"
        )
    if rows.shape == (8, 3):
        return frame.to_units(rows) if frame is not None and is_scaled else rows
    if is_scaled:
        raise InputError(f"{path}: XYZ must hold eight points of three coordinates; vertex numbers stand in a list")
    if np.any(rows != np.rint(rows)) or np.abs(rows).max() > _LARGEST_WHOLE:
        raise InputError(f"{path}: vertex numbers must be whole and at most {_LARGEST_WHOLE}")
    return rows.astype(np.int64)
