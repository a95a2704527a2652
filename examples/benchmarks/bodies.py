"""Measure solves on bodies of many patches: iterations, and CPU time of an unknown beside one cube with the same law.

    python examples/benchmarks/bodies.py heatsink_volume.npz flange_volume.npz --out examples/benchmarks/results

Made bodies are rods of cubes and hexahedra of tetrahedra in a box; files are bodies of your own. Each body is held on
its lowest side where the data say so. The residual falls to 1e-8, on one thread.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
from processes import OneLineParser

import iga_nn
from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.files import save_text
from parameterize.spline.body import as_body
from solve import benchmark_volume

TOLERANCE, MOST = 1e-8, 1000
BOX = (4.0, 2.0, 1.0)
LOW = "nz < -0.99"  # the lowest side, by its normal
HEAD = ("body", "patches", "law", "level", "unknowns", "iterations", "set-up", "solve", "us an unknown", "of a cube")
Problem = iga_nn.Poisson | iga_nn.Elasticity


@dataclass(frozen=True)
class Solve:
    """One solve; seconds are CPU seconds."""

    patches: int
    unknowns: int
    iterations: int
    setup: float
    solve: float

    @property
    def each(self) -> float:
        """Return microseconds of an unknown, set-up and solve."""
        return 1e6 * (self.setup + self.solve) / self.unknowns


def laws(held: str) -> dict[str, Problem]:
    """Return the laws by name. held: the region or the face that is held."""
    elastic: dict[str, Any] = {"young": 1.0, "poisson_ratio": 0.3, "body_force": ("0", "0", "-1")}
    return {
        "Poisson": iga_nn.Poisson(source="1", value={held: "0"}),
        "exchange all round": iga_nn.Poisson(source="1", kappa=0.2, exchange={"z > -1e9": (5e-5, 25)}),
        "elasticity": iga_nn.Elasticity(**elastic, fix=held),
        "springs alone": iga_nn.Elasticity(**elastic, spring={held: 1e-3}),
    }


def rod(count: int, length: float) -> iga_nn.Body:
    """Return a rod of cubes, each so many times longer than it is thick."""

    def piece(i: int) -> iga_nn.BSplineVolume:
        return iga_nn.BSplineVolume.from_function(lambda u, v, w: (v, w, length * (i + u)), 6)

    return iga_nn.Body.from_patches([piece(i) for i in range(count)])


def hexahedra(count: int, degree: int) -> iga_nn.Body:
    """Return some four hexahedra for each of `count` tetrahedra in a bent box, one span each."""
    cells = max(1, round((count / 6.0 / np.prod(BOX)) ** (1.0 / 3.0)))
    rows = [np.linspace(0.0, side, round(side * cells) + 1) for side in BOX]
    points = np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1)
    corners = _tetrahedra(points.shape[:3])
    whole = points.reshape(-1, 3)
    patches = []
    for first in range(4):
        a, b, c = (k for k in range(4) if k != first)
        parts = [(), (c,), (b,), (b, c), (a,), (a, c), (a, b), (a, b, c)]
        eight = np.stack([whole[corners[:, (first, *part)]].mean(axis=1) for part in parts], axis=1)
        for one in eight.reshape(-1, 2, 2, 2, 3):
            patches.append(iga_nn.BSplineVolume.from_function(_bent(one), degree + 1, degree=degree))
    return iga_nn.Body.from_patches(patches)


def _tetrahedra(shape: tuple[int, ...]) -> np.ndarray:
    """Return the corners (k, 4) of six tetrahedra a cell of a grid of points."""
    numbers = np.arange(np.prod(shape)).reshape(shape)
    found = []
    for order in permutations(range(3)):
        offsets = np.cumsum([np.zeros(3, dtype=int), *np.eye(3, dtype=int)[list(order)]], axis=0)
        ends = [tuple(slice(o, n - 1 + o) for o, n in zip(offset, shape, strict=True)) for offset in offsets]
        found.append(np.stack([numbers[end].ravel() for end in ends], axis=1))
    return np.concatenate(found)


def _bent(corners: np.ndarray) -> Callable[..., tuple[np.ndarray, ...]]:
    """Return the map of the trilinear cell of corners (2, 2, 2, 3), bent as the whole box is."""

    def place(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, ...]:
        along = (np.stack([1.0 - t, t]) for t in (u, v, w))
        x, y, z = np.einsum("i...,j...,k...,ijkx->x...", *along, corners)
        return x, y + 0.1 * np.sin(x), z

    return place


def solved(body: iga_nn.Body | iga_nn.BSplineVolume, law: Problem, refine: int) -> Solve:
    """Return the numbers of one solve."""
    start = time.process_time()
    system = iga_nn.discretize(body, law, refine=refine, threads=1)
    middle = time.process_time()
    found = conjugate_gradients(system.product, system.right, system.precondition, TOLERANCE, MOST)
    end = time.process_time()
    return Solve(len(as_body(body)), system.right.size, found.iterations, middle - start, end - middle)


def rows(bodies: dict[str, iga_nn.Body], levels: int) -> Iterator[tuple[str, ...]]:
    """Yield the rows of the table. A law runs once before it is measured, for compiled code."""
    for (law_name, law), of_cube in zip(laws(LOW).items(), laws("w0").values(), strict=True):
        solved(benchmark_volume(4), of_cube, 0)
        for name, body in bodies.items():
            for level in range(levels):
                own = solved(body, law, level)
                spans = max(2, round((own.unknowns / (3 if isinstance(law, iga_nn.Elasticity) else 1)) ** (1 / 3)) - 3)
                cube = solved(benchmark_volume(spans), of_cube, 0)
                counts = [str(own.patches), law_name, str(level), f"{own.unknowns:,}", str(own.iterations)]
                times = [f"{own.setup:.1f} s", f"{own.solve:.1f} s", f"{own.each:.0f}", f"{own.each / cube.each:.1f}"]
                yield name, *counts, *times


def main() -> None:
    """Print the table, and write it where --out names a folder."""
    parser = OneLineParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path, help="volume.npz of bodies")
    parser.add_argument("--hexahedra", type=int, nargs="*", default=[656], help="numbers of tetrahedra")
    parser.add_argument("--degree", type=int, default=3)
    parser.add_argument("--levels", type=int, default=1)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    bodies = {file.stem.removesuffix("_volume"): as_body(iga_nn.load_volume(file)) for file in given.files}
    bodies["rod 100 : 1"] = rod(10, 10.0)
    bodies |= {f"hexahedra, degree {given.degree}": hexahedra(count, given.degree) for count in given.hexahedra}
    table = ["| " + " | ".join(HEAD) + " |", "| " + " | ".join(["---"] * len(HEAD)) + " |"]
    for row in rows(bodies, given.levels):
        table.append("| " + " | ".join(row) + " |")
        print(table[-1], flush=True)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    table += ["", f"Peak memory of the whole run: {peak:.0f} MB."]
    if given.out:
        given.out.mkdir(parents=True, exist_ok=True)
        save_text(given.out / "bodies.md", "\n".join(table) + "\n")


if __name__ == "__main__":
    main()
