"""conch, eleven models of the benchmark set G1 and three remeshed shapes, from surface to solved PDE, beside the paper.

    python examples/benchmarks/g1.py --jobs 2
    python examples/benchmarks/g1.py --models DIR --only bunny duck --out out/g1
    python examples/benchmarks/g1.py --control-points auto --tolerance 1.5e-4 --out out/g1_auto

Runs the models as `iga-nn batch` does: each has a folder with its report, and the same command skips what is finished
and goes on from checkpoints. Writes g1.csv (every figure) and g1.md, anew after each model; copy them to results/ when
they are to be kept. A worker has cores // jobs threads, on the CPU also where there is a GPU. A model that cannot be
run keeps its row, which says why; the paper's santa4 is not public, its row waits for santa4.obj. Maps are of one cube,
as the paper's are; those of NAME_default are what a user gets by default.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal

import processes
from paper import EXACT, NOT_HERE, NOT_PUBLIC, PAPER, REMESHED, Published, blocks_of, file_of, surface_to_run

from iga_nn.batch.table import Batch
from iga_nn.batch.table import Row as Known
from iga_nn.batch.task import Task
from iga_nn.errors import InputError
from iga_nn.level_table import csv_text
from iga_nn.models import DATA_FOLDER
from iga_nn.options import MapOptions, PoissonOptions, WorkerOptions
from iga_nn.report import document as reports
from parameterize.cube.boundary_map import BoundaryMap
from parameterize.files import save_text
from solve.forms.poisson import DEFAULT_EXACT

REPOSITORY = Path(__file__).resolve().parents[2]
DONE = "done"


@dataclass(frozen=True)
class Row(processes.MapColumns):
    """What is known of one model, the columns of g1.csv; distances between spline and mesh at the scale it came in.

    status: "done", or in one line why figures are missing or not to be trusted.
    seconds: wall, of the parameterization alone; unknown where the run was interrupted and went on.
    """

    model: str
    status: str = DONE
    verdict: str | None = None
    one_to_one: str | None = None
    blocks: int = 1
    control_points: str | None = None
    det_lower_bound: float | None = None
    arap_mean_unit_volume: float | None = None
    arap_max_unit_volume: float | None = None
    arap_mean_as_given: float | None = None
    arap_max_as_given: float | None = None
    boundary_rms_unit_volume: float | None = None
    boundary_rms_as_given: float | None = None
    distance_rms: float | None = None  # between mesh and spline, both ways, over the diagonal of the box
    distance_max: float | None = None
    spline_to_mesh_rms: float | None = None
    spline_to_mesh_max: float | None = None
    mesh_to_spline_rms: float | None = None
    mesh_to_spline_max: float | None = None
    flipped_triangles: int | None = None
    seconds: float | None = None
    seconds_train: float | None = None
    seconds_fit: float | None = None
    seconds_optimize: float | None = None
    seconds_refine: float | None = None
    seconds_certify: float | None = None
    threads: int | None = None
    exact: str | None = None
    l2_relative_refine_0: float | None = None
    l2_relative_refine_1: float | None = None
    l2_refine_0: float | None = None
    l2_refine_1: float | None = None
    iterations_refine_0: int | None = None
    iterations_refine_1: int | None = None

    @property
    def arap_mean(self) -> float | None:
        """At the scale of the paper's figure, as the next two; that of several blocks is against their own boxes."""
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
    options = _options(argv)
    absent = [Row(name, why) for name in options.names if (why := _absence(name, options.models))]
    tasks = _tasks(options, leave_out=[row.model for row in absent])
    found: list[Row] = []

    def keep(batch: Batch) -> None:
        found[:] = absent + [row_of(known) for known in batch.rows if known.state != "waiting"]
        write_tables(found, options)

    workers = WorkerOptions(workers=options.jobs, threads_per_worker=options.threads, memory_limit="0")
    if code := processes.run("g1.py", options.out, tasks, workers, keep):
        return code
    print(*map(_told, found), summary(found), options.out / "g1.md", sep="\n")
    return int(any(row.status not in (DONE, NOT_PUBLIC, NOT_HERE) for row in found))


