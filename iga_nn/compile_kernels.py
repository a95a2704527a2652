"""Compiles the kernels of a usual run ahead of the first one: `python -m iga_nn.compile_kernels`.

It does so in two processes. `network` or `growth` after the command names one of the two alone: `growth` needs few
packages and no torch, so `make` runs it while pip installs the others.
"""

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import iga_nn

from .cli import BAD_INPUT


def network() -> None:
    """Map a body with the network."""
    _map("network")


def growth() -> None:
    """Solve on a volume, with all that a report tells of a solution; then map a body without the network."""
    volume = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u + 2 * v + v * w, v, w))
    iga_nn.certify(volume)
    solution = iga_nn.solve(volume, iga_nn.Poisson(exact="exp(X+Z)*sin(Y)"), refine=1)
    solution.all_extremes()
    _map("growth")


PARTS = {"network": network, "growth": growth}


def _map(way: str) -> None:
    """Map a body as coarsely as possible; the map need not be certified."""
    config = iga_nn.preset("fast").scaled(0.02).with_control_points(8)
    config = replace(config, spline=replace(config.spline, rounds=2), refinement=None, blocks=1)
    iga_nn.parameterize(iga_nn.sample("bean"), config, ways=way)


def main(names: Sequence[str]) -> None:
    """Run the named parts, by default both, each in a process of its own."""
    if unknown := [name for name in names if name not in PARTS]:
        sys.stderr.write(f"compile_kernels: unknown part {unknown[0]!r}; the parts are {', '.join(PARTS)}\n")
        sys.exit(BAD_INPUT)
    with ProcessPoolExecutor(len(PARTS), mp_context=get_context("spawn")) as pool:
        for done in [pool.submit(PARTS[name]) for name in names or PARTS]:
            done.result()


if __name__ == "__main__":
    main(sys.argv[1:])
