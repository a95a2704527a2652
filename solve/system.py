"""System: the linear system of a problem on a volume, to be solved here or in a loop of one's own."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from .balance import balanced, missing_mean
from .contradiction import contradictions
from .discretization.assembly import Assembled, assemble
from .discretization.dirichlet import boundary_coefficients
from .discretization.form_operator import FormOperator
from .discretization.natural import FaceMass, face_rule
from .discretization.norms import error_norms
from .discretization.operator import Operator, free_window
from .discretization.quadrature import GaussRule, operator_rule
from .discretization.roughness import is_rough
from .discretization.space import TrialSpace, embedded, longest_edge
from .estimate import error_estimate
from .failure import announce, solve_notices
from .field import Points, SplineField
from .forms.form import Form, check_law
from .forms.poisson import Poisson
from .forms.problem import BoundaryValueProblem, Problem
from .linear.cg import LinearResult, conjugate_gradients
from .linear.gmres import generalized_residuals
from .linear.preconditioner import FastDiagonalization, fast_diagonalization
from .meaning import doubtful_estimate, doubts
from .options import SolverOptions
from .report import SolveReport
from .solution import Solution
from .threads import one_blas_thread

DEVICES = ("cpu", "cuda")
SAMPLES = (0.07, 0.35, 0.62, 0.91)  # parameters a direction at which a user's law is checked


def check_device(device: str, problem: BoundaryValueProblem) -> None:
    """Raise ValueError for a device that is unknown or absent, or that cannot solve the problem."""
    if device not in DEVICES:
        raise ValueError(f"device must be one of {', '.join(DEVICES)}, got {device!r}")
    if device != "cpu":
        if not isinstance(problem, Poisson):
            raise ValueError(f"{type(problem).__name__.lower()} runs on device='cpu' only, got device={device!r}")
        if problem.robin:
            raise ValueError(f"Robin faces run on device='cpu' only, got device={device!r}")
        from .linear.cuda import check_available  # torch comes in here only

        check_available(device)


class MassForm(Form):
    """The law of the mass matrix: int u . v."""

    def tensor(self, x: Array, component: int = 0) -> Array:
        """Return zeros."""
        return np.zeros(x.shape[1:])

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return zeros."""
        return 0.0 * grad

    def react(self, u: Any, grad: Any, x: Any) -> Any:
        """Return u."""
        return u


