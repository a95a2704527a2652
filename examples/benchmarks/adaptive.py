"""Compares refinement where it counts with uniform refinement: L-shaped body, Fichera corner, fillet under bending.

    OMP_NUM_THREADS=1 python examples/benchmarks/adaptive.py [case ...]

prints the tables of examples/benchmarks/results/adaptive.md. Errors of manufactured solutions are integrated with p + 3
Gauss points a span, and spans that touch the singular edges are cut towards them. Rates are orders in unknowns^(1/3)
between the second row and the last one: smooth solutions have p in the energy norm and p + 1 in L2, in the plane 1.5
times as much. Seconds are those of all steps together.
"""

import math
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

import iga_nn
from parameterize.arrays import Array
from parameterize.spline.bspline import apply_along, collocation
from solve import Solution

CUTS = 5  # of spans that touch an edge, each to a fifth


def box(corner: tuple[float, ...]) -> iga_nn.BSplineVolume:
    """Return the unit cube at a corner."""
    x, y, z = corner
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (u + x, v + y, w + z), 2, 1)


class LShape:
    """Solve for r^(2/3) sin(2 t / 3) exp(z / 2) around the re-entrant edge x = y = 0; the degree of z is free."""

    title = "L-shaped body, r^(2/3) sin(2t/3) exp(z/2)"
    slope = 0.5

    @property
    def body(self) -> iga_nn.Body:
        """Return three cubes around the edge."""
        return iga_nn.Body.from_patches([box(corner) for corner in ((-1, 0, 0), (-1, -1, 0), (0, -1, 0))])

    def _polar(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        angle = np.arctan2(y, x)
        angle = np.where(angle < 0.5 * np.pi - 1e-9, angle + 2.0 * np.pi, angle)
        return np.hypot(x, y), angle, np.clip(angle - 0.5 * np.pi, 0.0, 1.5 * np.pi) * 2.0 / 3.0

    def exact(self, x: Array, y: Array, z: Array) -> Array:
        """Return u."""
        r, _, t = self._polar(x, y)
        return np.asarray(r ** (2 / 3) * np.sin(t) * np.exp(self.slope * z))

    def source(self, x: Array, y: Array, z: Array) -> Array:
        """Return -Laplace u."""
        return -(self.slope**2) * self.exact(x, y, z)

    def gradient(self, x: Array, y: Array, z: Array) -> Array:
        """Return the gradient (3, ...)."""
        r, angle, t = self._polar(x, y)
        along = 2.0 / 3.0 * r ** (-1 / 3) * np.exp(self.slope * z)
        return np.array(
            [
                along * (np.sin(t) * np.cos(angle) - np.cos(t) * np.sin(angle)),
                along * (np.sin(t) * np.sin(angle) + np.cos(t) * np.cos(angle)),
                self.slope * self.exact(x, y, z),
            ]
        )


class Plane(LShape):
    """Solve the same without z."""

    title = "L-shaped body, r^(2/3) sin(2t/3)"
    slope = 0.0


class Fichera:
    """Solve for the sum of the roots of the distances to three edges that meet at a corner."""

    title = "Fichera corner, roots of the distances to its edges"

    @property
    def body(self) -> iga_nn.Body:
        """Return seven of eight cubes."""
        return iga_nn.Body.from_patches([box(corner) for corner in product((-1, 0), repeat=3) if corner != (0, 0, 0)])

    def _squares(self, *x: Array) -> Iterator[tuple[int, Array, Array]]:
        for axis in range(3):
            behind = np.minimum(x[axis], 0.0)
            yield axis, behind, x[axis - 1] ** 2 + x[axis - 2] ** 2 + behind**2

    def exact(self, *x: Array) -> Array:
        """Return u."""
        return np.asarray(sum(square**0.25 for _, _, square in self._squares(*x)))

    def source(self, *x: Array) -> Array:
        """Return -Laplace u."""
        return np.asarray(
            -sum(np.where(x[axis] > 0.0, 0.25, 0.75) * square**-0.75 for axis, _, square in self._squares(*x))
        )

    def gradient(self, *x: Array) -> Array:
        """Return the gradient (3, ...)."""
        found = np.zeros((3, *x[0].shape))
        for axis, behind, square in self._squares(*x):
            found[axis] += 0.5 * square**-0.75 * behind
            for other in (axis - 1, axis - 2):
                found[other] += 0.5 * square**-0.75 * x[other]
        return found


def errors(case: Any, solution: Solution) -> tuple[float, float]:
    """Return the relative errors of a solution in the energy norm and in L2."""
    sums = np.zeros(4)
    for patch in solution.patches:
        low, degree = patch.geometry.control_points[0, 0, 0], patch.degrees[0]
        rows = [_rule(np.unique(knots), start, degree + 3) for knots, start in zip(patch.knots, low, strict=True)]
        (u, v, w), weights = zip(*rows, strict=True)
        for part in np.array_split(np.arange(len(u)), max(1, len(u) * len(v) * len(w) // 500_000)):
            places = [u[part], v, w]
            measure = np.einsum("i,j,k->ijk", weights[0][part], weights[1], weights[2])
            x = np.meshgrid(*(row + start for row, start in zip(places, low, strict=True)), indexing="ij")
            values, slopes = _spline(patch, places, None), [_spline(patch, places, axis) for axis in range(3)]
            exact, gradient = case.exact(*x), case.gradient(*x)
            squares = (gradient - slopes) ** 2, gradient**2, (exact - values) ** 2, exact**2
            sums += [float((square * measure).sum()) for square in squares]
    return math.sqrt(sums[0] / sums[1]), math.sqrt(sums[2] / sums[3])


def _rule(breaks: Array, start: float, count: int) -> tuple[Array, Array]:
    """Return Gauss points and weights of a direction of a unit cube; an end at the edges' coordinate 0 is cut."""
    cuts = 0.2 ** np.arange(CUTS, 0, -1)
    low, high = breaks[1] * cuts, 1.0 - (1.0 - breaks[-2]) * cuts
    breaks = np.unique(np.append(breaks, low if start == 0.0 else high if start == -1.0 else ()))
    nodes, weights = np.polynomial.legendre.leggauss(count)
    half = np.diff(breaks)[:, None] / 2.0
    return ((breaks[:-1] + breaks[1:])[:, None] / 2.0 + half * nodes).ravel(), (half * weights).ravel()


def _spline(patch: Any, places: list[Array], axis: int | None) -> Array:
    """Return the values, or slopes along an axis, of a solution on a tensor grid."""
    found = patch.coefficients
    for own, (knots, degree, row) in enumerate(zip(patch.knots, patch.degrees, places, strict=True)):
        found = apply_along(collocation(knots, degree, row, int(own == axis)), found, own)
    return np.asarray(found)


@dataclass
class Row:
    """Hold one solve: its name, unknowns, seconds of all solves up to it, and two numbers."""

    name: str
    unknowns: int
    seconds: float
    first: float
    second: float


def manufactured(case: Any, degree: int, levels: int, most: float) -> Iterator[Row]:
    """Yield uniform and adaptive solves of a manufactured solution with their errors."""
    problem = iga_nn.Poisson(exact=case.exact, source=case.source, boundary=case.exact)
    how: dict[str, Any] = {"degree": degree, "threads": 1, "tolerance": 1e-9, "estimate": False}
    for level in range(levels):
        start = time.perf_counter()
        solution = iga_nn.solve(case.body, problem, refine=level, **how)
        yield Row("uniform", solution.report.dofs, time.perf_counter() - start, *errors(case, solution))
    total = 0.0
    for step in iga_nn.adaptive(case.body, problem, 1e-7, max_unknowns=most, **how).steps:
        total += sum(step.seconds.values())
        yield Row("adaptive", step.solution.report.dofs, total, *errors(case, step.solution))


def fillet_body(thick: float = 0.3, radius: float = 0.05, depth: float = 0.2) -> iga_nn.Body:
    """Return two legs of length 1 that meet in a fillet, in four exact blocks."""
    corner, reach = thick + radius, np.tan(np.pi / 8) * radius
    middle = corner - radius * math.sqrt(0.5)
    weight = math.cos(np.pi / 8)

    def block(low: Any, high: Any, middle_weight: float) -> iga_nn.BSplineVolume:
        points, weights = np.zeros((3, 2, 2, 3)), np.ones((3, 2, 2))
        for side, row in enumerate((low, high)):
            points[:, side, :, :2] = np.array(row, dtype=float)[:, None]
        points[:, :, 1, 2] = depth
        weights[1, 1] = middle_weight
        line = np.array([0.0, 0.0, 1.0, 1.0])
        return iga_nn.BSplineVolume((2, 1, 1), (np.array([0, 0, 0, 1.0, 1, 1]), line, line), points, weights)

    def line(a: Any, b: Any) -> list[Any]:
        return [a, (np.add(a, b)) / 2.0, b]

    below, beside, on_arc = (corner, thick), (thick, corner), (middle, middle)
    return iga_nn.Body.from_patches(
        [
            block(line((0, 0), (corner, 0)), [on_arc, (corner - reach, thick), below], weight),
            block(line((0, corner), (0, 0)), [beside, (thick, corner - reach), on_arc], weight),
            block(line((corner, 0), (1, 0)), line(below, (1, thick)), 1.0),
            block(line((0, 1), (0, corner)), line((thick, 1), beside), 1.0),
        ]
    )


def fillet(degree: int, levels: int, most: float) -> Iterator[Row]:
    """Yield uniform and adaptive solves of the fillet: the peak, and half of the interval's width."""
    body = fillet_body()
    problem = iga_nn.Elasticity(fix="p2_u1", load={"p3_u0": (1.0, 0.0, 0.0)})
    how: dict[str, Any] = {"degree": degree, "threads": 1, "tolerance": 1e-8, "estimate": False}
    for level in range(1, levels):
        start = time.perf_counter()
        solution = iga_nn.solve(body, problem, refine=level, **how)
        seconds = time.perf_counter() - start
        yield Row("uniform", solution.report.dofs, seconds, _peak(solution), math.nan)
    total, ask = 0.0, "von_mises max over x < 0.5 and y < 0.5"
    for step in iga_nn.adaptive(body, problem, 0.01, ask=ask, max_unknowns=most, **how).steps:
        total += sum(step.seconds.values())
        (answer,) = step.solution.answers
        half = (answer.width or math.nan) * abs(answer.value)
        yield Row("adaptive", step.solution.report.dofs, total, answer.value, half)


def _peak(solution: Solution) -> float:
    """Return the largest von Mises stress on the fillet."""
    u, w = np.linspace(0.0, 1.0, 201), np.linspace(0.0, 1.0, 41)
    return max(float(solution.patches[i].quantity_grid("von_mises", u, [1.0], w).max()) for i in (0, 1))


def table(title: str, names: tuple[str, str], rows: Iterator[Row], is_rated: bool) -> None:
    """Print the rows as they come, then the rates of both ways."""
    print(
        f"\n{title}\n\n| spans | unknowns | {names[0]} | {names[1]} | seconds |\n| --- | --- | --- | --- | --- |",
        flush=True,
    )
    found: list[Row] = []
    for row in rows:
        found.append(row)
        numbers = f"{row.first:.3g} | {row.second:.2g}" if is_rated else f"{row.first:.2f} | {row.second:.2f}"
        print(f"| {row.name} | {row.unknowns:,} | {numbers} | {row.seconds:.1f} |".replace("nan", ""), flush=True)
    for name in ("uniform", "adaptive") if is_rated else ():
        first, last = (own := [row for row in found if row.name == name])[1], own[-1]
        size = math.log(last.unknowns / first.unknowns) / 3.0
        pairs = (first.first, last.first), (first.second, last.second)
        said = [f"{math.log(a / b) / size:.2f}" for a, b in pairs]
        print(f"\nrates, {name}: {said[0]} and {said[1]}", flush=True)


ERRORS = ("energy error", "L2 error")
CASES: dict[str, Callable[[], None]] = {
    **{
        f"{name}{degree}": (
            lambda case=case, degree=degree, most=most: table(
                f"{case.title}, degree {degree}", ERRORS, manufactured(case, degree, 4, most), True
            )
        )
        for name, case, most in (("plane", Plane(), 2e4), ("l", LShape(), 4e4), ("fichera", Fichera(), 6e4))
        for degree in (2, 3)
    },
    "fillet": lambda: table("Fillet, degree 2", ("peak von Mises", "half interval"), fillet(2, 5, 2e5), False),
}

if __name__ == "__main__":
    for name in sys.argv[1:] or CASES:
        CASES[name]()
