"""What the benchmarks share: surfaces measured in worker processes, arguments refused in one line, tables."""

from __future__ import annotations

import argparse
import os
import platform
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NoReturn

from iga_nn.batch.run_batch import Running, run_tasks
from iga_nn.batch.table import Batch, Row
from iga_nn.batch.task import Task, compute
from iga_nn.errors import InputError
from iga_nn.options import MapOptions, WorkerOptions
from iga_nn.workflow.output_folder import has_checkpoint
from iga_nn.workflow.worker_run import Ended
from parameterize.files import save_text
from parameterize.threads import default_threads

BAD_INPUT, INTERRUPTED = 2, 130
THREADS = "threads.txt"  # in the folder of a surface whose seconds were measured
STAGES = ("train", "fit", "optimize", "refine", "certify")
PHASES = ("approach", "grow", "shape", "unfold", "separate", "polish")  # of a spline stage, the columns of MapColumns


class OneLineParser(argparse.ArgumentParser):
    """Of the command line; bad arguments are one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        """Exit code 2."""
        self.exit(BAD_INPUT, f"{self.prog}: {message}\n")


def parser_of_surfaces(prog: str, description: str, out: Path) -> OneLineParser:
    """A parser with the options of every benchmark that runs surfaces; out: the folder of its results."""
    parser = OneLineParser(prog=prog, description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--jobs", type=int, default=1, help="surfaces at a time (default: 1)")
    parser.add_argument("--out", type=Path, default=out, help=f"folder (default: {out})")
    parser.add_argument("--steps-factor", type=float, default=1.0, help="shorten every stage, for a quick look")
    return parser


def demand_positive(parser: OneLineParser, given: argparse.Namespace, *names: str) -> None:
    """Refuse options that count something and are less than 1."""
    for name in names:
        if getattr(given, name) < 1:
            parser.error(f"--{name} {getattr(given, name)}: must be at least 1")


def demand_runnable(parser: OneLineParser, mapping: MapOptions, out: Path) -> None:
    """Refuse options of the map that cannot be, and a folder that cannot be written, where made surfaces go."""
    try:
        mapping.config()
        (out / "surfaces").mkdir(parents=True, exist_ok=True)
    except InputError as error:
        parser.error(str(error))
    except OSError as error:
        parser.error(f"{out}: cannot be written ({error.strerror}); --out names another folder")


def cores() -> int:
    """Of the processor, as far as this process may use them."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


# Surfaces in worker processes


def compute_measured(task: Task, number: int, batch: str) -> Ended:
    """Compute a surface and keep its number of threads; what goes on from a checkpoint has no time of its own."""
    resumed = has_checkpoint(task.folder)
    ended = compute(task, number, batch)
    if ended.report is not None and not resumed:
        save_text(task.folder / THREADS, f"{default_threads()}\n")
    return ended


def times_of(row: Row) -> dict[str, Any]:
    """Seconds of the parameterization, in all and by stage, and threads; empty where they were not measured."""
    file = row.entry.folder / THREADS
    if row.report is None or not file.is_file():
        return {}
    seconds = {f"seconds_{stage}": row.report["seconds"].get(stage, 0.0) for stage in STAGES}
    return seconds | {"seconds": sum(seconds.values()), "threads": int(file.read_text(encoding="utf-8"))}


@dataclass(frozen=True, kw_only=True)
class MapColumns:
    """Columns of a row on the starts of its map; rounds and seconds are sums over all starts."""

    origin: str | None = None  # where the map comes from
    attempts: str | None = None  # the starts that were tried
    rounds_approach: int | None = None
    rounds_grow: int | None = None
    rounds_shape: int | None = None
    rounds_unfold: int | None = None
    rounds_separate: int | None = None
    rounds_polish: int | None = None
    seconds_approach: float | None = None
    seconds_grow: float | None = None
    seconds_shape: float | None = None
    seconds_unfold: float | None = None
    seconds_separate: float | None = None
    seconds_polish: float | None = None


def columns_of(row: type[MapColumns]) -> list[str]:
    """The names of a row's columns, its own ones first."""
    shared = [field.name for field in fields(MapColumns)]
    return [field.name for field in fields(row) if field.name not in shared] + shared


def attempts_of(report: dict[str, Any]) -> dict[str, Any]:
    """Where the map comes from, the starts that were tried, and their rounds and seconds by phase, added up."""
    quality = report["parameterization"]
    if (tried := quality.get("attempts")) is None:  # the report of an earlier version
        return {}
    found = {"origin": quality["origin"], "attempts": ", ".join(one["start"] for one in tried)}
    for phase in PHASES:
        for name in ("rounds", "seconds"):
            found[f"{name}_{phase}"] = sum(one[name].get(phase, 0) for one in tried)
    return found


def run(
    prog: str,
    out: Path,
    tasks: Sequence[Task],
    workers: WorkerOptions,
    keep: Callable[[Batch], None],
    work: Callable[[Task, int, str], Ended] = compute_measured,
) -> int:
    """Compute the tasks as a batch; keep the rows after each that ends, and return an exit code.

    It is 0, 130 where the batch was interrupted, and 2 where the folder cannot be written.
    """
    ended = -1

    def show(batch: Batch, _: Sequence[Running]) -> None:
        nonlocal ended
        waiting = batch.counts.get("waiting", 0)
        if waiting != ended:
            keep(batch)
            ended = waiting

    try:
        keep(run_tasks(out, tasks, workers, progress=show, work=work))
    except KeyboardInterrupt as error:
        print(f"{prog}: {error or 'interrupted'}", file=sys.stderr)
        return INTERRUPTED
    except InputError as error:
        print(f"{prog}: {error}", file=sys.stderr)
        return BAD_INPUT
    return 0


# Tables


def as_markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def processor() -> str:
    """Return the model of the CPU."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or platform.machine())
