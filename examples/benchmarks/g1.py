"""conch and eleven models of the benchmark set G1, from surface to solved PDE, our figures beside the paper's.

    python examples/benchmarks/g1.py --jobs 2
    python examples/benchmarks/g1.py --models DIR --only bunny duck --out out/g1

Writes g1.csv (every figure) and g1.md, anew after each model. Every model has a process of its own with cores // jobs
threads, on the CPU also where there is a GPU. Right before a run the same process measures t_cal, the wall seconds of
1e12 floating-point operations: seconds / t_cal compares between machines. A model that cannot be run keeps its
row, which says why; the paper's santa4 is not public, its row waits for santa4.obj.
"""

from __future__ import annotations

import argparse
import os
import time
import traceback
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, Literal

import processes

import iga_nn
from iga_nn.errors import InputError, one_line
from iga_nn.models import DATA_FOLDER
from iga_nn.options import MapOptions
from iga_nn.report import document as reports
from parameterize.files import save_text
from solve.forms.poisson import DEFAULT_EXACT

REPOSITORY = Path(__file__).resolve().parents[2]
PAPER_EXACT = {"conch": "exp(x+z)*sin(y)"}  # where the paper solves Poisson's equation (section 5.5)
DONE, ABSENT = "done", "model not public"


@dataclass(frozen=True)
class Published:
    """The paper's figures: Table B.6 with the model brought to volume 1, Table 3 at the scale it came in."""

    arap_mean: float
    arap_max: float
    boundary: float
    table: Literal["B.6", "3"] = "B.6"

    @property
    def scale(self) -> str:
        """Which of our two scales these figures compare with."""
        return "unit_volume" if self.table == "B.6" else "as_given"


PAPER = {
    "conch": Published(1.468, 50.818, 0.00169, "3"),
    "bimba": Published(0.928, 15.921, 0.000708),
    "bird": Published(2.744, 37.446, 0.000961),
    "bone": Published(2.303, 22.687, 0.009318),
    "bumpy_sphere": Published(0.322, 6.283, 0.000704),
    "bunny": Published(0.835, 47.179, 0.000782),
    "duck": Published(0.341, 13.269, 0.000846),
    "hand": Published(1.621, 65.612, 0.001303),
    "homer": Published(1.799, 69.896, 0.001726),
    "moai": Published(0.903, 9.648, 0.000746),
    "octa_flower": Published(0.610, 39.612, 0.001494),
    "pig": Published(0.776, 42.099, 0.000565),
    "santa4": Published(3.936, 95.842, 0.00527, "3"),
}


@dataclass(frozen=True)
class Row:
    """What is known of one model, the columns of g1.csv; distances between spline and mesh at the scale it came in.

    status: "done", or in one line why figures are missing or not to be trusted.
    seconds: wall, of the parameterization alone; t_cal: wall seconds of 1e12 operations on the same threads.
    """

    model: str
    status: str = DONE
    verdict: str | None = None
    det_lower_bound: float | None = None
    arap_mean_unit_volume: float | None = None
    arap_max_unit_volume: float | None = None
    arap_mean_as_given: float | None = None
    arap_max_as_given: float | None = None
    boundary_rms_unit_volume: float | None = None
    boundary_rms_as_given: float | None = None
    spline_to_mesh_rms: float | None = None
    spline_to_mesh_max: float | None = None
    mesh_to_spline_rms: float | None = None
    mesh_to_spline_max: float | None = None
    flipped_triangles: int | None = None
    seconds: float | None = None
    seconds_train: float | None = None
    seconds_fit: float | None = None
    seconds_optimize: float | None = None
    seconds_certify: float | None = None
    threads: int | None = None
    t_cal: float | None = None
    seconds_in_t_cal: float | None = None
    exact: str | None = None
    l2_relative_refine_0: float | None = None
    l2_relative_refine_1: float | None = None
    l2_refine_0: float | None = None
    l2_refine_1: float | None = None
    iterations_refine_0: int | None = None
    iterations_refine_1: int | None = None

    @property
    def arap_mean(self) -> float | None:
        """At the scale of the paper's figure, as the next two."""
        return getattr(self, f"arap_mean_{PAPER[self.model].scale}")

    @property
    def arap_max(self) -> float | None:  # noqa: D102
        return getattr(self, f"arap_max_{PAPER[self.model].scale}")

    @property
    def boundary(self) -> float | None:  # noqa: D102
        return getattr(self, f"boundary_rms_{PAPER[self.model].scale}")


