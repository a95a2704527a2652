"""Judges the numbers of a solve: notices on its data, its map, its mesh and its linear solver."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.conjugate_gradients import INDEFINITE, LinearResult
from parameterize.quality.distortion import scaled_jacobian
from parameterize.spline.bspline import breakpoints
from parameterize.spline.orientation import orientation
from parameterize.spline.patch_groups import groups_of
from parameterize.spline.volume import AXES, FACE_NAMES, BSplineVolume

from .discretization.error_norms import Errors
from .discretization.quadrature import gauss_rule, map_planes
from .discretization.space import TrialSpace
from .field import Points
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.data import in_scaled
from .forms.elasticity import Elasticity
from .forms.parser import Expression, ExpressionError
from .patch_system import PatchProblem, PatchSystem
from .solution import Solution

# Parameters per direction: the ends, and between them places without a pattern that a periodic formula could share.
SAMPLES = np.concatenate([[0.0], np.sort(np.random.default_rng(0).uniform(0.0, 1.0, 7)), [1.0]])
_RANDOM = np.random.default_rng(1)  # points of all sizes, somewhere among which a formula that can vary does so
ANYWHERE = _RANDOM.choice([-1.0, 1.0], (3, 300)) * 10.0 ** _RANDOM.uniform(-3.0, 4.0, (3, 300))
MANY = 200  # patches from which on three places a direction suffice for each
INSIDE = np.linspace(0.05, 0.95, 7)  # parameters per direction at which data are compared with `exact`
SMALLEST = 1e-150  # values whose squares underflow
ROUNDING = 1e-13  # share of the size by which a formula must vary
AGREEMENT = 1e-6  # share of the size by which data may differ from those of `exact`
LARGEST_ERROR = 0.5  # relative L2: beyond it more of the solution is wrong than right
DECISIVE = ("exact", "source", "boundary")  # without these nothing is solved
INDEFINITE_REMEDY = ", as with a negative reaction; in a law of one's own, set `symmetric = False`, and GMRES solves it"
EXTREME_REMEDY = ": the numbers of the law or of the map lie too far apart; scale them, or smooth their jumps"
# Spans that are longer than so many thicknesses lock in bending, by the degree: the deflection of straight and curved
# cantilevers, 100 and 1000 times as long as thick, is then 2 to 40 % too small (tests/test_diagnostics.py).
SLENDER = {1: 1.0, 2: 8.0}
SLENDER_CUBIC = 30.0
TWO_PROBLEMS = "the errors compare the solutions of two problems"
TOO_STIFF = (
    "near Poisson's ratio 1/2 the displacement alone is too stiff, by any factor: do not trust it; formulation 'mixed' "
    "is taken by one process, with degree 2 or more and a ratio above 0 everywhere"
)


class ConvergenceError(RuntimeError):
    """Raised where the linear solver misses its tolerance; `solution` is the last iterate, None where there is none.

    Examples
    --------
    >>> import iga_nn, solve
    >>> try:
    ...     iga_nn.solve(solve.benchmark_volume(2), iga_nn.Poisson(), max_iterations=1, strict=True)
    ... except solve.ConvergenceError as error:
    ...     print(error.solution.report.iterations)
    1
    """

    def __init__(self, message: str, solution: Solution | None = None) -> None:
        super().__init__(message)
        self.solution = solution


def judge(
    problem: BoundaryValueProblem,
    patches: Sequence[PatchProblem],
    errors: Errors | None,
    estimate: Errors | None,
    unknowns: int,
) -> tuple[list[str], bool]:
    """Return the notices on a problem and on the errors of its solution, and whether the errors are meaningful.

    The errors are not meaningful where a decisive formula does not vary, or where the mesh does not resolve the exact
    solution. A large error estimate gives a notice only, because an estimate may be wrong.
    """
    points, ends = _samples(patches)
    contradictory = list(
        dict.fromkeys(line for patch in patches for line in contradictions(patch.volume, patch.problem))
    )
    empty = empty_formulas(problem, points, ends)
    rough, unresolved = [], []
    if estimate is not None and (estimate.l2_relative or 0.0) > LARGEST_ERROR:
        share = f"the relative L2 error is estimated as {estimate.l2_relative:.2g}"
        rough.append(f"the mesh hardly resolves the solution, {share}: refine it, and see whether the solution stays")
    if errors is not None and not contradictory and (errors.l2_relative or 0.0) > LARGEST_ERROR:
        share = f"{unknowns:,} unknowns do not resolve it, the relative L2 error is {errors.l2_relative:.2g}"
        described, remedy = _exact_on(problem, points)
        unresolved.append(f"{described}: {share}{remedy}")
    meaningful = not unresolved and not any(role in DECISIVE for role, _ in empty)
    return [*rough, *contradictory, *(notice for _, notice in empty), *unresolved], meaningful


def _samples(patches: Sequence[PatchProblem]) -> tuple[Array, dict[str, Array]]:
    """Return points (3, ...) of all patches, and those of their faces: of "u0" of all patches, of "p2_u0" of one."""
    rows = SAMPLES if len(patches) <= MANY else SAMPLES[:: len(SAMPLES) // 2]
    every: list[Any] = [None] * len(patches)
    for group in groups_of([patch.volume for patch in patches]):
        for number, points in zip(group.numbers, np.moveaxis(group.grid(rows, rows, rows), -1, 1), strict=True):
            every[number] = points
    ends: dict[str, Array] = {}
    for name in FACE_NAMES:
        parts = [np.take(points, -int(name[1]), 1 + AXES.index(name[0])) for points in every]
        ends |= {patch.problem.prefix + name: part for patch, part in zip(patches, parts, strict=True)}
        ends[name] = np.concatenate(parts, axis=1)
    return np.concatenate(every, axis=1), ends


def empty_formulas(
    problem: BoundaryValueProblem, points: Array, faces: Mapping[str, Array] | None = None
) -> list[tuple[str, str]]:
    """Return the data whose formulas underflow, or vary by less than rounding, at points (3, ...): role and notice.

    faces: the points of each face, for the data of that face; without `faces`, all points are used. A formula that is
    constant at all other points as well is accepted as a constant. Points where a formula is not finite do not count.
    """
    found = []
    for role, datum, formula in problem.formulas:
        where = (faces or {}).get(datum.face, points)
        ends = _range(formula(*where))
        if ends is None or (fault := _fault(*ends)) is None or _is_constant(formula, where):
            continue
        place = f"face {datum.face}" if where is not points else "the domain"
        described = f"{datum.name} {formula.text!r} runs from {ends[0]:.3g} to {ends[1]:.3g} on {place}"
        found.append((role, f"{described}: it {fault}, and means nothing here{in_scaled(formula, where)}"))
    return found


def _fault(low: float, high: float) -> str | None:
    size = max(abs(low), abs(high))
    if size < SMALLEST:
        return "underflows"
    return "varies by less than rounding" if high - low <= ROUNDING * size else None


def _is_constant(formula: Expression, where: Array) -> bool:
    """Return whether a formula has one value everywhere.

    Coordinates that do not vary at the points (3, ...) are fixed: on a face x = 0 the formula x*y is accepted as zero.
    """
    if not formula.variables:
        return True
    middle, length = (0.0, 1.0) if formula.frame is None else (np.array(formula.frame.center), formula.frame.length)
    anywhere = np.transpose(length * ANYWHERE.T + middle)
    for i, row in enumerate(where):
        if np.ptp(row) <= ROUNDING * np.abs(where).max():
            anywhere[i] = row.flat[0]
    ends = _range(formula(*anywhere))
    return ends is not None and ends[0] == ends[1]


def _exact_on(problem: BoundaryValueProblem, points: Array) -> tuple[str, str]:
    """Return a description of `exact` at points (3, ...), and a remedy where its scale causes the error."""
    exact = problem.exact_formulas
    ends = _range(np.array([formula(*points) for formula in exact]))
    described = "exact"
    if ends is not None:
        text = ";".join(formula.text for formula in exact)
        described = f"exact {text!r} runs from {ends[0]:.3g} to {ends[1]:.3g} on the domain"
    return described, in_scaled(exact[0], points) if len(exact) == 1 else ""


def _range(values: Array) -> tuple[float, float] | None:
    """Return the lowest and the highest finite value; None where no value is finite."""
    finite = values[np.isfinite(values)]
    return (float(finite.min()), float(finite.max())) if finite.size else None


def contradictions(volume: BSplineVolume, problem: BoundaryValueProblem) -> list[str]:
    """Return the data that contradict a problem's exact formulas on the volume, one line each; none without formulas.

    Source and Dirichlet data are compared with those of the formulas at 7 points per direction, unless the latter are
    not finite there.
    """
    found = []
    if not problem.exact_formulas:
        return []
    if "source" not in problem.data:
        if any("abs" in formula.text for formula in problem.exact_formulas):
            found.append(
                "exact contains abs: where its argument changes sign, u has a kink that the source derived from it "
                "does not know, and the errors stay"
            )
    elif not problem.not_differentiable:
        x = Points.on(volume, INSIDE, INSIDE, INSIDE)
        # rounding is measured by the terms of the law, which may cancel in the source
        if not _agree(problem.source_at(x), lambda: (problem.source_of_exact(x), problem.size_of_exact(x))):
            found.append(f"{problem.label('source')} is not that of exact: {TWO_PROBLEMS}")
    strong = [(face, condition) for face in problem.dirichlet if (condition := problem.strong_on(face))]
    wrong = [one.role for face, one in strong if one.datum and not _values_fit(volume, problem, face)]
    return [*found, *(f"{role} differs from exact: {TWO_PROBLEMS}" for role in dict.fromkeys(wrong))]


def _values_fit(volume: BSplineVolume, problem: BoundaryValueProblem, face: str) -> bool:
    x = Points.on(volume, *(np.array([float(face[1])]) if axis == face[0] else INSIDE for axis in AXES))
    return _agree(problem.boundary_at(x, face), lambda: (problem.exact_at(x)[0], 0.0))


def _agree(given: Array, of_exact: Callable[[], tuple[Array, float]]) -> bool:
    """Return whether data agree with the data of `exact`.

    of_exact: a function that returns the data of `exact`, and the size of the terms that cancel in these data.
    """
    try:
        derived, size = of_exact()
    except ExpressionError:  # perhaps the reason why they are given
        return True
    size = max(np.abs(given).max(), np.abs(derived).max(), size)
    return bool(np.abs(given - derived).max() <= AGREEMENT * size)


def map_notices(
    patches: Sequence[PatchProblem], certified: str | None, weaknesses: Iterable[str], folded: Iterable[str] = ()
) -> list[str]:
    """Return the notices on the map, and on a preconditioner that lacks a part.

    weaknesses: the weakness of the preconditioner of each component. folded: the lines of `folded_notices`.
    """
    notices = []
    if certified not in (None, "certified"):
        notices.append(f"the map is {certified}, not certified: do not trust the solution")
    notices += [*folded, *bending_notices(patches)]
    return notices + [f"more iterations than usual: {text}" for text in dict.fromkeys(weaknesses) if text]


def folded_notices(patch: PatchSystem) -> Iterator[str]:
    """Yield a line on a patch at whose points det J has the wrong sign."""
    matrix = patch.matrix
    if matrix.folded:
        points = matrix.space.total(int(np.prod(matrix.rule.shape)))
        wrong = "det J < 0" if orientation(patch.volume) > 0 else "the map is left-handed, and det J > 0"
        where = f" of patch {patch.problem.prefix[:-1]}" if patch.problem.prefix else ""
        yield f"{wrong} at {matrix.folded} of {points} Gauss points{where}: solved with |det J| instead"


def bending_notices(patches: Sequence[PatchProblem]) -> Iterator[str]:
    """Yield a notice on the elastic patch with the longest spans over its thickness, where they may lock in bending."""
    if not patches or not isinstance(patches[0].problem.form, Elasticity):
        return
    worst, share, degree, prefix = max((*_slenderness(patch), patch.problem.prefix) for patch in patches)
    if worst > 1.0:
        where = f" of patch {prefix[:-1]}" if prefix else ""
        yield (
            f"spans{where} are {share:.2g} times as long as the body is thick there: with degree {degree} it may bend "
            "some 2 to 40 % too little, and swing too fast; raise --refine or --degree until its numbers stay"
        )


def _slenderness(patch: PatchProblem) -> tuple[float, float, int]:
    """Return the longest span of a patch over its thickness, as a share of what its degree allows, and as it is.

    Lengths are those of the control net's lines, in the mean. The last number is the degree along that span.
    """
    net = patch.volume.control_points
    sides = [float(np.linalg.norm(np.diff(net, axis=a), axis=-1).sum(axis=a).mean()) for a in range(3)]
    spans = [len(breakpoints(knots)) - 1 for knots in patch.space.whole.knots]
    rows = zip(sides, spans, patch.space.degrees, strict=True)
    found = [(side / count / min(sides), degree) for side, count, degree in rows]
    return max((ratio / SLENDER.get(degree, SLENDER_CUBIC), ratio, degree) for ratio, degree in found)


def failure(
    patches: Sequence[PatchProblem], result: LinearResult, caveat: str = "", formulation: str = "displacement"
) -> str:
    """Return in one line why the linear solver did not converge and where the map is worst; "" where it converged.

    caveat: the caveat of the law. formulation: that of the unknowns.
    """
    if result.converged:
        return ""
    if result.breakdown:
        said = f"no convergence: after {result.iterations} iterations {result.breakdown}"
        return said + (INDEFINITE_REMEDY if result.breakdown == INDEFINITE else EXTREME_REMEDY)
    residuals = result.residuals
    said = (
        f"no convergence: residual {residuals[0]:.1e} at the start, {residuals[-1]:.1e} after {result.iterations} "
        f"iterations (lowest {min(residuals):.1e}); "
    )
    if caveat:
        remedy = "allow more of them" if formulation == "mixed" else "take formulation='mixed'"
        return f"{said}{caveat}, which takes many iterations: {remedy}"
    worst = [(*worst_place(patch.volume, patch.space), patch.problem.prefix) for patch in patches]
    parameters, point, scaled, prefix = min(worst, key=lambda place: place[2])
    cube, where = (
        ", ".join(f"{axis}={value:.4g}" for axis, value in zip(axes, place, strict=True))
        for axes, place in ((AXES, parameters), ("xyz", point))
    )
    of_patch = f" of {prefix[:-1]}" if prefix else ""
    return f"{said}the map is worst at {cube}{of_patch} ({where}): scaled Jacobian {scaled:.2g}"


def worst_place(volume: BSplineVolume, space: TrialSpace) -> tuple[Array, Array, float]:
    """Return the place where the map's scaled Jacobian, |det J| over the product of its columns' lengths, is least.

    The result is the Gauss point with its parameters (3,) and its position (3,) in space, and the scaled Jacobian
    there: 1 where the parameter lines meet at right angles, 0 where the map degenerates, negative where it is folded.
    """
    rule = gauss_rule(space)
    parameters, point, least, hand = np.zeros(3), np.zeros(3), np.inf, orientation(volume)
    for q, fields, _ in map_planes(volume, rule):
        scaled = hand * scaled_jacobian(np.moveaxis(fields[:, 1:], (0, 1), (2, 3)))  # of (q_w, q_v, 3, 3)
        w, v = (int(i) for i in np.unravel_index(np.argmin(scaled), scaled.shape))
        if scaled[w, v] < least:
            least = float(scaled[w, v])
            parameters = np.array([rule.points[a][i] for a, i in enumerate((q, v, w))])
            point = fields[:, 0, w, v].copy()
    return parameters, point, least
