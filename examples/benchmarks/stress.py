"""Random hard surfaces of genus 0 (hard_shapes.py), default settings: which share ends certified, by kind.

    python examples/benchmarks/stress.py --count 40
    python examples/benchmarks/stress.py --kinds thin flat --out out/stress

Every surface has a process of its own with one thread. A finished surface has its row in rows/, and is not run again:
the same command goes on after an interruption. stress.csv and stress.md are written anew after each; of a surface that
is not certified the mesh and a picture are kept, too. t_cal: wall seconds of 1e12 float32 operations, right before.
"""

from __future__ import annotations

import argparse
import json
import time
import traceback
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from statistics import median

import numpy as np
import processes
from hard_shapes import KINDS, hard_shape, kind_of

import iga_nn
from iga_nn.errors import InputError, one_line
from iga_nn.figures.render import can_draw, widest_view
from iga_nn.options import MapOptions
from iga_nn.report import document as reports
from iga_nn.report.advice import span_places
from iga_nn.samples import write_obj
from parameterize.arrays import Array
from parameterize.files import replacing, save_text
from parameterize.surface.surface import Surface

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
}
PICTURE = 700, 520  # pixels


@dataclass(frozen=True)
class Row:
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
    boundary_rms: float | None = None
    spline_to_mesh_max: float | None = None
    seconds: float | None = None
    t_cal: float | None = None
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

    def row_file(self, number: int) -> Path:
        """Where a finished surface's row is."""
        return self.out / "rows" / f"{number:03d}.json"


def main(argv: list[str] | None = None) -> int:
    """Run the surfaces and write the tables; 0 done, 2 bad arguments, 130 interrupted."""
    options, child = _options(argv)
    if child is not None:
        return processes.answer(lambda: run_surface(child, options))
    remains = "the same command goes on"
    found = results(options)
    rows, failed = processes.collect("stress.py", found, lambda rows: write_tables(rows, options), _told, remains)
    if failed:
        return failed
    print(f"{summary(rows)}\n{options.out / 'stress.md'}")
    return 0


def _told(row: Row) -> str:
    if row.seconds is None or row.arap_mean is None:
        return f"{row.name}: {row.error}"
    return f"{row.name}: {row.verdict}, ARAP mean {row.arap_mean:.2f}, {row.seconds:.0f} s"


def _options(argv: list[str] | None) -> tuple[Options, int | None]:
    """The options, and the one surface to run in this process, where it is a child."""
    parser = _parser()
    given = parser.parse_args(argv)
    mapping = MapOptions(device="cpu", control_points=given.control_points, steps_factor=given.steps_factor)
    for name in ("count", "jobs"):
        if getattr(given, name) < 1:
            parser.error(f"--{name} {getattr(given, name)}: must be at least 1")
    try:
        mapping.config()
        (given.out / "rows").mkdir(parents=True, exist_ok=True)
    except InputError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"{given.out}: cannot be written ({error.strerror}); --out names another folder")
    numbers = tuple(number for number in range(given.count) if kind_of(number) in given.kinds)
    return Options(numbers, mapping, given.jobs, given.out), given.child


def _parser() -> argparse.ArgumentParser:
    parser = processes.OneLineParser(
        prog="stress.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--count", type=int, default=200, help="surfaces 0 to COUNT - 1 (default: 200)")
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS, help="of these alone")
    parser.add_argument("--jobs", type=int, default=1, help="surfaces at a time (default: 1)")
    parser.add_argument("--out", type=Path, default=Path("out/stress"), help="folder (default: out/stress)")
    parser.add_argument("--steps-factor", type=float, default=1.0, help="shorten every stage, for a quick look")
    parser.add_argument("--control-points", type=int, default=30, help="per direction (default: 30)")
    parser.add_argument("--child", type=int, help=argparse.SUPPRESS)
    return parser


# Surfaces, each in a process


def results(options: Options) -> Generator[Row, None, None]:
    """Each surface's row: those finished before, then the others as soon as they are known."""
    known = {number: row for number in options.numbers if (row := _finished(number, options))}
    yield from known.values()
    commands = {str(number): _command(number, options) for number in options.numbers if number not in known}
    with closing(processes.in_processes(commands, 1, options.jobs)) as running:
        for ended in running:
            number = int(ended.name)
            if ended.result is None:  # killed: tried again the next time
                yield Row(number, kind_of(number), options.settings, error=ended.failure)
            else:
                save_text(options.row_file(number), json.dumps(ended.result) + "\n")
                yield Row(**ended.result)


def _finished(number: int, options: Options) -> Row | None:
    """The row of an earlier run with the same settings."""
    file = options.row_file(number)
    if not file.is_file():
        return None
    row = Row(**json.loads(file.read_text(encoding="utf-8")))
    return row if row.settings == options.settings else None


def _command(number: int, options: Options) -> list[str]:
    mapping = options.mapping
    values = {
        "child": number,
        "out": options.out,
        "steps-factor": mapping.steps_factor,
        "control-points": mapping.control_points,
    }
    return processes.script(__file__, values)


