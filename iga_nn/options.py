"""What a user may choose: the options of the pipeline and of the command line, and the check of their values."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

if TYPE_CHECKING:
    from parameterize.config import Config
    from parameterize.volume import BSplineVolume
    from solve import Poisson

_CORNERS_BYTES = 65_536
MAX_CONTROL_POINTS = 100  # per direction
MAX_STEPS_FACTOR = 100.0
MAX_REFINE = 6
MAX_DOFS = 20_000_000  # some 15 GB at degree 3
DEFAULT_EXACT = "exp(x+z)*sin(y)"  # the paper's problem, section 5.5


class InputError(ValueError):
    """An option, an input file or the output folder is at fault; one line that says which, and the remedy."""


@contextmanager
def input_errors() -> Iterator[None]:
    """Turn a check's ValueError or OSError into an InputError: around calls that only read or check what was given."""
    try:
        yield
    except (OSError, ValueError) as error:
        raise InputError(one_line(error)) from None


def one_line(error: BaseException) -> str:
    """What an exception says, as one line; "path: reason" where the operating system refused."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(str(error).split())


@dataclass(frozen=True)
class MapOptions:
    """How a surface becomes a volume.

    Attributes:
        preset: "fast", made for two CPU cores, or "paper", the paper's own settings.
        seed: equal seeds give equal volumes, bit for bit.
        device: where the network is trained; "auto" takes CUDA where there is one.
        control_points: per direction.
        corners: JSON file with a list of eight, one a corner of the cube in the order (0,0,0), (0,0,1), (0,1,0), ...,
            (1,1,1): points of three coordinates in the surface's units, or vertex numbers counted from 0.
        resume: go on from the checkpoint in the output folder.
        component: which connected piece of the file to take, counted from 0.
        max_faces: refuse larger surfaces.
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
    """Poisson's problem -Laplace u = f on the volume, u = g on its boundary, and the meshes it is solved on.

    Attributes:
        exact: solution as a formula in x, y, z; gives f and g, and errors are reported. The paper's exp(x+z)*sin(y)
            where neither f nor g is given. A formula that starts with a minus is written --exact=-x.
        source: f, a formula in x, y, z.
        boundary: g, a formula in x, y, z.
        refine: each level halves every span of the map's knots that many times.
        degree: of the trial space; the map's own by default.
    """

    exact: str | None = None
    source: str | None = None
    boundary: str | None = None
    refine: tuple[int, ...] = (0, 1)
    degree: int | None = None

    def problem(self) -> Poisson:
        """The problem these options name. Raises InputError."""
        from solve import Poisson

        if not self.refine or min(self.refine) < 0 or len(set(self.refine)) != len(self.refine):
            raise InputError(f"refine {self.refine}: give distinct levels, 0 or larger")
        if max(self.refine) > MAX_REFINE:
            raise InputError(f"refine {max(self.refine)}: at most {MAX_REFINE}; each level has 8 times the unknowns")
        if self.degree is not None and not 1 <= self.degree <= 8:
            raise InputError(f"degree {self.degree}: must lie between 1 and 8")
        exact = self.exact
        if exact is None and self.source is None and self.boundary is None:
            exact = DEFAULT_EXACT
        with input_errors():
            return Poisson(exact=exact, source=self.source, boundary=self.boundary)

    def check_size(self, volume: BSplineVolume) -> None:
        """Raise InputError where the finest mesh on a volume of these knots has too many unknowns."""
        from solve.space import trial_space

        dofs = trial_space(volume, max(self.refine), self.degree).dofs
        if dofs > MAX_DOFS:
            raise InputError(
                f"refine {max(self.refine)} gives {dofs:,} unknowns, more than {MAX_DOFS:,}: lower refine or degree"
            )


def read_corners(path: Path) -> np.ndarray[Any, Any]:
    """Eight points (8, 3) or eight whole numbers (8,) from a JSON list. Raises InputError."""
    try:
        with path.open(encoding="utf-8") as stream:
            given = json.loads(stream.read(_CORNERS_BYTES))
        rows = np.array(given, dtype=np.float64)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    except (ValueError, TypeError, OverflowError, RecursionError):
        raise InputError(f"{path}: corners must be a JSON list of eight points or of eight vertex numbers") from None
    if rows.shape not in ((8, 3), (8,)) or not np.all(np.isfinite(rows)):
        raise InputError(
            f"{path}: corners must be eight points of three finite coordinates or eight vertex numbers, "
            f"found an array of shape {rows.shape}"
        )
    if rows.shape == (8, 3):
        return rows
    numbers = rows.astype(np.int64)
    if np.any(numbers != rows):
        raise InputError(f"{path}: vertex numbers must be whole")
    return numbers
