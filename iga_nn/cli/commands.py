"""Defines the commands of `iga-nn`; nothing is computed here.

A command imports what it runs when it runs: `--help` and `--version` load neither numpy nor the packages below.
"""

from __future__ import annotations

import os
import sys
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, CycloptsError, Parameter

from ..errors import InputError, TimeLimitError, expected_errors, input_errors
from ..options import (
    PROBLEMS,
    MapOptions,
    ModesOptions,
    PoissonOptions,
    ProblemOptions,
    StudyOptions,
    SurfaceOptions,
    WorkerOptions,
)
from ..version import __version__
from . import BAD_INPUT, DONE, INTERRUPTED, NOT_CERTIFIED, NOT_SOLVED
from .arguments import (
    OF_STUDY,
    Json,
    Mesh,
    Mpi,
    ObjFile,
    OutputOptions,
    Overwrite,
    PageOptions,
    Volume,
    VolumeOrRun,
    converted,
    for_each_problem,
    with_values,
)
from .refusal import refusal

if TYPE_CHECKING:
    from parameterize.meshes.mesh import VolumeMesh

    from ..workflow.output_folder import Outcome

app = App(
    name="iga-nn",
    help="From a closed surface mesh to a solved PDE on a certified trivariate B-spline.",
    version=f"iga-nn {__version__}",
    suppress_keyboard_interrupt=False,
    default_parameter=Parameter(negative=(), consume_multiple=1, converter=converted),
)
run_app = App(name="run", help="Parameterize a surface and solve a problem on its volume.")
solve_app = App(name="solve", help="Solve a problem on a volume.")
study_app = App(
    name="study", help="Solve on finer and finer meshes of a volume.npz; write a table, CSV and a plot of the rates."
)
batch_app, page_app = App(name="batch"), App(name="app")
for group in (run_app, solve_app, study_app, batch_app, page_app):
    app.command(group)


@for_each_problem(run_app)
def run_problem(
    mesh: Mesh,
    /,
    *,
    output: OutputOptions = OutputOptions(),
    mapping: MapOptions = MapOptions(),
    problem_options: ProblemOptions = PoissonOptions(),
) -> int:
    """Parameterize a surface, certify the spline and solve {title} on it.

    named_faces.png shows which face of the volume is u0, u1, v0, v1, w0, w1; --corners decides it beforehand.
    """
    return _run(mesh, output, mapping, problem_options)


def _run(mesh: str, output: OutputOptions, mapping: MapOptions, problem_options: ProblemOptions | None = None) -> int:
    """Parameterize a surface, solve a problem on the volume, print the verdict and return the exit code."""
    from ..workflow.painter import beside
    from .progress import shown_progress

    with shown_progress(output.quiet) as progress, beside() as painter:
        from ..workflow import pipeline  # takes as long to load as what draws, which loads meanwhile

        outcome = pipeline.parameterize_to(
            mesh,
            mapping=mapping,
            problem_options=problem_options,
            progress=progress,
            painter=painter,
            **output.folder,
        )
    return _tell(outcome, output)


@for_each_problem(batch_app, is_default=True)
def run_many(
    *surfaces: str,
    split: bool = False,
    output: OutputOptions = OutputOptions(),
    workers: WorkerOptions = WorkerOptions(),
    mapping: MapOptions = MapOptions(),
    problem_options: ProblemOptions = PoissonOptions(),
) -> int:
    """Run many surfaces in worker processes, each into its own folder in --out, with one table; solve {title} on each.

    batch.csv, batch.json and batch.html are written anew after every surface. The same command again skips finished
    surfaces, continues from checkpoints and tries failures once more.

    Args:
        surfaces: files, folders, patterns in quotes, names of samples and models, or g1 for the set G1.
        split: take each body of a file with several, as NAME-0, NAME-1 and so on.
    """
    from ..batch.run_batch import run_batch
    from ..batch.surfaces import demand_surfaces
    from ..report import document as reports
    from .answer import batch_exit_code
    from .progress import shown_batch

    demand_surfaces(surfaces, list(PROBLEMS))
    if output.out is None:
        raise InputError("batch needs a folder for its results: name it with --out")
    with shown_batch(output.quiet) as progress:
        given = output.folder | {"mapping": mapping, "workers": workers, problem_options.section: problem_options}
        batch = run_batch(surfaces, problem=problem_options.section, split=split, progress=progress, **given)
    words = f"{batch.summary}\nresults in {batch.folder}"
    _print(reports.as_json(batch.as_dict()) if output.as_json else words)
    return batch_exit_code(batch)


