"""Asked quantities on CAD parts, with their intervals, beside those of a much finer solve.

    python examples/benchmarks/parts.py models/cad models/parts --out out/parts
    python examples/benchmarks/part_intervals.py out/parts --out examples/benchmarks/results

The volumes are those that parts.py leaves. Problems are those of part_problems.py. Values of the finer solves are kept
as JSON, for they take most of the time. A finer solve is no truth: its own error counts as that of the interval.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import processes
from asked_rows import HEAD, Row, rows_of, summary
from part_problems import PartProblem, every

import iga_nn
from parameterize.files import save_text
from parameterize.spline.body import as_body
from solve import Solution
from solve.ask import Ask
from solve.asked.functional import functional

TABLE_HEAD = (*HEAD[:5], "finer", *HEAD[6:])
PRICE_HEAD = ("part", "unknowns", "seconds of the solve", "of asks beside it", "finer: degree, level", "unknowns", "s")


@dataclass(frozen=True)
class Finer:
    """The values of the finer solve by what is asked, its unknowns and CPU seconds."""

    values: Mapping[str, float]
    unknowns: int
    seconds: float


@dataclass(frozen=True)
class Found:
    """What is known of a part: its rows, CPU seconds of the solve without asks and with them, and the finer solve."""

    part: PartProblem
    rows: Sequence[Row]
    plain: float
    asked: float
    finer: Finer

    @property
    def is_inside(self) -> bool:
        """Return whether every value of the finer solve lies inside of its interval."""
        return all(row.is_inside for row in self.rows)

    def cells(self) -> list[str]:
        """Return the cells of the table of prices."""
        numbers = [f"{self.rows[0].unknowns:,}", f"{self.plain:.1f}", f"{self.asked - self.plain:.1f}"]
        finer = [mesh_of(*self.part.finer), f"{self.finer.unknowns:,}", f"{self.finer.seconds:.0f}"]
        return [self.part.label, *numbers, *finer]


def mesh_of(degree: int, refine: int) -> str:
    """Return the words for a mesh in a table."""
    return f"{degree}, {refine}"


def timed(
    volume: iga_nn.Body, part: PartProblem, degree: int, refine: int, asks: Sequence[str], **more: Any
) -> tuple[Solution, float]:
    """Return a solution, and its CPU seconds."""
    start = time.process_time()
    options = {"ask": asks} | more
    solution = iga_nn.solve(volume, part.problem, degree=degree, refine=refine, **options)
    return solution, time.process_time() - start


def finer_of(part: PartProblem, volume: iga_nn.Body, kept: Path) -> Finer:
    """Return the values of the finer solve: those that are kept, if they are those of the same asks."""
    if kept.is_file():
        known = json.loads(kept.read_text(encoding="utf-8"))
        if known["mesh"] == list(part.finer) and set(part.asks) <= known["finer"]["values"].keys():
            return Finer(**known["finer"])
    solution, seconds = timed(volume, part, *part.finer, (), estimate=False)
    values = {ask: functional(Ask(ask), part.problem, volume).value(solution) for ask in part.asks}
    found = Finer(values, solution.report.dofs, seconds)
    save_text(kept, json.dumps({"mesh": part.finer, "finer": asdict(found)}, indent=1) + "\n")
    return found


def measured(part: PartProblem, volumes: Path, kept: Path) -> Found:
    """Return what is found of a part."""
    volume = as_body(iga_nn.load_volume(volumes / part.label / "volume.npz"))
    finer = finer_of(part, volume, kept / f"{part.label}.json")
    iga_nn.solve(volume, part.problem, degree=part.degree, estimate=False)  # compiles what the times are not to have
    _, plain = timed(volume, part, part.degree, part.refine, ())
    solution, asked = timed(volume, part, part.degree, part.refine, part.asks)
    truths = [finer.values[ask] for ask in part.asks]
    rows = rows_of(part.label, mesh_of(part.degree, part.refine), solution, truths)
    return Found(part, rows, plain, asked, finer)


def as_text(found: Sequence[Found], skipped: Mapping[str, str]) -> str:
    """Return the tables and their summary."""
    rows = [row for one in found for row in one.rows]
    parts = [
        f"On {sum(one.is_inside for one in found)} of {len(found)} parts every value of the finer solve lies inside.",
        summary(rows),
        processes.as_markdown(TABLE_HEAD, [row.cells() for row in rows]),
        "### Price",
        processes.as_markdown(PRICE_HEAD, [one.cells() for one in found]),
    ]
    parts += [f"Skipped: {label}: {why}" for label, why in skipped.items()]
    return "\n\n".join(parts) + "\n"


def main(argv: list[str] | None = None) -> int:
    """Print the rows, and write the tables."""
    parser = processes.OneLineParser(
        prog="part_intervals.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("volumes", type=Path, help="the folder that parts.py wrote")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="these parts alone, such as parts_bracket")
    parser.add_argument("--kept", type=Path, default=Path("out/part_intervals"), help="folder of the finer values")
    parser.add_argument("--out", type=Path, help="folder of the table")
    given = parser.parse_args(argv)
    given.kept.mkdir(parents=True, exist_ok=True)
    found: list[Found] = []
    skipped: dict[str, str] = {}
    for part in every():
        if given.only and part.label not in given.only:
            continue
        try:
            one = measured(part, given.volumes, given.kept)
        except (ValueError, FileNotFoundError, MemoryError) as error:
            skipped[part.label] = str(error)
            print(f"{part.label}: {error}", flush=True)
            continue
        found.append(one)
        print("\n".join([*(" | ".join(row.cells()) for row in one.rows), " | ".join(one.cells())]), flush=True)
    text = as_text(found, skipped)
    print(text)
    if given.out:
        given.out.mkdir(parents=True, exist_ok=True)
        save_text(given.out / "part_intervals.md", text)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
