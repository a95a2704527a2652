"""Defines System: the linear system of a problem on a volume, for `solve` or for a loop of the user's own."""

import functools
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator

from parameterize.arrays import Array
from parameterize.conjugate_gradients import LinearResult, conjugate_gradients
from parameterize.spline.volume import BSplineVolume
from parameterize.threads import one_blas_thread

from .assembly import assemble_data, balanced
from .diagnostics import ConvergenceError, failure, judge, map_notices
from .discretization.errors import Errors, error_norms, missing_mean
from .discretization.estimate import error_estimate
from .discretization.on_regions import demand_supports
from .discretization.operator import FormOperator, Operator, assemble, with_mass
from .discretization.space import TrialSpace, embedded, longest_edge
from .discretization.weak import WeakFace
from .field import SplineField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.mass import Mass
from .linear.krylov import generalized_residuals
from .linear.preconditioner import FastDiagonalization, fast_diagonalization
from .options import IterationOptions, SolveOptions, check_device
from .reactions import balance
from .solution import Solution, SolveReport

LARGEST_VALUE = 1e150  # of a solution: the squares of larger ones overflow

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class System:
    """State a problem on a volume as a linear system A x = b of N free unknowns, in double precision, matrix-free.

    A vector (N,) holds the free coefficients in C order of (c, m_u, m_v, m_w): components, and functions a direction
    without those that Dirichlet data fix; `operator`, `mass` and `preconditioner` are SciPy LinearOperators (N, N).
    Where processes share the space, arrays hold a process's rows and vectors its own rows; all processes call each
    method.

    Examples
    --------
    >>> import iga_nn
    >>> from scipy.sparse.linalg import cg
    >>> from solve import benchmark_volume
    >>> system = iga_nn.discretize(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z"))
    >>> x, failed = cg(system.operator, system.load, M=system.preconditioner)
    >>> failed, system.field(x).coefficients.shape
    (0, (5, 5, 5))
    """

    volume: BSplineVolume
    problem: BoundaryValueProblem
    space: TrialSpace
    matrix: Operator | FormOperator  # A, its products with all coefficients included
    known: Array  # (c, n_u, n_v, n_w): the coefficients that the Dirichlet data fix, zero elsewhere
    blocks: tuple[FastDiagonalization, ...]  # a component each
    right: Array  # b, (c, m_u, m_v, m_w): of the free coefficients
    loads: Array  # (c, n_u, n_v, n_w): of all coefficients, before the known ones are subtracted
    setup: float  # process seconds

    @property
    def operator(self) -> LinearOperator:
        """Return A, with Robin's terms."""
        return self._linear(self.matrix.apply_free)

    @functools.cached_property
    def mass(self) -> LinearOperator:
        """Return the mass matrix, the integrals of u . v."""
        single, _ = assemble(self.volume, self.space, Mass(), threads=self.matrix.threads)
        return self._linear(single.apply_free)

    @property
    def weak(self) -> list[WeakFace]:
        """Return the faces of the cube with terms of conditions on regions."""
        return [face for face in self.matrix.faces.values() if isinstance(face, WeakFace)]

    @property
    def load(self) -> Array:
        """Return the right-hand side b (N,): source and data on faces, minus A times the fixed coefficients."""
        return self.right.ravel()

    @property
    def preconditioner(self) -> LinearOperator:
        """Return an approximate inverse of A; it is symmetric, and positive unless the solution's constant is open."""
        return self._linear(self._precondition)

    def field(self, x: Array) -> SplineField:
        """Return the spline of the free coefficients x (N,) and the fixed coefficients.

        Raises ValueError for another number of coefficients.
        """
        if np.size(x) != self.right.size:
            raise ValueError(f"x must have {self.right.size} entries, the free coefficients, got {np.size(x)}")
        return self._spline(self._filled(np.reshape(x, self.right.shape)))

    def _filled(self, free: Array) -> Array:
        """Return all coefficients (c, n_u, n_v, n_w) from the free ones, with the fixed coefficients."""
        full = self.known.copy()
        full[:, *self.space.window] = free
        self.space.fill(full)
        return full

    def vector(self, field: SplineField) -> Array:
        """Return the free coefficients (N,) of a field in this space, or in a space that this one contains.

        Raises ValueError for any other field.
        """
        full = embedded(field.coefficients, field.degrees, field.knots, self.space)
        full = full[None] if full.ndim == 3 else np.moveaxis(full, -1, 0)
        return full[:, *self.space.window].ravel()

    def _spline(self, full: Array) -> SplineField:
        """Return the spline of coefficients (c, n_u, n_v, n_w), gathered from all processes."""
        whole = self.space.gather(full[:, self.space.own])
        coefficients = whole[0] if len(whole) == 1 else np.moveaxis(whole, 0, -1)
        return SplineField(self.space.degrees, self.space.whole.knots, coefficients, self.volume)

    def _precondition(self, residual: Array) -> Array:
        """Return the preconditioner times the free coefficients (c, m_u, m_v, m_w)."""
        return np.stack([block(part) for block, part in zip(self.blocks, residual, strict=True)])

    def _linear(self, apply: Callable[[Array], Array]) -> LinearOperator:
        def product(x: Array) -> Array:
            with one_blas_thread():
                return apply(np.asarray(x, dtype=np.float64).reshape(self.right.shape)).ravel()

        size = int(np.prod(self.right.shape))
        adjoint = {"rmatvec": product} if self.problem.form.symmetric else {}
        return LinearOperator((size, size), matvec=product, dtype=np.float64, **adjoint)

    def solve(self, **how: Any) -> Solution:
        """Solve the system, and return the solution with its errors and notices.

        how: tolerance, max_iterations, certified, device, start, estimate and strict, as in `iga_nn.solve`. Raises
        ConvergenceError where the linear solver fails before its first iteration, or where it fails at all with
        `strict`.
        """
        return self.solve_with(IterationOptions.of(how))

    def solve_with(self, options: IterationOptions) -> Solution:
        """Return the solution of `solve` for options in one object."""
        check_device(options.device, self.problem)
        with one_blas_thread():
            solution = self._solve(options)
        for notice in solution.report.notices if self.space.rank == 0 else ():
            log.warning("%s", notice)
        if options.strict and not solution.report.converged:
            raise ConvergenceError(solution.report.notices[-1], solution)
        return solution

    def _solve(self, options: IterationOptions) -> Solution:
        volume, problem, space = self.volume, self.problem, self.space
        dofs = len(self.known) * space.dofs
        clock, sent = [time.process_time()], space.traffic()
        result = self._iterate(options)
        failed = failure(volume, space, result, problem.form.caveat)
        if failed and result.iterations == 0:  # there is the start alone
            raise ConvergenceError(failed)
        steps = result.iterations + (options.start is not None)  # products made
        traffic = {kind: (count - sent.get(kind, 0)) / steps for kind, count in space.traffic().items() if steps}
        full = self._filled(result.x)
        if self.blocks[0].singular:
            full += missing_mean(volume, space, full[0], problem)
        clock.append(time.process_time())
        largest = max(space.shared(float(np.abs(full).max(initial=0.0))))
        has_norm = largest <= LARGEST_VALUE
        errors, estimate = self._errors(full, result.x, options.estimate) if has_norm else (None, None)
        clock.append(time.process_time())
        doubtful, meaningful = judge(volume, problem, errors, estimate if result.converged else None, dofs)
        if errors is None and problem.form.caveat:
            doubtful.append(f"the error is not estimated: {problem.form.caveat}; compare two refinements")
        if not has_norm:
            doubtful.append(f"the solution reaches {largest:.1e}, too large for its norms: choose other units")
        of_map = map_notices(volume, self.matrix, options.certified, [block.weakness for block in self.blocks])
        report = SolveReport(
            elements=space.elements,
            dofs=dofs,
            h=longest_edge(volume, space),
            iterations=result.iterations,
            converged=result.converged,
            residual=result.residuals[-1],
            seconds={"setup": self.setup, "solve": clock[1] - clock[0], "errors": clock[2] - clock[1]},
            errors=errors,
            estimate=estimate,
            notices=(*doubtful, *of_map, *([failed] if failed else [])),
            meaningful=meaningful and has_norm,
            residuals=result.residuals,
            traffic=traffic,
            balance=balance(problem, self.matrix, full, self.loads) if has_norm else None,
        )
        field = self._spline(full)
        return Solution(field.degrees, field.knots, field.coefficients, volume, report=report, problem=self.problem)

    def _errors(self, full: Array, free: Array, is_estimated: bool | None) -> tuple[Errors | None, Errors | None]:
        """Return the errors of a solution, None without an exact one, and their estimate, None unless it is wanted.

        full: all coefficients. free: the free coefficients. is_estimated: whether to estimate; None for problems
        without an exact solution only.
        """
        volume, problem, space = self.volume, self.problem, self.space
        errors = estimate = None
        if problem.exact is not None:
            errors = error_norms(volume, space, full, problem.exact_at, self.matrix.threads)
        if is_estimated or (is_estimated is None and problem.exact is None):
            estimate = error_estimate(volume, space, full, problem, self._energy(free))
        return errors, estimate

    def _energy(self, free: Array) -> float | None:
        """Return a(u_h, u_h) of free coefficients that solve the system; None where it is not the work of the loads."""
        lifted = sum(int(np.count_nonzero(face.values)) for face in self.weak)
        if not self.problem.form.symmetric or self.space.total(np.count_nonzero(self.known) + lifted):
            return None
        return float(self.space.total((self.right * free).sum()))

    def _iterate(self, options: IterationOptions) -> LinearResult:
        """Return the result of conjugate gradients, or of GMRES where the law is not symmetric."""
        operator, limits = self.matrix, (options.tolerance, options.max_iterations)
        guess = None if options.start is None else self.vector(options.start).reshape(self.right.shape)
        if options.device != "cpu":
            from .linear.cuda import solve_on_device

            assert isinstance(operator, Operator)
            return solve_on_device(operator, self.blocks[0], self.right, *limits, options.device, guess)
        if self.problem.form.symmetric:
            system = operator.apply_free, self.right, self._precondition
            return conjugate_gradients(*system, *limits, guess, self.space.total)
        # the vectors of GMRES are whole on every process, products and preconditioner are shared
        gather, own = self.space.gather, (slice(None), self.space.place)
        found = generalized_residuals(
            lambda x: gather(operator.apply_free(x[own])),
            gather(self.right),
            lambda x: gather(self._precondition(x[own])),
            *limits,
            None if guess is None else gather(guess),
        )
        return replace(found, x=found.x[own])