def _told(row: Row) -> str:
    if row.arap_mean is None:
        return f"{row.model}: {row.status}"
    seconds = "" if row.seconds is None else f", {row.seconds:.0f} s"
    return f"{row.model}: {row.status}, {row.verdict}, ARAP mean {row.arap_mean:.3f}{seconds}"


# Arguments


def _options(argv: list[str] | None) -> Options:
    parser = _parser()
    given = parser.parse_args(argv)
    unknown = [name for name in given.only if name not in PAPER]
    mapping = MapOptions(
        preset=given.preset,
        seed=given.seed,
        device="cpu",
        control_points=given.control_points,
        tolerance=given.tolerance,
        steps_factor=given.steps_factor,
        resume=True,
    )
    if unknown:
        parser.error(f"--only {' '.join(unknown)}: no such model; the models are {', '.join(PAPER)}")
    processes.demand_positive(parser, given, "jobs")
    if not given.models.is_dir():
        parser.error(f"{given.models}: no such folder; name the models' with --models or {DATA_FOLDER}")
    try:
        mapping.config()
    except InputError as error:
        parser.error(str(error))
    names = tuple(name for name in PAPER if name in (given.only or PAPER))
    return Options(given.models, names, mapping, given.jobs, given.out)


def _parser() -> processes.OneLineParser:
    parser = processes.OneLineParser(
        prog="g1.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    models = Path(os.environ.get(DATA_FOLDER) or REPOSITORY.parent / "shared" / "models")
    results = Path("out/g1")
    parser.add_argument("--models", type=Path, default=models, help=f"folder of NAME.obj (default: {models})")
    parser.add_argument("--jobs", type=int, default=1, help="models at a time (default: 1)")
    parser.add_argument("--preset", default="fast", choices=("fast", "paper"))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="NAME", help="these alone, and no others in the tables"
    )
    parser.add_argument("--out", type=Path, default=results, help=f"folder of the results (default: {results})")
    parser.add_argument("--steps-factor", type=float, default=1.0, help="shorten every stage, for a quick look")
    parser.add_argument("--control-points", type=_count, default=30, help='per direction, or "auto" (default: 30)')
    tolerance = MapOptions.tolerance
    parser.add_argument("--tolerance", type=float, default=tolerance, help=f"of auto (default: {tolerance:g})")
    return parser


def _count(text: str) -> int | Literal["auto"]:
    return "auto" if text == "auto" else int(text)


# Models


def _tasks(options: Options, leave_out: Sequence[str]) -> list[Task]:
    """The runs of the models."""
    return [
        Task(
            name,
            str(surface_to_run(name, options.models, options.out / "surfaces").absolute()),
            (options.out / name).absolute(),
            replace(options.mapping, blocks=blocks_of(name)),
            PoissonOptions(exact=DEFAULT_EXACT if PAPER[name].table == "B.6" else EXACT),
        )
        for name in options.names
        if name not in leave_out
    ]


def _absence(name: str, folder: Path) -> str | None:
    """Why there is nothing to run; None where there is."""
    path = file_of(name, folder)
    if path.is_file():
        return None
    if name in REMESHED:
        return NOT_HERE
    return NOT_PUBLIC if name == "santa4" else f"{path}: not found; there, `iga-nn fetch {name}` gets it"


def row_of(known: Known) -> Row:
    """All figures of one model, from its folder; why there are none as the status."""
    if known.report is None:
        return Row(known.entry.name, known.line)
    report = known.report
    quality, solved_on = report["parameterization"], report.get("poisson", {})
    found: dict[str, Any] = {
        "verdict": quality["bijective"],
        "one_to_one": reports.one_to_one(report),
        "blocks": len(quality.get("patches", ())) or 1,
        "control_points": _control_points(quality["control_points"]),
        "det_lower_bound": quality["det_lower_bound"],
        "exact": solved_on.get("exact"),
    }
    if "not_solved" in report:
        found["status"] = f"not solved: {report['not_solved']}"
    if found["blocks"] == 1:  # the surface is cut along the edges of a cube alone
        found["flipped_triangles"] = len(BoundaryMap.load(known.entry.folder / "boundary.npz").flipped())
    for scale in ("unit_volume", "as_given"):
        arap = quality["arap"][scale]
        found |= {f"arap_mean_{scale}": arap["mean"], f"arap_max_{scale}": arap["max"]}
        found[f"boundary_rms_{scale}"] = quality["boundary"][scale]["rms"]
    for name in ("spline_to_mesh", "mesh_to_spline"):
        distances = quality["surface_distance"][name]["as_given"]
        found |= {f"{name}_rms": distances["rms"], f"{name}_max": distances["max"]}
    for key, value in reports.surface_distance(report).items():
        if key != "mean":
            found[f"distance_{key}"] = value
    for level, solved in enumerate(solved_on.get("levels", ())):
        found |= {f"l2_relative_refine_{level}": solved["l2_relative"], f"l2_refine_{level}": solved["l2"]}
        found[f"iterations_refine_{level}"] = solved["iterations"]
        if not solved["converged"]:
            found["status"] = f"the solver did not converge at refine {level}"
    return Row(known.entry.name, **found, **processes.times_of(known), **processes.attempts_of(report))


