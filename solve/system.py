"""System: the linear system of a problem on a volume, to be solved here or in a loop of one's own."""

import functools
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from numbers import Integral, Real
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator

from parameterize.arrays import Array
from parameterize.conjugate_gradients import LinearResult, conjugate_gradients
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from parameterize.threads import one_blas_thread

from .diagnostics import ConvergenceError, failure, judge, map_notices
from .discretization.boundary import FaceRule, boundary_coefficients, face_rule, has_face
from .discretization.errors import error_norms, missing_mean
from .discretization.estimate import error_estimate
from .discretization.on_regions import demand_area, demand_supports, weak_faces
from .discretization.operator import FormOperator, Operator, assemble, with_mass
from .discretization.quadrature import rule_of
from .discretization.space import TrialSpace, agreed, embedded, longest_edge
from .discretization.weak import WeakFace
from .field import Points, SplineField
from .forms.form import check_law
from .forms.mass import Mass
from .forms.poisson import Poisson
from .forms.problem import BoundaryValueProblem, Problem
from .linear.krylov import generalized_residuals
from .linear.preconditioner import FastDiagonalization, fast_diagonalization
from .reactions import balance
from .solution import Solution, SolveReport

DEVICES = ("cpu", "cuda")
SAMPLES = np.array([0.07, 0.35, 0.62, 0.91])  # parameters a direction at which a user's law is checked

LARGEST_VALUE = 1e150  # of a solution: the squares of larger ones overflow
LARGEST_IMBALANCE = 0.01  # of the data's size; what quadrature leaves of data in balance is far below

log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class SolverOptions:
    """Hold what the linear solver is told: keywords of `iga_nn.solve`, which describes them.

    Raises ValueError where a tolerance or a number of iterations is out of range.
    """

    tolerance: float = 1e-10
    max_iterations: int = 1000
    certified: str | None = None
    device: str = "cpu"
    start: SplineField | None = None
    estimate: bool | None = None
    strict: bool = False

    def __post_init__(self) -> None:
        if not (isinstance(self.tolerance, Real) and 0.0 < self.tolerance < 1.0):
            raise ValueError(f"tolerance must be a number between 0 and 1, got {self.tolerance!r:.80}")
        if not (isinstance(self.max_iterations, Integral) and self.max_iterations >= 1):
            raise ValueError(f"max_iterations must be a whole number, at least 1, got {self.max_iterations!r:.80}")


def check_device(device: str, problem: BoundaryValueProblem) -> None:
    """Raise ValueError for a device that is unknown or absent, or that cannot solve the problem."""
    if device not in DEVICES:
        raise ValueError(f"device must be one of {', '.join(DEVICES)}, got {device!r}")
    if device != "cpu":
        if not isinstance(problem, Poisson):
            raise ValueError(f"{type(problem).__name__.lower()} runs on device='cpu' only, got device={device!r}")
        if problem.robin:
            raise ValueError(f"Robin faces run on device='cpu' only, got device={device!r}")
        if problem.conditions:
            raise ValueError(f"regions run on device='cpu' only, got device={device!r}")
        from .linear.cuda import check_available  # torch comes in here only

        check_available(device)