def build(
    volume: BSplineVolume,
    problem: BoundaryValueProblem,
    space: TrialSpace,
    options: SolveOptions,
    shift: float = 0.0,
) -> System:
    """Return the system of a problem on a trial space; the problem's data are placed in the volume (`problem.on`).

    shift: the factor of the mass matrix in A, which is added to the law's matrix.
    """
    start = time.process_time()
    with one_blas_thread():
        operator, load, known = assemble_data(volume, problem, space, options)
        if shift == 0.0:
            weak = [face for face in operator.faces.values() if isinstance(face, WeakFace)]
            demand_supports(problem, space, weak, float(np.ptp(volume.control_points, axis=(0, 1, 2)).max()))
        else:
            operator = with_mass(volume, operator, problem.form, shift)
        blocks = (operator,) if isinstance(operator, Operator) else map(operator.block, range(len(known)))
        inverses = tuple(map(fast_diagonalization, blocks))
        if isinstance(operator, FormOperator) and inverses[0].singular:
            raise ValueError(
                f"{type(problem.form).__name__} without a reaction, and with Neumann data on all faces, does not "
                "determine the solution: give a value, or an exchange, on a face or a region"
            )
        loads = load.copy()
        load -= operator.apply(known)
        space.add(load)
        right = np.ascontiguousarray(load[:, *space.window])
        right = balanced(right, space) if inverses[0].singular else right
        setup = time.process_time() - start
    return System(volume, problem, space, operator, known, inverses, right, loads, setup)
