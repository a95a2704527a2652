"""The commands of `iga-nn` and their arguments; nothing is computed here.

A command imports what it runs when it runs: `--help` and `--version` load neither numpy nor the packages below.
"""

from __future__ import annotations

import os
import sys
from contextlib import AbstractContextManager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, CycloptsError, Parameter

from ..errors import InputError, expected_errors, input_errors, one_line
from ..options import ElasticityOptions, ElasticityStudyOptions, MapOptions, PoissonOptions, StudyOptions
from ..version import __version__
from .exit_codes import BAD_INPUT, DONE, INTERRUPTED, NOT_CERTIFIED

if TYPE_CHECKING:
    from parameterize.progress import ProgressCallback

    from ..workflow.output_folder import Outcome

FORMULAS = ("--exact", "--source", "--boundary", "--kappa", "--reaction", "--body-force", "--displacement")

app = App(
    name="iga-nn",
    help="From a closed surface mesh to a solved PDE on a certified trivariate B-spline.",
    version=f"iga-nn {__version__}",
    suppress_keyboard_interrupt=False,
    default_parameter=Parameter(negative=(), consume_multiple=True),
)
run_app = App(name="run", help="Parameterize a surface and solve a problem on its volume.")
solve_app = App(name="solve", help="Solve a problem on a volume.")
study_app = App(
    name="study", help="Solve on finer and finer meshes of a volume.npz; write a table, CSV and a plot of the rates."
)
for group in (run_app, solve_app, study_app):
    app.command(group)


Mesh = Annotated[str, Parameter(help="path of a closed surface, or the name of a sample or a model.")]
Volume = Annotated[
    Path, Parameter(help="volume.npz as `iga-nn run` writes it, G+Smo XML, an MFEM NURBS mesh or splinepy's JSON.")
]
ObjFile = Annotated[Path | None, Parameter(help="file to write; NAME.obj in the current folder by default.")]
Overwrite = Annotated[bool, Parameter(help="replace that file where it has other content.")]
Json = Annotated[bool, Parameter(name="--json", help="print the verdict as JSON.")]


@dataclass(frozen=True)
class OutputOptions:
    """Where the results go, and what is printed.

    Args:
        out: output folder; the input's stem in the current folder by default.
        force: replace a finished result in that folder.
        vector: write plots of curves (loss history, errors over the mesh size) as PDF, too.
        quiet: show no progress.
    """

    out: str | None = None
    force: bool = False
    vector: bool = False
    quiet: bool = False
    as_json: Json = False

    @property
    def folder(self) -> dict[str, Any]:
        """What the pipeline takes of these options."""
        return {"out": self.out, "force": self.force, "vector": self.vector}


Output = Annotated[OutputOptions, Parameter(name="*")]
Mapping = Annotated[MapOptions, Parameter(name="*")]
Equation = Annotated[PoissonOptions, Parameter(name="*")]
Body = Annotated[ElasticityOptions, Parameter(name="*")]
Study = Annotated[StudyOptions, Parameter(name="*")]
BodyStudy = Annotated[ElasticityStudyOptions, Parameter(name="*")]

OUTPUT, MAPPING, STUDY = OutputOptions(), MapOptions(), StudyOptions()
POISSON, BODY, BODY_STUDY = PoissonOptions(), ElasticityOptions(), ElasticityStudyOptions()


@run_app.command(name="poisson")
def run_poisson(
    mesh: Mesh, /, *, output: Output = OUTPUT, mapping: Mapping = MAPPING, poisson: Equation = POISSON
) -> int:
    """Parameterize a surface, certify the spline and solve Poisson's equation on it."""
    from ..workflow import pipeline

    with _progress(output) as progress:
        outcome = pipeline.run("poisson", mesh, mapping=mapping, poisson=poisson, progress=progress, **output.folder)
    return _finish(outcome, output)