@dataclass(frozen=True, eq=False)
class System:
    """A problem on a volume as a linear system A x = b of its N free unknowns, in double precision, without matrices.

    A vector (N,) holds the free coefficients in C order of (c, m_u, m_v, m_w): components, and functions a direction,
    those that Dirichlet data fix left out. `operator`, `mass` and `preconditioner` are SciPy LinearOperators (N, N),
    `load` is b, (N,), `field` makes a spline of a vector and `vector` a vector of a spline, `solve` a Solution with its
    report.
    """

    volume: BSplineVolume
    problem: BoundaryValueProblem
    space: TrialSpace
    assembled: Assembled
    faces: Mapping[str, FaceMass]  # Robin's terms
    known: Array  # (c, n_u, n_v, n_w): the coefficients that the Dirichlet data fix, zero elsewhere
    blocks: tuple[FastDiagonalization, ...]  # a component each
    right: Array  # b as an array of the free coefficients' shape
    threads: int
    setup: float  # process seconds

    @property
    def operator(self) -> LinearOperator:
        """A, Robin's terms included."""
        return self._linear(self.multiply)

    @cached_property
    def mass(self) -> LinearOperator:
        """The mass matrix, the integrals of u . v."""
        window = self.assembled.operator.window
        single = assemble(self.volume, self.space, MassForm(), window=window, threads=self.threads).operator
        return self._linear(lambda free: np.stack([single.apply_free(component) for component in free]))

    @property
    def load(self) -> Array:
        """The right-hand side b (N,): source and data on faces, less A times the coefficients that are fixed."""
        return self.right.ravel()

    @property
    def preconditioner(self) -> LinearOperator:
        """An approximation of the inverse of A; symmetric, and positive unless the solution's constant is open."""
        return self._linear(self.precondition)

    def field(self, x: Array) -> SplineField:
        """Return the spline of the free coefficients x (N,) and of those that are fixed."""
        full = self.known.copy()
        full[self.window] = np.reshape(x, self.shape)
        spline = full[0] if len(full) == 1 else np.moveaxis(full, 0, -1)
        return SplineField(self.space.degrees, self.space.knots, spline)

    def vector(self, field: SplineField) -> Array:
        """Return the free coefficients (N,) of a field of this space, or of one that it contains.

        Raises ValueError for any other field.
        """
        full = embedded(field.coefficients, field.degrees, field.knots, self.space)
        return (full[None] if full.ndim == 3 else np.moveaxis(full, -1, 0))[self.window].ravel()

    @property
    def window(self) -> tuple[slice, ...]:
        """The free coefficients in an array (c, n_u, n_v, n_w)."""
        return (slice(None), *self.assembled.operator.window)

    @property
    def shape(self) -> tuple[int, ...]:
        """(c, m_u, m_v, m_w) of the free coefficients."""
        return self.known[self.window].shape

    def multiply(self, free: Array) -> Array:
        """Return A times the free coefficients (c, m_u, m_v, m_w)."""
        if not self.faces:
            return self.assembled.operator.apply_free(free)
        full = np.zeros(self.known.shape)
        full[self.window] = free
        return apply_all(self.assembled, self.faces, full)[self.window]

    def precondition(self, residual: Array) -> Array:
        """Return the preconditioner times the free coefficients (c, m_u, m_v, m_w)."""
        if len(self.blocks) == 1:
            return self.blocks[0](residual)
        return np.stack([block(part) for block, part in zip(self.blocks, residual, strict=True)])

    def _linear(self, apply: Callable[[Array], Array]) -> LinearOperator:
        def product(x: Array) -> Array:
            with one_blas_thread():
                return apply(np.asarray(x, dtype=np.float64).reshape(self.shape)).ravel()

        size = int(np.prod(self.shape))
        adjoint = {"rmatvec": product} if self.problem.form.symmetric else {}
        return LinearOperator((size, size), matvec=product, dtype=np.float64, **adjoint)

    def solve(self, **how: Any) -> Solution:
        """Solve, and return the solution with its errors and notices. how: the fields of `SolverOptions`.

        Raises ConvergenceError where the linear solver fails and `strict` is asked for.
        """
        options = SolverOptions(**how)
        check_device(options.device, self.problem)
        with one_blas_thread():
            solution = self._solve(options)
        announce(solution, options.strict)
        return solution

    def _solve(self, options: SolverOptions) -> Solution:
        volume, problem, space = self.volume, self.problem, self.space
        clock = [time.process_time()]
        result = self.iterate(options)
        coefficients = self.known.copy()
        coefficients[self.window] = result.x
        if self.blocks[0].singular:
            coefficients += missing_mean(volume, space, coefficients[0], problem)
        clock.append(time.process_time())
        errors = estimate = None
        if problem.exact is not None:
            errors = error_norms(volume, space, coefficients, problem.exact_at, self.threads)
        if options.estimate or (options.estimate is None and problem.exact is None):
            estimate = error_estimate(volume, space, coefficients, problem)
        clock.append(time.process_time())
        contradictory = contradictions(volume, problem)
        judged = doubts(volume, problem, None if contradictory else errors, coefficients.size)
        doubtful = doubtful_estimate(estimate)
        failed = solve_notices(volume, space, self.assembled, options.certified, result)
        report = SolveReport(
            elements=space.elements,
            dofs=coefficients.size,
            h=longest_edge(volume, space),
            iterations=result.iterations,
            converged=result.converged,
            residual=result.residuals[-1],
            seconds={"setup": self.setup, "solve": clock[1] - clock[0], "errors": clock[2] - clock[1]},
            errors=errors,
            estimate=estimate,
            notices=(*doubtful, *contradictory, *judged.notices, *failed),
            meaningful=judged.meaningful and not doubtful,
            residuals=result.residuals,
        )
        field = self.field(coefficients[self.window])
        return Solution(space.degrees, space.knots, field.coefficients, volume, report)

    def iterate(self, options: SolverOptions) -> LinearResult:
        """Return what the linear solver finds: conjugate gradients, or GMRES where the law is not symmetric."""
        limits = options.tolerance, options.max_iterations
        guess = None if options.start is None else self.vector(options.start).reshape(self.shape)
        if options.device != "cpu":
            from .linear.cuda import solve_on_device

            assert isinstance(self.assembled.operator, Operator)
            return solve_on_device(self.assembled.operator, self.blocks[0], self.right, *limits, options.device, guess)
        iterate = conjugate_gradients if self.problem.form.symmetric else generalized_residuals
        return iterate(self.multiply, self.right, self.precondition, *limits, guess)