@dataclass(frozen=True)
class Options:
    """What to run, how, and where the tables go."""

    models: Path
    names: tuple[str, ...]
    mapping: MapOptions
    jobs: int
    out: Path

    @property
    def threads(self) -> int:
        """Of each process."""
        return max(1, processes.cores() // self.jobs)


def main(argv: list[str] | None = None) -> int:
    """Run the models and write the tables; 0 done, 1 a row has a failure, 2 bad arguments, 130 interrupted."""
    options, child = _options(argv)
    if child:
        return processes.answer(lambda: run_model(child, options))
    remains = f"they are in {options.out / 'g1.csv'}"
    found = _results(options)
    rows, failed = processes.collect("g1.py", found, lambda rows: write_tables(rows, options), _told, remains)
    if failed:
        return failed
    print(f"{summary(rows)}\n{options.out / 'g1.md'}")
    return int(any(row.status not in (DONE, ABSENT) for row in rows))


def _told(row: Row) -> str:
    if row.arap_mean is None or row.seconds is None:
        return f"{row.model}: {row.status}"
    return f"{row.model}: {row.status}, {row.verdict}, ARAP mean {row.arap_mean:.3f}, {row.seconds:.0f} s"


# Arguments


def _options(argv: list[str] | None) -> tuple[Options, str | None]:
    """The options, and the one model to run in this process, where it is a child."""
    parser = _parser()
    given = parser.parse_args(argv)
    unknown = [name for name in given.only if name not in PAPER]
    mapping = MapOptions(given.preset, given.seed, "cpu", given.control_points, steps_factor=given.steps_factor)
    if unknown:
        parser.error(f"--only {' '.join(unknown)}: no such model; the models are {', '.join(PAPER)}")
    if given.jobs < 1:
        parser.error(f"--jobs {given.jobs}: must be at least 1")
    if not given.models.is_dir():
        parser.error(f"{given.models}: no such folder; name the models' with --models or {DATA_FOLDER}")
    try:
        mapping.config()
        given.out.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=given.out).close()  # before hours of work, not after
    except InputError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"{given.out}: cannot be written ({error.strerror}); --out names another folder")
    names = tuple(name for name in PAPER if name in (given.only or PAPER))
    return Options(given.models, names, mapping, given.jobs, given.out), given.child