@dataclass(frozen=True, eq=False)
class System:
    """A problem on a volume as a linear system A x = b of its N free unknowns, in double precision, without matrices.

    A vector (N,) holds the free coefficients in C order of (c, m_u, m_v, m_w): components, and functions a direction,
    those that Dirichlet data fix left out; `operator`, `mass` and `preconditioner` are SciPy LinearOperators (N, N).
    Where processes share the space, arrays hold a process's rows and vectors its own ones; all call each method.

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
    loads: Array  # (c, n_u, n_v, n_w): of all coefficients, before what is known is taken from them
    setup: float  # process seconds

    @property
    def operator(self) -> LinearOperator:
        """A, Robin's terms included."""
        return self._linear(self.matrix.apply_free)

    @functools.cached_property
    def mass(self) -> LinearOperator:
        """The mass matrix, the integrals of u . v."""
        single, _ = assemble(self.volume, self.space, Mass(), threads=self.matrix.threads)
        return self._linear(single.apply_free)

    @property
    def weak(self) -> list[WeakFace]:
        """The faces of the cube with terms of conditions on regions."""
        return [face for face in self.matrix.faces.values() if isinstance(face, WeakFace)]

    @property
    def load(self) -> Array:
        """The right-hand side b (N,): source and data on faces, less A times the coefficients that are fixed."""
        return self.right.ravel()

    @property
    def preconditioner(self) -> LinearOperator:
        """An approximation of the inverse of A; symmetric, and positive unless the solution's constant is open."""
        return self._linear(self._precondition)

    def field(self, x: Array) -> SplineField:
        """Return the spline of the free coefficients x (N,) and of those that are fixed.

        Raises ValueError for another number of them.
        """
        if np.size(x) != self.right.size:
            raise ValueError(f"x must have {self.right.size} entries, the free coefficients, got {np.size(x)}")
        return self._spline(self._filled(np.reshape(x, self.right.shape)))

    def _filled(self, free: Array) -> Array:
        """Return the coefficients (c, n_u, n_v, n_w), those that are fixed included."""
        full = self.known.copy()
        full[:, *self.space.window] = free
        self.space.fill(full)
        return full

    def vector(self, field: SplineField) -> Array:
        """Return the free coefficients (N,) of a field of this space, or of one that it contains.

        Raises ValueError for any other field.
        """
        full = embedded(field.coefficients, field.degrees, field.knots, self.space)
        full = full[None] if full.ndim == 3 else np.moveaxis(full, -1, 0)
        return full[:, *self.space.window].ravel()

    def _spline(self, full: Array) -> SplineField:
        """Return the spline of coefficients (c, n_u, n_v, n_w), those of all processes together."""
        own = self.space.owned[self.space.comm.rank]
        whole = self.space.gather(full[:, : own.stop - own.start])
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
        """Solve, and return the solution with its errors and notices.

        how: tolerance, max_iterations, certified, device, start, estimate and strict, as in `iga_nn.solve`.
        Raises ConvergenceError where the linear solver fails before its first iteration, else only for `strict`.
        """
        options = SolverOptions(**how)
        check_device(options.device, self.problem)
        with one_blas_thread():
            solution = self._solve(options)
        for notice in solution.report.notices if self.space.comm.rank == 0 else ():
            log.warning("%s", notice)
        if options.strict and not solution.report.converged:
            raise ConvergenceError(solution.report.notices[-1], solution)
        return solution

    def _solve(self, options: SolverOptions) -> Solution:
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
        errors = estimate = None
        largest = max(space.shared(float(np.abs(full).max(initial=0.0))))
        has_norm = largest <= LARGEST_VALUE
        if has_norm and problem.exact is not None:
            errors = error_norms(volume, space, full, problem.exact_at, self.matrix.threads)
        if has_norm and (options.estimate or (options.estimate is None and problem.exact is None)):
            estimate = error_estimate(volume, space, full, problem, self._energy(result.x))
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

    def _energy(self, free: Array) -> float | None:
        """Return a(u_h, u_h) of free coefficients that solve the system, None where it is not the work of the loads."""
        lifted = sum(int(np.count_nonzero(face.values)) for face in self.weak)
        if not self.problem.form.symmetric or self.space.total(np.count_nonzero(self.known) + lifted):
            return None
        return float(self.space.total((self.right * free).sum()))

    def _iterate(self, options: SolverOptions) -> LinearResult:
        """Return what the linear solver finds: conjugate gradients, or GMRES where the law is not symmetric."""
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
    threads: int = 1,
    quadrature: str = "spline",
    shift: float = 0.0,
) -> System:
    """Return the system of a problem, its data placed in the volume (`problem.on`), on a trial space.

    shift: A is the law's matrix plus so many times the mass.
    """
    start = time.process_time()
    with one_blas_thread():
        operator, load, known = assemble_data(volume, problem, space, threads, quadrature)
        if shift == 0.0:
            weak = [face for face in operator.faces.values() if isinstance(face, WeakFace)]
            demand_supports(problem, space, weak, float(np.ptp(volume.control_points, axis=(0, 1, 2)).max()))
        else:
            operator = with_mass(volume, operator, problem.form, shift)
        blocks = (operator,) if isinstance(operator, Operator) else map(operator.block, range(len(known)))
        inverses = tuple(map(fast_diagonalization, blocks))
        if isinstance(operator, FormOperator) and inverses[0].singular:
            raise ValueError(
                f"{type(problem.form).__name__} without a reaction and with Neumann data on all faces leaves the "
                "solution open: give one face, or a region, a value or an exchange"
            )
        loads = load.copy()
        load -= operator.apply(known)
        space.add(load)
        right = np.ascontiguousarray(load[:, *space.window])
        right = balanced(right, space) if inverses[0].singular else right
        setup = time.process_time() - start
    return System(volume, problem, space, operator, known, inverses, right, loads, setup)


