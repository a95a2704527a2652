"""What the benchmarks share: a process of its own for every row, arguments refused in one line, tables."""

from __future__ import annotations

import argparse
import csv
import io
import json
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, NoReturn, TypeVar

from iga_nn.errors import one_line
from iga_nn.report.document import plain

BAD_INPUT, INTERRUPTED = 2, 130
POLL = 0.2  # seconds
Row = TypeVar("Row")
THREAD_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")


class OneLineParser(argparse.ArgumentParser):
    """Of the command line; bad arguments are one line, without the usage."""

    def error(self, message: str) -> NoReturn:
        """Exit code 2."""
        self.exit(BAD_INPUT, f"{self.prog}: {message}\n")


def cores() -> int:
    """Of the processor, as far as this process may use them."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class Ended:
    """A process that has ended. result: the JSON object of the last line it printed; None where there is none."""

    name: str
    code: int
    result: dict[str, Any] | None

    @property
    def failure(self) -> str:
        """In words."""
        return f"its process ended with code {self.code}, without a result"


def in_processes(commands: Mapping[str, Sequence[str]], threads: int, jobs: int) -> Generator[Ended, None, None]:
    """Run each command in a process, `jobs` at a time; yield as they end. Those still running end with this."""
    waiting = list(commands)
    running: list[_Child] = []
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                name = waiting.pop(0)
                running.append(_Child.start(name, commands[name], threads))
            for child in [child for child in running if child.process.poll() is not None]:
                running.remove(child)
                yield child.ended()
            time.sleep(POLL)
    finally:
        for child in running:
            child.stop()


@dataclass(frozen=True)
class _Child:
    name: str
    process: subprocess.Popen[bytes]
    output: IO[bytes]

    @classmethod
    def start(cls, name: str, command: Sequence[str], threads: int) -> _Child:
        output = TemporaryFile()  # noqa: SIM115 - a pipe could fill up; closed with the row
        environment = os.environ | dict.fromkeys(THREAD_VARIABLES, str(threads))
        return cls(name, subprocess.Popen(command, stdout=output, env=environment), output)

    def ended(self) -> Ended:
        with self.output:
            self.output.seek(0)
            lines = self.output.read().splitlines()
        succeeded = self.process.returncode == 0 and lines
        return Ended(self.name, self.process.returncode, json.loads(lines[-1]) if succeeded else None)

    def stop(self) -> None:
        self.process.kill()
        self.process.wait()
        self.output.close()


def script(file: str, options: Mapping[str, Any]) -> list[str]:
    """The command that runs a script with these options."""
    return [sys.executable, str(Path(file).resolve()), *(f"--{name}={value}" for name, value in options.items())]


def end_children_on_term() -> None:
    """Leave by an exception where this process is asked to end, so that in_processes ends its children."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))


def answer(find: Callable[[], Any]) -> int:
    """In a child: print a row, a dataclass, as the last line. Interrupted it is silent, its parent has the say."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    print(json.dumps(plain(asdict(find()))))
    return 0


def collect(
    prog: str,
    found: Generator[Row, None, None],
    keep: Callable[[list[Row]], None],
    told: Callable[[Row], str],
    remains: str,
) -> tuple[list[Row], int]:
    """Keep all rows so far and tell the new one, as they come; return them with an exit code.

    remains: what an interrupted run leaves. The code is 0, 130 interrupted, 2 where the disk is full.
    """
    rows: list[Row] = []
    try:
        with closing(found):
            for row in found:
                rows.append(row)
                keep(rows)
                print(told(row), flush=True)
    except KeyboardInterrupt:
        print(f"{prog}: interrupted after {len(rows)} rows; {remains}", file=sys.stderr)
        return rows, INTERRUPTED
    except OSError as error:
        print(f"{prog}: {one_line(error)}", file=sys.stderr)
        return rows, BAD_INPUT
    return rows, 0


def as_csv(columns: Iterable[str], rows: Iterable[Mapping[str, Any]]) -> str:
    """Every figure with all its digits; empty where there is none."""
    text = io.StringIO()
    table = csv.DictWriter(text, list(columns), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def as_markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [head, ["---"] * len(head), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def calibrate(share: float = 1.0, threads: int | None = None) -> tuple[float, int]:
    """Return t_cal, the wall seconds of 1e12 operations in float32 products (8192, 512) @ (512, 512), and the threads.

    share: the part of these operations that is measured, for quick looks. threads: as many as torch takes by default.
    """
    import torch

    usual = torch.get_num_threads()
    torch.set_num_threads(threads or usual)
    left, right = torch.ones(8192, 512), torch.full((512, 512), 1.0 / 512.0)
    operations = 2 * 8192 * 512 * 512  # of one product
    repeats = max(1, round(share * 1e12 / operations))
    product = left @ right  # starts the threads
    start = time.perf_counter()
    for _ in range(repeats):
        torch.mm(left, right, out=product)
    seconds = time.perf_counter() - start
    torch.set_num_threads(usual)
    return seconds * 1e12 / (repeats * operations), threads or usual


def processor() -> str:
    """Return the model of the CPU."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    named = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(named, platform.processor() or platform.machine())