@app.command(name="parameterize")
def parameterize_mesh(
    mesh: Mesh, /, *, output: OutputOptions = OutputOptions(), mapping: MapOptions = MapOptions()
) -> int:
    """Turn a surface into a certified trivariate B-spline."""
    return _run(mesh, output, mapping)


@for_each_problem(solve_app)
def solve_problem(
    volume: Volume,
    /,
    *,
    device: Literal["cpu", "cuda"] = "cpu",
    mpi: Mpi = False,
    resume: bool = False,
    output: OutputOptions = OutputOptions(),
    problem_options: ProblemOptions = PoissonOptions(),
) -> int:
    """Solve {title} on a volume.npz.

    The volume's six faces u0, u1, v0, v1, w0, w1, the images of u = 0, u = 1 and so on, carry values of u unless an
    option names them.

    Args:
        resume: go on after the levels that an interrupted solve in the output folder has done.
        device: where the linear system is solved; cuda takes symmetric laws that are scalar, or constant as elasticity.
    """
    from ..workflow import mpi_job, pipeline
    from .progress import shown_progress

    with shown_progress(output.quiet):
        comm = mpi_job.all_processes() if mpi else None
        how: dict[str, Any] = {"device": device, "comm": comm, "resume": resume}
        outcome = pipeline.solve_to(volume, problem_options=problem_options, **how, **output.folder)
    return DONE if outcome is None else _tell(outcome, output)


@for_each_problem(study_app, is_default=True, hidden=OF_STUDY)
def study_volume(
    volume: Volume,
    /,
    *,
    output: OutputOptions = OutputOptions(),
    study: StudyOptions = StudyOptions(),
    problem_options: ProblemOptions = PoissonOptions(),
) -> int:
    """Solve {title} on finer and finer meshes of a volume.npz; write a table, CSV and a plot of the errors' rates.

    The problem has an exact solution. Results go to STEM-study in the current folder, unless --out names another.
    """
    from ..workflow import pipeline
    from .progress import shown_progress

    with shown_progress(output.quiet):
        outcome, table = pipeline.study_to(
            volume, problem_options=problem_options, study_options=study, **output.folder
        )
    return _tell(outcome, output, table, outcome.report.get("study"))


@app.command(name="modes")
def find_modes(
    volume: Volume, /, *, output: OutputOptions = OutputOptions(), modes: ModesOptions = ModesOptions()
) -> int:
    """Find the lowest vibrations of an elastic body, a volume.npz; write their frequencies, shapes and a figure.

    Frequencies are in Hz where the units agree: m, Pa and kg/m^3, or mm, MPa and t/mm^3. Results go to STEM-modes in
    the current folder, unless --out names another.
    """
    from ..workflow import pipeline
    from .progress import shown_progress

    with shown_progress(output.quiet):
        outcome, table = pipeline.modes_to(volume, modes_options=modes, **output.folder)
    return _tell(outcome, output, table)


def _tell(outcome: Outcome, output: OutputOptions, table: str = "", section: dict[str, Any] | None = None) -> int:
    """Print a table, or with --json a section; the verdict if there is none of these. Return the exit code."""
    from ..report import document as reports
    from .answer import exit_code, verdict_in_words

    if output.as_json:
        _print(reports.as_json(section or reports.verdict(outcome.report, outcome.folder)))
    else:
        _print(f"{table}\nresults in {outcome.folder}" if table else verdict_in_words(outcome))
    return exit_code(outcome.report)


