"""Compiles, in two processes, the kernels of a usual run ahead of the first one: `python -m iga_nn.compile_kernels`."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import iga_nn


def train_and_certify() -> None:
    """Map a body with the network."""
    _map("network")


def solve_and_grow() -> None:
    """Solve on a volume, with all that a report tells of a solution; then map a body without the network.

    By then the other process has compiled most of what both maps need.
    """
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u + 2 * v + v * w, v, w))
    iga_nn.certify(volume)
    solution = iga_nn.solve(volume, iga_nn.Poisson(exact="exp(X+Z)*sin(Y)"), refine=1)
    solution.all_extremes()
    _map("growth")


def _map(way: str) -> None:
    """Map a body as coarsely as possible; the map need not be certified."""
    config = iga_nn.preset("fast").scaled(0.02).with_control_points(8)
    config = replace(config, spline=replace(config.spline, rounds=2), refinement=None, blocks=1)
    iga_nn.parameterize(iga_nn.sample("bean"), config, ways=way)


def main() -> None:
    """Run both."""
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        for done in [pool.submit(train_and_certify), pool.submit(solve_and_grow)]:
            done.result()


if __name__ == "__main__":
    main()
