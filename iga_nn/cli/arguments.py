"""Defines the arguments that several commands share, and the conversion of their texts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, make_dataclass
from pathlib import Path
from types import FunctionType
from typing import Annotated, Any, get_args

from cyclopts import App, CycloptsError, Parameter, Token, convert

from ..options import (
    PROBLEMS,
    UNITS,
    MapOptions,
    ModesOptions,
    ProblemOptions,
    StudyOptions,
    SurfaceOptions,
    WorkerOptions,
)
from ..type_check import hints_of


def converted(kind: Any, tokens: Sequence[Token]) -> Any:
    """Convert an argument as cyclopts does, but refuse a fraction for a whole number, which cyclopts would round."""
    if int in (kind, *get_args(kind)) and (wrong := [token for token in tokens if "." in token.value]):
        raise CycloptsError(msg=f"{wrong[0].keyword}: must be a whole number, got {wrong[0].value}")
    return convert(kind, tokens)


def with_values(argv: Sequence[str]) -> list[str]:
    """Return the words of a command line with the value of a --close that has none, so that a name may follow it."""
    words = list(argv)
    for place, word in enumerate(words):
        if word == "--close" and words[place + 1 : place + 2] != ["all"]:
            words[place] = "--close=true"
    return words


# Options of a problem that a study has of its own, or lacks.
OF_STUDY = ("refine", "degree", "quadrature", "ask", "accuracy", *UNITS)


def for_each_problem(group: App, *, is_default: bool = False, hidden: Sequence[str] = ()) -> Callable[[Any], Any]:
    """Return a decorator that makes a command of each problem: its `problem_options` takes the options of that problem.

    is_default: whether the group itself is the command of the first problem, too. hidden: options that are no flags.
    """

    def add(command: FunctionType) -> FunctionType:
        for name, kind in PROBLEMS.items():
            taken = _without(kind, hidden)
            one = FunctionType(command.__code__, command.__globals__, command.__name__, command.__defaults__)
            one.__kwdefaults__ = (command.__kwdefaults__ or {}) | {"problem_options": taken()}
            one.__annotations__ = command.__annotations__ | {"problem_options": taken}
            one.__doc__ = (command.__doc__ or "").format(title=kind.title)
            if is_default and kind is next(iter(PROBLEMS.values())):
                group.default(one)
            group.command(one, name=name)
        return command

    return add


def _without(kind: type[ProblemOptions], names: Sequence[str]) -> type[ProblemOptions]:
    """Return the options of a problem of which some are no flags, and have their defaults."""
    hints, left = hints_of(kind), [field for field in fields(kind) if field.name in names]
    if not left:
        return kind
    rows = [(field.name, Annotated[hints[field.name], Parameter(parse=False)], field.default) for field in left]
    own = {"__doc__": kind.__doc__, "__module__": kind.__module__}  # where its annotations mean something
    return make_dataclass(kind.__name__, rows, bases=(kind,), frozen=True, namespace=own)


Mesh = Annotated[str, Parameter(help="path of a closed surface, or the name of a sample or a model.")]
Volume = Annotated[
    Path,
    Parameter(
        help="volume.npz as `iga-nn run` writes it, or its folder; a file of G+Smo (XML), MFEM, GeoPDEs or splinepy "
        "(JSON); or a mesh of hexahedra or tetrahedra (.msh, .inp, .vtu, .vtk, Exodus)."
    ),
]
VolumeOrRun = Annotated[
    Path, Parameter(help="volume.npz, another file with a volume, or the output folder of a run, with its solution.")
]
ObjFile = Annotated[Path | None, Parameter(help="file to write; NAME.obj in the current folder by default.")]
Overwrite = Annotated[bool, Parameter(help="replace that file where it has other content.")]
Mpi = Annotated[
    bool, Parameter(help="share the solve among the processes of `mpiexec -n 4 iga-nn solve ...`; docs/mpi.md.")
]
Json = Annotated[bool, Parameter(name="--json", help="print the verdict as JSON.")]


@dataclass(frozen=True)
class OutputOptions:
    """Hold the options of the output folder and of the terminal.

    Args:
        out: output folder; the input's stem in the current folder by default.
        force: replace a finished result in that folder.
        vector: also write plots of curves (loss history, errors over the mesh size) as PDF.
        quiet: show no progress.
        time_limit: time such as 90s, 10min or 1h, after which a run ends with the best result it has; in a batch it is
            that of each surface, and --resume continues.
    """

    out: str | None = None
    force: bool = False
    vector: bool = False
    quiet: bool = False
    time_limit: str | None = None
    as_json: Json = False

    @property
    def folder(self) -> dict[str, Any]:
        """Return the keywords of the pipeline."""
        return {name: getattr(self, name) for name in ("out", "force", "vector", "time_limit")}


@dataclass(frozen=True)
class PageOptions(MapOptions):
    """Hold the options of the map for all surfaces of the live page, without those of a single surface."""

    corners: Annotated[Path | None, Parameter(parse=False)] = None
    resume: Annotated[bool, Parameter(parse=False)] = False


for kind in (OutputOptions, SurfaceOptions, WorkerOptions, ProblemOptions, StudyOptions, ModesOptions):
    Parameter(name="*")(kind)  # each field of these options, and of those derived from them, is a flag
