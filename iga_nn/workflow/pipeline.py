"""Both rooms in order, and the folder they leave: surface -> volume -> solution -> report and figures.

Every file is written as soon as its content is known, so that a late failure costs nothing that was computed before.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from parameterize.files import save_text
from parameterize.spline.volume import BSplineVolume
from solve.forms.frame import UnitFrame

from ..errors import InputError, input_errors, one_line
from ..io.formats import load_volume
from ..options import MapOptions, PoissonOptions, ProblemOptions, StudyOptions, check_size
from ..report import tables as studies
from .output_folder import Outcome, RunFolder, open_folder
from .repeat import command_line, gives_the_same
from .train import map_surface
from .verdict import write_certificate

if TYPE_CHECKING:
    from parameterize.progress import ProgressCallback
    from solve import ConvergenceRow, Elasticity, Poisson, Solution, SolveReport

log = logging.getLogger(__name__)


def run(
    problem: Literal["poisson"],
    mesh: str | Path,
    out: str | Path | None = None,
    *,
    mapping: MapOptions | None = None,
    poisson: PoissonOptions | None = None,
    force: bool = False,
    vector: bool = False,
    progress: ProgressCallback | None = None,
) -> Outcome:
    """From a surface to a solved problem, all files of the README's table in `out` (default: the input's stem).

    mesh: path of a closed surface, or a sample's or model's name.
    vector: write the plots of curves as PDF, too.
    Raises MeshError for a surface that cannot be taken, solve.ExpressionError for a formula, InputError for other
    options and for an output folder that is finished (unless `force`) or cannot be written.
    """
    if problem != "poisson":
        raise InputError(f"problem {problem!r}: only 'poisson' can be solved")
    mapping, poisson = mapping or MapOptions(), poisson or PoissonOptions()
    equation, spline = poisson.problem(), mapping.config().spline
    unknowns = _check_size(BSplineVolume.uniform(np.zeros((spline.control_points,) * 3 + (3,)), spline.degree), poisson)
    with open_folder(mesh, out, force, mapping.resume, vector) as (state, finished):
        if finished and "poisson" not in finished.report:
            volume = finished.folder / "volume.npz"
            raise InputError(
                f"{finished.folder}: holds a finished volume; `iga-nn solve poisson {volume}` solves on it"
            )
        command = command_line("run poisson", mesh, mapping, poisson, out=out)
        if finished:
            return _there_already(finished, command)
        result = map_surface(state, mesh, mapping, progress, command, equation, unknowns)
        solution = _solve(state, result.volume, equation, poisson)
        return _finish(state, result.volume, solution, equation)


def parameterize_to(
    mesh: str | Path,
    out: str | Path | None = None,
    *,
    mapping: MapOptions | None = None,
    force: bool = False,
    vector: bool = False,
    progress: ProgressCallback | None = None,
) -> Outcome:
    """From a surface to volume.npz, boundary.npz, history.npz, report.json and figures; raises as `run` does."""
    mapping = mapping or MapOptions()
    with open_folder(mesh, out, force, mapping.resume, vector) as (state, finished):
        command = command_line("parameterize", mesh, mapping, out=out)
        if finished:
            return _there_already(finished, command)
        result = map_surface(state, mesh, mapping, progress, command)
        return _finish(state, result.volume)


def solve_to(
    volume: str | Path,
    out: str | Path | None = None,
    *,
    problem: ProblemOptions | None = None,
    force: bool = False,
    vector: bool = False,
    device: str = "cpu",
) -> Outcome:
    """Solve on a saved volume: solution.npz, report.json, figures; raises as `run` does. On the CPU without torch.

    device: where Poisson's linear system is solved, "cpu" or "cuda".
    """
    from solve import check_device, check_problem

    options = problem or PoissonOptions()
    equation = options.problem()
    path = Path(volume)
    loaded = load_volume(path)
    _check_size(loaded, options)
    with input_errors():
        check_problem(loaded, equation)
        check_device(device, equation)
    with open_folder(path, out, force, vector=vector) as (state, _):
        state.begin("solution")
        elsewhere = {"device": device} if device != "cpu" else {}
        command = command_line(f"solve {options.section}", path, options, **elsewhere, out=out)
        write_certificate(state, path, loaded, command)
        solution = _solve(state, loaded, equation, options, **elsewhere)
        if len(equation.dirichlet) < 6:  # the user names faces: show which is which
            state.draw("solution", named_volume=loaded)
        return _finish(state, loaded, solution, equation)


def study_to(
    volume: str | Path,
    out: str | Path | None = None,
    *,
    options: StudyOptions | None = None,
    force: bool = False,
    vector: bool = False,
) -> tuple[Outcome, str]:
    """A convergence study on a saved volume: study.csv, study.png, report.json, and the table.

    Takes and raises what `run` does.
    """
    from solve import check_problem, convergence

    options = options or StudyOptions()
    equation, levels, path = options.problem(), options.levels(), Path(volume)
    loaded = load_volume(path)
    degrees = sorted(options.degree) or [max(loaded.degrees)]
    for degree in degrees:
        check_size(loaded, levels[-1], degree)
    with input_errors():
        check_problem(loaded, equation)
    with open_folder(path, out or f"{path.name.split('.')[0]}-study", force, vector=vector) as (state, _):
        state.begin("study")
        write_certificate(state, path, loaded, command_line("study", path, options, out=out))
        verdict = state.report["parameterization"]["bijective"]
        study: dict[int, list[ConvergenceRow]] = {}
        with state.timed("solve"), input_errors():
            for degree in degrees:
                study[degree] = convergence(loaded, equation, levels, degree, certified=verdict)
                log.info("degree %d: done", degree)
        save_text(state.folder / "study.csv", studies.as_csv(study))
        state.write(
            study=_given(equation, loaded)
            | {"levels": studies.rows_of(study), "notices": _notices([row.report for row in chain(*study.values())])}
        )
        state.draw("study", study=study)
        return _finish(state, loaded), studies.as_table(study)


def _there_already(finished: Outcome, command: str) -> Outcome:
    """The result that a resumed run finds. Raises InputError where it is another command's, or not whole."""
    made_by = finished.report.get("command", "")
    if not gives_the_same(made_by, command):
        raise InputError(
            f"{finished.folder}: holds the result of `{made_by}`; --force replaces it, --out names another folder"
        )
    wanted = ["volume.npz"] + ["solution.npz"] * ("poisson" in finished.report)
    if gone := [name for name in wanted if not (finished.folder / name).is_file()]:
        raise InputError(f"{finished.folder}: {gone[0]} is gone from this finished result; --force makes it anew")
    log.info("%s: finished already", finished.folder)
    return finished


