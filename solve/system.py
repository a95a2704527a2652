"""Defines System: the linear system of a problem on a body, for `solve` or for a loop of the user's own."""

import functools
import logging
import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from scipy.sparse import bsr_array
from scipy.sparse.linalg import LinearOperator

from parameterize.arrays import Array, Mask, listed
from parameterize.conjugate_gradients import LinearResult, conjugate_gradients
from parameterize.spline.body import Body
from parameterize.spline.bspline import greville
from parameterize.spline.volume import FACE_NAMES
from parameterize.threads import one_blas_thread

from .assembly import Assembled, assemble_body_data, balanced
from .diagnostics import TOO_STIFF, ConvergenceError, failure, folded_notices, judge, map_notices
from .discretization.error_norms import Compared, Errors, error_norms, missing_mean
from .discretization.estimate import OnRegions, error_estimate, estimated_squares, why_not_estimated
from .discretization.grouped import BodyMatrix, Law, assemble_body
from .discretization.on_regions import demand_area, demand_supports
from .discretization.operator import FormOperator, Operator
from .discretization.parted import shared_unknowns
from .discretization.processes import Processes, most_memory
from .discretization.quadrature import GaussRule, operator_rule
from .discretization.residual import Solved
from .discretization.space import embedded, longest_edges
from .discretization.tie import Tie, tie_of
from .discretization.unknowns import Glued, Unknowns, Window
from .field import BodyField, FieldOnBody, SplineField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.mass import Mass
from .linear.krylov import generalized_residuals
from .linear.low_order import LowOrder, Survey, survey_of, surveyed, trilinear
from .linear.preconditioner import Componentwise, fast_diagonalization
from .options import IterationOptions, SolveOptions, check_device
from .patch_system import PatchProblem, PatchSystem, operators_of, systems_of
from .reactions import Balance, balance
from .solution import Solution, SolveReport

LARGEST_TOLERANCE = 0.5  # of an iteration that continues
LARGEST_VALUE = 1e150  # of a solution: the squares of larger ones overflow

log = logging.getLogger(__name__)

Preconditioner = Componentwise | LowOrder
TOLD = 10.0  # seconds between two lines on the iterations


class _Told:
    """Applies a product, and logs every ten seconds how often it has."""

    def __init__(self, product: Callable[[Array], Array], speaks: bool) -> None:
        self._product, self._speaks, self._count = product, speaks, 0
        self._start = self._last = time.monotonic()

    def __call__(self, x: Array) -> Array:
        now = time.monotonic()
        if self._speaks and now - self._last >= TOLD:
            self._last = now
            log.info("solving: %d iterations in %.0f seconds", self._count, now - self._start)
        self._count += 1
        return self._product(x)