@run_app.command(name="elasticity")
def run_elasticity(mesh: Mesh, /, *, output: Output = OUTPUT, mapping: Mapping = MAPPING, body: Body = BODY) -> int:
    """Parameterize a surface, certify the spline and solve linear elasticity on it.

    named_faces.png shows which face of the volume is u0, u1, v0, v1, w0, w1; --corners decides it beforehand.
    """
    from ..workflow import pipeline

    with _progress(output) as progress:
        outcome = pipeline.run("elasticity", mesh, mapping=mapping, elasticity=body, progress=progress, **output.folder)
    return _finish(outcome, output)


@app.command(name="parameterize")
def parameterize_mesh(mesh: Mesh, /, *, output: Output = OUTPUT, mapping: Mapping = MAPPING) -> int:
    """Turn a surface into a certified trivariate B-spline."""
    from ..workflow import pipeline

    with _progress(output) as progress:
        outcome = pipeline.parameterize_to(mesh, mapping=mapping, progress=progress, **output.folder)
    return _finish(outcome, output)


@solve_app.command(name="poisson")
def solve_poisson(
    volume: Volume, /, *, device: Literal["cpu", "cuda"] = "cpu", output: Output = OUTPUT, poisson: Equation = POISSON
) -> int:
    """Solve Poisson's equation, -div(kappa grad u) + c u = f, on a volume.npz.

    The volume's six faces u0, u1, v0, v1, w0, w1, the images of u = 0, u = 1 and so on, carry values of u unless named
    under --neumann or --robin.

    Args:
        device: where the linear system is solved.
    """
    from ..workflow import pipeline

    with _progress(output):
        outcome = pipeline.solve_to(volume, problem=poisson, device=device, **output.folder)
    return _finish(outcome, output)


@solve_app.command(name="elasticity")
def solve_elasticity(volume: Volume, /, *, output: Output = OUTPUT, body: Body = BODY) -> int:
    """Solve linear elasticity on a volume.npz.

    A vector is three formulas separated by semicolons, in quotes: "x*y;0;sin(z)". The volume's six faces u0, u1, v0,
    v1, w0, w1, the images of u = 0, u = 1 and so on, carry displacements unless named under --traction.
    """
    from ..workflow import pipeline

    with _progress(output):
        outcome = pipeline.solve_to(volume, problem=body, **output.folder)
    return _finish(outcome, output)


@study_app.default
def study_volume(volume: Volume, /, *, output: Output = OUTPUT, study: Study = STUDY) -> int:
    """Solve on finer and finer meshes of a volume.npz; write a table, CSV and a plot of the errors and their rates.

    Results go to STEM-study in the current folder, unless --out names another.
    """
    return _study(volume, output, study)


@study_app.command(name="elasticity")
def study_elasticity(volume: Volume, /, *, output: Output = OUTPUT, study: BodyStudy = BODY_STUDY) -> int:
    """Do the same for linear elasticity with a given displacement."""
    return _study(volume, output, study)


def _study(volume: Path, output: OutputOptions, study: StudyOptions) -> int:
    """Make a convergence study, print its table and return the exit code."""
    from ..workflow import pipeline
    from . import answer

    with _progress(output):
        outcome, table = pipeline.study_to(volume, options=study, **output.folder)
    _print(answer.as_json(outcome.report["study"]) if output.as_json else f"{table}\nresults in {outcome.folder}")
    return answer.exit_code(outcome.report)


@app.command(name="check")
def check(
    path: str,
    /,
    *,
    component: int | None = None,
    max_faces: int = MapOptions.max_faces,
    decimate: bool = False,
    strict: bool = False,
    as_json: Json = False,
) -> int:
    """Say whether a surface is accepted, or whether a volume is certified; write nothing.

    Args:
        path: surface, name of a sample or a model, or a volume (.npz, or a file of G+Smo, MFEM or splinepy).
        component: number of the connected component to take, counted from 0.
        max_faces: refuse surfaces with more faces.
        decimate: reduce surfaces with more faces to max_faces instead.
        strict: refuse a surface that intersects itself; without this option it is a notice.
    """
    from ..io.formats import is_volume
    from ..report import document as reports
    from ..workflow.verdict import check_surface, check_volume
    from . import answer

    if not is_volume(path):
        facts = check_surface(path, component, max_faces, decimate, strict)
        _print(answer.as_json(facts) if as_json else "accepted\n" + answer.facts_in_words(facts))
        return DONE
    if component is not None or max_faces != MapOptions.max_faces or decimate or strict:
        raise InputError(f"{path}: is a volume; --component, --max-faces, --decimate and --strict are for surfaces")
    facts = check_volume(path)
    _print(answer.as_json(facts) if as_json else answer.volume_in_words(facts))
    return DONE if reports.is_certified({"parameterization": facts}) else NOT_CERTIFIED


