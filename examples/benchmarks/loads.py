"""Loads in total, fluids, and forces of the mass, beside formulas of textbooks.

    python examples/benchmarks/loads.py --out examples/benchmarks/results

The bodies have exact circles. Each row is one number: ours, that of the formula, and their difference relative to it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import processes
from rational_bodies import block, quarter_ring, round_bar

import iga_nn
from parameterize.arrays import Array
from parameterize.files import save_text
from solve import Solution

HEAD = ("case", "number", "ours", "formula", "difference")
YOUNG, RATIO, DENSITY = 210000.0, 0.3, 7.85e-9  # steel: MPa, t/mm³
STEEL = {"young": YOUNG, "poisson_ratio": RATIO}
QUICK = {"estimate": False, "tolerance": 1e-12}


@dataclass(frozen=True)
class Number:
    """One number of a case."""

    case: str
    what: str
    ours: float
    formula: float
    size: float | None = None  # of what the difference is relative to, where the formula says zero

    def cells(self) -> list[str]:
        """Return the cells of the table."""
        difference = abs(self.ours - self.formula) / (self.size or abs(self.formula))
        return [self.case, self.what, f"{self.ours:.9g}", f"{self.formula:.9g}", f"{difference:.1e}"]


def ring(inner: float, outer: float, height: float) -> iga_nn.Body:
    """Return a whole ring about z."""
    quarter = quarter_ring((inner, outer), height).patches[0]
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turns = (np.linalg.matrix_power(turn, number).T for number in range(4))
    return iga_nn.Body.from_patches([replace(quarter, control_points=quarter.control_points @ own) for own in turns])


def solved(body: iga_nn.Body, degree: int, refine: int, **data: object) -> Solution:
    """Return the solution of a body of steel, or of the material that is given."""
    return iga_nn.solve(body, iga_nn.Elasticity(**STEEL | data), degree=degree, refine=refine, **QUICK)


def stress_at(solution: Solution, place: tuple[float, float, float]) -> Array:
    """Return the stress (3, 3) at a place in the body."""
    owners, where = solution.body.locate([place])
    found: Array = solution.patches[owners[0]].quantity("stress", where)[0]
    return found


def shaft(degree: int, refine: int) -> Iterator[Number]:
    """Yield the twist of a round shaft, and the stress at its surface, under a moment (Saint-Venant)."""
    moment, length, radius = 2.0e5, 60.0, 10.0
    found = solved(
        round_bar(radius, radius, length), degree, refine, fix="nz < -0.99", moment={"nz > 0.99": (0, 0, moment)}
    )
    polar, shear = 0.5 * np.pi * radius**4, YOUNG / (2.0 * (1.0 + RATIO))
    name = "torsion of a shaft"
    yield Number(name, "moment of the load, N mm", found.report.balance.moments.load[2], moment)
    end = found.field.probe([[radius, 0.0, length]])[0]
    yield Number(name, "twist of the end", float(end[1]) / radius, moment * length / (shear * polar))
    stress = stress_at(found, (radius, 0.0, 0.5 * length))
    yield Number(name, "shear stress at the surface, MPa", float(stress[1, 2]), moment * radius / polar)


def lug(degree: int, refine: int) -> Iterator[Number]:
    """Yield the resultant of a pin's force in the bore of a ring, and the largest pressure."""
    force, radius, height = 500.0, 10.0, 8.0
    bore = f"x*x+y*y < {(1.01 * radius) ** 2} and nz*nz < 0.1"
    body = ring(radius, 2.0 * radius, height)
    problem = iga_nn.Elasticity(**STEEL, fix="nz < -0.99", bearing={bore: (0, -force, 0)})
    system = iga_nn.discretize(body, problem, degree=degree, refine=refine)
    load = system.solve(**QUICK).report.balance.load
    name = "bearing of a lug"
    yield Number(name, "force along the pin's, N", load[1], -force)
    yield Number(name, "force across, N", load[0], 0.0, force)
    facing = np.array([[0.0], [-radius], [0.5 * height]]), np.array([[0.0], [1.0], [0.0]])
    pressure = -system.problem.conditions[1].flux_at(problem, *facing)[1, 0]
    yield Number(name, "largest pressure, MPa", float(pressure), 2.0 * force / (np.pi * radius * height))