@dataclass(frozen=True, eq=False)
class System:
    """State a problem on a body as a linear system A x = b of N free unknowns, in double precision, matrix-free.

    For a volume a vector (N,) holds the free coefficients in C order of (c, m_u, m_v, m_w): components, and functions a
    direction without those that Dirichlet data fix. For several patches it holds, for each component, the free
    coefficients of all patches, shared ones once. `operator`, `mass` and `preconditioner` are SciPy LinearOperators
    (N, N). Where processes share the space, arrays hold a process's rows and vectors its own rows; all processes call
    each method.

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

    body: Body
    problem: BoundaryValueProblem
    stated: Sequence[PatchProblem]  # on every patch of the body
    patches: tuple[PatchSystem, ...]  # of this process
    matrix: BodyMatrix  # of all patches
    unknowns: Unknowns
    inverse: Preconditioner
    is_open: bool  # whether a constant is in the kernel of A
    right: Array  # b, (c, ...): of the free coefficients
    setup: float = 0.0  # process seconds
    ties: Sequence[Tie] = ()  # of coefficients on two cuts

    formulation: ClassVar[str] = "displacement"  # of the unknowns

    @property
    def operator(self) -> LinearOperator:
        """Return A, with Robin's terms."""
        return self._linear(self.product)

    def product(self, x: Array) -> Array:
        """Return A times the free coefficients (c, ...)."""
        return self._product(x, self.matrix)

    def _product(self, x: Array, matrix: BodyMatrix) -> Array:
        return self._tied(self.unknowns.collect(matrix.apply(self.unknowns.spread(self._tied(x)))))

    def _tied(self, x: Array) -> Array:
        """Return the vector (c, ...) nearest to x that has u on one cut as on the other."""
        for tie in self.ties:
            x = tie(x)
        return x

    @functools.cached_property
    def mass(self) -> LinearOperator:
        """Return the mass matrix, the integrals of u . v."""
        return self.weighted_mass(np.ones(len(self.matrix.laws)))

    def weighted_mass(self, densities: Array) -> LinearOperator:
        """Return the integrals of density u . v, with the density (n,) of each patch."""
        rules: dict[int, GaussRule] = {}
        laws = []
        for law, density in zip(self.matrix.laws, densities.tolist(), strict=True):
            if id(law.rule) not in rules:
                rules[id(law.rule)] = operator_rule(law.space, "spline")
            laws.append(Law(law.volume, law.space, rules[id(law.rule)], Mass(density), same=density))
        whole, _ = assemble_body(self.matrix.layout, laws, self.matrix.parts[0].threads)
        return self._linear(lambda x: self._product(x, whole))

    @property
    def load(self) -> Array:
        """Return the right-hand side b (N,): source and data on faces, minus A times the fixed coefficients."""
        return self.right.ravel()

    @property
    def preconditioner(self) -> LinearOperator:
        """Return an approximate inverse of A; it is symmetric, and positive unless the solution's constant is open."""
        return self._linear(self.precondition)

    @property
    def points(self) -> Array:
        """Return the points (m, 3) of the free coefficients of a component: the images of their Greville points."""
        grids = []
        for patch in self.patches:
            u, v, w = (
                greville(knots, degree) for knots, degree in zip(patch.space.knots, patch.space.degrees, strict=True)
            )
            grids.append(np.moveaxis(patch.volume.grid(u, v, w), -1, 0))
        return self.unknowns.chosen(grids).reshape(3, -1).T

    def at_rest(self) -> "System":
        """Return the same system with the value zero wherever values are given; its fields are zero there."""
        return replace(self, patches=tuple(patch.at_rest() for patch in self.patches))

    def field(self, x: Array) -> BodyField:
        """Return the spline on each patch of the free coefficients x (N,) and the fixed coefficients.

        Raises ValueError for another number of coefficients.
        """
        if np.size(x) != self.right.size:
            raise ValueError(f"x must have {self.right.size} entries, the free coefficients, got {np.size(x)}")
        return self._field(self._filled(np.reshape(x, self.right.shape)))

    def _field(self, full: Sequence[Array]) -> BodyField:
        """Return the field of the coefficients (c, n_u, n_v, n_w) of each patch of this process."""
        return field_of(self.body, self.stated, self.unknowns.whole(full))

    def _filled(self, free: Array) -> list[Array]:
        """Return all coefficients (c, n_u, n_v, n_w) of each patch, with the fixed coefficients."""
        found = []
        for patch, full in zip(self.patches, self.unknowns.spread(free), strict=True):
            full += patch.known
            found.append(full)
        return found

    def vector(self, field: FieldOnBody) -> Array:
        """Return the free coefficients (N,) of a field in this space, or in a space that this one contains.

        Raises ValueError for any other field.
        """
        return self.unknowns.chosen(coefficients_in(field, self.stated, self.unknowns.patches)).ravel()

    def precondition(self, residual: Array) -> Array:
        """Return the preconditioner times the free coefficients (c, ...)."""
        return self._tied(self.inverse(self._tied(residual))) if self.ties else self.inverse(residual)

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
        self._demand_device(options.device)
        with one_blas_thread():
            solution = self._solve(options)
        for notice in solution.report.notices if self.unknowns.processes.rank == 0 else ():
            log.warning("%s", notice)
        if options.strict and not solution.report.converged:
            raise ConvergenceError(solution.report.notices[-1], solution)
        return solution

    def _demand_device(self, device: str) -> None:
        """Raise ValueError for a device that cannot solve the system."""
        if device != "cpu" and self.formulation == "mixed":
            raise ValueError(f"formulation 'mixed' is solved on device='cpu' only, got device={device!r}")
        check_device(device, self.problem)
        if device != "cpu" and len(self.unknowns.processes.shared(None)) > 1:
            raise ValueError(f"several processes solve on device='cpu' only, got device={device!r}")

    def _solve(self, options: IterationOptions) -> Solution:
        problem, processes = self.problem, self.unknowns.processes
        dofs = problem.form.components * self.unknowns.count
        clock, sent = [time.process_time()], processes.traffic()
        result = self._iterate(options)
        failed = failure(self.stated, result, problem.form.caveat, self.formulation)
        if failed and result.iterations == 0:  # there is the start alone
            raise ConvergenceError(failed)
        steps = result.iterations + (options.start is not None)  # products made
        traffic = {kind: (count - sent.get(kind, 0)) / steps for kind, count in processes.traffic().items() if steps}
        full = self._completed(result.x)
        clock.append(time.process_time())
        largest = max(processes.shared(max(float(np.abs(part).max(initial=0.0)) for part in full)))
        has_norm = largest <= LARGEST_VALUE
        errors, estimate = self._errors(full, result.x, options.estimate) if has_norm else (None, None)
        clock.append(time.process_time())
        doubtful, meaningful = judge(problem, self.stated, errors, estimate if result.converged else None, dofs)
        if errors is None and problem.form.caveat:
            doubtful.append(f"the error is not estimated: {problem.form.caveat}; compare two refinements")
        elif errors is None and len(self.stated) > 1 and (why := self._unknown):
            doubtful.append(f"the error is not estimated: {why}; compare two refinements")
        if problem.form.caveat and self.formulation == "displacement":
            doubtful.append(TOO_STIFF)
        if not has_norm:
            doubtful.append(f"the solution reaches {largest:.1e}, too large for its norms: choose other units")
        weaknesses = processes.shared(self.inverse.weakness)
        of_map = map_notices(self.stated, options.certified, weaknesses, self._folded)
        spaces = [patch.space for patch in self.patches]
        report = SolveReport(
            elements=sum(patch.space.elements for patch in self.stated),
            dofs=dofs,
            h=max(processes.shared(longest_edges([own.volume for own in self.patches], spaces))),
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
            memory=most_memory(processes),
            balance=self._balance(full) if has_norm else None,
            formulation=self.formulation,
        )
        return self._solution(full, report)

    def continued(self, start: Array, share: float, options: IterationOptions) -> Solution:
        """Return the solution from the free coefficients `start` (N,), whose residual falls to a share of its own.

        The report has no errors and no notices. The tolerance of the options is the least residual.
        """
        clock, guess = time.process_time(), start.reshape(self.right.shape)
        with one_blas_thread():
            tolerance = float(np.clip(share * self._size(guess), options.tolerance, LARGEST_TOLERANCE))
            result = self._iterate(replace(options, tolerance=tolerance, start=None), guess)
            full = self._completed(result.x)
            spaces = [patch.space for patch in self.patches]
            report = SolveReport(
                elements=sum(patch.space.elements for patch in self.stated),
                dofs=self.problem.form.components * self.unknowns.count,
                h=max(self.unknowns.processes.shared(longest_edges([own.volume for own in self.patches], spaces))),
                iterations=result.iterations,
                converged=result.converged,
                residual=result.residuals[-1],
                seconds={"setup": self.setup, "solve": time.process_time() - clock},
                residuals=result.residuals,
                balance=self._balance(full),
                formulation=self.formulation,
            )
        return self._solution(full, report)

    def _solution(self, full: Sequence[Array], report: SolveReport) -> Solution:
        return Solution.of(self._field(full), [patch.problem for patch in self.stated], report, self.problem)

    def _completed(self, free: Array) -> list[Array]:
        """Return all coefficients of a solution (c, n_u, n_v, n_w) of each patch, where it is open with its mean."""
        full = self._filled(free)
        if not self.is_open:
            return full
        mean = missing_mean(self._parts(full), self.unknowns.processes)
        return [part + mean for part in full]

    def _size(self, x: Array) -> float:
        """Return the residual of x (c, ...) over the right-hand side, as the iteration measures it."""
        total = self.unknowns.processes.total
        rest, size = (float(total(float(np.square(part).sum()))) for part in (self.right - self.product(x), self.right))
        return math.sqrt(rest / size) if size > 0.0 else 0.0

    @property
    def _folded(self) -> Sequence[str]:
        """Return a line on each patch, of all processes, at whose points det J has the wrong sign."""
        own = [line for patch in self.patches for line in folded_notices(patch)]
        return list(dict.fromkeys(line for lines in self.unknowns.processes.shared(own) for line in lines))

    def _balance(self, full: Sequence[Array]) -> Balance:
        """Return the balance of a solution."""
        products, matrix = self.matrix.apply(full), self.matrix
        return balance(self.problem, self.patches, self.unknowns, matrix.faces, full, products, matrix.couplings)

    def _parts(self, full: Sequence[Array]) -> list[Compared]:
        """Return coefficients (c, n_u, n_v, n_w) of each patch with the exact values, zero where none are known."""
        exact = self.problem.exact is not None
        return [
            Compared(
                patch.volume,
                patch.space,
                own,
                patch.problem.exact_at if exact else _nothing,
                patch.problem.in_volume if exact and len(full) > 1 else None,
            )
            for patch, own in zip(self.patches, full, strict=True)
        ]

    def _errors(
        self, full: Sequence[Array], free: Array, is_estimated: bool | None
    ) -> tuple[Errors | None, Errors | None]:
        """Return the errors of a solution, None without an exact one, and their estimate, None unless it is wanted.

        full: all coefficients of each patch. free: the free coefficients. is_estimated: whether to estimate; None for
        problems without an exact solution only.
        """
        errors = estimate = None
        if self.problem.exact is not None:
            errors = error_norms(self._parts(full), self.patches[0].matrix.threads, self.unknowns.processes)
        is_wanted = self.problem.exact is None if is_estimated is None else is_estimated
        if is_wanted and not self._unknown:
            solved, processes = self._solved(full), self.unknowns.processes
            with self.unknowns.agreed(), solved[0].space.agreed():
                squares = estimated_squares(solved, self.body.interfaces, list(self._on_regions(full)))
            estimate = error_estimate(processes.total(squares), self._work(free), self._energy(full))
        return errors, estimate

    @property
    def _unknown(self) -> str:
        """Return why the error cannot be estimated; "" where it can."""
        return why_not_estimated([patch.space for patch in self.stated], [patch.problem for patch in self.stated])

    def _solved(self, full: Sequence[Array]) -> list[Solved]:
        """Return the solution on each patch, of one cube that processes share on their rows."""
        names: list[list[str]] = [[] for _ in self.patches]
        for face in self.matrix.weak:
            for place in face.patches:
                names[place].append(face.name)
        if self.body.is_single:
            return [Solved(own.volume, own.space, own.problem, full[0], names[0]) for own in self.patches]
        regions = dict(zip(self.unknowns.patches, names, strict=True))
        return [
            Solved(one.volume, one.space, one.problem, whole, regions.get(number, ()), number in regions)
            for number, (one, whole) in enumerate(zip(self.stated, self.unknowns.whole(full), strict=True))
        ]

    def _on_regions(self, full: Sequence[Array]) -> Iterator[OnRegions]:
        """Yield the terms of conditions on regions, with their spaces and the coefficients of their patches."""
        coefficients = self.matrix.layout.joined(full)
        for face in self.matrix.weak:
            whole = face
            for coupling in self.matrix.couplings:
                whole = whole if whole is not face else coupling.completed(face, coefficients)
            yield whole, self.patches[face.patches[0]].space, coefficients.of(face.patches)

    @property
    def has_given_values(self) -> bool:
        """Return whether values other than zero are given somewhere."""
        given: Any = sum(np.count_nonzero(patch.known) for patch in self.patches)
        given += sum(np.count_nonzero(face.values) for face in self.matrix.weak)
        return bool(self.unknowns.processes.total(given))

    def _energy(self, full: Sequence[Array]) -> float | None:
        """Return a(u_h, u_h); None for a law that is not symmetric."""
        if not self.problem.form.symmetric:
            return None
        products = self.matrix.apply(self.matrix.layout.joined(full))
        found = sum(float((own * product).sum()) for own, product in zip(full, products, strict=True))
        return float(self.unknowns.processes.total(found))

    def _work(self, free: Array) -> float | None:
        """Return a(u_h, u_h) of free coefficients that solve the system; None where it is not the work of the loads."""
        has_given = self.has_given_values  # of all processes
        if not self.problem.form.symmetric or has_given:
            return None
        return float(self.unknowns.processes.total((self.right * free).sum()))

    def _iterate(self, options: IterationOptions, guess: Array | None = None) -> LinearResult:
        """Return the result of conjugate gradients, or of GMRES where the law is not symmetric.

        guess: where the iteration starts, (c, ...); by default at the start of the options.
        """
        limits = options.tolerance, options.max_iterations
        guess = None if guess is None else self._tied(guess)
        if options.start is not None:
            guess = self._tied(self.vector(options.start).reshape(self.right.shape))
        if options.device != "cpu":
            from .linear.cuda import solve_on_device

            whole = self.unknowns, self.matrix, self.inverse, self.right
            return solve_on_device(*whole, *limits, options.device, guess)
        if self.problem.form.symmetric:
            processes = self.unknowns.processes
            system = _Told(self.product, processes.rank == 0), self.right, self.precondition
            return conjugate_gradients(*system, *limits, guess, processes.total)
        # the vectors of GMRES are whole on every process, products and preconditioner are shared
        joined, own = self.unknowns.joined, (slice(None), self.unknowns.place)
        found = generalized_residuals(
            lambda x: joined(self.product(x[own])),
            joined(self.right),
            lambda x: joined(self.precondition(x[own])),
            *limits,
            None if guess is None else joined(guess),
        )
        return replace(found, x=found.x[own])


