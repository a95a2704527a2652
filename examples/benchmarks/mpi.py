"""Time, memory and communication of a solve shared by the processes of an MPI job, on the twisted cube.

    OMP_NUM_THREADS=1 python examples/benchmarks/mpi.py 100 --ranks 1 2 4 --out examples/benchmarks/results
    OMP_NUM_THREADS=1 python examples/benchmarks/mpi.py 100 --ranks 1 4 --limit 300

Every row is a job of its own; one rank is the solve without MPI. Memory is the resident memory of the largest process,
less what it had before the solve. Seconds are those of the longest process, wall and CPU, of set-up, solve and error
norms to a residual of 1e-10; a process that waits takes CPU seconds, too, and where other programs or processes want
the same cores, wall seconds say little. Bytes are those that all processes send in a
step of conjugate gradients, counted, and beside them the model of docs/mpi.md. --limit lets each process take no more
than that many megabytes of address space beside those that it has when the solve begins.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from processes import as_markdown, cores, processor

from iga_nn.level_table import csv_text
from iga_nn.report.document import versions
from parameterize.files import save_text
from solve import Poisson, benchmark_volume, solve_problem

EXACT = "exp(x+z)*sin(y)"
DEGREE = 3
NUMBER = 8  # bytes
BANDWIDTH, LATENCY = 10e9, 5e-6  # bytes a second into a node, seconds a message, of the network in the model
NODES = (1, 4, 16, 64)
MPI_ENVIRONMENT = {  # more processes than cores, also as root; MPICH ignores it
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "PRTE_MCA_hwloc_default_binding_policy": "none",
}


@dataclass(frozen=True)
class Row:
    """One solve. memory_mb: of the largest process. halo, transposition: bytes a step. difference: to one rank."""

    n: int
    ranks: int
    limit_mb: int | None
    iterations: int | None = None
    wall: float | None = None
    cpu: float | None = None
    memory_mb: float | None = None
    halo: float = 0.0
    transposition: float = 0.0
    difference: float = 0.0

    def cells(self, serial: Row | None) -> list[str]:
        """Of the table; None where the solve did not fit the limit."""
        limit = "none" if self.limit_mb is None else str(self.limit_mb)
        head = [str(self.n), str(self.ranks), limit]
        if self.memory_mb is None:
            return [*head, "out of memory", *("",) * 6]
        share = f"{self.memory_mb / serial.memory_mb:.2f}" if serial and serial.memory_mb else ""
        halo, transposition = model(self.n, self.ranks)
        return [
            *head,
            str(self.iterations),
            f"{self.wall:.1f}",
            f"{self.cpu:.1f}",
            f"{self.memory_mb:.0f}",
            share,
            f"{self.halo / 1e6:.3f} / {halo / 1e6:.3f}",
            f"{self.transposition / 1e6:.3f} / {transposition / 1e6:.3f}",
        ]


HEAD = (
    "n, ranks, limit MB, iterations, wall s, CPU s, memory MB, of one rank, halo MB / model, transposition MB / model"
)


def model(n: int, ranks: int) -> tuple[float, float]:
    """Return the bytes of a step: degree rows to and from each neighbour, and two transpositions of the free values."""
    functions, free = n + DEGREE, (n + DEGREE - 2) ** 3
    halo = 2 * DEGREE * functions**2 * (ranks - 1) * NUMBER
    return float(halo), 2.0 * (1.0 - 1.0 / ranks) * free * NUMBER


def predicted(n: int, nodes: int, step: float) -> tuple[float, float]:
    """Return the seconds of a step on some nodes, and those of them in which they wait for messages.

    step: seconds of a step on one node.
    """
    halo, transposition = model(n, nodes)
    waiting = (halo + transposition) / nodes / BANDWIDTH + (nodes > 1) * LATENCY * (4 + 2 * nodes + 3 * np.log2(nodes))
    return step / nodes + waiting, float(waiting)


def resident_mb(peak: bool = False) -> float:
    """Return the resident memory of this process, now or at most so far."""
    name = "VmHWM:" if peak else "VmRSS:"
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(name)) / 1024.0


def measure(n: int, limit: int | None, file: Path, comm: Any) -> Row:
    """Return a row, from all processes of a job; comm is None for a single one. The coefficients go to a file."""
    ranks = 1 if comm is None else comm.size
    problem, how = Poisson(exact=EXACT), {"comm": comm, "threads": 1, "tolerance": 1e-10}
    solve_problem(benchmark_volume(max(8, 2 * ranks), DEGREE), problem, **how)  # compiles
    before = resident_mb()
    volume = benchmark_volume(n, DEGREE)
    Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")  # the highest memory counts from now on
    if limit is not None:
        pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[0])
        most = pages * resource.getpagesize() + limit * 1_000_000
        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        solution = solve_problem(volume, problem, **how)
    except MemoryError:
        return Row(n, ranks, limit)
    seconds = time.perf_counter() - wall, time.process_time() - cpu, resident_mb(peak=True) - before
    if comm is not None:
        seconds = tuple(max(column) for column in zip(*comm.allgather(seconds), strict=True))
    wall, cpu, memory = seconds
    difference, found = 0.0, solution.coefficients
    if comm is None:
        np.save(file, found)
    elif comm.rank == 0 and file.exists():
        wanted = np.load(file)
        difference = float(np.abs(found - wanted).max() / np.abs(wanted).max())
    sent, iterations = solution.report.traffic, solution.report.iterations
    halo, transposition = sent.get("halo", 0.0), sent.get("transposition", 0.0)
    return Row(n, ranks, limit, iterations, wall, cpu, memory, halo, transposition, difference)


def measure_apart(n: int, ranks: int, limit: int | None, file: Path) -> Row:
    """Return a row, from a job of its own."""
    command = [sys.executable, __file__, str(n), "--row", str(file), "--ranks", str(ranks)]
    if ranks > 1:
        command = [str(Path(sys.executable).with_name("mpiexec")), "-n", str(ranks), *command]
    command += [] if limit is None else ["--limit", str(limit)]
    environment = MPI_ENVIRONMENT | os.environ
    printed = subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
    return Row(**json.loads(printed.splitlines()[-1]))


def text_of(rows: Sequence[Row]) -> str:
    """Return the page: the rows, what differs from one rank, and the model of a larger machine."""
    alone = {row.n: row for row in rows if row.ranks == 1 and row.memory_mb is not None}
    lines = [as_markdown(HEAD.split(", "), [row.cells(alone.get(row.n)) for row in rows]), ""]
    worst = max((row.difference for row in rows if row.ranks > 1), default=0.0)
    lines += [f"Coefficients differ from those of one rank by at most {worst:.1e} of the largest.", ""]
    for n, row in alone.items():
        assert row.cpu is not None and row.iterations
        step = row.cpu / row.iterations
        cells = [[str(nodes), *(f"{1e3 * t:.2f}" for t in predicted(n, nodes, step))] for nodes in NODES]
        lines += [
            f"What the model says of n = {n}: a step of {1e3 * step:.0f} ms on one rank (all its CPU seconds over the "
            f"iterations), {BANDWIDTH / 1e9:.0f} GB/s into each node, {1e6 * LATENCY:.0f} us a message:",
            "",
            as_markdown(["nodes", "ms a step", "of them for messages"], cells),
            "",
        ]
    named = ", ".join(f"{name} {number}" for name, number in versions().items())
    return "\n".join([*lines, f"{processor()}, {cores()} cores; {named}."])


def save(rows: Sequence[Row], folder: Path) -> None:
    """Write mpi.csv and mpi.md."""
    folder.mkdir(parents=True, exist_ok=True)
    about = (__doc__ or "").split("\n\n")[2].strip()
    save_text(folder / "mpi.csv", csv_text([field.name for field in fields(Row)], map(asdict, rows)))
    save_text(folder / "mpi.md", f"# A solve shared by processes\n\n{about}\n\n{text_of(rows)}\n")


def main(arguments: Sequence[str] | None = None) -> list[Row]:
    """Measure the rows asked for, print them and, with --out, write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", type=int, nargs="*", default=[64, 100], help="elements a direction")
    parser.add_argument("--ranks", type=int, nargs="+", default=[1, 2, 4])
    parser.add_argument("--limit", type=int, help="megabytes of address space that a solve may take")
    parser.add_argument("--out", type=Path, help="folder for mpi.csv and mpi.md")
    parser.add_argument("--row", type=Path, help="measure in this process and print JSON; a file for the coefficients")
    options = parser.parse_args(arguments)
    if options.row:
        comm = None
        if options.ranks[0] > 1:
            from mpi4py import MPI

            comm = MPI.COMM_WORLD
        row = measure(options.sizes[0], options.limit, options.row, comm)
        if comm is None or comm.rank == 0:
            print(json.dumps(asdict(row)))
        return [row]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for n in options.sizes:
            for limit in dict.fromkeys((None, options.limit)):
                for ranks in options.ranks:
                    rows.append(measure_apart(n, ranks, limit, Path(folder) / f"{n}.npy"))
                    print(rows[-1], flush=True)
    print(text_of(rows))
    if options.out:
        save(rows, options.out)
    return rows


if __name__ == "__main__":
    main()