def run_surface(number: int, options: Options) -> Row:
    """All figures of one surface; after an error its message. Where it is not certified, mesh and picture are kept."""
    row = Row(number, kind_of(number), options.settings)
    surface, places = None, np.empty((0, 3))
    try:
        surface = hard_shape(number)
        row = replace(row, faces=len(surface.faces))
        run = iga_nn.parameterize  # loads torch
        t_cal, _ = processes.calibrate(min(1.0, options.mapping.steps_factor), threads=1)
        start = time.perf_counter()
        result = run(surface, options.mapping.config(), seed=options.mapping.seed, device="cpu")
        row = replace(row, seconds=time.perf_counter() - start, t_cal=t_cal)
        places = span_places(result.volume, result.certificate.unproved)
        row = replace(row, **_figures(result))
    except Exception as error:
        traceback.print_exc()
        row = replace(row, error=one_line(error) or type(error).__name__)
    if surface is not None and not row.certified:
        write_obj(surface, options.out / f"{row.name}.obj")
        draw(surface, places, options.out / f"{row.name}.png")
    return row


def _figures(result: iga_nn.Parameterization) -> dict[str, object]:
    """By column."""
    found, quality = result.quality.as_dict(), result.quality
    return {
        "verdict": found["bijective"],
        "boundary_injective": found["boundary_injective"],
        "det_lower_bound": found["det_lower_bound"],
        "unproved": len(result.certificate.unproved),
        "arap_mean": quality.arap.unit_volume.mean,
        "arap_max": quality.arap.unit_volume.max,
        "boundary_rms": quality.boundary.unit_volume.rms,
        "spline_to_mesh_max": quality.spline_to_mesh.unit_volume.max,
    }


def draw(surface: Surface, places: Array, path: Path) -> None:
    """The mesh from the front and from behind, places (k, 3) as red balls; nothing where nothing can be drawn."""
    if not can_draw():
        return
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, shape=(1, 2), window_size=[2 * PICTURE[0], PICTURE[1]])
    mesh = pyvista.PolyData.from_regular_faces(surface.vertices, surface.faces)
    middle = surface.vertices.mean(axis=0)
    view = widest_view(surface.vertices, tilt=0.45)
    for panel, direction in enumerate((view, view.turned())):
        plotter.subplot(0, panel)
        plotter.set_background("white")
        plotter.add_mesh(mesh, color="tan", show_edges=True, edge_color="grey", opacity=0.6 if len(places) else 1.0)
        if len(places):
            plotter.add_points(places, color="red", point_size=9, render_points_as_spheres=True)
        plotter.camera_position = [middle + direction.towards, middle, direction.up]
        plotter.reset_camera()
    with replacing(path) as temporary:
        plotter.screenshot(temporary)
    plotter.close()


# Tables


def write_tables(rows: Sequence[Row], options: Options) -> None:
    """stress.csv and stress.md with the rows so far; each replaced in one go."""
    rows = sorted(rows, key=lambda row: row.number)
    columns = [field.name for field in fields(Row)]
    save_text(options.out / "stress.csv", processes.as_csv(columns, map(asdict, rows)))
    save_text(options.out / "stress.md", as_text(rows, options))


KIND_HEAD = ("kind", "what it is", "surfaces", "certified", "share", "ARAP mean", "boundary rms", "seconds / t_cal")
FAILED_HEAD = ("surface", "verdict", "spans not proved", "faces", "ARAP mean", "seconds", "what it is")


def as_text(rows: Sequence[Row], options: Options) -> str:
    """The share certified by kind, those that failed, and the machine."""
    failed = [row for row in rows if not row.certified]
    parts = [
        "# Random hard surfaces",
        "Certified: det J > 0 proved on the whole cube, and the boundary not found to meet itself. ARAP and distances "
        "at volume 1; medians over the surfaces of a kind.",
        processes.as_markdown(KIND_HEAD, [_kind_cells(kind, rows) for kind in KINDS if _of(kind, rows)]),
        summary(rows),
    ]
    if failed:
        parts += [
            "Not certified; mesh and picture, the places in red, are kept under the surface's name:",
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
    """One line of counts."""
    certified = sum(row.certified for row in rows)
    return f"Certified {certified} of {len(rows)} surfaces, {100.0 * certified / max(len(rows), 1):.1f} %."


def _of(kind: str, rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row.kind == kind]


def _kind_cells(kind: str, rows: Sequence[Row]) -> list[str]:
    own = _of(kind, rows)
    certified = sum(row.certified for row in own)
    ratios = [row.seconds / row.t_cal for row in own if row.seconds is not None and row.t_cal]
    return [
        kind,
        LOOKS[kind],
        str(len(own)),
        str(certified),
        f"{100.0 * certified / len(own):.0f} %",
        _median([row.arap_mean for row in own if row.arap_mean is not None], "{:.2f}"),
        _median([row.boundary_rms for row in own if row.boundary_rms is not None], "{:.5f}"),
        _median(ratios, "{:.1f}"),
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
    processes.end_children_on_term()
    raise SystemExit(main())
