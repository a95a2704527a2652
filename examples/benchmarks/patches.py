"""Measure what several patches cost: iterations beside one patch, and the time of an unknown in an iteration.

Bodies of unit cubes glued in a grid, and a ring of one patch glued to itself. The right-hand side has no pattern, and
the residual falls to 1e-10.

    python examples/benchmarks/patches.py --out examples/benchmarks/results
"""

from __future__ import annotations

import argparse
import time
from itertools import product
from pathlib import Path

import numpy as np

import iga_nn
from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.files import save_text

EXACT = "exp(X+Z)*sin(Y)"
ROUNDS = 20  # of a product and a preconditioner; the shortest counts
HEAD = "| body | patches | spans | unknowns | data | iterations | of its first patch alone | time of an unknown |"
FREE = ("u0", "u1", "v1", "w0", "w1")
GRID = list(product(range(3), repeat=3))
PLATE = [(i, j, 0) for i, j, k in GRID if k == 0 and (i, j) != (1, 1)]
FRAME = [cell for cell in GRID if cell.count(1) < 2]


def cubes(cells: list[tuple[int, ...]], spans: int) -> iga_nn.Body:
    """Return unit cubes at whole places, glued where they touch."""

    def cube(cell: tuple[int, ...]) -> iga_nn.BSplineVolume:
        x, y, z = cell
        return iga_nn.BSplineVolume.from_function(lambda u, v, w: (x + u, y + v, z + w), spans + 3)

    return iga_nn.Body.from_patches([cube(cell) for cell in cells])


def ring(spans: int) -> iga_nn.Body:
    """Return a ring of radii 1 and 2 of one patch."""

    def place(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, ...]:
        return (1.0 + v) * np.cos(2.0 * np.pi * u), (1.0 + v) * np.sin(2.0 * np.pi * u), w

    counts = (2 * spans + 3, spans // 2 + 3, spans // 2 + 3)
    return iga_nn.Body.from_patches([iga_nn.BSplineVolume.from_function(place, counts)])


def measured(body: iga_nn.Body | iga_nn.BSplineVolume, law: iga_nn.Poisson) -> tuple[int, int, float]:
    """Return unknowns, iterations, and CPU nanoseconds of an unknown for a product and a preconditioner, one thread."""
    system = iga_nn.discretize(body, law, threads=1)
    right = np.random.default_rng(0).uniform(-1.0, 1.0, system.right.shape)
    found = conjugate_gradients(system.product, right, system.precondition, 1e-10, 500)
    seconds = []
    for _ in range(ROUNDS):
        start = time.process_time()
        system.precondition(system.product(right))
        seconds.append(time.process_time() - start)
    return right.size, found.iterations, 1e9 * min(seconds) / right.size


def held_at(body: iga_nn.Body, face: str) -> dict[str, None]:
    """Return the exact flux as data of all outer faces but one."""
    names = [f"p{i}_{name}" for i, faces in enumerate(body.outer) for name in faces]
    return {name: None for name in names if name != face}


def rows() -> list[str]:
    """Return the rows of the table."""
    found = []
    bodies = {"two cubes": (cubes, [(0, 0, 0), (1, 0, 0)], (8, 16)), "plate with a hole": (cubes, PLATE, (8, 16))}
    bodies |= {"frame of genus 5": (cubes, FRAME, (6, 12)), "ring": (ring, None, (16, 32))}
    for name, (make, cells, sizes) in bodies.items():
        for spans in sizes:
            body = make(spans) if cells is None else make(cells, spans)
            alone = body.patches[0]  # of the ring the cube that is not glued
            laws = {"all faces held": ({}, {}), "one face held": (held_at(body, "p0_v0"), dict.fromkeys(FREE))}
            for data, (natural, single) in laws.items():
                count, iterations, each = measured(body, iga_nn.Poisson(exact=EXACT, neumann=natural))
                _, of_one, each_of_one = measured(alone, iga_nn.Poisson(exact=EXACT, neumann=single))
                found.append(
                    f"| {name} | {len(body)} | {spans} | {count:,} | {data} | {iterations} | {of_one} | "
                    f"{each:.0f} ns, {each / each_of_one:.2f} times that of the patch |"
                )
                print(found[-1], flush=True)
    return found


def main() -> None:
    """Print the table, and write it where --out names a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    print(HEAD)
    table = [HEAD, "| " + " | ".join(["---"] * 8) + " |", *rows()]
    if given.out:
        given.out.mkdir(parents=True, exist_ok=True)
        save_text(given.out / "patches.md", "\n".join(table) + "\n")


if __name__ == "__main__":
    main()
