"""Writes the volume of a file or of a run, with its solution, in a format of the table in `io.kinds`.

A solution, scalar or a displacement, goes with its volume: `vtk`, `view` and `gmsh` hold it as the data `u` of their
points, others as a second file beside the volume's. `calculix` takes the problem that was solved.
"""

from collections.abc import Iterable
from pathlib import Path

from parameterize.cube.boundary_map import read_part
from parameterize.files import replacing
from parameterize.surface.part import PartSurface

from ..errors import InputError, did_you_mean, input_errors
from ..new_file import check_new
from ..report import document as reports
from ..report.artifacts import REPORT
from ..type_check import check_type
from .formats import load_volume
from .kinds import FORMATS, Exported, Format
from .solutions import SOLUTION, SURFACE, VOLUME, read_solution


def export(
    volume: str | Path,
    to: str,
    out: str | Path | None = None,
    *,
    solution: str | Path | None = None,
    samples: int | None = None,
    quantity: Iterable[str] = (),
    element: str | None = None,
    force: bool = False,
) -> Path:
    """Write the volume of a file or of a run in another format and return the path written; atomic.

    Parameters
    ----------
    volume : str or Path
        File with the volume, or the output folder of a run: then its solution is exported, too.
    to : str
        "gismo", "mfem", "vtk", "view", "json", "calculix", "gmsh", "bezier", "step" or "iges".
    out : str or Path, optional
        By default the stem of the volume, or the name of the folder, with the format's ending, in the current folder.
    solution : str or Path, optional
        solution.npz of a solve on this volume. By the report.json beside it, the view knows its law, and shows the
        error, where there is an exact solution, and stress and von_mises of elasticity, gradient and flux of Poisson's
        equation. With G+Smo, MFEM and splinepy's JSON it is a file of its own, NAME_u.xml, NAME.gf, NAME_u.json.
    samples : int, optional
        Of a view: cells a span of the solution and direction; by default 3, fewer where they were more than a million.
        For CalculiX and gmsh: elements a span of the map and direction; by default 1.
    quantity : names, optional
        Of a view: other quantities of the law, by their names, such as "principal".
    element : str, optional
        For CalculiX "C3D20", the default, "C3D20R" or "C3D8"; for gmsh "hex64", the default, or "hex27".
    force : bool
        Replace a file that exists.

    Raises
    ------
    InputError
        Where a file cannot be read or written, exists (unless `force`), a package is missing, or the format cannot hold
        what is given.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> benchmark_volume(2).save("volume.npz")
    >>> iga_nn.export("volume.npz", "view", "seen.vtu").name
    'seen.vtu'
    """
    for name, value, kind in (("volume", volume, str | Path), ("to", to, str), ("out", out, str | Path | None)):
        check_type(name, value, kind)
    chosen = _format(to, {"samples": samples is not None, "quantity": bool(quantity), "element": element is not None})
    if samples is not None and samples < 1:
        raise InputError(f"samples {samples}: must be 1 or larger")
    if solution is not None and not chosen.holds_solution:
        raise InputError(f"format {to!r}: has no place for a solution: leave --solution out")
    if volume == "":
        raise InputError("no volume is named: give a volume.npz, or the folder of a run")
    source, beside = _run(Path(volume))
    given = beside if solution is None and chosen.holds_solution else None if solution is None else Path(solution)
    stem = Path(volume).resolve().name if Path(volume).is_dir() else source.stem
    target = check_new(stem + chosen.ending if out is None else out, chosen.ending[chosen.ending.index(".") :])
    field_ending, write_field = chosen.beside if given and chosen.beside else ("", None)
    second = target.with_name(target.stem + field_ending) if write_field else target
    for file in (target, second):
        if file.exists() and not force:
            raise InputError(f"{file}: exists; --force replaces it, --out names another file")
    loaded = load_volume(source)
    part = _part(source)
    read = None if given is None else read_solution(given, loaded)
    field, problem = (None, None) if read is None else (read.field, read.problem)
    if problem is not None and part is not None and problem.conditions:
        problem = problem.on_surface(part)
    content = Exported(loaded, field, problem, part, samples, tuple(quantity) or None, element)
    try:
        with replacing(target) as temporary:
            assert chosen.write is not None
            chosen.write(temporary, content)
            if field is not None and write_field is not None:
                with replacing(second) as temporary_beside:
                    write_field(temporary_beside, field, loaded)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}): choose another with --out") from None
    return target


def _format(to: str, given: dict[str, bool]) -> Format:
    """Return a format that is written. Raises InputError for another, and for an option that it does not take."""
    chosen = FORMATS.get(to)
    written = [name for name, kind in FORMATS.items() if kind.write is not None]
    if chosen is None or chosen.write is None:
        raise InputError(f"format {to!r}: choose one of {', '.join(written)}{did_you_mean(to, written)}")
    for name in (name for name, is_given in given.items() if is_given and name not in chosen.takes):
        takers = ", ".join(other for other in written if name in FORMATS[other].takes)
        raise InputError(f"format {to!r}: --{name} is for --to {takers}")
    return chosen


def _run(given: Path) -> tuple[Path, Path | None]:
    """Return the volume that is named, by its file or by a run, and the solution of the run, None where there is none.

    Raises InputError for a folder without a volume.
    """
    if not given.is_dir():
        return given, None
    if not (given / REPORT).is_file():
        raise InputError(f"{given}: is a folder: name the volume.npz in it")
    solution = given / SOLUTION
    beside = solution if solution.is_file() else None
    if (own := given / VOLUME).is_file():
        return own, beside
    solved_on = ((reports.read(given) or {}).get("input") or {}).get("file")
    if isinstance(solved_on, str) and Path(solved_on).suffix == ".npz":
        if not Path(solved_on).is_file():
            raise InputError(f"{given}: was solved on {solved_on}, which is not there: name the volume, and --solution")
        return Path(solved_on), beside
    raise InputError(f"{given}: holds no volume, and was not solved on a volume.npz: name the volume")


def _part(volume: Path) -> PartSurface | None:
    """Return the surface of the part that a volume.npz was made of, None where it is unknown."""
    beside = volume.with_name(SURFACE)
    if volume.suffix != ".npz" or not beside.is_file():
        return None
    with input_errors():
        return read_part(beside)
