"""Surfaces with handles and limbs by default settings: certified, one-to-one, how distorted and how close.

    python examples/benchmarks/handles.py --jobs 2
    python examples/benchmarks/handles.py --lists limbs --blocks 1 --out out/one_cube
    python examples/benchmarks/handles.py --files downloads/*.off --out out/downloads

Runs the surfaces of handle_shapes.py and the models with handles and limbs as `iga-nn batch` does, with one thread
each: the same command skips what is finished and goes on from checkpoints. Writes handles.csv (every figure) and
handles.md, anew after each surface; copy them to results/ when they are to be kept. A surface that is refused keeps its
row, which says why; the knotted tunnel is to be refused.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median
from typing import Any, Literal

import handle_shapes as shapes
import processes

from iga_nn.batch.table import Batch
from iga_nn.batch.table import Row as Known
from iga_nn.batch.task import Task
from iga_nn.level_table import csv_text
from iga_nn.models import DATA_FOLDER
from iga_nn.options import MapOptions, WorkerOptions
from iga_nn.report import document as reports
from parameterize.files import save_text
from parameterize.quality.distortion import in_own_box
from parameterize.spline.volume import BSplineVolume

REPOSITORY = Path(__file__).resolve().parents[2]
MODELS = {  # file below the folder of models -> its list
    "handles/3holes.obj": "handles",
    "handles/idler_riser.STL": "handles",
    "handles/mirror.ply": "handles",
    "handles/plate_holes.STL": "handles",
    "handles/rocker-arm.obj": "handles",
    "limbs/human_man.obj": "limbs",
}
LISTS = {  # what a list is, as a heading
    "handles": "Surfaces with handles on which the method was developed",
    "everyday": "Everyday things, to which nothing was tuned",
    "limbs": "Bodies with limbs",
    "knotted": "A tunnel with a knot, which is to be refused",
    "files": "Files",
}
MADE = {
    "handles": shapes.HANDLES,
    "everyday": shapes.EVERYDAY,
    "limbs": shapes.LIMBS,
    "knotted": shapes.KNOTTED,
}
DONE, ABSENT = "done", "model not found"


@dataclass(frozen=True)
class Row(processes.MapColumns):
    """What is known of one surface, the columns of handles.csv.

    status: "done", or in one line why figures are missing.
    arap_mean, arap_max: of each block against its own box, the mean weighted by the blocks' volumes.
    seconds: wall, of the parameterization alone; unknown where the run was interrupted and went on.
    """

    surface: str
    list: str
    status: str = DONE
    genus: int | None = None
    faces: int | None = None
    blocks: int | None = None
    control_points: int | None = None
    verdict: str | None = None
    one_to_one: str | None = None
    det_lower_bound: float | None = None
    arap_mean: float | None = None
    arap_max: float | None = None
    distance_rms: float | None = None  # between mesh and spline, both ways, over the diagonal of the box
    distance_max: float | None = None
    seconds: float | None = None
    threads: int | None = None

    @property
    def sound(self) -> bool:
        """Whether det J > 0 and that the map is one-to-one are both proved."""
        return self.verdict == "certified" and self.one_to_one == "yes"


@dataclass(frozen=True)
class Named:
    """A surface of a list: a mesh file, or one that the worker makes there."""

    name: str
    list: str
    mesh: Path
    made: bool

    @property
    def absent(self) -> bool:
        """Whether there is nothing to run."""
        return not (self.made or self.mesh.is_file())


@dataclass(frozen=True)
class Options:
    """What to run, how, and where the tables go."""

    surfaces: tuple[Named, ...]
    mapping: MapOptions
    jobs: int
    out: Path


def main(argv: list[str] | None = None) -> int:
    """Run the surfaces and write the tables; 0 done, 2 bad arguments, 130 interrupted."""
    options = _options(argv)
    lists = {surface.name: surface.list for surface in options.surfaces}
    absent = [Row(one.name, one.list, f"{ABSENT}: {one.mesh}") for one in options.surfaces if one.absent]
    found: list[Row] = []

    def keep(batch: Batch) -> None:
        ended = (known for known in batch.rows if known.state != "waiting")
        found[:] = absent + [row_of(known, lists[known.entry.name]) for known in ended]
        write_tables(found, options)

    workers = WorkerOptions(workers=options.jobs, memory_limit="0")
    if code := processes.run("handles.py", options.out, _tasks(options), workers, keep, shapes.compute_named):
        return code
    print(*map(_told, found), summary(found), options.out / "handles.md", sep="\n")
    return 0


def _told(row: Row) -> str:
    if row.verdict is None:
        return f"{row.surface}: {row.status}"
    seconds = "" if row.seconds is None else f", {row.seconds:.0f} s"
    return f"{row.surface}: {row.verdict}, one-to-one: {row.one_to_one}, ARAP mean {row.arap_mean:.2f}{seconds}"


# Arguments


def _options(argv: list[str] | None) -> Options:
    parser = _parser()
    given = parser.parse_args(argv)
    mapping = MapOptions(device="cpu", blocks=given.blocks, steps_factor=given.steps_factor, resume=True)
    processes.demand_positive(parser, given, "jobs")
    lists = given.lists or ([] if given.files else list(MADE))
    surfaces = _named(lists, given.files, given.models, given.out)
    names = [surface.name for surface in surfaces]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        parser.error(f"{', '.join(twice)}: two surfaces have this name; rename the file, or run it alone")
    if unknown := sorted(set(given.only) - set(names)):
        parser.error(f"--only {' '.join(unknown)}: no such surface; there are {', '.join(names)}")
    processes.demand_runnable(parser, mapping, given.out)
    chosen = tuple(surface for surface in surfaces if not given.only or surface.name in given.only)
    return Options(chosen, mapping, given.jobs, given.out)


def _parser() -> processes.OneLineParser:
    parser = processes.parser_of_surfaces("handles.py", __doc__, Path("out/handles"))
    models = Path(os.environ.get(DATA_FOLDER) or REPOSITORY.parent / "shared" / "models")
    parser.add_argument("--lists", nargs="+", default=[], choices=list(MADE), help="of these alone (default: all)")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these surfaces alone")
    parser.add_argument("--files", nargs="+", default=[], type=Path, metavar="FILE", help="these files instead")
    parser.add_argument("--models", type=Path, default=models, help=f"folder of the models (default: {models})")
    parser.add_argument("--blocks", type=_blocks, default="auto", help='at most so many, or "auto" (default: auto)')
    return parser


def _blocks(text: str) -> int | Literal["auto"]:
    return "auto" if text == "auto" else int(text)


# Surfaces


def _named(lists: Sequence[str], files: Sequence[Path], models: Path, out: Path) -> list[Named]:
    """Return the surfaces of the lists, the made ones before the models, and then the files."""
    found = []
    for title in lists:
        found += [Named(name, title, out / "surfaces" / f"{name}.obj", True) for name in MADE[title]]
        found += [Named(Path(file).stem, title, models / file, False) for file, own in MODELS.items() if own == title]
    return found + [Named(file.stem, "files", file, False) for file in files]


def _tasks(options: Options) -> list[Task]:
    """Return the runs of the surfaces that are there or can be made."""
    out = options.out.absolute()
    return [
        Task(one.name, str(one.mesh.absolute()), out / one.name, options.mapping, None)
        for one in options.surfaces
        if not one.absent
    ]


def row_of(known: Known, title: str) -> Row:
    """Return all figures of one surface, from its folder; why there are none as the status."""
    report = known.report
    if report is None:
        return Row(known.entry.name, title, known.line)
    quality, input_ = report["parameterization"], report["input"]
    distance = reports.surface_distance(report)
    figures: dict[str, Any] = {
        "genus": 1 - (input_["vertices"] - input_["faces"] // 2) // 2,
        "faces": input_["faces"],
        "blocks": len(quality.get("patches", ())) or 1,
        "control_points": _product(quality["control_points"]),
        "verdict": quality["bijective"],
        "one_to_one": reports.one_to_one(report),
        "det_lower_bound": quality["det_lower_bound"],
        "distance_rms": distance.get("rms"),
        "distance_max": distance.get("max"),
    }
    return Row(
        known.entry.name,
        title,
        **figures,
        **_distortion(known),
        **{name: value for name, value in processes.times_of(known).items() if name in ("seconds", "threads")},
        **processes.attempts_of(report),
    )


def _product(counts: int | list[int]) -> int:
    """Return the number of control points: of several blocks it is given, of one it is a number by direction."""
    if isinstance(counts, int):
        return counts
    u, v, w = counts
    return u * v * w


def _distortion(known: Known) -> dict[str, float]:
    """Return mean and max of the ARAP distortion against own boxes: reports have it for several blocks."""
    quality = known.report["parameterization"]
    if "patches" in quality:
        found = quality["arap"]["unit_volume"]
        return {"arap_mean": found["mean"], "arap_max": found["max"]}
    own = in_own_box(BSplineVolume.load(known.entry.folder / "volume.npz")).arap
    return {"arap_mean": own.mean, "arap_max": own.max}


# Tables


HEAD = (
    "surface", "genus", "blocks", "control points", "verdict", "one-to-one", "ARAP mean", "max",
    "rms both ways / diagonal", "max", "seconds",
)  # fmt: skip
CELLS = {
    "genus": "{}", "blocks": "{}", "control_points": "{:,}", "verdict": "{}", "one_to_one": "{}", "arap_mean": "{:.3f}",
    "arap_max": "{:.2f}", "distance_rms": "{:.2e}", "distance_max": "{:.2e}", "seconds": "{:.0f}",
}  # fmt: skip


def write_tables(rows: Sequence[Row], options: Options) -> None:
    """Write handles.csv and handles.md with the rows so far, in the order of the lists; each replaced in one go."""
    order = [surface.name for surface in options.surfaces]
    rows = sorted(rows, key=lambda row: order.index(row.surface))
    save_text(options.out / "handles.csv", csv_text(processes.columns_of(Row), map(asdict, rows)))
    save_text(options.out / "handles.md", as_text(rows, options))


def as_text(rows: Sequence[Row], options: Options) -> str:
    """Return the tables of the lists, the summary and the machine."""
    parts = [
        "# Handles and limbs",
        "Certified: det J > 0 is proved on every block; one-to-one: it is also proved that the body's surface does not "
        "meet itself. ARAP is that of each block against its own box, the mean weighted by their volumes. Distances "
        "are those of all of surface and spline, both ways, over the diagonal of the box.",
    ]
    for title, heading in LISTS.items():
        if own := [row for row in rows if row.list == title]:
            parts += [f"## {heading}", processes.as_markdown(HEAD, map(_cells, own)), summary(own)]
    if missing := len(options.surfaces) - len(rows):
        parts.append(f"Not finished yet: {missing} of {len(options.surfaces)} surfaces.")
    if options.mapping.blocks != "auto":
        parts.append(f"At most {options.mapping.blocks} {'block' if options.mapping.blocks == 1 else 'blocks'}.")
    if options.mapping.steps_factor != 1.0:
        parts.append(f"Every stage's steps times {options.mapping.steps_factor:g}: a quick look, no measurement.")
    versions = ", ".join(f"{name} {number}" for name, number in reports.versions().items())
    machine = f"{processes.processor()}, {processes.cores()} cores, {options.jobs} at a time with one thread each"
    return "\n\n".join([*parts, f"{machine}; {versions}."]) + "\n"


def _cells(row: Row) -> list[str]:
    """Return one row of a table; where there is no map the verdict says why."""
    values = asdict(row) | ({} if row.verdict else {"verdict": row.status})
    return [row.surface, *("" if values[name] is None else form.format(values[name]) for name, form in CELLS.items())]


def summary(rows: Sequence[Row]) -> str:
    """Return one line of counts and medians."""
    sound = sum(row.sound for row in rows)
    parts = [f"Certified and one-to-one {sound} of {len(rows)}."]
    for name, words, form in (
        ("arap_mean", "ARAP mean", "{:.3f}"),
        ("distance_rms", "rms both ways", "{:.2e}"),
        ("seconds", "seconds", "{:.0f}"),
    ):
        if values := [value for row in rows if (value := getattr(row, name)) is not None]:
            parts.append(f"{words}: median {form.format(median(values))}, largest {form.format(max(values))}.")
    return " ".join(parts)


if __name__ == "__main__":
    raise SystemExit(main())
