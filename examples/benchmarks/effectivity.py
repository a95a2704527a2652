"""Intervals of asked quantities beside what finer spaces say: how wide they are, and how many hold the truth.

    OMP_NUM_THREADS=1 python examples/benchmarks/effectivity.py
    python examples/benchmarks/effectivity.py --cases bar edge --degrees 2

Every case is solved on a coarse mesh. The truth is the same quantity of a solution of degree 5 or 6 on a finer mesh,
where it is singular on spans that are graded to the edges. `over error` is half of the interval's width over the error.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import numpy as np
from processes import as_markdown

import iga_nn
from iga_nn import Body, BSplineVolume, Elasticity, Grading, Poisson
from parameterize.spline.body import BodyLike
from solve import benchmark_volume
from solve.ask import Ask
from solve.asked.functional import functional
from solve.forms.boundary_value_problem import BoundaryValueProblem

WAVE = "exp(x)*sin(y)+z*z*y"
TWIST = ("exp(x/3)*sin(y)", "cos(x*z/3)", "x*y*z/9+sin(z)")
HALVINGS = 4  # of spans at singular edges, for the truth
ROUNDING = 1e-7  # share of the value: smaller errors vanish by chance, or are those of the truth
HEADINGS = ("case", "degree", "quantity", "value", "truth", "interval", "over error", "inside")


def box(low: Sequence[float], size: Sequence[float], spans: Sequence[int], degree: int) -> BSplineVolume:
    """A box with its least corner, its size and its spans."""
    (x, y, z), (a, b, c) = low, size
    counts = tuple(n + degree for n in spans)
    return BSplineVolume.from_function(lambda u, v, w: (x + a * u, y + b * v, z + c * w), counts, degree)


def halves(degree: int, spans: int = 2) -> Body:
    """Two cubes along x."""
    return Body.from_patches([box((i, 0, 0), (1, 1, 1), (spans,) * 3, degree) for i in (0, 1)])


def edge(degree: int) -> Body:
    """Three cubes around a reentrant edge at x = y = 1."""
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0))
    return Body.from_patches([box(corner, (1, 1, 1), (2, 2, 1), degree) for corner in corners])


def arch(degree: int) -> Body:
    """A quarter ring of two patches."""

    def part(number: int) -> BSplineVolume:
        def place(u: Any, v: Any, w: Any) -> Any:
            angle = 0.25 * np.pi * (number + u)
            return (1.0 + v) * np.cos(angle), (1.0 + v) * np.sin(angle), w

        return BSplineVolume.from_function(place, (3 + degree, 2 + degree, 1 + degree), degree)

    return Body.from_patches([part(0), part(1)])


def tetrahedron(degree: int) -> Body:
    """The four hexahedra of a tetrahedron, of one span each."""
    corners = np.array([(0, 0, 0), (1.2, 0.1, 0), (0.2, 1.1, 0.1), (0.1, 0.3, 1.3)], dtype=float)

    def part(number: int) -> BSplineVolume:
        order = np.roll(np.arange(4), -number)
        order = order if number % 2 == 0 else order[[0, 2, 1, 3]]
        a, b, c, d = corners[order]
        net = np.empty((2, 2, 2, 3))
        for i, j, k in np.ndindex(2, 2, 2):
            chosen = [a, *(corner for corner, one in ((b, i), (c, j), (d, k)) if one)]
            net[i, j, k] = np.mean(chosen, axis=0)
        linear = BSplineVolume.uniform(net, 1)
        return BSplineVolume.from_function(
            lambda u, v, w: np.moveaxis(linear(np.stack([u, v, w], axis=-1).reshape(-1, 3)), -1, 0).reshape(
                3, *u.shape
            ),
            1 + degree,
            degree,
        )

    return Body.from_patches([part(number) for number in range(4)])


def corner_function(x: Any, y: Any, z: Any) -> Any:
    """U = r^(2/3) sin(2 t / 3) around the reentrant edge."""
    angle = np.arctan2(y - 1.0, x - 1.0)
    angle = np.clip(np.where(angle <= 1e-14, angle + 2.0 * np.pi, angle) - 0.5 * np.pi, 0.0, 1.5 * np.pi)
    return ((x - 1.0) ** 2 + (y - 1.0) ** 2) ** (1.0 / 3.0) * np.sin(2.0 * angle / 3.0)


@dataclass(frozen=True)
class Case:
    """A body by its degree, a problem, what is asked, and how the truth is found.

    sharp: whether the truth needs spans graded to the ends of patches; `refine` is its number of halvings.
    """

    body: Callable[[int], BodyLike]
    problem: BoundaryValueProblem
    ask: Sequence[str]
    refine: int = 1
    degree: int = 5
    sharp: bool = False
    how: dict[str, Any] = field(default_factory=dict)


PULLED = {"fix": "u0", "load": {"u1": (0.1, 0.0, -1.0)}}
BENT = (
    "uz at (3, 0.5, 0.5)", "ux at (1.1, 0.4, 0.3)", "von_mises at (1.1, 0.4, 0.3)", "stress_xx at (2, 0.3, 0.8)",
    "von_mises max over x > 2", "mean uz over u1", "mean stress_xx over x > 2", "energy",
)  # fmt: skip
SCALAR = (
    "u at (0.43, 0.37, 0.61)", "gradient_x at (0.43, 0.37, 0.61)", "gradient_z at (0.7, 0.5, 0.3)", "mean u", "energy",
    "u max over x < 0.5", "integral u over y > 0.5",
)  # fmt: skip
VECTOR = (
    "ux at (0.43, 0.37, 0.61)", "uz at (0.7, 0.5, 0.3)", "von_mises at (0.43, 0.37, 0.61)",
    "stress_xx at (0.7, 0.5, 0.3)", "mean von_mises", "energy", "von_mises max",
)  # fmt: skip
INSIDE = ("u at (0.25, 0.25, 0.2)", "gradient_x at (0.25, 0.25, 0.2)", "mean u", "energy", "u max")
STRESSED = ("ux at (0.25, 0.25, 0.2)", "von_mises at (0.25, 0.25, 0.2)", "mean von_mises", "energy")
NEAR = ("u at (0.43, 0.37, 0.6)", "u at (0.8, 0.85, 0.3)", "gradient_x at (1.6, 0.3, 0.4)", "mean u", "energy")
CURVED = ("u at (1.3, 0.4, 0.6)", "gradient_y at (0.5, 1.5, 0.3)", "mean u", "energy", "flow over p0_u0")
BAR = ((0, 0, 0), (3, 1, 1), (4, 2, 2))
CASES = {
    "twisted cube, Poisson": Case(lambda p: benchmark_volume(3, p), Poisson(exact=WAVE), SCALAR),
    "twisted cube, elastic": Case(lambda p: benchmark_volume(3, p), Elasticity(exact=TWIST), VECTOR),
    "two cubes, elastic": Case(halves, Elasticity(exact=TWIST), VECTOR),
    "two materials": Case(halves, Poisson(source="1+x*y", kappa={0: 1.0, 1: 50.0}), SCALAR, 0, 4, sharp=True),
    "arch, Poisson": Case(arch, Poisson(source="y", boundary="x*y"), CURVED, 1, 6),
    "hexahedra, Poisson": Case(tetrahedron, Poisson(exact=WAVE), INSIDE, 1, 6),
    "hexahedra, elastic": Case(tetrahedron, Elasticity(exact=TWIST), STRESSED, 1, 6),
    "reentrant edge": Case(
        edge, Poisson(exact=corner_function, source="0", boundary=corner_function), NEAR, 0, 4, sharp=True
    ),
    "clamped bar": Case(lambda p: box(*BAR, p), Elasticity(**PULLED), BENT, 0, 4, sharp=True),
    "clamped bar, refined": Case(
        lambda p: box(*BAR, p), Elasticity(**PULLED), BENT, 0, 4, sharp=True, how={"refine": 1}
    ),
    "nearly incompressible bar": Case(
        lambda p: box(*BAR, p), Elasticity(poisson_ratio=0.49, **PULLED), BENT, 0, 4, sharp=True
    ),
}


@dataclass(frozen=True)
class Row:
    """A quantity of a case."""

    case: str
    degree: int
    answer: iga_nn.Answer
    truth: float

    @property
    def over_error(self) -> float:
        """Half of the interval's width over the error."""
        return 0.5 * (self.answer.upper - self.answer.lower) / abs(self.truth - self.answer.value)

    @property
    def is_inside(self) -> bool:
        """Whether the interval holds the truth."""
        return bool(self.answer.lower <= self.truth <= self.answer.upper)

    def cells(self) -> list[str]:
        """Of the Markdown table."""
        answer = self.answer
        numbers = f"{answer.value:.6g}", f"{self.truth:.6g}", f"{answer.lower:.6g} to {answer.upper:.6g}"
        return [
            self.case,
            str(self.degree),
            answer.ask,
            *numbers,
            f"{self.over_error:.2f}",
            "yes" if self.is_inside else "no",
        ]


