"""Time, memory and accuracy of the solver on the twisted cube: -Laplace u = f, u = exp(x+z) sin(y).

    OMP_NUM_THREADS=1 python examples/benchmarks/poisson.py 27 64 100
    python examples/benchmarks/poisson.py 27 64 --degrees 2 3 4 5 --threads 1 2 --peers --out results

Every row has a process of its own, whose peak memory it reports. Seconds are those of set-up and solve to a residual
of 1e-10, compilation and error norms apart: process CPU seconds, and beside them wall seconds; they differ
between machines. Peers solve the same problem on the same map, where their package is installed: MFEM with its
assembled matrix, Gauss-Seidel and conjugate gradients. All L2 errors come from rules of degree + 2 points.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from processes import processor

from iga_nn.report.document import versions
from iga_nn.report.tables import csv_text
from parameterize.files import save_text
from solve import Poisson, Problem, benchmark_volume, solve_problem
from solve.discretization.errors import error_norms
from solve.discretization.space import trial_space

EXACT = "exp(x+z)*sin(y)"
TOLERANCE = 1e-10
OURS, MFEM = "iga-nn", "mfem"
PEERS = {MFEM: "mfem"}  # name -> module


@dataclass(frozen=True)
class Row:
    """One solve. setup, solve: CPU seconds; wall: of both together; peak_mb: of the process."""

    solver: str
    n: int
    degree: int
    threads: int
    dofs: int
    setup: float
    solve: float
    wall: float
    iterations: int
    l2: float
    peak_mb: int

    @property
    def seconds_per_mdof(self) -> float:
        """CPU seconds for a million unknowns."""
        return (self.setup + self.solve) / self.dofs * 1e6

    def cells(self) -> list[str]:
        """Of the Markdown table."""
        return [
            self.solver,
            f"{self.n} | {self.degree} | {self.threads} | {self.dofs}",
            f"{self.setup:.2f} | {self.solve:.2f} | {self.wall:.2f}",
            f"{self.seconds_per_mdof:.1f} | {self.iterations} | {self.l2:.4e} | {self.peak_mb}",
        ]


HEADINGS = "solver, n, degree, threads, dofs, setup s, solve s, wall s, s per Mdof, iterations, L2, peak MB"


def run_ours(n: int, degree: int, threads: int) -> dict[str, Any]:
    """Solve once small, for the compilation, then the row."""
    exact = Poisson(exact=EXACT)
    problem = Problem(exact, source=exact.source_at, boundary=exact.boundary_at)  # no error norms in the wall seconds
    volume = benchmark_volume(n, degree)
    solve_problem(benchmark_volume(16, degree), problem, threads=threads, estimate=False)  # as smooth as the row
    start = time.perf_counter()
    solution = solve_problem(volume, problem, tolerance=TOLERANCE, threads=threads, estimate=False)
    wall = time.perf_counter() - start
    report = solution.report
    errors = error_norms(volume, trial_space(volume), solution.coefficients[None], exact.exact_at)
    return {
        "dofs": report.dofs,
        "setup": report.seconds["setup"],
        "solve": report.seconds["solve"],
        "wall": wall,
        "iterations": report.iterations,
        "l2": errors.l2,
    }


def run_mfem(n: int, degree: int, _: int) -> dict[str, Any]:
    """MFEM on the map as it is exported, with boundary data projected in L2 on the boundary."""
    import mfem.ser as mfem  # type: ignore[import-not-found]

    from iga_nn.io.splinepy import write_mfem

    exact = mfem.jit.scalar()(lambda x: np.exp(x[0] + x[2]) * np.sin(x[1]))
    source = mfem.jit.scalar()(lambda x: -np.exp(x[0] + x[2]) * np.sin(x[1]))
    with TemporaryDirectory() as folder:
        file = Path(folder) / "map.mesh"
        write_mfem(file, benchmark_volume(n, degree))
        mesh = mfem.Mesh(str(file), 1, 0)
    start, wall = time.process_time(), time.perf_counter()
    collection = mfem.NURBSFECollection(degree)
    space = mfem.FiniteElementSpace(mesh, collection)
    fixed = mfem.intArray()
    space.GetEssentialTrueDofs(mfem.intArray([1] * mesh.bdr_attributes.Max()), fixed)
    load = mfem.LinearForm(space)
    load.AddDomainIntegrator(mfem.DomainLFIntegrator(source))
    load.Assemble()
    u = mfem.GridFunction(space)
    u.Assign(0.0)
    mass, data = mfem.BilinearForm(space), mfem.LinearForm(space)
    mass.AddBoundaryIntegrator(mfem.MassIntegrator())
    mass.Assemble()
    mass.Finalize()
    data.AddBoundaryIntegrator(mfem.BoundaryLFIntegrator(exact))
    data.Assemble()
    mfem.CG(mass.SpMat(), data, u, 0, 2000, 1e-28, 0.0)
    form = mfem.BilinearForm(space)
    form.AddDomainIntegrator(mfem.DiffusionIntegrator())
    form.Assemble()
    matrix, right, unknowns = mfem.SparseMatrix(), mfem.Vector(), mfem.Vector()
    form.FormLinearSystem(fixed, u, load, matrix, unknowns, right)
    middle = time.process_time()
    smoother, solver = mfem.GSSmoother(matrix), mfem.CGSolver()
    solver.SetPreconditioner(smoother)
    solver.SetOperator(matrix)
    solver.SetRelTol(TOLERANCE)
    solver.SetMaxIter(5000)
    solver.SetPrintLevel(0)
    solver.iterative_mode = False
    solver.Mult(right, unknowns)
    form.RecoverFEMSolution(unknowns, load, u)
    end, wall = time.process_time(), time.perf_counter() - wall
    rule = mfem.IntRules.Get(mfem.Geometry.CUBE, 2 * (degree + 2) - 1)
    return {
        "dofs": space.GetVSize(),
        "setup": middle - start,
        "solve": end - middle,
        "wall": wall,
        "iterations": solver.GetNumIterations(),
        "l2": u.ComputeL2Error(exact, [rule] * (mfem.Geometry.CUBE + 1)),
    }


RUNNERS = {OURS: run_ours, MFEM: run_mfem}


def measure(solver: str, n: int, degree: int, threads: int) -> Row:
    """A row, in this process."""
    found = RUNNERS[solver](n, degree, threads)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    return Row(solver=solver, n=n, degree=degree, threads=threads, peak_mb=peak, **found)


def measure_apart(solver: str, n: int, degree: int, threads: int) -> Row:
    """A row, in a process of its own."""
    command = [sys.executable, __file__, str(n), "--degrees", str(degree), "--threads", str(threads), "--row", solver]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return Row(**json.loads(printed.splitlines()[-1]))


def table(rows: Sequence[Row]) -> str:
    """The rows in Markdown, with the machine and the versions."""
    headings = HEADINGS.split(", ")
    lines = [f"| {' | '.join(headings)} |", "|" + " --- |" * len(headings)]
    lines += [f"| {' | '.join(row.cells())} |" for row in rows]
    named = ", ".join(f"{name} {number}" for name, number in versions().items())
    return "\n".join([*lines, "", f"{processor()}; {named}."])


def save(rows: Sequence[Row], folder: Path) -> None:
    """Write poisson.csv and poisson.md."""
    folder.mkdir(parents=True, exist_ok=True)
    save_text(folder / "poisson.csv", csv_text([field.name for field in fields(Row)], map(asdict, rows)))
    save_text(
        folder / "poisson.md",
        f"# The solver on the twisted cube\n\n{(__doc__ or '').split(chr(10) * 2)[2].strip()}\n\n{table(rows)}\n",
    )


def main(arguments: Sequence[str] | None = None) -> list[Row]:
    """Measure the rows asked for, print them and, with --out, write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", type=int, nargs="*", default=[16, 27, 40, 64], help="elements a direction")
    parser.add_argument("--degrees", type=int, nargs="+", default=[3])
    parser.add_argument("--threads", type=int, nargs="+", default=[1])
    parser.add_argument("--peers", action="store_true", help="rows of the other programs that are installed")
    parser.add_argument("--out", type=Path, help="folder for poisson.csv and poisson.md")
    parser.add_argument("--row", choices=RUNNERS, help="measure in this process and print JSON")
    options = parser.parse_args(arguments)
    if options.row:
        row = measure(options.row, options.sizes[0], options.degrees[0], options.threads[0])
        print(json.dumps(asdict(row)))
        return [row]
    cases = [(OURS, n, p, t) for p in options.degrees for n in options.sizes for t in options.threads]
    if options.peers:
        installed = [name for name, module in PEERS.items() if find_spec(module)]
        cases += [(name, n, p, 1) for name in installed for p in options.degrees for n in options.sizes]
    rows = []
    for case in cases:
        rows.append(measure_apart(*case))
        if options.out:
            save(rows, options.out)
    print(table(rows))
    return rows


if __name__ == "__main__":
    main()