def spinning(degree: int, refine: int) -> Iterator[Number]:
    """Yield the stress around a long hollow cylinder that spins, held along its axis (plane strain)."""
    inner, outer, speed = 20.0, 60.0, 1000.0
    body = quarter_ring((inner, outer), 10.0)
    found = solved(
        body, degree, refine + 1, symmetry=["v0", "v1", "w0", "w1"], density=DENSITY, spin=((0, 0, speed), (0, 0, 0))
    )
    nu, pull = RATIO / (1.0 - RATIO), DENSITY * speed**2  # plane strain is plane stress with this ratio
    around = pull / 4.0 * ((3.0 + nu) * outer**2 + (1.0 - nu) * inner**2)
    stress = stress_at(found, (inner, 0.0, 5.0))
    yield Number("spinning cylinder", "stress around the bore, MPa", float(stress[1, 1]), around)


def hanging(degree: int, refine: int) -> Iterator[Number]:
    """Yield tip and stress of a bar under its own weight, without Poisson's effect."""
    length, gravity = 1000.0, 9810.0
    found = solved(
        block((0.0, -5.0, -5.0), (length, 5.0, 5.0)),
        degree,
        refine,
        roller=["u0", "v0", "w0"],
        density=DENSITY,
        gravity=(gravity, 0, 0),
        poisson_ratio=0.0,
    )
    name, weight = "bar under its weight", DENSITY * gravity
    yield Number(name, "weight, N", found.report.balance.load[0], weight * length * 100.0)
    tip = float(found.field.probe([[length, 0.0, 0.0]])[0, 0])
    yield Number(name, "displacement of the tip, mm", tip, weight * length**2 / (2.0 * YOUNG))
    stress = float(stress_at(found, (0.0, 0.0, 0.0))[0, 0])
    yield Number(name, "stress at the top, MPa", stress, weight * length)


def wall(degree: int, refine: int) -> Iterator[Number]:
    """Yield the resultant of water on a wall, and the height at which it acts."""
    weight, height, width = 9.81e-6, 3000.0, 1000.0
    body = block((0.0, 0.0, 0.0), (300.0, width, height))
    found = solved(body, degree, refine, fix="w0", hydrostatic={"u0": ((0, 0, -weight), (0, 0, height))})
    balance, name = found.report.balance, "wall that holds water"
    yield Number(name, "resultant, N", balance.load[0], 0.5 * weight * height**2 * width)
    yield Number(name, "height of the resultant, mm", balance.moments.load[1] / balance.load[0], height / 3.0)


def founded(degree: int, refine: int) -> Iterator[Number]:
    """Yield how far a block sinks into an elastic foundation under a force in total."""
    force, bedding, side, height = 1000.0, 0.5, 20.0, 40.0
    found = solved(
        block((0.0, 0.0, 0.0), (side, side, height)),
        degree,
        refine,
        foundation={"w0": bedding},
        roller=["u0", "v0"],
        total_force={"w1": (0, 0, -force)},
        poisson_ratio=0.0,
    )
    pressure = force / side**2
    sunk = float(found.field.probe([[0.5 * side, 0.5 * side, height]])[0, 2])
    yield Number("block on a foundation", "top, mm", sunk, -pressure / bedding - pressure * height / YOUNG)


CASES: dict[str, Callable[[int, int], Iterator[Number]]] = {
    "shaft": shaft,
    "lug": lug,
    "spinning": spinning,
    "hanging": hanging,
    "wall": wall,
    "founded": founded,
}


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table, and save it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=list(CASES), choices=CASES, help="cases")
    parser.add_argument("--degree", type=int, default=3)
    parser.add_argument("--refine", type=int, default=2)
    parser.add_argument("--out", type=Path, help="folder of loads.md")
    given = parser.parse_args(argv)
    numbers = [number for name in given.only for number in CASES[name](given.degree, given.refine)]
    text = processes.as_markdown(HEAD, [number.cells() for number in numbers])
    print(text)
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        save_text(given.out / "loads.md", text + "\n")


if __name__ == "__main__":
    main()