def _solve(
    state: RunFolder,
    volume: BSplineVolume,
    equation: Poisson | Elasticity,
    options: ProblemOptions,
    **solver: Any,
) -> Solution:
    """Solve on every level, write what is known of all and the finest solution, and return that."""
    from solve import Poisson, rates, solve_problem

    verdict = state.report["parameterization"]["bijective"]
    solutions: list[Solution] = []
    with state.timed("solve"):
        for level in sorted(set(options.refine)):
            if solutions and isinstance(equation, Poisson):
                solver["start"] = solutions[-1]
            with input_errors():
                solution = solve_problem(
                    volume, equation, refine=level, degree=options.degree, certified=verdict, **solver
                )
            solutions.append(solution)
            log.info("solved, refined %d times: %s", level, str(solution.report).splitlines()[0])
            solution.save(state.folder / "solution.npz")  # the finest so far
    found = [solution.report for solution in solutions]
    section = {
        **{name: given for name, given in asdict(options).items() if name not in ("refine", "degree")},
        **_given(equation, volume),
        "levels": [item.as_dict() for item in found],
        "rates": rates(found),
        "notices": _notices(found),
    }
    section = {name: given for name, given in section.items() if given is not None and given != ()}
    state.write(**{options.section: section})
    _draw_errors(state, volume, solutions, equation)
    return solutions[-1]


def _draw_errors(
    state: RunFolder, volume: BSplineVolume, solutions: Sequence[Solution], equation: Poisson | Elasticity
) -> None:
    """Draw the errors where they are known, and their convergence where there are several levels, coarsest first."""
    from solve import ConvergenceRow

    is_finite = all(np.all(np.isfinite(solution.coefficients)) for solution in solutions)
    if equation.exact is None or not is_finite:  # without an exact solution, or where the solver broke down
        return
    known: dict[str, Any] = {"volume": volume, "solution": solutions[-1], "problem": equation}
    if len(solutions) > 1:
        rows = [ConvergenceRow(solution.report, None, None) for solution in solutions]
        known["levels"] = {max(solutions[-1].degrees): rows}
    state.draw("solution", **known)


def _given(equation: Poisson | Elasticity, volume: BSplineVolume) -> dict[str, Any]:
    """What a report says of a problem beside the user's options: the default solution, too, and what X, Y, Z mean."""
    given: dict[str, Any] = {"exact": equation.exact} if isinstance(equation.exact, str) else {}
    return given | ({"frame": UnitFrame.of(volume).as_dict()} if equation.is_scaled else {})


def _notices(found: Iterable[SolveReport]) -> list[str]:
    """The notices of some solves, each once."""
    return list(dict.fromkeys(notice for item in found for notice in item.notices))


def _finish(
    state: RunFolder,
    volume: BSplineVolume,
    solution: Solution | None = None,
    equation: Poisson | Elasticity | None = None,
) -> Outcome:
    """Close the report, and write the page that shows it; without a view where that cannot be drawn."""
    from ..report import html as page

    scene = None
    with state.timed("report"):
        try:
            from ..report.viewer import scene_of

            scene = scene_of(volume, solution, equation)
        except Exception as error:  # no figure ends a run
            log.warning("the interactive view could not be drawn: %s", one_line(error))
            state.note_failures({"interactive view": one_line(error) or type(error).__name__})
    outcome = state.finish()
    page.write(outcome.folder, outcome.report, scene)
    return outcome


def _check_size(volume: BSplineVolume, options: ProblemOptions) -> int:
    """The largest problem's unknowns."""
    return check_size(volume, max(options.refine), options.degree, 3 if options.section == "elasticity" else 1)
