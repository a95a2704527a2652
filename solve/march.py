"""Marches through time with M u' + A u = f(t): BDF2 and the trapezoidal rule, step after step."""

import itertools
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Integral
from pathlib import Path
from typing import Any, Literal

import numpy as np

from parameterize.arrays import Array
from parameterize.conjugate_gradients import LinearResult, conjugate_gradients
from parameterize.display import Brief, above
from parameterize.old_names import takes_volume
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.threads import one_blas_thread

from .assembly import Assembled, assemble_body_data
from .diagnostics import ConvergenceError
from .discretization.grading import Grading
from .discretization.groups import OnPatches
from .discretization.projection import projected
from .discretization.unknowns import Unknowns, unknowns_of
from .field import BodyField, FieldOnBody
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.data import PerPatch, parse_each
from .forms.frame import UnitFrame
from .forms.owners import Owner, demand_owners, demand_positive, of_each_patch
from .linear.krylov import generalized_residuals
from .options import SolveOptions
from .patch_system import PatchProblem
from .preparation import prepared
from .system import System, coefficients_in, field_of, system_of

SCHEMES = ("bdf2", "trapezoidal")
EULER = 1.0  # the factors of capacity / dt that a step adds to the matrix
FACTORS = {"bdf2": 1.5, "trapezoidal": 2.0}

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class March(Brief):
    """Hold the solution u at some of the times of a march.

    Attributes
    ----------
    times : (k,) array
        The times of the fields; the first is the time of the start.
    fields : tuple of k BodyField
        The solution at these times.
    iterations : (steps,) array
        Number of iterations of the linear solver in each step.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> cooling = iga_nn.Poisson(source="0", boundary="0")
    >>> found = iga_nn.march(benchmark_volume(2), cooling, "1", dt=0.01, steps=4, every=2)
    >>> found.times.round(6).tolist(), len(found.fields)
    ([0.0, 0.02, 0.04], 3)
    """

    times: Array
    fields: tuple[BodyField, ...]
    iterations: Array

    def save_pvd(self, path: str | Path, samples: int | None = None) -> None:
        """Write NAME.pvd, which ParaView plays, and NAME_0000.vtu, NAME_0001.vtu, ... beside it; each file is atomic.

        samples: linear cells a span and direction, which can be sliced; None for exact Bezier cells.
        """
        above("io.view").write_series(Path(path), self.times, self.fields, samples)