@app.command(name="check")
def check(
    path: str,
    /,
    *,
    surface: SurfaceOptions = SurfaceOptions(),
    strict: bool = False,
    region: tuple[str, ...] = (),
    picture: Path | None = None,
    force: bool = False,
    as_json: Json = False,
) -> int:
    """Check a surface for acceptance, or certify a volume or a volume mesh; write nothing but a picture of regions.

    Of a volume mesh det J > 0 is proved or refuted on every element, and whether elements overlap.

    Args:
        path: surface, name of a sample or a model, a volume (.npz, or a file of G+Smo, MFEM, GeoPDEs or splinepy), or
            a mesh of hexahedra or tetrahedra, linear or curved (.msh, .inp, .vtu, .vtk, Exodus, CGNS).
        strict: refuse a surface that intersects itself; by default this is a notice.
        region: regions of the surface, such as "nz > 0.9 and x < 2"; the answer has the area of each region and the
            number of triangles that lie mostly in it; a region without a point of the surface is refused.
        picture: PNG of the surface to write, with the regions in colours.
        force: replace an existing picture.
    """
    from ..io.beginnings import is_volume

    if is_volume(path):
        if surface != SurfaceOptions() or strict or region or picture:
            options = "--component, --close, --deflection, --max-faces, --decimate, --sharp, --strict, --region"
            raise InputError(f"{path}: is a volume; {options} and --picture are for surfaces")
        return _check_volume(Path(path), as_json)
    if surface == SurfaceOptions() and not (strict or region or picture):
        from ..io.meshes import mesh_in

        if (mesh := mesh_in(path)) is not None:
            return _check_mesh(mesh, as_json)
    from ..models import resolve
    from .facts import surface_in_words

    given = resolve(path, **surface.reading())
    if strict:
        given.refuse_crossings()
    facts = given.summary()
    if region or picture:
        from ..workflow.regions import looked_at

        facts |= {"regions": looked_at(region, given, picture, force)}
    if as_json:
        from ..report.document import as_json as json_text

    _print(json_text(facts) if as_json else "accepted\n" + surface_in_words(facts))
    return DONE


def _check_volume(path: Path, as_json: bool) -> int:
    """Certify a volume, print the verdict and return the exit code."""
    from ..io.formats import load_volume
    from ..report import document as reports
    from ..workflow.verdict import facts_of_file
    from . import answer

    facts = facts_of_file(path, load_volume(path))
    _print(reports.as_json(facts) if as_json else answer.volume_in_words(facts))
    return answer.exit_code({"parameterization": facts})


def _check_mesh(mesh: VolumeMesh, as_json: bool) -> int:
    """Certify a volume mesh, print the verdict and return the exit code."""
    from parameterize.compilation import compilation_told
    from parameterize.meshes.certify import certify_mesh

    from ..report import document as reports
    from .facts import mesh_in_words

    with compilation_told():
        found = certify_mesh(mesh)
    _print(reports.as_json(found.as_dict()) if as_json else mesh_in_words(found))
    return DONE if found.is_proved else NOT_CERTIFIED


@app.command(name="sample")
def write_sample(name: str, /, *, out: ObjFile = None, force: Overwrite = False) -> None:
    """Write a surface made by formula as an OBJ file.

    Args:
        name: one of the samples.
    """
    from ..new_file import check_new, save_new
    from ..samples import obj_text, sample

    with input_errors():
        surface = sample(name)
    target = check_new(f"{name}.obj" if out is None else out, ".obj")
    save_new(target, obj_text(surface).encode(), force)
    _print(str(target))


@app.command
def materials() -> None:
    """List the materials that --material knows, their numbers and what these are quoted for."""
    from ..options.materials import listed

    _print(listed())


@app.command(name="fetch")
def fetch_model(name: str, /, *, out: ObjFile = None, force: Overwrite = False) -> None:
    """Write a published model as an OBJ file; download it where it is not at hand.

    Args:
        name: one of the models, or g1 for all models of the set G1.
    """
    from ..models import fetch_all

    for path in fetch_all(name, out, force=force):
        _print(str(path))