def coefficients_in(
    field: FieldOnBody, patches: Sequence[PatchProblem], wanted: Sequence[int] | None = None
) -> list[Array]:
    """Return the coefficients (c, n_u, n_v, n_w) of a field in the space of each patch, which contains the field's.

    wanted: the numbers of the patches whose coefficients are returned; by default all. Raises ValueError for any other
    field, TypeError for what is no field.
    """
    if not isinstance(field, FieldOnBody):
        raise TypeError(f"start must be a field of the trial space, such as solution.field, got {field!r:.80}")
    if len(field.patches) != len(patches):
        raise ValueError(f"the field has {len(field.patches)} patches, the body {len(patches)}")
    found = []
    for own, patch in ((field.patches[i], patches[i]) for i in wanted or range(len(patches))):
        full = embedded(own.coefficients, own.degrees, own.knots, patch.space)
        found.append(full[None] if full.ndim == 3 else np.moveaxis(full, -1, 0))
        if len(found[-1]) != (components := patch.problem.form.components):
            raise ValueError(f"start has {len(found[-1])} components, the law {components}")
    return found


def field_of(body: Body, patches: Sequence[PatchProblem], full: Sequence[Array]) -> BodyField:
    """Return the field of coefficients (c, n_u, n_v, n_w) of each patch of a body."""
    found = []
    for patch, whole in zip(patches, full, strict=True):
        coefficients = whole[0] if len(whole) == 1 else np.moveaxis(whole, 0, -1)
        found.append(SplineField(patch.space.degrees, patch.space.whole.knots, coefficients, patch.volume))
    return BodyField(tuple(found), body)


