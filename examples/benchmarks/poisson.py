"""Time and accuracy of the solver on the twisted cube: -Laplace u = f, u = exp(x+z) sin(y), tricubic splines.

    OMP_NUM_THREADS=1 python examples/benchmarks/poisson.py 16 27 40 64

Seconds are process CPU seconds, without the compilation of the kernels.
"""

from __future__ import annotations

import argparse

from solve import Poisson, benchmark_volume, solve_poisson


def main(sizes: list[int], degree: int = 3) -> None:
    """Print one line per number of elements a direction."""
    problem = Poisson(exact="exp(x+z)*sin(y)")
    print(f"{'n':>4} {'dofs':>8} {'L2':>11} {'iterations':>10} {'setup':>7} {'solve':>7} {'errors':>7}")
    for n in sizes:
        report = solve_poisson(benchmark_volume(n, degree), problem).report
        setup, solve, errors = (report.seconds[part] for part in ("setup", "solve", "errors"))
        print(f"{n:4} {report.dofs:8} {report.l2:11.4e} {report.iterations:10} {setup:7.2f} {solve:7.2f} {errors:7.2f}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", type=int, nargs="*", default=[16, 27, 40, 64], help="elements a direction")
    parser.add_argument("--degree", type=int, default=3)
    arguments = parser.parse_args()
    main(arguments.sizes, arguments.degree)
