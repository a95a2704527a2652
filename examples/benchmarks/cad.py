"""Parts with sharp edges by default settings: certified, one-to-one, and how close the map is to their edges.

    python examples/benchmarks/cad.py --jobs 2
    python examples/benchmarks/cad.py --only cylinder shaft --control-points 20 --out out/coarse

Runs the parts of cad_shapes.py as `iga-nn batch` does, with one thread each: the same command skips what is finished
and goes on from checkpoints. Writes cad.csv (every figure) and cad.md, anew after each part; copy them to results/ when
they are to be kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import processes
from cad_shapes import CAD
from handle_shapes import write

from iga_nn.batch.table import Batch
from iga_nn.batch.table import Row as Known
from iga_nn.batch.task import Task
from iga_nn.level_table import csv_text
from iga_nn.options import MapOptions, WorkerOptions
from iga_nn.report import document as reports
from iga_nn.workflow.worker_run import Ended
from parameterize.files import save_text


@dataclass(frozen=True)
class Row(processes.MapColumns):
    """What is known of one part, the columns of cad.csv.

    status: "done", or in one line why figures are missing. distance_max: the largest between mesh and spline, both
    ways; edge_rms, edge_max: of the sharp edges from the nearest edge of a block; all over the diagonal of the box.
    normals_mean: angle between the normals of spline and mesh, in degrees.
    """

    part: str
    status: str = "done"
    faces: int | None = None
    blocks: int | None = None
    verdict: str | None = None
    one_to_one: str | None = None
    distance_max: float | None = None
    edge_rms: float | None = None
    edge_max: float | None = None
    normals_mean: float | None = None
    seconds: float | None = None
    threads: int | None = None

    @property
    def sound(self) -> bool:
        """Whether det J > 0 and that the map is one-to-one are both proved."""
        return self.verdict == "certified" and self.one_to_one == "yes"


@dataclass(frozen=True)
class Options:
    """What to run, how, and where the tables go."""

    parts: tuple[str, ...]
    mapping: MapOptions
    jobs: int
    out: Path


def main(argv: list[str] | None = None) -> int:
    """Run the parts and write the tables; 0 done, 2 bad arguments, 130 interrupted."""
    options = _options(argv)
    found: list[Row] = []

    def keep(batch: Batch) -> None:
        found[:] = [row_of(known) for known in batch.rows if known.state != "waiting"]
        write_tables(found, options)

    workers = WorkerOptions(workers=options.jobs, memory_limit="0")
    if code := processes.run("cad.py", options.out, _tasks(options), workers, keep, compute_part):
        return code
    print(as_text(found, options))
    return 0


def _options(argv: list[str] | None) -> Options:
    parser = processes.parser_of_surfaces("cad.py", __doc__, Path("out/cad"))
    parser.add_argument("--only", nargs="+", default=list(CAD), metavar="NAME", help="these parts alone")
    parser.add_argument("--control-points", type=int, default=30, help="of one cube, a direction (default: 30)")
    given = parser.parse_args(argv)
    mapping = MapOptions(
        device="cpu", control_points=given.control_points, steps_factor=given.steps_factor, resume=True
    )
    processes.demand_positive(parser, given, "jobs")
    if unknown := sorted(set(given.only) - set(CAD)):
        parser.error(f"--only {' '.join(unknown)}: no such part; there are {', '.join(CAD)}")
    processes.demand_runnable(parser, mapping, given.out)
    return Options(tuple(name for name in CAD if name in given.only), mapping, given.jobs, given.out)


def _tasks(options: Options) -> list[Task]:
    out = options.out.absolute()
    meshes = {name: str(out / "surfaces" / f"{name}.obj") for name in options.parts}
    return [Task(name, mesh, out / name, options.mapping, None) for name, mesh in meshes.items()]


def compute_part(task: Task, number: int, batch: str) -> Ended:
    """Make the part that `task` names where its mesh is not there; then compute it, measured."""
    if not Path(task.mesh).is_file():
        write(task.name, CAD[task.name], Path(task.mesh))
    return processes.compute_measured(task, number, batch)


def row_of(known: Known) -> Row:
    """Return all figures of one part, from its report; why there are none as the status."""
    report = known.report
    if report is None:
        return Row(known.entry.name, known.line)
    quality = report["parameterization"]
    edges = quality["sharp_edges"]
    distance: dict[str, Any] = edges["distance"] or {}
    times = processes.times_of(known)
    return Row(
        known.entry.name,
        faces=report["input"]["faces"],
        blocks=len(quality.get("patches", ())) or 1,
        verdict=quality["bijective"],
        one_to_one=reports.one_to_one(report),
        distance_max=reports.surface_distance(report).get("max"),
        edge_rms=distance.get("rms"),
        edge_max=distance.get("max"),
        normals_mean=edges["normals"]["mean"],
        seconds=times.get("seconds"),
        threads=times.get("threads"),
        **processes.attempts_of(report),
    )


HEAD = (
    "part", "faces", "blocks", "first map", "verdict", "one-to-one", "largest distance / diagonal",
    "edges, rms / diagonal", "largest", "normals, degrees", "seconds",
)  # fmt: skip
CELLS = {
    "faces": "{}", "blocks": "{}", "origin": "{}", "verdict": "{}", "one_to_one": "{}", "distance_max": "{:.1e}",
    "edge_rms": "{:.1e}", "edge_max": "{:.1e}", "normals_mean": "{:.2f}", "seconds": "{:.0f}",
}  # fmt: skip


def write_tables(rows: Sequence[Row], options: Options) -> None:
    """Write cad.csv and cad.md with the rows so far, in the order of the parts; each replaced in one go."""
    rows = sorted(rows, key=lambda row: options.parts.index(row.part))
    save_text(options.out / "cad.csv", csv_text(processes.columns_of(Row), map(asdict, rows)))
    save_text(options.out / "cad.md", as_text(rows, options))


def as_text(rows: Sequence[Row], options: Options) -> str:
    """Return the table, the count of what is sound, and the machine."""
    parts = [
        "# Parts with sharp edges",
        "Certified: det J > 0 is proved on every block; one-to-one: it is also proved that the body's surface does not "
        "meet itself. The largest distance is that of all of surface and spline, both ways; edges are sharp edges, "
        "measured from the nearest edge of a block; both over the diagonal of the box.",
        processes.as_markdown(HEAD, map(_cells, rows)),
        f"Certified and one-to-one {sum(row.sound for row in rows)} of {len(rows)}.",
    ]
    if missing := len(options.parts) - len(rows):
        parts.append(f"Not finished yet: {missing} of {len(options.parts)} parts.")
    if options.mapping.control_points != MapOptions.control_points:
        parts.append(f"One cube with {options.mapping.control_points} control points a direction.")
    versions = ", ".join(f"{name} {number}" for name, number in reports.versions().items())
    machine = f"{processes.processor()}, {processes.cores()} cores, {options.jobs} at a time with one thread each"
    return "\n\n".join([*parts, f"{machine}; {versions}."]) + "\n"


def _cells(row: Row) -> list[str]:
    """Return one row of the table; where there is no map the verdict says why."""
    values = asdict(row) | ({} if row.verdict else {"verdict": row.status})
    return [row.part, *("" if values[name] is None else form.format(values[name]) for name, form in CELLS.items())]


if __name__ == "__main__":
    raise SystemExit(main())