def _nothing(x: Array) -> tuple[Array, None]:
    """Return the value zero (1, ...) at points (3, ...)."""
    return np.zeros((1, *x.shape[1:])), None


def build(
    body: Body,
    problem: BoundaryValueProblem,
    patches: Sequence[PatchProblem],
    options: SolveOptions,
    is_loose: bool = False,
) -> System:
    """Return the system of a problem on a body, whose data are placed in it (`problem.on`).

    patches: the problem on each patch. is_loose: whether motions that nothing holds are no fault.
    """
    start = time.process_time()
    with one_blas_thread():
        unknowns = shared_unknowns(body, [patch.space for patch in patches], options.comm)
        found = assemble_body_data([patches[number] for number in unknowns.patches], options, unknowns)
        system = system_of(body, problem, patches, unknowns, found, is_loose)
    return replace(system, setup=time.process_time() - start)


def system_of(
    body: Body,
    problem: BoundaryValueProblem,
    patches: Sequence[PatchProblem],
    unknowns: Unknowns,
    found: Assembled,
    is_loose: bool,
) -> System:
    """Return the system of `build` from the unknowns and what is assembled on the patches of this process."""
    matrix, loads = found.matrix, found.loads
    problem, patches = problem.sharing(found.conditions), found.stated(patches)
    known = matrix.layout.joined(unknowns.completed(found.known))
    systems = systems_of([patches[number] for number in unknowns.patches], found._replace(known=known))
    components = loads.components
    operators = (
        operators_of(matrix, components)[0] if is_diagonalized(unknowns, components) and not matrix.couplings else ()
    )
    survey = survey_of(matrix, [[own] for own in operators]) if operators else surveyed(matrix)
    _demand_held(body, problem, systems, matrix, unknowns, survey.free, is_loose)
    is_open = all(unknowns.processes.shared(bool(survey.free.all())))
    if is_open and not is_loose and isinstance(systems[0].matrix, FormOperator):
        raise ValueError(
            f"{type(problem.form).__name__} without a reaction, and with Neumann data on all faces, does not "
            "determine the solution: give a value, or an exchange, on a face or a region"
        )
    ties = [] if is_loose or len(matrix.couplings) > 1 else [tie_of(one, glued(unknowns)) for one in matrix.couplings]
    held = [tie for tie in ties if tie is not None]
    if held:
        matrix = replace(matrix, couplings=[replace(one, is_tied=True) for one in matrix.couplings])
    right = unknowns.collect(loads - matrix.apply(known))
    for tie in held:
        right = tie(right)
    right = balanced(right, unknowns) if is_open and not is_loose else right
    inverse = preconditioner(
        body,
        unknowns,
        survey,
        operators,
        lambda nodes: trilinear(nodes, matrix),
        is_loose,
    )
    return System(body, problem, patches, systems, matrix, unknowns, inverse, is_open, right, ties=held)