def _parser() -> argparse.ArgumentParser:
    parser = processes.OneLineParser(
        prog="g1.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    models = Path(os.environ.get(DATA_FOLDER) or REPOSITORY.parent / "shared" / "models")
    results = Path(__file__).resolve().parent / "results"
    parser.add_argument("--models", type=Path, default=models, help=f"folder of NAME.obj (default: {models})")
    parser.add_argument("--jobs", type=int, default=1, help="models at a time (default: 1)")
    parser.add_argument("--preset", default="fast", choices=("fast", "paper"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="NAME", help="these alone, and no others in the tables"
    )
    parser.add_argument("--out", type=Path, default=results, help=f"folder of the tables (default: {results})")
    parser.add_argument("--steps-factor", type=float, default=1.0, help="shorten every stage, for a quick look")
    parser.add_argument("--control-points", type=int, default=30, help="per direction (default: 30)")
    parser.add_argument("--child", help=argparse.SUPPRESS)
    return parser


# Processes, one a model


def _command(name: str, options: Options) -> list[str]:
    mapping = options.mapping
    values = {
        "child": name,
        "models": options.models,
        "jobs": options.jobs,
        "preset": mapping.preset,
        "seed": mapping.seed,
        "out": options.out,
        "steps-factor": mapping.steps_factor,
        "control-points": mapping.control_points,
    }
    return processes.script(__file__, values)


def _results(options: Options) -> Generator[Row, None, None]:
    """Each model's row as soon as it is known; processes still running end with this generator."""
    absent = {name: why for name in options.names if (why := _absence(name, options.models))}
    yield from (Row(name, why) for name, why in absent.items())
    commands = {name: _command(name, options) for name in options.names if name not in absent}
    with closing(processes.in_processes(commands, options.threads, options.jobs)) as running:
        for ended in running:
            yield Row(ended.name, ended.failure) if ended.result is None else Row(**ended.result)


def _file(name: str, folder: Path) -> Path:
    """NAME.obj, or the published tetrahedra where they alone are there."""
    path, tetrahedra = folder / f"{name}.obj", folder / f"{name}.mesh"
    return tetrahedra if tetrahedra.is_file() and not path.is_file() else path


def _absence(name: str, folder: Path) -> str | None:
    """Why there is nothing to run; None where there is."""
    path = _file(name, folder)
    if path.is_file():
        return None
    return ABSENT if name == "santa4" else f"{path}: not found; there, `iga-nn fetch {name}` gets it"


# One model


def run_model(name: str, options: Options) -> Row:
    """All figures of one model; after an error those known before it, and its message as the status."""
    row = Row(name)
    try:
        surface = iga_nn.load_surface(_file(name, options.models))
        run = iga_nn.parameterize  # loads torch
        t_cal, threads = processes.calibrate(min(1.0, options.mapping.steps_factor))
        start = time.perf_counter()
        result = run(surface, options.mapping.config(), seed=options.mapping.seed, device=options.mapping.device)
        seconds = time.perf_counter() - start
        row = replace(row, seconds=seconds, threads=threads, t_cal=t_cal, seconds_in_t_cal=seconds / t_cal)
        row = replace(row, **_figures(result))
        return replace(row, **_solved(result, PAPER_EXACT.get(name, DEFAULT_EXACT)))
    except Exception as error:
        if not isinstance(error, iga_nn.MeshError):
            traceback.print_exc()
        return replace(row, status=one_line(error) or type(error).__name__)


def _figures(result: iga_nn.Parameterization) -> dict[str, Any]:
    """Quality, foldings and seconds of the stages, by column."""
    quality = result.quality
    found: dict[str, Any] = {
        "verdict": quality.certificate.verdict,
        "det_lower_bound": quality.as_dict()["det_lower_bound"],
        "flipped_triangles": len(result.boundary.flipped()),
    }
    for scale in ("unit_volume", "as_given"):
        arap = getattr(quality.arap, scale)
        found |= {f"arap_mean_{scale}": arap.mean, f"arap_max_{scale}": arap.max}
        found[f"boundary_rms_{scale}"] = getattr(quality.boundary, scale).rms
    for name in ("spline_to_mesh", "mesh_to_spline"):
        distances = getattr(quality, name).as_given
        found |= {f"{name}_rms": distances.rms, f"{name}_max": distances.max}
    return found | {f"seconds_{stage}": result.seconds[stage] for stage in ("train", "fit", "optimize", "certify")}


def _solved(result: iga_nn.Parameterization, exact: str) -> dict[str, Any]:
    """L2 errors and iterations of the two levels, by column; a status where the solver did not converge."""
    problem = iga_nn.Poisson(exact=exact)
    found: dict[str, Any] = {"exact": exact}
    for level in (0, 1):
        report = iga_nn.solve(result.volume, problem, refine=level, certified=result.certificate.verdict).report
        found |= {f"l2_relative_refine_{level}": report.l2_relative, f"l2_refine_{level}": report.l2}
        found[f"iterations_refine_{level}"] = report.iterations
        if not report.converged:
            found["status"] = f"the solver did not converge at refine {level}"
    return found


# Tables


def write_tables(rows: Sequence[Row], options: Options) -> None:
    """g1.csv and g1.md with the rows so far, in the paper's order; each replaced in one go."""
    order = list(PAPER)
    rows = sorted(rows, key=lambda row: order.index(row.model))
    save_text(options.out / "g1.csv", as_csv(rows))
    save_text(options.out / "g1.md", as_markdown(rows, options))


def as_csv(rows: Sequence[Row]) -> str:
    """Every figure, ours and the paper's, with all its digits; empty where there is none."""
    columns = [field.name for field in fields(Row)] + [f"paper_{field.name}" for field in fields(Published)]
    paper = [{f"paper_{name}": value for name, value in asdict(PAPER[row.model]).items()} for row in rows]
    return processes.as_csv(columns, (asdict(row) | beside for row, beside in zip(rows, paper, strict=True)))


def as_markdown(rows: Sequence[Row], options: Options) -> str:
    """The figures a reader compares, the summary and the machine."""
    measured = [row for row in rows if row.verdict is not None]
    parts = [
        "# G1: our figures beside the paper's",
        "Figures at or below the paper's are bold. The paper's are those of Table B.6, with the models brought to "
        "volume 1, and for conch and santa4 of Table 3, at the scale they came in. Its det J > 0 is at samples of the "
        'network; "certified" is a proof for the spline.',
        processes.as_markdown(QUALITY_HEAD, [_quality_cells(row) for row in rows]),
        "Distances between spline and mesh, at the scale the models came in; triangles of the boundary map turned over",
        processes.as_markdown(DISTANCE_HEAD, [_cells(row, DISTANCE_COLUMNS) for row in measured]),
        "Wall seconds of the parameterization; t_cal: 1e12 float32 operations on the same threads, right before",
        processes.as_markdown(TIME_HEAD, [_cells(row, TIME_COLUMNS) for row in measured]),
        "Poisson's equation; X, Y, Z are x, y, z scaled to volume 1 about the middle of the bounding box",
        processes.as_markdown(SOLVE_HEAD, [_cells(row, SOLVE_COLUMNS) for row in measured]),
        *_caveats(rows, options),
        summary(rows),
        _machine(options),
    ]
    return "\n\n".join(parts) + "\n"


Format = Callable[[Any], str]
QUALITY_HEAD = ("model", "verdict", "det J / mean >=", "ARAP mean", "paper", "ARAP max", "paper", "boundary", "paper")
DISTANCE_HEAD = ("model", "spline to mesh rms", "max", "mesh to spline rms", "max", "flipped")
TIME_HEAD = ("model", "seconds", "train", "fit", "optimize", "certify", "t_cal", "seconds / t_cal")
SOLVE_HEAD = (
    "model", "exact solution", "relative L2, refine 0", "refine 1", "L2, refine 0", "refine 1", "iterations, refine 0",
    "refine 1",
)  # fmt: skip
DISTANCE_COLUMNS: dict[str, Format] = {
    "spline_to_mesh_rms": "{:.3g}".format,
    "spline_to_mesh_max": "{:.3g}".format,
    "mesh_to_spline_rms": "{:.3g}".format,
    "mesh_to_spline_max": "{:.3g}".format,
    "flipped_triangles": str,
}
TIME_COLUMNS: dict[str, Format] = {
    **dict.fromkeys(("seconds", *(f"seconds_{s}" for s in ("train", "fit", "optimize", "certify"))), "{:.1f}".format),
    "t_cal": "{:.2f}".format,
    "seconds_in_t_cal": "{:.1f}".format,
}
SOLVE_COLUMNS: dict[str, Format] = {
    "exact": str,
    "l2_relative_refine_0": "{:.2e}".format,
    "l2_relative_refine_1": "{:.2e}".format,
    "l2_refine_0": "{:.2e}".format,
    "l2_refine_1": "{:.2e}".format,
    "iterations_refine_0": str,
    "iterations_refine_1": str,
}


def _cells(row: Row, columns: dict[str, Format]) -> list[str]:
    values = ((getattr(row, name), form) for name, form in columns.items())
    return [row.model, *("" if value is None else form(value) for value, form in values)]


def _quality_cells(row: Row) -> list[str]:
    """One row of the first table; where something failed the verdict says what."""
    paper = PAPER[row.model]
    verdict = "; ".join(part for part in (row.verdict, row.status) if part not in (None, DONE))
    bound = "" if row.det_lower_bound is None else f"{row.det_lower_bound:.3g}"
    cells = [row.model, verdict, bound]
    for ours, theirs, form in (
        (row.arap_mean, paper.arap_mean, "{:.3f}"),
        (row.arap_max, paper.arap_max, "{:.3f}"),
        (row.boundary, paper.boundary, "{:.6f}"),
    ):
        cells += [_beside(ours, theirs, form), form.format(theirs)]
    return cells


def _beside(ours: float | None, theirs: float, form: str) -> str:
    """Our figure, bold where it is at or below theirs."""
    if ours is None:
        return ""
    return f"**{form.format(ours)}**" if ours <= theirs else form.format(ours)


def summary(rows: Sequence[Row]) -> str:
    """One line of counts; every model that is there or should be counts, santa4 only where it was run."""
    tried = [row for row in rows if row.status != ABSENT]
    g1 = [row for row in tried if PAPER[row.model].table == "B.6"]
    certified = sum(row.verdict == "certified" for row in tried)
    arap = sum(row.arap_mean is not None and row.arap_mean <= PAPER[row.model].arap_mean for row in g1)
    boundary = sum(row.boundary is not None and row.boundary <= PAPER[row.model].boundary for row in g1)
    return (
        f"Certified {certified} of {len(tried)}; of G1, ARAP mean at or below the paper's {arap} of {len(g1)}, "
        f"boundary rms at or below the paper's {boundary} of {len(g1)}."
    )


def _caveats(rows: Sequence[Row], options: Options) -> list[str]:
    """What keeps these tables from being the benchmark."""
    mapping, found = options.mapping, []
    missing = [name for name in options.names if name not in {row.model for row in rows}]
    if missing:
        found.append(f"Not finished yet: {', '.join(missing)}.")
    if mapping.steps_factor != 1.0:
        found.append(f"Every stage's steps times {mapping.steps_factor:g}: a quick look, no measurement.")
    if mapping.control_points != 30:
        found.append(f"{mapping.control_points} control points a direction; the paper has 30.")
    return found


def _machine(options: Options) -> str:
    mapping = options.mapping
    versions = ", ".join(f"{name} {number}" for name, number in reports.versions().items())
    return (
        f"{processes.processor()}, {processes.cores()} cores, "
        f"{options.jobs} at a time with {options.threads} threads each; "
        f"{versions}; preset {mapping.preset}, seed {mapping.seed}."
    )


if __name__ == "__main__":
    processes.end_children_on_term()
    raise SystemExit(main())