def _control_points(found: int | Sequence[int]) -> str:
    """Of several blocks their number is given, of one cube those by direction."""
    return str(found) if isinstance(found, int) else " x ".join(map(str, found))


# Tables


def write_tables(rows: Sequence[Row], options: Options) -> None:
    """g1.csv and g1.md with the rows so far, in the paper's order; each replaced in one go."""
    order = list(PAPER)
    rows = sorted(rows, key=lambda row: order.index(row.model))
    save_text(options.out / "g1.csv", as_csv(rows))
    save_text(options.out / "g1.md", as_markdown(rows, options))


def as_csv(rows: Sequence[Row]) -> str:
    """Every figure, ours and the paper's, with all its digits; empty where there is none."""
    columns = processes.columns_of(Row) + [f"paper_{field.name}" for field in fields(Published)]
    paper = [{f"paper_{name}": value for name, value in asdict(PAPER[row.model]).items()} for row in rows]
    return csv_text(columns, (asdict(row) | beside for row, beside in zip(rows, paper, strict=True)))


def as_markdown(rows: Sequence[Row], options: Options) -> str:
    """The figures a reader compares, the summary and the machine."""
    measured = [row for row in rows if row.verdict is not None]
    parts = [
        "# G1: our figures beside the paper's",
        "Figures at or below the paper's are bold. The paper's are those of Table B.6, with the models brought to "
        "volume 1; for conch, santa4 and the remeshed shapes of Tables 2 and 3, at the scale they came in. Distances "
        "in this table are at the mesh's vertices, root mean square, as the paper's. Its det J > 0 is at samples of "
        'the network; "certified" is a proof for the spline.',
        "The paper's duck of Table 2, horse and santa4 are not public. Surfaces of these names from HybridOctree_Hex, "
        "remeshed by others, stand beside its rows: no claim about its files. They have the volume of the conch, 3.14, "
        "as the paper does not say at which scale its models came. `_cube` is a map of one cube, `_default` what a run "
        "makes without options. ARAP of several blocks is against their own boxes, and no bold figure.",
        processes.as_markdown(QUALITY_HEAD, [_quality_cells(row) for row in rows]),
        "Distances between spline and mesh, sampled over all of both: the two together over the diagonal of the box, "
        "each at the scale the models came in; triangles of the boundary map turned over",
        processes.as_markdown(DISTANCE_HEAD, [_cells(row, DISTANCE_COLUMNS) for row in measured]),
        "Control points, and wall seconds of the parameterization, which differ between machines and hours",
        processes.as_markdown(TIME_HEAD, [_time_cells(row) for row in measured]),
        "Where the map comes from, the starts that were tried, and of all these the rounds / seconds by phase",
        processes.as_markdown(PHASE_HEAD, [_phase_cells(row) for row in measured]),
        "Poisson's equation; X, Y, Z are x, y, z scaled to volume 1 about the middle of the bounding box",
        processes.as_markdown(SOLVE_HEAD, [_cells(row, SOLVE_COLUMNS) for row in measured]),
        *_caveats(rows, options),
        summary(rows),
        _machine(options),
    ]
    return "\n\n".join(parts) + "\n"


