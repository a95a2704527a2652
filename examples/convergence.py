"""Rates on one fixed curved map, refined exactly by knot insertion: degree p gives p + 1 in L2 and p in H1."""

from __future__ import annotations

import iga_nn
from solve.study import benchmark_volume


def main(degrees: tuple[int, ...] = (2, 3), levels: int = 4) -> dict[int, list[dict[str, float]]]:
    """Print a table for each degree, starting from 4 elements a direction, and return the rows."""
    problem = iga_nn.Poisson(exact="exp(x+z)*sin(y)")
    tables = {}
    for degree in degrees:
        print(f"degree {degree}")
        tables[degree] = list(iga_nn.convergence(benchmark_volume(4, degree=degree), problem, refine=range(levels)))
        for row in tables[degree]:
            print(row)
    return tables


if __name__ == "__main__":
    main()
