"""Reads a solution back from the files of a run: solution.npz, the volume that it lives on, and report.json."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.files import digest
from parameterize.spline.body import Body, BodyLike, as_body, shared_numbers
from parameterize.spline.volume import BSplineVolume
from solve import Solution, SolveReport
from solve.answer import Answer
from solve.discretization.error_norms import Errors
from solve.discretization.space import TrialSpace, longest_edges
from solve.field import BodyField, SplineField
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.reactions import Balance

from ..errors import InputError, input_errors
from ..figures.fields import problems_on
from ..options import PROBLEMS
from ..report import document as reports
from ..report.artifacts import REPORT
from ..type_check import check_type
from .formats import load_volume

SOLUTION, VOLUME, SURFACE = "solution.npz", "volume.npz", "boundary.npz"
_READ = ("elements", "dofs", "h", "iterations", "converged", "residual", "seconds", "meaningful", "formulation")


def load_solution(path: str | Path, volume: str | Path | None = None) -> Solution:
    """Return the solution that a run has left in its folder, with its map, its problem and the report of its solve.

    Everything works on it that works on a solution that was just computed: `quantity`, `extremes`, `probe`, `plot`,
    `to_pyvista`; `field` is a datum for another problem on the same volume.

    Parameters
    ----------
    path : str or Path
        The output folder of `iga-nn run` or `iga-nn solve`, or the solution.npz in it; report.json is beside.
    volume : str or Path, optional
        The volume; by default volume.npz in the folder, or the file that report.json names.

    Returns
    -------
    Solution
        That of the finest level that is done. `report.residuals` is empty.

    Raises
    ------
    InputError
        Where a file is missing or damaged, where the files do not belong together, and where report.json does not
        tell the problem, because it was stated in Python or by another version.

    Examples
    --------
    >>> import iga_nn
    >>> quick = iga_nn.MapOptions(steps_factor=0.02, control_points=6)
    >>> outcome = iga_nn.run("poisson", "cube", "out", mapping=quick, poisson=iga_nn.PoissonOptions(refine=(0,)))
    >>> solution = iga_nn.load_solution("out")
    >>> solution.report.dofs, solution.quantity("gradient", [[0.5, 0.5, 0.5]]).shape
    (216, (1, 1, 3))
    """
    check_type("path", path, str | Path)
    check_type("volume", volume, str | Path | None)
    given = Path(path)
    source = given / SOLUTION if given.is_dir() else given
    folder = source.parent
    report = reports.read(folder)
    if report is None:
        raise InputError(f"{folder / REPORT}: is missing or damaged: a solution is read with the report of its run")
    if not source.is_file():
        why = f": {report['not_solved']}" if "not_solved" in report else ""
        raise InputError(f"{source}: is not there, this folder holds no solution{why}")
    place = _volume_of(folder, report) if volume is None else Path(volume)
    body = load_volume(place)
    read = read_solution(source, body, report)
    if read.problem is None:
        raise InputError(f"{folder / REPORT}: does not tell the problem, so that the law of {source.name} is unknown")
    level = read.section["levels"][-1]
    if (count := _unknowns(read.field, as_body(body))) != level["dofs"]:
        raise InputError(f"{source}: is that of another solve: it has {count:,} unknowns, the report {level['dofs']:,}")
    with input_errors():
        problem = _on_surface(read.problem, place.with_name(SURFACE))
        return solution_on(read.field, body, problem, _report_of(level, read.section.get("notices", ())))


def solution_on(field: BodyField, body: BodyLike, problem: BoundaryValueProblem, report: SolveReport) -> Solution:
    """Return the solution that a field of a file is on its body."""
    glued = as_body(body)
    return Solution.of(BodyField(field.patches, glued), problems_on(problem, glued), report, problem.on(glued))


@dataclass(frozen=True, eq=False)
class Read:
    """Hold a field, its problem (None if it is not known), and the section of report.json on it."""

    field: BodyField
    problem: BoundaryValueProblem | None
    section: dict[str, Any]


def read_solution(path: Path, body: BodyLike, report: reports.Report | None = None) -> Read:
    """Return a solution of a file with the problem that the report tells; by default the report beside the file.

    Raises InputError where the solution does not belong to the body: by its knots, or by the h of its report.
    """
    several = as_body(body)
    with input_errors():
        found = BodyField.load(path)
    fields = found.patches
    if any(field.coefficients.shape[3:] not in ((), (3,)) for field in fields):
        raise InputError(f"{path}: coefficients must have shape (m_u, m_v, m_w) or (.., 3)")
    if len(fields) != len(several) or not all(map(_is_refined, several, fields)):
        raise InputError(f"{path}: belongs to another volume: its knots are not those of the map, refined")
    known = (reports.read(path.parent) if report is None else report) or {}
    name = next((name for name in PROBLEMS if isinstance(known.get(name), dict)), "")
    section = known.get(name, {})
    if (there := _mesh_size(section, several, found)) is not None:
        spaces = (TrialSpace(field.degrees, field.knots) for field in fields)
        here = longest_edges(several.patches, list(spaces))
        if not np.isclose(here, there, rtol=1e-9):
            raise InputError(
                f"{path}: belongs to another volume: the longest edge of its elements is {there:.6g}, here {here:.6g}"
            )
    return Read(found, _stated(name, section) if name else None, section)


def _volume_of(folder: Path, report: reports.Report) -> Path:
    """Return the volume of a report. Raises InputError where it is not there, or has changed since."""
    input_file = str(report.get("input", {}).get("file", ""))
    own = (folder / VOLUME).is_file() or not input_file
    place = folder / VOLUME if own else Path(input_file)
    if not place.is_file():
        raise InputError(f"{place}: is not there, and the solution lives on it: name it, volume=...")
    known = report.get("files", {}).get(VOLUME) if own else report.get("input", {}).get("sha256")
    if known and known != digest(place):
        raise InputError(f"{place}: has changed since the run: solve again, or name the volume of then, volume=...")
    return place


def _on_surface(problem: BoundaryValueProblem, beside: Path) -> BoundaryValueProblem:
    """Return a problem whose regions know the surface of the map. Raises ValueError where they need a missing file."""
    if problem.needs_surface and not beside.is_file():
        raise ValueError(f"{beside}: is not there, and without it group:NAME and face(x, y, z) mean nothing")
    if not problem.conditions or not beside.is_file():
        return problem
    from parameterize.cube.boundary_map import read_part

    return problem.on_surface(read_part(beside))


def _report_of(level: dict[str, Any], notices: Sequence[str]) -> SolveReport:
    """Return the report of a solve from its entry in report.json."""
    more: dict[str, Any] = {name: level[name] for name in _READ if name in level}
    if "l2" in level:
        norms = {name: level.get(name) for name in ("l2_relative", "h1_seminorm", "h1_relative")}
        more["errors"] = Errors(level["l2"], **norms)
    if "error_estimate" in level:
        relative = {name: level.get(f"error_estimate_{name}") for name in ("energy_relative",)}
        more["estimate"] = Errors(level["error_estimate"], level.get("error_estimate_relative"), **relative)
    if "load" in level:
        reactions = {role: tuple(force) for role, force in level["reactions"].items()}
        more["balance"] = Balance(tuple(level["load"]), reactions, level["areas"], level.get("imbalance"))
    answers = (answer | ({"at": tuple(answer["at"])} if "at" in answer else {}) for answer in level.get("asked", ()))
    asked = tuple(Answer(**answer) for answer in answers)
    return SolveReport(**more, notices=tuple(notices), asked=asked, memory=tuple(level.get("memory_mb", ())))


def _is_refined(volume: BSplineVolume, field: SplineField) -> bool:
    return all(np.isin(own, finer).all() for own, finer in zip(volume.knots, field.knots, strict=True))


def _stated(name: str, section: dict[str, Any]) -> BoundaryValueProblem | None:
    """Return the problem of a report's section, None where its options are damaged, or of another version."""
    kind = PROBLEMS[name]
    known = {field.name for field in fields(kind)} & section.keys()
    given: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in section.items()
    }
    try:
        return kind(**{name: given[name] for name in known}).problem()
    except InputError:
        return None


def _unknowns(field: BodyField, body: Body) -> int:
    """Return the number of unknowns of a field, those at interfaces once."""
    shapes = [patch.coefficients.shape[:3] for patch in field.patches]
    components = int(np.prod(field.patches[0].coefficients.shape[3:], dtype=int))
    return components * int(shared_numbers(shapes, body.interfaces)[1])


def _mesh_size(section: dict[str, Any], body: Body, field: BodyField) -> float | None:
    """Return h of the finest level, None where the section is not the field's, is empty or was edited."""
    try:
        finest = section["levels"][-1]
        return float(finest["h"]) if finest["dofs"] == _unknowns(field, body) else None
    except (LookupError, TypeError, ValueError):
        return None