def problem_rule(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, quadrature: str = "spline"
) -> GaussRule:
    """Return the rule of a problem's operator, once its law is checked; quadrature as in `operator_rule`."""
    if isinstance(problem, Problem):
        check_law(problem.form, _samples(volume))
    return operator_rule(space, quadrature, is_rough(volume, space, problem.form.tensor))


def build(
    volume: BSplineVolume,
    problem: BoundaryValueProblem,
    space: TrialSpace,
    threads: int = 1,
    rule: GaussRule | None = None,
) -> System:
    """Return the system of a problem, its data placed in the volume (`problem.on`), on a trial space.

    rule: of the operator; default: that of a rough map.
    """
    rule = rule or operator_rule(space)
    start = time.process_time()
    with one_blas_thread():
        assembled, faces, known = assemble_data(volume, problem, space, rule, threads)
        operator = assembled.operator
        extra = np.zeros(space.shape)
        for term in faces.values():
            term.add_diagonal(extra)
        blocks = (operator,) if isinstance(operator, Operator) else map(operator.block, range(len(known)))
        robin = {name: term.mean for name, term in faces.items()}
        inverses = tuple(fast_diagonalization(block, robin, extra) for block in blocks)
        if isinstance(operator, FormOperator) and inverses[0].singular:
            raise ValueError(
                f"{type(problem.form).__name__} without a reaction and with Neumann data on all faces leaves the "
                "solution open: give one face to boundary or robin"
            )
        right = (assembled.load - apply_all(assembled, faces, known))[:, *operator.window]
        right = balanced(right) if inverses[0].singular else right
        setup = time.process_time() - start
    return System(volume, problem, space, assembled, faces, known, inverses, right, threads, setup)


def apply_all(assembled: Assembled, faces: Mapping[str, FaceMass], coefficients: Array) -> Array:
    """Return operator and Robin's terms times coefficients (c, n_u, n_v, n_w)."""
    result = assembled.operator.apply(coefficients)
    for face in faces.values():
        for component, total in zip(coefficients, result, strict=True):
            face.add_product(component, total)
    return result


def assemble_data(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, rule: GaussRule, threads: int = 1
) -> tuple[Assembled, dict[str, FaceMass], Array]:
    """Return operator and load with the data on faces, Robin's terms by face, and the coefficients that are fixed."""
    form = problem.form
    couples = isinstance(problem, Problem) and check_law(form, _samples(volume))
    assembled = assemble(
        volume,
        space,
        form,
        problem.source_at,
        rule,
        window=free_window(space, problem.dirichlet),
        is_scalar=form.components == 1 and form.symmetric and not couples,
        threads=threads,
    )
    terms = {}
    for name in FACE_NAMES:
        if name in problem.dirichlet:
            continue
        face = face_rule(volume, space, name)
        if name in problem.natural:
            data = problem.flux_at(name, face.points, face.normal)
        else:
            alpha, data = problem.robin_at(name, face.points, face.normal)
            terms[name] = FaceMass(face, alpha * face.measure)
        for density, total in zip(data, assembled.load, strict=True):
            total[face.layer] += face.integrate(density)
    known = boundary_coefficients(volume, space, problem.boundary_at, problem.dirichlet, form.components)
    return assembled, terms, known


def _samples(volume: BSplineVolume) -> Points:
    row = np.array(SAMPLES)
    return Points.of(np.moveaxis(volume.grid(row, row, row), -1, 0).reshape(3, -1), (row, row, row))
