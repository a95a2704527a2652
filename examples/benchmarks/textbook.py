"""Asked quantities on problems of textbooks: does the true value lie inside of the interval, and how wide is that?

    python examples/benchmarks/textbook.py --out examples/benchmarks/results
    python examples/benchmarks/textbook.py --only kirsch fin --degrees 2

Problems and formulas are those of textbook_cases.py. The price of the intervals is CPU seconds with asks over CPU
seconds of the same solve without, each the shortest of some rounds.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import processes
from asked_rows import HEAD, Row, rows_of, summary
from textbook_cases import CASES, Case

import iga_nn
from parameterize.files import save_text
from solve import Solution

ROUNDS = 2  # of a solve; the shortest counts
PRICE_HEAD = ("case", "degree, level", "unknowns", "quantities", "seconds of the solve", "of asks beside it", "ratio")


@dataclass(frozen=True)
class Price:
    """CPU seconds of a solve without asks and with them."""

    case: str
    mesh: str
    unknowns: int
    quantities: int
    plain: float
    asked: float

    def cells(self) -> list[str]:
        """Return the cells of the table."""
        more = self.asked - self.plain
        numbers = [f"{self.plain:.2f}", f"{more:.2f}", f"{more / self.plain:.2f}"]
        return [self.case, self.mesh, f"{self.unknowns:,}", str(self.quantities), *numbers]


def solved(case: Case, degree: int, refine: int, asks: Sequence[str]) -> tuple[Solution, float]:
    """Return the solution with answers, and the CPU seconds of the shortest of some rounds."""
    seconds = []
    for _ in range(ROUNDS):
        start = time.process_time()
        solution = iga_nn.solve(case.body, case.problem, degree=degree, refine=refine, ask=asks)
        seconds.append(time.process_time() - start)
    return solution, min(seconds)


def measured(case: Case, degree: int, refine: int) -> tuple[list[Row], Price]:
    """Return the rows of one solve, and its price."""
    mesh, asks = f"{degree}, {refine}", list(case.truths)
    solution, asked = solved(case, degree, refine, asks)
    _, plain = solved(case, degree, refine, ())
    price = Price(case.name, mesh, solution.report.dofs, len(asks), plain, asked)
    return rows_of(case.name, mesh, solution, list(case.truths.values())), price


def as_text(rows: Sequence[Row], prices: Sequence[Price]) -> str:
    """Return the tables and their summary."""
    outside = [row for row in rows if not row.is_inside]
    ratios = [(price.asked - price.plain) / price.plain for price in prices]
    parts = [
        summary(rows),
        f"Seconds of the asks over seconds of the solve: {min(ratios):.2f} to {max(ratios):.2f}.",
        "### Outside",
        processes.as_markdown(HEAD, [row.cells() for row in outside]) if outside else "None.",
        "### All quantities",
        processes.as_markdown(HEAD, [row.cells() for row in rows]),
        "### Price",
        processes.as_markdown(PRICE_HEAD, [price.cells() for price in prices]),
    ]
    return "\n\n".join(parts) + "\n"


def main(argv: list[str] | None = None) -> int:
    """Print the tables, and write them where --out names a folder."""
    parser = processes.OneLineParser(
        prog="textbook.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=list(CASES), default=list(CASES), help="these cases alone")
    parser.add_argument("--degrees", nargs="+", type=int, default=[2, 3], help="of the splines (default: 2 3)")
    parser.add_argument("--levels", nargs="+", type=int, default=[2, 3], help="times spans are halved (default: 2 3)")
    parser.add_argument("--out", type=Path, help="folder of the tables")
    given = parser.parse_args(argv)
    rows: list[Row] = []
    prices: list[Price] = []
    for name in given.only:
        case = CASES[name]()
        for degree in given.degrees:
            for level in given.levels:
                found, price = measured(case, degree, level)
                rows, prices = [*rows, *found], [*prices, price]
                print("\n".join([*(" | ".join(row.cells()) for row in found), " | ".join(price.cells())]), flush=True)
    text = as_text(rows, prices)
    print(text)
    if given.out:
        given.out.mkdir(parents=True, exist_ok=True)
        save_text(given.out / "textbook.md", text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