def is_diagonalized(unknowns: Unknowns, components: int) -> bool:
    """Return whether fast diagonalization serves: one patch with one component, or with all faces held.

    Components and faces of such patches couple little. Slabs of processes have no other preconditioner.
    """
    if not isinstance(unknowns, Window):
        return False
    space = unknowns.space
    return components == 1 or len(space.dirichlet) == len(FACE_NAMES) or space.whole is not space


def preconditioner(
    body: Body,
    unknowns: Unknowns,
    survey: Survey,
    operators: Sequence[Operator],
    low_order: Callable[[Glued], bsr_array],
    is_loose: bool,
) -> Preconditioner:
    """Return the preconditioner of a matrix: fast diagonalization where it serves, otherwise low order.

    operators: those of the components on the only patch where they are diagonalized, none otherwise. low_order:
    returns the matrix of trilinear functions on nodes.
    """
    if operators:
        return Componentwise(tuple(map(fast_diagonalization, operators, survey.diagonal[0])))
    return LowOrder.of(body, glued(unknowns), low_order, survey, is_loose)


def glued(unknowns: Unknowns) -> Glued:
    """Return the unknowns of a body, those of a single patch numbered one after another."""
    if isinstance(unknowns, Window):
        return Glued.of([unknowns.space], ())
    assert isinstance(unknowns, Glued)
    return unknowns


