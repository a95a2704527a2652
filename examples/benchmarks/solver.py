"""Time, memory and accuracy of the solver on the twisted cube: Poisson's equation and linear elasticity.

    OMP_NUM_THREADS=1 python examples/benchmarks/solver.py 27 64 100
    python examples/benchmarks/solver.py 27 64 --degrees 2 3 4 5 --threads 1 2 --peers --out results
    python examples/benchmarks/solver.py 27 --law elasticity --peers

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
from processes import as_markdown, processor

from iga_nn.level_table import csv_text
from iga_nn.report.document import versions
from parameterize.files import save_text
from solve import Elasticity, Poisson, Problem, benchmark_volume, solve_problem
from solve.discretization.error_norms import Compared, error_norms
from solve.discretization.space import trial_space

EXACT = "exp(x+z)*sin(y)"  # of Poisson's equation, and each component of elasticity's displacement
LAWS = {"poisson": Poisson(exact=EXACT), "elasticity": Elasticity(exact=(EXACT,) * 3)}
TOLERANCE = 1e-10
OURS, MFEM = "iga-nn", "mfem"
PEERS = {MFEM: "mfem"}  # name -> module


@dataclass(frozen=True)
class Case:
    """What a row measures."""

    solver: str
    law: str
    n: int
    degree: int
    threads: int


@dataclass(frozen=True)
class Row(Case):
    """One solve. setup, solve: CPU seconds; wall: of both together; peak_mb: of the process."""

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
        counts = (self.n, self.degree, self.threads, self.dofs)
        seconds = (f"{self.setup:.2f}", f"{self.solve:.2f}", f"{self.wall:.2f}", f"{self.seconds_per_mdof:.1f}")
        found = (str(self.iterations), f"{self.l2:.4e}", str(self.peak_mb))
        return [self.solver, self.law, *map(str, counts), *seconds, *found]


HEADINGS = (
    "solver", "law", "n", "degree", "threads", "unknowns", "setup s", "solve s", "wall s", "s per million unknowns",
    "iterations", "L2", "peak MB",
)  # fmt: skip


def run_ours(case: Case) -> dict[str, Any]:
    """Solve once small, for the compilation, then the row."""
    law, degree, threads = LAWS[case.law], case.degree, case.threads
    problem = Problem(law, source=law.source_at, boundary=law.exact_values)  # no error norms in the wall seconds
    volume = benchmark_volume(case.n, degree)
    solve_problem(benchmark_volume(16, degree), problem, threads=threads, estimate=False)  # as smooth as the row
    start = time.perf_counter()
    solution = solve_problem(volume, problem, tolerance=TOLERANCE, threads=threads, estimate=False)
    wall = time.perf_counter() - start
    report = solution.report
    coefficients = solution.coefficients.reshape(*volume.shape, -1)
    errors = error_norms([Compared(volume, trial_space(volume), np.moveaxis(coefficients, -1, 0), law.exact_at)])
    return {
        "dofs": report.dofs,
        "setup": report.seconds["setup"],
        "solve": report.seconds["solve"],
        "wall": wall,
        "iterations": report.iterations,
        "l2": errors.l2,
    }


def run_mfem(case: Case) -> dict[str, Any]:
    """MFEM on the map as it is exported, with boundary data projected in L2 on the boundary."""
    import mfem.ser as mfem  # type: ignore[import-not-found]

    from iga_nn.io.mfem_writer import write_mfem

    terms = _poisson_of_mfem() if case.law == "poisson" else _elasticity_of_mfem()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "map.mesh"
        write_mfem(file, benchmark_volume(case.n, case.degree))
        mesh = mfem.Mesh(str(file), 1, 0)
    start, wall = time.process_time(), time.perf_counter()
    collection = mfem.NURBSFECollection(case.degree)
    space = mfem.FiniteElementSpace(mesh, collection, LAWS[case.law].components)
    fixed = mfem.intArray()
    space.GetEssentialTrueDofs(mfem.intArray([1] * mesh.bdr_attributes.Max()), fixed)
    load = mfem.LinearForm(space)
    load.AddDomainIntegrator(terms["load"])
    load.Assemble()
    u = mfem.GridFunction(space)
    u.Assign(0.0)
    mass, data = mfem.BilinearForm(space), mfem.LinearForm(space)
    mass.AddBoundaryIntegrator(terms["boundary_mass"])
    mass.Assemble()
    mass.Finalize()
    data.AddBoundaryIntegrator(terms["boundary_load"])
    data.Assemble()
    mfem.CG(mass.SpMat(), data, u, 0, 2000, 1e-28, 0.0)
    form = mfem.BilinearForm(space)
    form.AddDomainIntegrator(terms["operator"])
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
    rule = mfem.IntRules.Get(mfem.Geometry.CUBE, 2 * (case.degree + 2) - 1)
    return {
        "dofs": space.GetVSize(),
        "setup": middle - start,
        "solve": end - middle,
        "wall": wall,
        "iterations": solver.GetNumIterations(),
        "l2": u.ComputeL2Error(terms["exact"], [rule] * (mfem.Geometry.CUBE + 1)),
    }


def _poisson_of_mfem() -> dict[str, Any]:
    """MFEM's integrators of Poisson's equation, and its exact solution."""
    import mfem.ser as mfem

    exact = mfem.jit.scalar()(lambda x: np.exp(x[0] + x[2]) * np.sin(x[1]))
    source = mfem.jit.scalar()(lambda x: -np.exp(x[0] + x[2]) * np.sin(x[1]))
    return {
        "exact": exact,
        "load": mfem.DomainLFIntegrator(source),
        "boundary_mass": mfem.MassIntegrator(),
        "boundary_load": mfem.BoundaryLFIntegrator(exact),
        "operator": mfem.DiffusionIntegrator(),
        "kept": source,  # the integrators do not keep it alive
    }


def _elasticity_of_mfem() -> dict[str, Any]:
    """MFEM's integrators of linear elasticity, and its exact solution: the force is derived by hand."""
    import mfem.ser as mfem

    law = LAWS["elasticity"]
    assert isinstance(law, Elasticity)
    first, shear = law.constants

    def displacement(x: Any) -> Any:
        return np.full(3, np.exp(x[0] + x[2]) * np.sin(x[1]))

    def force(x: Any) -> Any:  # -mu Laplace u - (lambda + mu) grad div u, with w = u_i and v its y derivative
        w, v = np.exp(x[0] + x[2]) * np.sin(x[1]), np.exp(x[0] + x[2]) * np.cos(x[1])
        return -shear * w - (first + shear) * np.array([2.0 * w + v, 2.0 * v - w, 2.0 * w + v])

    exact = mfem.jit.vector(shape=(3,))(displacement)
    source = mfem.jit.vector(shape=(3,))(force)
    constants = mfem.ConstantCoefficient(first), mfem.ConstantCoefficient(shear)
    return {
        "exact": exact,
        "load": mfem.VectorDomainLFIntegrator(source),
        "boundary_mass": mfem.VectorMassIntegrator(),
        "boundary_load": mfem.VectorBoundaryLFIntegrator(exact),
        "operator": mfem.ElasticityIntegrator(*constants),
        "kept": (source, constants),  # the integrators do not keep them alive
    }