@app.command(name="sample")
def write_sample(name: str, /, *, out: ObjFile = None, force: Overwrite = False) -> int:
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
    return DONE


@app.command(name="fetch")
def fetch_model(name: str, /, *, out: ObjFile = None, force: Overwrite = False) -> int:
    """Write a published model as an OBJ file; download it where it is not at hand.

    Args:
        name: one of the models, or g1 for all those of the set G1.
    """
    from ..models import fetch_all

    for path in fetch_all(name, out, force=force):
        _print(str(path))
    return DONE


@app.command(name="export")
def export_volume(
    volume: Volume, /, *, to: str, out: Path | None = None, solution: Path | None = None, force: bool = False
) -> int:
    """Write a volume in a format that other programs read.

    Args:
        to: gismo (G+Smo XML), mfem (NURBS mesh), vtk (exact Bezier cells), view (samples for slicing in ParaView),
            json (splinepy's).
        out: file to write; the volume's stem with the format's ending in the current folder by default.
        solution: solution.npz to export, too: as point data u (vtk, view), or in a file beside it (NAME_u.xml, NAME.gf,
            NAME_u.json).
        force: replace that file where it exists.
    """
    from ..io.formats import export

    _print(str(export(volume, to, out, solution=solution, force=force)))
    return DONE


@app.command(name="app")
def serve_page(
    *,
    port: int = 8080,
    open_browser: Annotated[bool, Parameter(name="--open")] = False,
    max_upload: int = 64,
    mapping: Mapping = MAPPING,
    poisson: Equation = POISSON,
) -> int:
    """Serve a page to this computer's browser: drop a surface, watch it become a volume, download the files.

    Args:
        port: of 127.0.0.1; 0 takes a free one.
        open_browser: open the page in the browser.
        max_upload: megabytes a surface's file may have.
    """
    from ..live.app import serve

    serve(_print, port=port, open_browser=open_browser, max_upload=max_upload, mapping=mapping, poisson=poisson)
    return DONE


def main(argv: list[str]) -> int:
    """Run one command and return its exit code; only an internal error shows a traceback."""
    try:
        code = app(argv, exit_on_error=False, print_error=False, result_action="return_value")
    except KeyboardInterrupt as error:  # its message says how to continue, where that is possible
        print(f"iga-nn: {str(error) or 'interrupted'}", file=sys.stderr)
        return INTERRUPTED
    except CycloptsError as error:
        print(f"iga-nn: {one_line(error)}{_minus_hint(argv)}", file=sys.stderr)
        return BAD_INPUT
    except expected_errors() as error:
        print(f"iga-nn: {one_line(error)}", file=sys.stderr)
        return BAD_INPUT
    return code if isinstance(code, int) else DONE  # --help and --version return nothing


def _minus_hint(argv: list[str]) -> str:
    """Return the remedy where a formula was taken for an option."""
    for option, value in pairwise(argv):
        if option in FORMULAS and value.startswith("-"):
            return f" A formula that starts with a minus is written {option}={value}"
    return ""


def _progress(output: OutputOptions) -> AbstractContextManager[ProgressCallback | None]:
    """Return the context in which progress is shown."""
    from .progress import shown_progress

    return shown_progress(output.quiet)


def _finish(outcome: Outcome, output: OutputOptions) -> int:
    """Print the verdict and return the exit code."""
    from . import answer

    _print(answer.verdict_as_json(outcome) if output.as_json else answer.verdict_in_words(outcome))
    return answer.exit_code(outcome.report)


def _print(text: str) -> None:
    """Print to stdout; a reader that has gone, such as `head`, is no error."""
    try:
        print(text, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the flush at exit