def _demand_held(
    body: Body,
    problem: BoundaryValueProblem,
    systems: Sequence[PatchSystem],
    matrix: BodyMatrix,
    unknowns: Unknowns,
    free: Mask,
    is_loose: bool,
) -> None:
    """Raise ValueError where a region has no area, and where a part of a body that is not loose is free to move.

    matrix: has the terms of conditions on regions. free: which of the patches leave a constant free.
    """
    weak, couplings = matrix.weak, matrix.couplings
    processes, here = unknowns.processes, dict(zip(unknowns.patches, systems, strict=True))
    demand_area(problem, weak, processes, body.patches)
    if is_loose:
        return
    parts = body.parts
    for numbers in parts:
        part = [here[number] for number in numbers if number in here]
        own = np.flatnonzero(np.isin(unknowns.patches, numbers))
        faces = [face.on(own) for face in weak] if len(parts) > 1 else weak
        within = [one for one in couplings if one.is_within(numbers)]
        named = listed([f"p{number}" for number in numbers])
        try:
            if problem.conditions and not processes.total(sum(len(system.space.dirichlet) for system in part)):
                demand_supports(problem, faces, processes, [body.patches[number] for number in numbers], within)
        except ValueError as error:
            raise ValueError(f"{named}: {error}" if len(parts) > 1 else str(error)) from None
        if len(parts) > 1:
            demand_fixed(numbers, free[np.isin(unknowns.patches, numbers)], processes)


def demand_fixed(part: Sequence[int], free: Mask, processes: Processes) -> None:
    """Raise ValueError where a part of a body, patches by their numbers, leaves a constant free.

    free: which of its patches on this process do.
    """
    if all(processes.shared(bool(free.all()))):
        named = listed([f"p{number}" for number in part])
        raise ValueError(f"nothing fixes the solution on {named}, a part of its own: give it a value, or glue it")