@app.command(name="export")
def export_volume(
    volume: VolumeOrRun,
    /,
    *,
    to: str,
    out: Path | None = None,
    solution: Path | None = None,
    samples: int | None = None,
    quantity: tuple[str, ...] = (),
    element: str | None = None,
    force: bool = False,
) -> None:
    """Write a volume, or the volume and the solution of a run, in a format that other programs read.

    Args:
        to: gismo (G+Smo XML), mfem (NURBS mesh), vtk (exact Bezier cells), view (samples for slicing in ParaView),
            json (splinepy's), calculix (Abaqus' and CalculiX' input file, with the problem of the run),
            gmsh (curved hexahedra), bezier (Bezier extraction), step or iges (spline faces of the boundary).
        out: file to write; the volume's stem with the format's ending in the current folder by default.
        solution: solution.npz to export, too: as point data u (vtk, view), or in a file beside it (NAME_u.xml, NAME.gf,
            NAME_u.json).
        samples: number of cells of a view per span of the solution and direction; 3 by default, fewer where the view
            would have more than a million cells.
        quantity: quantities in a view of a solution, beside u, such as stress, von_mises, principal, strain, gradient,
            flux.
        element: of calculix C3D20 (default), C3D20R or C3D8; of gmsh hex64 (default) or hex27.
        force: replace an existing file.
    """
    from ..io.export import export

    how: dict[str, Any] = {"samples": samples, "quantity": quantity, "element": element, "force": force}
    _print(str(export(volume, to, out, solution=solution, **how)))


@app.command(name="compare")
def compare_runs(one: Path, other: Path, /, *more: Path, out: Path = Path("compare.html"), force: bool = False) -> None:
    """Put finished runs side by side: verdicts, errors, largest values and figures, in one page.

    Args:
        one: output folder of a run.
        other: output folder of another run; ratios are its numbers over those of the first run.
        more: output folders of further runs.
        out: page to write.
        force: replace an existing file.
    """
    from ..new_file import check_new, save_new
    from ..report import comparison

    runs = [comparison.Run.of(folder) for folder in (one, other, *more)]
    target = check_new(out, ".html")
    save_new(target, comparison.page(runs).encode(), force)
    _print(f"{comparison.as_text(runs)}\nopen {target}")


@for_each_problem(page_app, is_default=True)
def serve_page(
    *,
    port: int = 8080,
    open_browser: Annotated[bool, Parameter(name="--open")] = False,
    max_upload: int = 64,
    mapping: PageOptions = PageOptions(),
    problem_options: ProblemOptions = PoissonOptions(),
) -> None:
    """Serve a page to this computer's browser: drop a surface, watch it become a volume, download the files.

    {title} is what its form states first.

    Args:
        port: port of 127.0.0.1; 0 takes a free port.
        open_browser: open the page in the browser.
        max_upload: largest size of a surface's file, in megabytes.
    """
    from ..live.app import serve

    surfaces = MapOptions(**vars(mapping))
    serve(
        _print,
        port=port,
        open_browser=open_browser,
        max_upload=max_upload,
        mapping=surfaces,
        problem_options=problem_options,
    )


def main(argv: list[str]) -> int:
    """Run one command and return its exit code; only an internal error shows a traceback."""
    try:
        with _processes(argv):
            code = app(with_values(argv), exit_on_error=False, print_error=False, result_action="return_value")
    except KeyboardInterrupt as error:  # its message has the command that continues, where there is one
        print(f"iga-nn: {str(error) or 'interrupted'}", file=sys.stderr)
        return INTERRUPTED
    except expected_errors() + (CycloptsError,) as error:
        from solve import ConvergenceError

        print(f"iga-nn: {refusal(error, argv)}", file=sys.stderr)
        codes = {ConvergenceError: NOT_SOLVED, TimeLimitError: NOT_CERTIFIED}
        return codes.get(type(error), BAD_INPUT)
    return code if isinstance(code, int) else DONE  # a command that only writes a file returns nothing


def _processes(argv: list[str]) -> AbstractContextManager[None]:
    """Return the context in which the processes of an MPI job fail together, and one of them prints."""
    if "--mpi" not in argv:
        return nullcontext()
    from ..workflow import mpi_job

    return mpi_job.together(mpi_job.all_processes())


def _print(text: str) -> None:
    """Print to stdout; a reader that has gone, such as `head`, is no error."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the flush at exit
