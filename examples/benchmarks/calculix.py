"""Solved runs beside CalculiX: the same problem on the exported mesh of proved hexahedra.

    python examples/benchmarks/calculix.py out/bracket out/flange out/heatsink

Each argument is the output folder of `iga-nn run` or `iga-nn solve`. Its problem is written by the export to CalculiX
and solved by `ccx` (Debian: calculix-ccx), in a folder of its own under --work; what is there already is not solved
again. Displacements, or temperatures, are compared at all nodes of the mesh, and at their largest. Writes calculix.md;
copy it to results/ where it is to be kept.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import iga_nn
from iga_nn.io.calculix import Deck, write_calculix
from iga_nn.io.gmsh import values_at_nodes
from parameterize.arrays import Array
from parameterize.files import save_text

FIELDS = {3: "DISP", 1: "NDTEMP"}  # CalculiX's names, by the number of components
HEAD = (
    "| part | unknowns | seconds | elements | nodes | folded for ccx | seconds of ccx | largest | by ccx | difference "
    "| farthest apart at a node |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
)


@dataclass(frozen=True)
class Row:
    """Hold what is known of a part; shares are those of our largest value."""

    name: str
    unknowns: int
    seconds: float
    elements: int
    nodes: int
    folded: int
    seconds_ccx: float
    largest: float
    largest_ccx: float
    apart: float

    def text(self) -> str:
        """Return the row of the table."""
        share = self.largest_ccx / self.largest - 1.0
        return (
            f"| {self.name} | {self.unknowns:,} | {self.seconds:.0f} | {self.elements:,} | {self.nodes:,} "
            f"| {self.folded} | {self.seconds_ccx:.0f} | {self.largest:.5g} | {self.largest_ccx:.5g} "
            f"| {100 * share:+.2f} % | {100 * self.apart:.2f} % |"
        )


def values(path: Path, deck: Deck) -> Array:
    """Return the displacements (n, 3) or temperatures (n, 1) of a .frd file at the nodes of a deck, NaN elsewhere."""
    components, rows, inside = deck.forces.shape[1], [], False
    for line in path.read_text().splitlines():
        if line.startswith(" -4"):
            inside = line.split()[1] == FIELDS[components]
        elif line.startswith(" -3") and inside:
            break
        elif inside and line.startswith(" -1"):
            words = [line[i : i + 12] for i in range(13, 13 + 12 * components, 12)]
            rows.append([float(line[3:13]), *map(float, words)])
    table = np.array(rows)
    found = np.full((len(deck.numbers), components), np.nan)
    places = np.zeros(deck.numbers.max() + 1, dtype=np.int64)
    places[deck.numbers] = np.arange(len(deck.numbers))
    found[places[table[:, 0].astype(np.int64)]] = table[:, 1:]
    return found


def solved_by_ccx(folder: Path, name: str) -> str:
    """Run ccx in a folder, unless its answer is there, and return what it said."""
    said = folder / f"{name}.log"
    if not said.is_file():
        done = subprocess.run(
            [shutil.which("ccx") or "ccx", "-i", name], cwd=folder, capture_output=True, text=True, check=False
        )
        said.write_text(done.stdout + done.stderr)
    return said.read_text()


def compared(run: Path, work: Path) -> Row:
    """Return the row of a run."""
    solution = iga_nn.load_solution(run)
    sections = json.loads((run / "report.json").read_text()).values()
    level = next(one for one in sections if isinstance(one, dict) and "levels" in one)["levels"][-1]
    folder = work / run.name
    folder.mkdir(parents=True, exist_ok=True)
    deck = write_calculix(folder / f"{run.name}.inp", solution.geometry, solution.problem)
    said = solved_by_ccx(folder, run.name)
    used = deck.numbers > 0
    theirs, ours = values(folder / f"{run.name}.frd", deck)[used], values_at_nodes(deck.elements, solution)[used]
    sizes = [np.linalg.norm(one, axis=1) for one in (ours, theirs)]
    largest = float(sizes[0].max())
    took = re.search(r"Total CalculiX Time:\s*([\d.]+)", said)
    return Row(
        run.name,
        level["dofs"],
        sum(level["seconds"].get(step, 0.0) for step in ("setup", "solve")),
        len(deck.elements),
        int(used.sum()),
        said.count("nonpositive"),
        float(took[1]) if took else float("nan"),
        largest,
        float(sizes[1].max()),
        float(np.linalg.norm(ours - theirs, axis=1).max()) / largest,
    )


def main() -> None:
    """Compare the runs that are named, and write the table anew after each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--work", type=Path, default=Path("calculix"))
    parser.add_argument("--out", type=Path, default=Path("calculix.md"))
    given = parser.parse_args()
    rows: list[Row] = []
    for run in given.runs:
        rows.append(compared(run, given.work))
        print(rows[-1].text(), flush=True)
        save_text(given.out, HEAD + "\n".join(row.text() for row in rows) + "\n")


if __name__ == "__main__":
    main()
