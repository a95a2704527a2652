"""Random hard surfaces (hard_shapes.py), default settings: which share ends certified, by kind.

    python examples/benchmarks/stress.py --first 40 --count 120
    python examples/benchmarks/stress.py --first 1000 --count 80
    python examples/benchmarks/stress.py --kinds thin flat --out out/stress

From number 1000 on they have limbs or handles. Runs the surfaces as `iga-nn batch` does, with one thread each: the
same command skips what is finished and goes on from checkpoints. stress.csv and stress.md are written anew after each;
a surface's mesh is in surfaces/, and report.html in its folder shows where it is not certified.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean, median

import processes
from hard_shapes import KINDS, LATER, compute_shape, kind_of, name_of

from iga_nn.batch.table import Batch
from iga_nn.batch.table import Row as Known
from iga_nn.batch.task import Task
from iga_nn.level_table import csv_text
from iga_nn.options import MapOptions, WorkerOptions
from iga_nn.report import document as reports
from parameterize.files import save_text

SETTINGS = "{0.preset}, seed {0.seed}, {0.control_points} control points, steps times {0.steps_factor:g}"
LOOKS = {  # what a reader should picture
    "bumpy": "a ball, all bumps and hollows",
    "bent": "a sausage bent by 200 to 400 degrees",
    "spiky": "a ball with 4 to 10 twisted spikes, up to 4 times as high as wide",
    "thin": "a wavy sheet, 8 to 15 times as wide as thick, rolled up",
    "flat": "a flat plate with arms, 8 to 15 times as wide as thick",
    "long": "a curved worm with necks, 8 to 12 times as long as wide",
    "bulb": "a ball on a thin stalk",
    "fingers": "a palm with 3 to 5 fingers close together",
    "flap": "a body with thin wings that lie along it",
    "folded": "a sheet folded once or twice, its layers close together",
    "limbed": "a body with 4 to 8 limbs, some of them forked",
    "graph": "rods around a graph in space, with 1 to 8 handles",
}


@dataclass(frozen=True)
class Row(processes.MapColumns):
    """What is known of one surface. Distances and ARAP at volume 1; error: in one line why figures are missing."""

    number: int
    kind: str
    settings: str
    faces: int | None = None
    verdict: str | None = None
    boundary_injective: bool | None = None
    det_lower_bound: float | None = None
    unproved: int | None = None  # spans
    arap_mean: float | None = None
    arap_max: float | None = None
    boundary_rms: float | None = None  # at the mesh's vertices
    distance_rms: float | None = None  # between mesh and spline, both ways, over the diagonal of the box
    distance_max: float | None = None
    spline_to_mesh_max: float | None = None
    seconds: float | None = None
    error: str | None = None

    @property
    def certified(self) -> bool:
        """As exit code 0 of `iga-nn run`: det J > 0 is proved, and the boundary was not found to meet itself."""
        return self.verdict == "certified" and self.boundary_injective is not False

    @property
    def name(self) -> str:
        """As that of its surface."""
        return f"{self.number:03d}-{self.kind}"


@dataclass(frozen=True)
class Options:
    """What to run, how, and where the rows go."""

    numbers: tuple[int, ...]
    mapping: MapOptions
    jobs: int
    out: Path

    @property
    def settings(self) -> str:
        """Rows of other settings do not count."""
        return SETTINGS.format(self.mapping)


def main(argv: list[str] | None = None) -> int:
    """Run the surfaces and write the tables; 0 done, 2 bad arguments, 130 interrupted."""
    options = _options(argv)
    found: list[Row] = []

    def keep(batch: Batch) -> None:
        found[:] = [row_of(known, options) for known in batch.rows if known.state != "waiting"]
        write_tables(found, options)

    workers = WorkerOptions(workers=options.jobs, memory_limit="0")
    if code := processes.run("stress.py", options.out, _tasks(options), workers, keep, compute_shape):
        return code
    print(*map(_told, found), summary(found), options.out / "stress.md", sep="\n")
    return 0


def _told(row: Row) -> str:
    if row.arap_mean is None:
        return f"{row.name}: {row.error}"
    seconds = "" if row.seconds is None else f", {row.seconds:.0f} s"
    return f"{row.name}: {row.verdict}, ARAP mean {row.arap_mean:.2f}{seconds}"


def _options(argv: list[str] | None) -> Options:
    parser = _parser()
    given = parser.parse_args(argv)
    mapping = MapOptions(
        device="cpu", control_points=given.control_points, steps_factor=given.steps_factor, resume=True
    )
    processes.demand_positive(parser, given, "count", "jobs")
    processes.demand_runnable(parser, mapping, given.out)
    if given.first < 0:
        parser.error(f"--first {given.first}: must not be negative")
    numbers = tuple(
        number for number in range(given.first, given.first + given.count) if kind_of(number) in given.kinds
    )
    if not numbers:
        kinds = " ".join(given.kinds)
        parser.error(f"--kinds {kinds}: no surface of these numbers is one; limbed and graph begin at --first {LATER}")
    return Options(numbers, mapping, given.jobs, given.out)


def _parser() -> processes.OneLineParser:
    parser = processes.parser_of_surfaces("stress.py", __doc__, Path("out/stress"))
    parser.add_argument("--first", type=int, default=0, help="number of the first surface (default: 0)")
    parser.add_argument("--count", type=int, default=200, help="so many from there on (default: 200)")
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS, help="of these alone")
    parser.add_argument("--control-points", type=int, default=30, help="per direction (default: 30)")
    return parser


# Surfaces


def _tasks(options: Options) -> list[Task]:
    """The runs; the worker makes the mesh."""
    out = options.out.absolute()
    names = [name_of(number) for number in options.numbers]
    return [Task(name, str(out / "surfaces" / f"{name}.obj"), out / name, options.mapping, None) for name in names]


def row_of(known: Known, options: Options) -> Row:
    """All figures of one surface, from its folder; why there are none as the error."""
    number, kind = known.entry.name.split("-")
    if known.report is None:
        return Row(int(number), kind, options.settings, error=known.line)
    quality, times = known.report["parameterization"], processes.times_of(known)
    distance = reports.surface_distance(known.report)
    return Row(
        int(number),
        kind,
        options.settings,
        faces=known.report["input"]["faces"],
        verdict=quality["bijective"],
        boundary_injective=quality["boundary_injective"],
        det_lower_bound=quality["det_lower_bound"],
        unproved=quality.get("unproved", {}).get("spans", 0),
        arap_mean=quality["arap"]["unit_volume"]["mean"],
        arap_max=quality["arap"]["unit_volume"]["max"],
        boundary_rms=quality["boundary"]["unit_volume"]["rms"],
        distance_rms=distance.get("rms"),
        distance_max=distance.get("max"),
        spline_to_mesh_max=quality["surface_distance"]["spline_to_mesh"]["unit_volume"]["max"],
        seconds=times.get("seconds"),
        **processes.attempts_of(known.report),
    )


# Tables


def write_tables(rows: Sequence[Row], options: Options) -> None:
    """stress.csv and stress.md with the rows so far; each replaced in one go."""
    rows = sorted(rows, key=lambda row: row.number)
    save_text(options.out / "stress.csv", csv_text(processes.columns_of(Row), map(asdict, rows)))
    save_text(options.out / "stress.md", as_text(rows, options))


KIND_HEAD = (
    "kind", "what it is", "surfaces", "certified", "share", "ARAP mean", "at vertices", "both ways / diagonal",
    "seconds", "longest",
)  # fmt: skip
PHASE_HEAD = ("kind", "origins", "attempts", *processes.PHASES)
FAILED_HEAD = ("surface", "verdict", "spans not proved", "faces", "ARAP mean", "seconds", "what it is")


def as_text(rows: Sequence[Row], options: Options) -> str:
    """The share certified by kind, those that failed, and the machine."""
    failed = [row for row in rows if not row.certified]
    parts = [
        "# Random hard surfaces",
        "Certified: det J > 0 proved on the whole cube, and the boundary not found to meet itself. ARAP and the rms "
        "distance at the mesh's vertices at volume 1, that of all of surface and spline both ways over the box's "
        "diagonal; medians over the surfaces of a kind.",
        processes.as_markdown(KIND_HEAD, [_kind_cells(kind, rows) for kind in KINDS if _of(kind, rows)]),
        "Where the maps come from, and of a surface in the mean: attempts, and their rounds / seconds by phase.",
        processes.as_markdown(PHASE_HEAD, [_phase_cells(kind, rows) for kind in KINDS if _of(kind, rows)]),
        summary(rows),
    ]
    if failed:
        parts += [
            "Not certified; report.html in the surface's folder shows the places:",
            processes.as_markdown(FAILED_HEAD, [_failed_cells(row) for row in failed]),
        ]
    if missing := len(options.numbers) - len(rows):
        parts.append(f"Not finished yet: {missing} of {len(options.numbers)} surfaces.")
    if options.mapping.steps_factor != 1.0 or options.mapping.control_points != MapOptions().control_points:
        parts.append("These are not the default settings: a quick look, no measurement.")
    versions = ", ".join(f"{name} {number}" for name, number in reports.versions().items())
    parts.append(
        f"{processes.processor()}, {processes.cores()} cores, {options.jobs} at a time with one thread each; "
        f"{versions}; {options.settings}."
    )
    return "\n\n".join(parts) + "\n"


def summary(rows: Sequence[Row]) -> str:
    """One line of counts and seconds."""
    certified = sum(row.certified for row in rows)
    proved = sum(row.boundary_injective is True for row in rows)
    counts = f"Certified {certified} of {len(rows)} surfaces, {100.0 * certified / max(len(rows), 1):.1f} %."
    seconds = [row.seconds for row in rows if row.seconds is not None]
    times = f" Seconds: median {median(seconds):.0f}, longest {max(seconds):.0f}." if seconds else ""
    return f"{counts} The boundary is proved not to meet itself for {proved}.{times}"


def _of(kind: str, rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row.kind == kind]


def _kind_cells(kind: str, rows: Sequence[Row]) -> list[str]:
    own = _of(kind, rows)
    certified = sum(row.certified for row in own)
    seconds = [row.seconds for row in own if row.seconds is not None]
    return [
        kind,
        LOOKS[kind],
        str(len(own)),
        str(certified),
        f"{100.0 * certified / len(own):.0f} %",
        _median([row.arap_mean for row in own if row.arap_mean is not None], "{:.2f}"),
        _median([row.boundary_rms for row in own if row.boundary_rms is not None], "{:.5f}"),
        _median([row.distance_rms for row in own if row.distance_rms is not None], "{:.5f}"),
        _median(seconds, "{:.0f}"),
        f"{max(seconds):.0f}" if seconds else "",
    ]


def _phase_cells(kind: str, rows: Sequence[Row]) -> list[str]:
    """One row of the table by phase; surfaces without a map do not count."""
    own = [row for row in _of(kind, rows) if row.origin is not None]
    if not own:
        return [kind, *[""] * (len(PHASE_HEAD) - 1)]
    origins = Counter(row.origin for row in own)
    found = [
        tuple(fmean(getattr(row, f"{name}_{phase}") for row in own) for name in ("rounds", "seconds"))
        for phase in processes.PHASES
    ]
    return [
        kind,
        ", ".join(f"{name} {count}" for name, count in origins.most_common()),
        f"{fmean(len((row.attempts or '').split(', ')) for row in own):.1f}",
        *(f"{rounds:.1f} / {seconds:.1f}" if rounds else "" for rounds, seconds in found),
    ]


def _median(values: Sequence[float], form: str) -> str:
    return form.format(median(values)) if values else ""


def _failed_cells(row: Row) -> list[str]:
    verdict = row.error or f"{row.verdict}{', meets itself' if row.boundary_injective is False else ''}"
    figures = ((row.unproved, "{}"), (row.faces, "{}"), (row.arap_mean, "{:.2f}"), (row.seconds, "{:.0f}"))
    return [
        row.name,
        verdict,
        *("" if value is None else form.format(value) for value, form in figures),
        LOOKS[row.kind],
    ]


if __name__ == "__main__":
    raise SystemExit(main())