@takes_volume
def march(
    body: BodyLike,
    problem: BoundaryValueProblem | Callable[[float], BoundaryValueProblem],
    start: FieldOnBody | PerPatch,
    *,
    dt: float,
    steps: int,
    scheme: Literal["bdf2", "trapezoidal"] = "bdf2",
    capacity: float | Mapping[Owner, float] = 1.0,
    first: float = 0.0,
    every: int = 1,
    callback: Callable[[float, BodyField], object] | None = None,
    refine: int = 0,
    degree: int | None = None,
    grading: Grading | None = None,
    threads: int | None = None,
    quadrature: str = SolveOptions.quadrature,
    tolerance: float = 1e-10,
    max_iterations: int = 1000,
) -> March:
    """Step through time: capacity du/dt - div flux + react = f, the law and its data those of a problem.

    Both schemes are of second order in dt. BDF2 damps a rough start, and its first step is Euler's; the
    trapezoidal rule keeps more energy, and oscillates where start and data on faces disagree.

    Parameters
    ----------
    body : BSplineVolume or Body
        The map, or the maps.
    problem : Poisson, Elasticity, Problem, or a function of the time that returns one
        A function changes the data from step to step: `lambda t: iga_nn.Poisson(source=f"{t}*x", boundary="0")`. The
        law stays that of the first time, and so do the faces where u is given.
    start : SplineField, BodyField or datum
        u at the first time: a field of the trial space or of a coarser space, or a datum: a formula, a function or a
        sequence, also one for each solid.
    dt : float
        The time step.
    steps : int
        Number of time steps.
    scheme : str
        "bdf2" or "trapezoidal".
    capacity : float, or dict of solid or patch to float
        The factor of du/dt, of the whole body or for each of its solids, {"steel": 3.6, "pad": 1.9}.
    first : float
        The time of the start.
    every : int
        Number of steps between two fields that are kept; the last field is always kept.
    callback : function, optional
        Function that is called with time and field after every step.
    refine, degree, grading, threads, quadrature, tolerance, max_iterations
        As in `iga_nn.solve`.

    Returns
    -------
    March

    Raises
    ------
    ValueError
        For arguments out of range, and faces that change.
    ConvergenceError
        Where the linear solver does not reach its tolerance in a step.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> warmed = lambda t: iga_nn.Poisson(source="0", boundary=f"{t}")
    >>> found = iga_nn.march(benchmark_volume(2), warmed, "0", dt=0.1, steps=10)
    >>> bool(0.8 < found.fields[-1]([[0.5, 0.5, 0.5]])[0] < 1.0)  # later than the walls
    True
    """
    _check(dt, steps, scheme, every)
    if callback is not None and not callable(callback):
        raise TypeError(f"callback must be a function of a time and a field, or None, got {callback!r:.80}")
    options = SolveOptions(
        refine=refine,
        degree=degree,
        grading=grading,
        threads=threads,
        quadrature=quadrature,
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    at = problem if callable(problem) else lambda _: problem
    glued = as_body(body)
    placed, patches = prepared(glued, at(first), options)
    rates = of_each_patch("capacity", capacity, glued.solids) / dt
    with one_blas_thread():
        data = _Data(glued, placed, patches, at, options, callable(problem))
        path = _Path(data, scheme, rates, _started(data, start, first), first)
        times, fields, iterations = [first], [path.field], []
        for number in range(1, steps + 1):
            iterations.append(path.step(first + number * dt))
            if callback is not None:
                callback(path.time, path.field)
            if number % every == 0 or number == steps:
                times.append(path.time)
                fields.append(path.field)
    return March(np.array(times), tuple(fields), np.array(iterations))


def _check(dt: float, steps: int, scheme: str, every: int) -> None:
    """Raise ValueError for arguments of `march` that are out of range."""
    demand_positive("dt", dt)
    for name, count in (("steps", steps), ("every", every)):
        if not (isinstance(count, Integral) and count >= 1):
            raise ValueError(f"{name} must be a whole number, at least 1, got {count!r:.80}")
    if scheme not in SCHEMES:
        raise ValueError(f"scheme must be one of {', '.join(SCHEMES)}, got {scheme!r:.80}")


@dataclass(frozen=True, eq=False)
class _Data:
    """Evaluate a problem at any time, on one trial space.

    placed, patches: the problem of the first time, placed in the body, and on each patch.
    """

    body: Body
    placed: BoundaryValueProblem
    patches: list[PatchProblem]
    problem_at: Callable[[float], Any]
    options: SolveOptions
    varies: bool

    @cached_property
    def unknowns(self) -> Unknowns:
        """Return the unknowns of all patches."""
        return unknowns_of([patch.space for patch in self.patches], self.body.interfaces)

    @cached_property
    def first(self) -> Assembled:
        """Return what is assembled for the first time."""
        return self._completed(assemble_body_data(self.patches, self.options))

    def _completed(self, found: Assembled) -> Assembled:
        """Return the same with all fixed coefficients of each patch."""
        return found._replace(known=found.matrix.layout.joined(self.unknowns.completed(found.known)))

    def at(self, time: float) -> Assembled:
        """Return the matrix of the law with the loads and the coefficients given on faces.

        Raises ValueError where the faces with given coefficients are others than at the first time.
        """
        if not self.varies:
            return self.first
        problem = self.problem_at(time)
        if problem.places != self.placed.places:
            raise ValueError(f"the problem of time {time:g} has data on other faces than that of the first time")
        each = zip(self.patches, problem.on(self.body).on_patches(self.body), strict=True)
        return self._completed(self.first.renewed([replace(patch, problem=given) for patch, given in each]))

    def filled(self, free: Array, known: OnPatches) -> OnPatches:
        """Return all coefficients from the unknowns (c, ...) and the coefficients given on faces."""
        return known.layout.joined(self.unknowns.spread(free)) + known

    def system(self, shifts: Array) -> System:
        """Return the system of the law plus the mass, times the shift (n,) of each patch."""
        first = self.first.shifted(shifts)
        return system_of(self.body, self.placed, self.patches, self.unknowns, first, is_loose=True)


def _started(data: _Data, start: FieldOnBody | PerPatch, time: float) -> OnPatches:
    """Return the coefficients of the start; those on faces follow from the data at `time`.

    A datum is projected on each patch: at an interface the mean of the patches' coefficients is taken.
    """
    if isinstance(start, FieldOnBody):
        full = coefficients_in(start, data.patches)
    else:
        datum = parse_each("start", start, data.placed.form.components, of_coordinates=data.placed.of_coordinates)
        placed, solids = datum.placed(UnitFrame.of(data.body)), data.body.solids
        if isinstance(start, Mapping):
            demand_owners("start", start.keys(), solids)
        own = itertools.starmap(placed.on_patch, enumerate(solids.of_patches))
        parts = zip(data.patches, own, strict=True)
        full = [projected(patch.volume, patch.space, values) for patch, values in parts]
    copies = data.unknowns.collect([np.ones(part.shape) for part in full])
    return data.filled(data.unknowns.collect(full) / copies, data.at(time).known)


class _Path:
    """Hold the state of a march: the time, and the last and earlier coefficients of all patches."""

    def __init__(self, data: _Data, scheme: str, rates: Array, start: OnPatches, time: float) -> None:
        """Begin a march at a time; rates: (n,), the capacity over dt of each patch."""
        self.data, self.scheme = data, scheme
        self.time, self.last, self.load = time, start, data.at(time).loads
        self.before: OnPatches | None = None
        self.rate = float(rates.max())
        self.system = data.system(FACTORS[scheme] * rates)
        self.mass = data.first.mass(rates / self.rate)

    @property
    def field(self) -> BodyField:
        """Return the field of the last coefficients."""
        return field_of(self.data.body, self.data.patches, self.last)

    def step(self, time: float) -> int:
        """March to a time, and return the number of iterations. Raises ConvergenceError."""
        new, unknowns = self.data.at(time), self.data.unknowns
        known, right = new.known, self._right(new.loads)
        found = self._solved(unknowns.collect(right - self._product(known)), unknowns.chosen(self._guess))
        if not found.converged:
            raise ConvergenceError(
                f"march: no convergence at time {time:g}, residual {found.residuals[-1]:.1e} after {found.iterations} "
                "iterations: raise max_iterations or the tolerance"
            )
        self.time, self.before, self.last, self.load = time, self.last, self.data.filled(found.x, known), new.loads
        log.info("time %g: %d iterations", time, found.iterations)
        return found.iterations

    @property
    def _guess(self) -> OnPatches:
        """Return the coefficients on the line through the earlier and the last ones."""
        return self.last if self.before is None else 2.0 * self.last - self.before

    @property
    def _is_euler(self) -> bool:
        """Return whether the next step is Euler's, the first one of BDF2."""
        return self.scheme == "bdf2" and self.before is None

    def _right(self, load: OnPatches) -> OnPatches:
        """Return the right-hand side of a step on all patches."""
        if self.scheme == "trapezoidal":  # f_new + f + (s M - A) last, s = 2 / dt: that of (A + s M) new
            shift = 2.0 * FACTORS[self.scheme] * self.rate
            return load + self.load + shift * self.mass.apply(self.last) - self.system.matrix.apply(self.last)
        if self.before is None:
            return load + EULER * self.rate * self.mass.apply(self.last)
        return load + 0.5 * self.rate * self.mass.apply(4.0 * self.last - self.before)

    def _product(self, x: OnPatches) -> OnPatches:
        """Return the matrix of a step times all coefficients: that of the system, and less of the mass for Euler's."""
        product = self.system.matrix.apply(x)
        if not self._is_euler:
            return product
        return product - (FACTORS[self.scheme] - EULER) * self.rate * self.mass.apply(x)

    def _solved(self, right: Array, guess: Array) -> LinearResult:
        """Return the solution of a step from an initial guess; all arrays have the shape (c, m_u, m_v, m_w)."""
        unknowns, options, joined = self.data.unknowns, self.data.options, self.last.layout.joined
        solver = conjugate_gradients if self.system.problem.form.symmetric else generalized_residuals

        def product(x: Array) -> Array:
            return unknowns.collect(self._product(joined(unknowns.spread(x))))

        return solver(product, right, self.system.precondition, options.tolerance, options.max_iterations, guess)