def assemble_data(
    volume: BSplineVolume,
    problem: BoundaryValueProblem,
    space: TrialSpace,
    threads: int = 1,
    quadrature: str = "spline",
) -> tuple[Operator | FormOperator, Array, Array]:
    """Return operator and load, the data on faces included, and the coefficients that are fixed."""
    form, couples = problem.form, False
    if isinstance(problem, Problem):
        samples = np.moveaxis(volume.grid(SAMPLES, SAMPLES, SAMPLES), -1, 0).reshape(3, -1)
        couples = check_law(form, Points.of(samples, (SAMPLES, SAMPLES, SAMPLES)))
    operator, load = assemble(
        volume,
        space,
        form,
        problem.source_at,
        rule_of(volume, space, form.tensor, quadrature),
        component=0 if form.components == 1 and form.symmetric and not couples else None,
        threads=threads,
    )
    with agreed(space.comm):
        if problem.conditions:
            terms: dict[str, Any] = _on_regions(volume, problem, space, load)
        else:
            terms = _on_faces(volume, problem, space, load)
    known = boundary_coefficients(volume, space.whole, problem.boundary_at, form.components)
    return replace(operator, faces=terms), load, known[:, space.rows].copy()


def _on_faces(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, load: Array
) -> dict[str, FaceRule]:
    """Add the data on the images of the cube's faces to a load, and return the faces that have Robin's term."""
    robin = {}
    for name in FACE_NAMES:
        if name in space.dirichlet or not has_face(space, name):
            continue
        face = face_rule(volume, space, name)
        alpha, data = problem.on_face(name, face.points, face.normal)
        if alpha is not None:
            robin[name] = replace(face, measure=alpha * face.measure)
        for density, total in zip(data, load, strict=True):
            total[face.layer] += face.integrate(density)
    return robin


def _on_regions(
    volume: BSplineVolume, problem: BoundaryValueProblem, space: TrialSpace, load: Array
) -> dict[str, WeakFace]:
    """Add the data on regions of the boundary to a load, and return the faces that have terms."""
    faces = weak_faces(volume, problem, space)
    demand_area(volume, problem, space, faces)
    for face in faces:
        face.add_load(load)
    return {face.name: face for face in faces}


def balanced(load: Array, space: TrialSpace) -> Array:
    """Return the free coefficients' load (1, ...) less its mean: of problems that leave the solution's constant open.

    The basis functions sum to one, so the load is then orthogonal to constants.
    Raises ValueError where the load's sum, the integral of source and fluxes, is not nearly zero.
    """
    total, size = float(space.total(load.sum())), float(space.total(np.abs(load).sum()))
    if abs(total) > LARGEST_IMBALANCE * size:
        raise ValueError(
            f"incompatible Neumann data: source plus flux integrate to {total:.4g}, must be 0 where no Dirichlet face, "
            "no Robin face and no reaction fixes the solution"
        )
    return load - total / space.dofs