def graded(body: BodyLike) -> Grading:
    """Spans at the ends of all sheets halved again and again."""
    found = Grading.of(body)
    for _ in range(HALVINGS):
        ends = {sheet: [i in (0, count - 1) for i in range(count)] for sheet, count in enumerate(found.spans)}
        found = found.refined(ends)
    return found


def rows_of(name: str, degree: int, case: Case) -> Iterator[Row]:
    """The rows of a case at one degree; quantities without a numerical error are left out."""
    body, problem = case.body(degree), case.problem
    how = {"grading": graded(body)} if case.sharp else {"refine": case.refine}
    finer = iga_nn.solve(body, problem, degree=case.degree, tolerance=1e-9, estimate=False, **how)
    answers = iga_nn.solve(body, problem, degree=degree, ask=case.ask, estimate=False, **case.how).answers
    for ask, answer in zip(case.ask, answers, strict=True):
        truth = functional(Ask(ask), problem, body).value(finer)
        if abs(truth - answer.value) > ROUNDING * abs(truth):
            yield Row(name, degree, answer, truth)


def summary(rows: Sequence[Row]) -> str:
    """The share of intervals that hold the truth, and how wide they are."""
    widths = np.array([row.over_error for row in rows])
    inside = sum(row.is_inside for row in rows)
    return (
        f"{len(rows)} quantities: the truth is inside of {inside}; half of the width over the error is "
        f"{np.median(widths):.2f} in the median, at most 3 in {100 * np.mean(widths <= 3.0):.0f} %"
    )


def main(arguments: Sequence[str] | None = None) -> list[Row]:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=[""], help="words of the names of cases")
    parser.add_argument("--degrees", type=int, nargs="+", default=[2, 3])
    options = parser.parse_args(arguments)
    chosen = [name for name in CASES if any(word in name for word in options.cases)]
    print("\n".join(as_markdown(HEADINGS, []).splitlines()))
    rows = []
    for name, degree in product(chosen, options.degrees):
        for row in rows_of(name, degree, CASES[name]):
            rows.append(row)
            print(f"| {' | '.join(row.cells())} |", flush=True)
    print(f"\n{summary(rows)}")
    return rows


if __name__ == "__main__":
    main()