RUNNERS = {OURS: run_ours, MFEM: run_mfem}


def measure(case: Case) -> Row:
    """A row, in this process."""
    found = RUNNERS[case.solver](case)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    return Row(**asdict(case), peak_mb=peak, **found)


def measure_apart(case: Case) -> Row:
    """A row, in a process of its own."""
    chosen = {"--law": case.law, "--degrees": case.degree, "--threads": case.threads, "--row": case.solver}
    words = [str(case.n), *(str(word) for pair in chosen.items() for word in pair)]
    printed = subprocess.run([sys.executable, __file__, *words], check=True, capture_output=True, text=True)
    return Row(**json.loads(printed.stdout.splitlines()[-1]))


def table(rows: Sequence[Row]) -> str:
    """The rows in Markdown, with the machine and the versions."""
    named = ", ".join(f"{name} {number}" for name, number in versions().items())
    return f"{as_markdown(HEADINGS, [row.cells() for row in rows])}\n\n{processor()}; {named}."


def save(rows: Sequence[Row], folder: Path) -> None:
    """Write solver.csv and solver.md."""
    folder.mkdir(parents=True, exist_ok=True)
    save_text(folder / "solver.csv", csv_text([field.name for field in fields(Row)], map(asdict, rows)))
    told = (__doc__ or "").split("\n\n")[2].strip()
    save_text(folder / "solver.md", f"# The solver on the twisted cube\n\n{told}\n\n{table(rows)}\n")


def main(arguments: Sequence[str] | None = None) -> list[Row]:
    """Measure the rows asked for, print them and, with --out, write them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", type=int, nargs="*", default=[16, 27, 40, 64], help="elements a direction")
    parser.add_argument("--law", nargs="+", choices=LAWS, default=["poisson"])
    parser.add_argument("--degrees", type=int, nargs="+", default=[3])
    parser.add_argument("--threads", type=int, nargs="+", default=[1])
    parser.add_argument("--peers", action="store_true", help="rows of the other programs that are installed")
    parser.add_argument("--out", type=Path, help="folder for solver.csv and solver.md")
    parser.add_argument("--row", choices=RUNNERS, help="measure in this process and print JSON")
    options = parser.parse_args(arguments)
    if options.row:
        row = measure(Case(options.row, options.law[0], options.sizes[0], options.degrees[0], options.threads[0]))
        print(json.dumps(asdict(row)))
        return [row]
    shapes = [(law, n, degree) for law in options.law for degree in options.degrees for n in options.sizes]
    cases = [Case(OURS, *shape, threads) for shape in shapes for threads in options.threads]
    if options.peers:
        installed = [name for name, module in PEERS.items() if find_spec(module)]
        cases += [Case(name, *shape, 1) for name in installed for shape in shapes]
    rows = []
    for case in cases:
        rows.append(measure_apart(case))
        if options.out:
            save(rows, options.out)
    print(table(rows))
    return rows


if __name__ == "__main__":
    main()