Format = Callable[[Any], str]
QUALITY_HEAD = (
    "model", "blocks", "verdict", "one-to-one", "det J / mean >=", "ARAP mean", "paper", "ARAP max", "paper",
    "at vertices", "paper",
)  # fmt: skip
DISTANCE_HEAD = (
    "model", "both ways / diagonal, rms", "max", "spline to mesh rms", "max", "mesh to spline rms", "max", "flipped",
)  # fmt: skip
TIME_HEAD = ("model", "control points", "seconds", "paper, on an RTX 3080 Ti", *processes.STAGES)
PHASE_HEAD = ("model", "origin", "attempts", *processes.PHASES)
SOLVE_HEAD = (
    "model", "exact solution", "relative L2, refine 0", "refine 1", "L2, refine 0", "refine 1", "iterations, refine 0",
    "refine 1",
)  # fmt: skip
DISTANCE_COLUMNS: dict[str, Format] = {
    "distance_rms": "{:.3g}".format,
    "distance_max": "{:.3g}".format,
    "spline_to_mesh_rms": "{:.3g}".format,
    "spline_to_mesh_max": "{:.3g}".format,
    "mesh_to_spline_rms": "{:.3g}".format,
    "mesh_to_spline_max": "{:.3g}".format,
    "flipped_triangles": str,
}
TIME_COLUMNS: dict[str, Format] = {
    "control_points": str,
    **dict.fromkeys(("seconds", *(f"seconds_{stage}" for stage in processes.STAGES)), "{:.1f}".format),
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


def _time_cells(row: Row) -> list[str]:
    """One row of the table of seconds."""
    model, points, seconds, *stages = _cells(row, TIME_COLUMNS)
    return [model, points, seconds, f"{PAPER[row.model].seconds:.1f}", *stages]


def _phase_cells(row: Row) -> list[str]:
    """One row of the table by phase."""
    if row.origin is None or row.attempts is None:
        return [row.model, *[""] * (len(PHASE_HEAD) - 1)]
    found = [(getattr(row, f"rounds_{phase}"), getattr(row, f"seconds_{phase}")) for phase in processes.PHASES]
    return [row.model, row.origin, row.attempts, *(f"{n} / {s:.1f}" if n else "" for n, s in found)]


def _quality_cells(row: Row) -> list[str]:
    """One row of the first table; where something failed the verdict says what."""
    paper = PAPER[row.model]
    verdict = "; ".join(part for part in (row.verdict, row.status) if part not in (None, DONE))
    bound = "" if row.det_lower_bound is None else f"{row.det_lower_bound:.3g}"
    blocks = "" if row.verdict is None else str(row.blocks)
    cells = [row.model, blocks, verdict, row.one_to_one or "", bound]
    for ours, theirs, form, comparable in (
        (row.arap_mean, paper.arap_mean, "{:.3f}", row.blocks == 1),
        (row.arap_max, paper.arap_max, "{:.3f}", row.blocks == 1),
        (row.boundary, paper.boundary, "{:.6f}", True),
    ):
        beaten = comparable and ours is not None and ours <= theirs
        cells += [_told_figure(ours, form, bold=beaten), form.format(theirs)]
    return cells


def _told_figure(ours: float | None, form: str, *, bold: bool) -> str:
    """Our figure, bold where it is comparable with the paper's and at or below it."""
    if ours is None:
        return ""
    return f"**{form.format(ours)}**" if bold else form.format(ours)


def summary(rows: Sequence[Row]) -> str:
    """One line of counts; every model that is there or should be counts, those that are not public where they ran."""
    tried = [row for row in rows if row.status not in (NOT_PUBLIC, NOT_HERE)]
    g1 = [row for row in tried if PAPER[row.model].table == "B.6"]
    certified = sum(row.verdict == "certified" and row.one_to_one == "yes" for row in tried)
    arap = sum(row.arap_mean is not None and row.arap_mean <= PAPER[row.model].arap_mean for row in g1)
    boundary = sum(row.boundary is not None and row.boundary <= PAPER[row.model].boundary for row in g1)
    return (
        f"Certified and one-to-one {certified} of {len(tried)}; of G1, ARAP mean at or below the paper's {arap} of "
        f"{len(g1)}, rms at the vertices at or below the paper's {boundary} of {len(g1)}."
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
        tolerance = f" with tolerance {mapping.tolerance:g}" if mapping.control_points == "auto" else ""
        found.append(f"{mapping.control_points} control points a direction{tolerance}; the paper has 30.")
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
    raise SystemExit(main())
