"""CAD parts by default settings: the way that each takes, its verdict, and its distances from the exact part.

    python examples/benchmarks/parts.py models/cad models/parts
    python examples/benchmarks/parts.py --only bolt gear --again
    python examples/benchmarks/parts.py my_parts --limit 300

The parts are the STEP files of the given folders, and those that own_parts.py makes. Each map is a process of its own
with a limit of CPU time (map_part.py). So is the measurement of its distances (part_distances.py), which takes nothing
from the program but the saved volume. What is known of a part is kept as JSON, and the same command goes on with the
others. Writes parts.md, anew after each part; copy it to results/ where it is to be kept.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import processes
import psutil

from iga_nn.report import document as reports
from parameterize.files import save_text

HERE = Path(__file__).parent
OWN = "own"  # the set of the parts that are made here
WAITS = 8  # times its CPU seconds, on a busy machine
LOOK = 0.2  # seconds between two looks at the memory
DISTANCE, EDGES, VOLUME = 1e-3, 2e-4, 1e-3  # what a part must meet, the first two over the diagonal
MOST_SECONDS = 600.0  # of making the own parts, and of measuring distances
MOST_SAID = 160  # characters of a reason
MEGABYTE = 1e6


@dataclass(frozen=True)
class Ended:
    """How a process ended. code: None at the limit; memory: the largest of it and its children together, in MB."""

    code: int | None
    output: str
    errors: str
    seconds: float
    cpu: float
    memory: float

    @property
    def reason(self) -> str:
        """Return why it failed, in one line."""
        if self.code is None:
            return f"ended after {self.cpu:.0f} CPU s"
        if self.code < 0:
            return f"ended by {signal.Signals(-self.code).name}"
        lines = self.errors.strip().splitlines() or self.output.strip().splitlines() or [f"exit code {self.code}"]
        return lines[-1][:MOST_SAID]


@dataclass(frozen=True)
class Row:
    """What is known of a part. status: "done", or why figures are missing.

    seconds: of reading, map and certificate. cpu: CPU seconds of the whole process and its children. memory: in MB.
    distance, edges_rms, corners: over the diagonal of the part's box; volume: relative to the exact one. fineness: how
    exactly the distances are known.
    """

    group: str
    part: str
    status: str = "done"
    way: str | None = None
    blocks: int | None = None
    unknowns: int | None = None
    seconds: float | None = None
    cpu: float | None = None
    memory: float | None = None
    verdict: str | None = None
    one_to_one: str | None = None
    distance: float | None = None
    edges_rms: float | None = None
    corners: float | None = None
    volume: float | None = None
    fineness: float | None = None

    @property
    def sound(self) -> bool:
        """Return whether the map is certified and one-to-one."""
        return self.verdict == "certified" and self.one_to_one == "yes"

    @property
    def near(self) -> bool:
        """Return whether the map is near to the part by every measure; edges of parts without any are no matter."""
        pairs = ((self.distance, DISTANCE), (self.edges_rms or 0.0, EDGES), (self.volume, VOLUME))
        return all(value is not None and abs(value) <= most for value, most in pairs)


@dataclass(frozen=True)
class Part:
    """A STEP file, and the set to which it belongs."""

    group: str
    file: Path

    @property
    def label(self) -> str:
        """Return the name of its folder and of its JSON."""
        return f"{self.group}_{self.file.stem}"


@dataclass(frozen=True)
class Options:
    """What to run. limit: CPU seconds of a map."""

    parts: tuple[Part, ...]
    out: Path
    jobs: int
    limit: float
    again: bool


def main(argv: list[str] | None = None) -> int:
    """Run the parts and write the table; 0 done, 2 bad arguments."""
    options = _options(argv)
    rows: dict[Part, Row] = {}
    writing = threading.Lock()

    def run(part: Part) -> None:
        found = compute(part, options)
        with writing:
            rows[part] = found
            print(" | ".join(_cells(found)), flush=True)
            write_table([rows[one] for one in options.parts if one in rows], options)

    with ThreadPoolExecutor(options.jobs) as pool:
        list(pool.map(run, options.parts))
    return 0


def _options(argv: list[str] | None) -> Options:
    parser = processes.OneLineParser(
        prog="parts.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", type=Path, nargs="*", help="folders of STEP files, each a set of parts")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these parts or sets alone")
    parser.add_argument("--limit", type=float, default=300.0, help="CPU seconds of a map (default: 300)")
    parser.add_argument("--again", action="store_true", help="also run what is kept")
    parser.add_argument("--jobs", type=int, default=1, help="parts at a time (default: 1)")
    parser.add_argument("--out", type=Path, default=Path("out/parts"), help="folder (default: out/parts)")
    given = parser.parse_args(argv)
    processes.demand_positive(parser, given, "jobs", "limit")
    given.out.mkdir(parents=True, exist_ok=True)
    there = [part for folder in given.folders for part in parts_in(folder, folder.name)] + own_parts(given.out / OWN)
    names = {part.file.stem for part in there} | {part.group for part in there}
    if unknown := sorted(set(given.only or ()) - names):
        parser.error(f"--only {' '.join(unknown)}: no such part or set; there are {', '.join(sorted(names))}")
    chosen = tuple(part for part in there if not given.only or {part.file.stem, part.group} & set(given.only))
    return Options(chosen, given.out, given.jobs, given.limit, given.again)


def parts_in(folder: Path, group: str) -> list[Part]:
    """Return the STEP files of a folder."""
    return [Part(group, file) for file in sorted(folder.glob("*")) if file.suffix.lower() in (".step", ".stp")]


def own_parts(folder: Path) -> list[Part]:
    """Return the parts of own_parts.py, made where the folder has none."""
    if not parts_in(folder, OWN):
        ended = watched([sys.executable, str(HERE / "own_parts.py"), str(folder)], MOST_SECONDS)
        if ended.code != 0:
            raise RuntimeError(f"own_parts.py: {ended.reason}")
    return parts_in(folder, OWN)


# One part


def compute(part: Part, options: Options) -> Row:
    """Return what is known of a part: what is kept, else by its map and its distances."""
    kept = options.out / f"{part.label}.json"
    if kept.is_file() and not options.again:
        return Row(**json.loads(kept.read_text(encoding="utf-8")))
    folder = options.out / part.label
    row = row_of(part, watched([sys.executable, str(HERE / "map_part.py"), str(part.file), str(folder)], options.limit))
    if row.verdict:
        script = [sys.executable, str(HERE / "part_distances.py"), str(part.file), str(folder / "volume.npz")]
        row = with_distances(row, watched(script, MOST_SECONDS))
    save_text(kept, json.dumps(asdict(row), indent=1) + "\n")
    return row


def row_of(part: Part, ended: Ended) -> Row:
    """Return what map_part.py found, or why it found nothing; the volume is that of the map."""
    row: dict[str, Any] = {"group": part.group, "part": part.file.stem, "cpu": ended.cpu, "memory": ended.memory}
    found = {"status": ended.reason} if ended.code != 0 else json.loads(ended.output.splitlines()[-1])
    return Row(**row | found)


def with_distances(row: Row, ended: Ended) -> Row:
    """Return the row with what part_distances.py found, and the volume relative to the exact one."""
    if ended.code != 0:
        return replace(row, status=f"distances: {ended.reason}", volume=None)
    found = json.loads(ended.output.splitlines()[-1])
    return replace(
        row,
        distance=max(found["to_part"], found["to_volume"]),
        edges_rms=found.get("edges_rms"),
        corners=found.get("corners_max"),
        volume=(row.volume or 0.0) / found["volume"] - 1.0,
        fineness=found["fineness"],
    )


# Processes


def watched(command: Sequence[str], limit: float) -> Ended:
    """Run a command until it ends or has taken `limit` CPU seconds, and look at its tree of processes all the while.

    On a busy machine it may take WAITS times as long.
    """
    start, cpu, memory = time.monotonic(), 0.0, 0.0
    with tempfile.TemporaryFile("w+") as output, tempfile.TemporaryFile("w+") as errors:
        root = psutil.Popen(command, stdout=output, stderr=errors, stdin=subprocess.DEVNULL)
        try:
            while (code := root.poll()) is None and cpu < limit and time.monotonic() - start < WAITS * limit:
                seconds, bytes_now = looked_at(root)
                cpu, memory = max(cpu, seconds), max(memory, bytes_now / MEGABYTE)
                time.sleep(LOOK)
        finally:
            end(root)
        texts = [file.read() for file in (output, errors) if file.seek(0) == 0]
    return Ended(code, *texts, time.monotonic() - start, cpu, memory)


def looked_at(root: psutil.Process) -> tuple[float, float]:
    """Return the CPU seconds of a process with its children, ended and running, and the memory of the running ones."""
    seconds, memory = 0.0, 0.0
    with suppress(psutil.NoSuchProcess):
        for process in (root, *root.children(recursive=True)):
            with suppress(psutil.NoSuchProcess):
                seconds += sum(process.cpu_times()[:4])
                memory += process.memory_info().rss
    return seconds, memory


def end(root: psutil.Process) -> None:
    """End a process and its descendants, where they have not ended."""
    with suppress(psutil.NoSuchProcess):
        for process in (*root.children(recursive=True), root):
            with suppress(psutil.NoSuchProcess):
                process.kill()
    root.wait()


# The table

HEAD = (
    "part", "way", "blocks", "unknowns", "seconds", "CPU s", "memory, MB", "verdict", "one-to-one",
    "largest distance / diagonal", "edges, rms / diagonal", "corners / diagonal", "volume, relative",
)  # fmt: skip
CELLS = {
    "way": "{}", "blocks": "{:,}", "unknowns": "{:,}", "seconds": "{:.0f}", "cpu": "{:.0f}", "memory": "{:,.0f}",
    "verdict": "{}", "one_to_one": "{}", "distance": "{:.1e}", "edges_rms": "{:.1e}", "corners": "{:.1e}",
    "volume": "{:+.1e}",
}  # fmt: skip
SHARES = (
    "set", "parts", "certified, one-to-one", "also within the limits", "seconds, median", "CPU s, median",
    "seconds, most", "memory, most, MB",
)  # fmt: skip


def write_table(rows: Sequence[Row], options: Options) -> None:
    """Write parts.md with the rows so far, replaced in one go."""
    save_text(options.out / "parts.md", as_text(rows, options))


def as_text(rows: Sequence[Row], options: Options) -> str:
    """Return the tables of all sets, way by way, with shares and medians, and the machine."""
    groups = list(dict.fromkeys(row.group for row in rows))
    texts = [
        "Certified: det J > 0 is proved on every block; one-to-one: it is also proved that the body's surface does not "
        "meet itself. Distances are those from the exact faces and edges of the STEP file, both ways; edges are sharp "
        "where their faces meet at more than 20 degrees. The volume is compared with that of the exact part."
    ]
    for group in groups:
        own = sorted((row for row in rows if row.group == group), key=lambda row: (row.way or "~", row.part))
        texts += [f"## {group}", processes.as_markdown(HEAD, map(_cells, own))]
    limits = f"largest distance {DISTANCE:.0e}, edges {EDGES:.0e} rms, volume {VOLUME:.0e}"
    shares = [_share(group, [row for row in rows if row.group == group]) for group in groups]
    ways = list(dict.fromkeys(row.way for row in rows if row.way))
    shares += [_share(f"way {way}", [row for row in rows if row.way == way]) for way in sorted(ways)]
    texts += ["## Shares", f"Limits: {limits}.", processes.as_markdown(SHARES, shares)]
    if fine := [row.fineness for row in rows if row.fineness is not None]:
        texts.append(f"Triangles that stand for outer faces are within {max(fine):.0e} of the diagonal of them.")
    if missing := len(options.parts) - len(rows):
        texts.append(f"Not finished yet: {missing} of {len(options.parts)} parts.")
    versions = ", ".join(f"{name} {number}" for name, number in reports.versions().items())
    machine = f"{processes.processor()}, {processes.cores()} cores, {options.jobs} at a time, OMP_NUM_THREADS="
    return "\n\n".join([*texts, f"{machine}{os.environ.get('OMP_NUM_THREADS', 'unset')}; {versions}."]) + "\n"


def _cells(row: Row) -> list[str]:
    """Return one row of the table; where there is no map the verdict says why."""
    values = asdict(row) | ({} if row.status == "done" else {"verdict": row.status})
    return [row.part, *("" if values[name] is None else form.format(values[name]) for name, form in CELLS.items())]


def _share(name: str, rows: Sequence[Row]) -> list[str]:
    """Return the row of a set, or of a way, with its shares and medians."""
    count = len(rows)
    sound, near = sum(row.sound for row in rows), sum(row.sound and row.near for row in rows)
    seconds, cpu, memory = (
        [value for row in rows if (value := getattr(row, what)) is not None] for what in ("seconds", "cpu", "memory")
    )
    times = [
        f"{take(values):,.0f}" if values else ""
        for take, values in ((median, seconds), (median, cpu), (max, seconds), (max, memory))
    ]
    return [name, str(count), f"{sound} ({sound / count:.0%})", f"{near} ({near / count:.0%})", *times]


if __name__ == "__main__":
    raise SystemExit(main())
