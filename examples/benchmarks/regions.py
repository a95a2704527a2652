"""Measure what data on regions cost beside data on whole faces of the cube: errors, rates, iterations, points, seconds.

A manufactured solution of Poisson's equation: its values on a region, its flux on all else of the boundary.

    python examples/benchmarks/regions.py volume.npz --levels 2
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import iga_nn
from iga_nn.report.document import plain

WHOLE = "u0 or u1 or v0"  # held by the trial space itself
REGIONS = (WHOLE, "Z < 0", "X < 0 and Y > Z", "nz > 0.5", "X*X + Y*Y + Z*Z < 0.3", "nx > 0.9 and Z > 0.1", "X > -9")
EXACT = "exp(X+Z)*sin(Y)"


def measured(volume: iga_nn.BSplineVolume, region: str, level: int) -> dict[str, float]:
    """Of one solve: relative L2 error, iterations, points on regions, seconds of setup and solve."""
    start = time.perf_counter()
    system = iga_nn.discretize(volume, iga_nn.Poisson(exact=EXACT, value=region), refine=level)
    ready = time.perf_counter()
    report = system.solve().report
    return {
        "l2": report.l2_relative,
        "iterations": report.iterations,
        "points": sum(len(face.weights) for face in system.matrix.weak),
        "area": sum(face.weights[face.holds(0)].sum() for face in system.matrix.weak),
        "setup": ready - start,
        "solve": time.perf_counter() - ready,
    }


def main() -> None:
    """Print a row for each region and level, with the rate, and iterations over those of whole faces."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("volume", type=Path)
    parser.add_argument("--levels", type=int, default=2)
    given = parser.parse_args()
    volume, whole = iga_nn.load_volume(given.volume), {}
    print("| region | level | relative L2 | rate | iterations | over whole faces | points | setup s | solve s |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for region in REGIONS:
        before = None
        for level in range(given.levels):
            row = plain(measured(volume, region, level))
            whole.setdefault(level, row["iterations"])
            rate = "" if before is None else f"{np.log2(before / row['l2']):.2f}"
            before, ratio = row["l2"], row["iterations"] / whole[level]
            cells = f"{row['l2']:.3e} | {rate} | {row['iterations']} | {ratio:.2f} | {row['points']}"
            print(f"| `{region}` | {level} | {cells} | {row['setup']:.1f} | {row['solve']:.1f} |", flush=True)


if __name__ == "__main__":
    main()
