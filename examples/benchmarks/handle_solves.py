"""Solve on the maps that handles.py left: rates on one refinement, and iterations beside those of a cube.

    python examples/benchmarks/handle_solves.py out/handles --only torus frame --out out/handle_solves

Poisson's equation and elasticity with a known solution, whose L2 rate is shown, and elasticity clamped on one side of
the body and pulled on the opposite one, along its longest direction: its work converges. The cube is the twisted one
of solver.py, with about as many unknowns and the same kind of data: sides are clamped and pulled as regions. Iterations
lower the residual to 1e-10. Rows that the table has already stay, or are replaced where they are measured again.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
from processes import OneLineParser, as_markdown

import iga_nn
from iga_nn.level_table import csv_text
from parameterize.files import save_text
from parameterize.spline.body import as_body
from parameterize.spline.sampled_boundary import SampledBoundary
from solve import Solution, benchmark_volume

BodyLike = iga_nn.BSplineVolume | iga_nn.Body
EXACT = "exp(X+Z)*sin(Y)"  # of Poisson's equation, and of each component of a displacement
KNOWN = {"poisson": iga_nn.Poisson(exact=EXACT), "elasticity": iga_nn.Elasticity(exact=(EXACT,) * 3)}
CLAMPED = "clamped"
LAWS = (*KNOWN, CLAMPED)
SIDE = 0.1  # of the body's longest extent: so deep is a side that is clamped or pulled
FACING = 0.7  # cosine to the direction of the pull, of normals there at least
TOLERANCE = 1e-10
LEVELS = 2
HEAD = ("body", "blocks", "law", "level", "unknowns", "rate", "work", "change", "iterations", "of a cube", "ratio")


@dataclass(frozen=True)
class Row:
    """One solve. rate: of the L2 error, from the level before; work: of the pull, with a traction of 1."""

    body: str
    blocks: int
    law: str
    level: int
    unknowns: int
    iterations: int
    of_cube: int
    work: float | None = None
    change: float | None = None  # of the work from the level before, as a share
    rate: float | None = None

    @property
    def key(self) -> tuple[str, int, int]:
        """By which the rows of the table are ordered."""
        return self.body, LAWS.index(self.law), self.level

    @property
    def cells(self) -> list[str]:
        """As they stand in the table."""
        rate = "" if self.rate is None else f"{self.rate:.2f}"
        work = "" if self.work is None else f"{self.work:.5g}"
        change = "" if self.change is None else f"{100.0 * self.change:.2f} %"
        ratio = f"{self.iterations / self.of_cube:.1f}"
        counts = [str(self.blocks), self.law, str(self.level), f"{self.unknowns:,}"]
        return [self.body, *counts, rate, work, change, str(self.iterations), str(self.of_cube), ratio]


def main(argv: list[str] | None = None) -> int:
    """Solve on the maps, print the rows, and write them anew after each body; 0 done, 2 bad arguments."""
    parser = OneLineParser(prog="handle_solves.py", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of handles.py, or of iga-nn batch")
    parser.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these bodies alone")
    parser.add_argument("--laws", nargs="+", default=LAWS, choices=LAWS, help="of these alone")
    parser.add_argument("--out", type=Path, default=Path("out/handle_solves"), help="folder of the table")
    given = parser.parse_args(argv)
    maps = {path.parent.name: path for path in sorted(given.folder.glob("*/volume.npz"))}
    if missing := [name for name in given.only or ["a map"] if name not in maps and (given.only or not maps)]:
        parser.error(f"{given.folder}: holds no volume.npz of {', '.join(missing)}; run handles.py first")
    given.out.mkdir(parents=True, exist_ok=True)
    rows = {row.key: row for row in kept(given.out)}
    for name in given.only or maps:
        for row in rows_of(name, iga_nn.load_volume(maps[name]), given.laws):
            rows[row.key] = row
            print(" | ".join(row.cells), flush=True)
            save(sorted(rows.values(), key=lambda one: one.key), given.out)
    return 0


def kept(folder: Path) -> Iterator[Row]:
    """Yield the rows of the table in a folder; none where there is no table."""
    file = folder / "handle_solves.csv"
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    for line in csv.DictReader(lines):
        counts = {name: int(line[name]) for name in ("blocks", "level", "unknowns", "iterations", "of_cube")}
        figures = {name: float(line[name]) for name in ("work", "change", "rate") if line[name]}
        yield Row(body=line["body"], law=line["law"], **counts, **figures)


def rows_of(name: str, body: BodyLike, laws: Sequence[str] = LAWS) -> Iterator[Row]:
    """Yield the solves on one body, law after law, level after level."""
    blocks = len(as_body(body).patches)
    for law in laws:
        before = None
        for level in range(LEVELS):
            unknowns, figure, iterations = solved(law, body, level)
            components = KNOWN[law].components if law in KNOWN else 3
            of_cube = solved(law, cube_with(unknowns // components), 0)[2]
            gain = None if before is None else before / figure
            counts = unknowns, iterations, of_cube
            if law in KNOWN:
                yield Row(name, blocks, law, level, *counts, rate=None if gain is None else float(np.log2(gain)))
            else:
                yield Row(name, blocks, law, level, *counts, figure, None if gain is None else abs(1.0 - gain))
            before = figure


def solved(law: str, body: BodyLike, level: int) -> tuple[int, float, int]:
    """Return the unknowns, the relative L2 error or the work of the pull, and the iterations of a solve."""
    pulled, problem = ("", KNOWN[law]) if law in KNOWN else clamped_and_pulled(body)
    solution = iga_nn.solve(body, problem, refine=level, tolerance=TOLERANCE, estimate=False)
    report = solution.report
    return report.dofs, work_of(solution, pulled) if pulled else report.l2_relative, report.iterations


def clamped_and_pulled(body: BodyLike) -> tuple[str, iga_nn.Elasticity]:
    """Return the region on which a body is pulled outward, and the problem: it is clamped on the opposite side."""
    points = SampledBoundary.of(body).points
    low, high = points.min(axis=0), points.max(axis=0)
    axis = int(np.argmax(high - low))
    name, deep = "xyz"[axis], SIDE * (high - low)[axis]
    fixed = f"{name} < {low[axis] + deep} and n{name} < -{FACING}"
    pulled = f"{name} > {high[axis] - deep} and n{name} > {FACING}"
    return pulled, iga_nn.Elasticity(fix=fixed, load={pulled: tuple(np.eye(3)[axis].tolist())})


def work_of(solution: Solution, pulled: str) -> float:
    """Return the work of the pull: the displacement along it, integrated over its region."""
    (direction,) = (one.data for one in solution.problem.conditions if isinstance(one, iga_nn.Load))
    return float(np.dot(iga_nn.integrate(solution, "u", over=pulled), direction))


def cube_with(count: int) -> iga_nn.BSplineVolume:
    """Return a twisted cube with about so many control points."""
    return benchmark_volume(max(1, round(count ** (1.0 / 3.0)) - 3))


def save(rows: list[Row], folder: Path) -> None:
    """Write handle_solves.csv and handle_solves.md."""
    save_text(folder / "handle_solves.csv", csv_text([field.name for field in fields(Row)], map(asdict, rows)))
    save_text(folder / "handle_solves.md", as_markdown(HEAD, [row.cells for row in rows]) + "\n")


if __name__ == "__main__":
    raise SystemExit(main())
