"""Marches through time with M u' + A u = f(t): BDF2 and the trapezoidal rule, step after step."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Literal

import numpy as np

from parameterize.arrays import Array
from parameterize.conjugate_gradients import LinearResult, conjugate_gradients
from parameterize.display import Brief, above
from parameterize.spline.volume import BSplineVolume, demand_volume
from parameterize.threads import one_blas_thread

from .assembly import assemble_data
from .diagnostics import ConvergenceError
from .discretization.operator import MatrixFree, Operator, assemble
from .discretization.projection import projected
from .discretization.quadrature import GaussRule
from .discretization.space import TrialSpace, embedded
from .field import SplineField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.data import Data, parse
from .forms.frame import UnitFrame
from .forms.mass import Mass
from .linear.krylov import generalized_residuals
from .options import IterationOptions, SolveOptions
from .patch_system import PatchProblem
from .solver import prepared
from .system import System, build

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
    fields : tuple of k SplineField
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
    fields: tuple[SplineField, ...]
    iterations: Array

    def save_pvd(self, path: str | Path, samples: int | None = None) -> None:
        """Write NAME.pvd, which ParaView plays, and NAME_0000.vtu, NAME_0001.vtu, ... beside it; each file is atomic.

        samples: linear cells a span and direction, which can be sliced; None for exact Bezier cells.
        """
        above("io.series").write_series(Path(path), self.times, self.fields, samples)


def march(
    volume: BSplineVolume,
    problem: BoundaryValueProblem | Callable[[float], BoundaryValueProblem],
    start: SplineField | Data,
    *,
    dt: float,
    steps: int,
    scheme: Literal["bdf2", "trapezoidal"] = "bdf2",
    capacity: float = 1.0,
    first: float = 0.0,
    every: int = 1,
    callback: Callable[[float, SplineField], object] | None = None,
    refine: int = 0,
    degree: int | None = None,
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
    volume : BSplineVolume
        The map.
    problem : Poisson, Elasticity, Problem, or a function of the time that returns one
        A function changes the data from step to step: `lambda t: iga_nn.Poisson(source=f"{t}*x", boundary="0")`. The
        law stays that of the first time, and so do the faces where u is given.
    start : SplineField or datum
        u at the first time: a field of the trial space or of a coarser space, or a datum: a formula, a function or a
        sequence.
    dt : float
        The time step.
    steps : int
        Number of time steps.
    scheme : str
        "bdf2" or "trapezoidal".
    capacity : float
        The factor of du/dt.
    first : float
        The time of the start.
    every : int
        Number of steps between two fields that are kept; the last field is always kept.
    callback : function, optional
        Function that is called with time and field after every step.
    refine, degree, threads, quadrature, tolerance, max_iterations
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
    _check(dt, steps, scheme, capacity, every)
    options = SolveOptions(
        refine=refine,
        degree=degree,
        threads=threads,
        quadrature=quadrature,
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    at = problem if callable(problem) else lambda _: problem
    demand_volume(volume)
    _, (patch,) = prepared(volume, at(first), options)
    with one_blas_thread():
        data = _Data(patch, at, options, callable(problem))
        path = _Path(data, scheme, capacity / dt, _started(data, start, first), first)
        times, fields, iterations = [first], [path.field], []
        for number in range(1, steps + 1):
            iterations.append(path.step(first + number * dt))
            if callback is not None:
                callback(path.time, path.field)
            if number % every == 0 or number == steps:
                times.append(path.time)
                fields.append(path.field)
    return March(np.array(times), tuple(fields), np.array(iterations))


def _check(dt: float, steps: int, scheme: str, capacity: float, every: int) -> None:
    """Raise ValueError for arguments of `march` that are out of range."""
    for name, value in (("dt", dt), ("capacity", capacity)):
        if not (isinstance(value, Real) and 0.0 < value < np.inf):
            raise ValueError(f"{name} must be a positive number, got {value!r:.80}")
    for name, count in (("steps", steps), ("every", every)):
        if not (isinstance(count, Integral) and count >= 1):
            raise ValueError(f"{name} must be a whole number, at least 1, got {count!r:.80}")
    if scheme not in SCHEMES:
        raise ValueError(f"scheme must be one of {', '.join(SCHEMES)}, got {scheme!r:.80}")


@dataclass(frozen=True, eq=False)
class _Data:
    """Evaluate a problem at any time, on one trial space.

    patch: the problem of the first time, placed in the volume.
    """

    patch: PatchProblem
    problem_at: Callable[[float], Any]
    options: SolveOptions
    varies: bool

    @property
    def volume(self) -> BSplineVolume:
        """Return the volume."""
        return self.patch.volume

    @property
    def placed(self) -> BoundaryValueProblem:
        """Return the problem of the first time, placed in the volume."""
        return self.patch.problem

    @property
    def space(self) -> TrialSpace:
        """Return the trial space."""
        return self.patch.space

    def at(self, time: float) -> tuple[Array, Array]:
        """Return the load and the coefficients given on faces, (c, n_u, n_v, n_w) each.

        Raises ValueError where the faces with given coefficients are others than at the first time.
        """
        return self._found(self.problem_at(time), time) if self.varies else self._constant

    @cached_property
    def _constant(self) -> tuple[Array, Array]:
        return self._found(self.placed, 0.0)

    def _found(self, problem: BoundaryValueProblem, time: float) -> tuple[Array, Array]:
        if problem.places != self.placed.places:
            raise ValueError(f"the problem of time {time:g} has data on other faces than that of the first time")
        given = problem.on(self.volume)
        _, load, known = assemble_data(self.volume, given, self.space, self.options)
        return load, known

    def system(self, shift: float) -> System:
        """Return the system of the law plus `shift` times the mass."""
        return build(self.volume, self.placed, [self.patch], self.options, shift)

    def mass(self, rule: GaussRule) -> Operator:
        """Return the mass matrix of all coefficients, by the quadrature rule of a system.

        The mass by another rule would act as a source.
        """
        found, _ = assemble(self.volume, self.space, Mass(), rule=rule, threads=self.options.thread_count)
        assert isinstance(found, Operator)
        return found


def _started(data: _Data, start: SplineField | Data, time: float) -> Array:
    """Return the coefficients (c, n_u, n_v, n_w) of the start; coefficients on faces follow from the data at `time`."""
    space, components = data.space, data.placed.form.components
    if isinstance(start, SplineField):
        full = embedded(start.coefficients, start.degrees, start.knots, space)
        full = np.array(full[None] if full.ndim == 3 else np.moveaxis(full, -1, 0))
        if len(full) != components:
            raise ValueError(f"start has {len(full)} components, the law {components}")
    else:
        datum = parse("start", start, components, of_coordinates=data.placed.of_coordinates)
        full = projected(data.volume, space, datum.placed(UnitFrame.of(data.volume)))
    _, known = data.at(time)
    inside = full[:, *space.window].copy()
    full = known.copy()
    full[:, *space.window] = inside
    return full


class _Path:
    """Hold the state of a march: the time, and the last and earlier coefficients, (c, n_u, n_v, n_w) each."""

    def __init__(self, data: _Data, scheme: str, rate: float, start: Array, time: float) -> None:
        """Begin a march at a time; rate: the capacity over dt."""
        self.data, self.scheme, self.rate = data, scheme, rate
        self.time, self.last, self.load = time, start, data.at(time)[0]
        self.before: Array | None = None
        self.system = data.system(FACTORS[scheme] * rate)
        self.mass = data.mass(self.matrix.rule)

    @property
    def matrix(self) -> MatrixFree:
        """Return the matrix of the system that most steps solve."""
        return self.system.patches[0].matrix

    @property
    def field(self) -> SplineField:
        """Return the spline of the last coefficients."""
        space = self.data.space
        coefficients = self.last[0] if len(self.last) == 1 else np.moveaxis(self.last, 0, -1)
        return SplineField(space.degrees, space.knots, coefficients, self.data.volume)

    def step(self, time: float) -> int:
        """March to a time, and return the number of iterations. Raises ConvergenceError."""
        load, known = self.data.at(time)
        system, right = self._equation(load)
        window = (slice(None), *self.data.space.window)
        right = np.ascontiguousarray((right - system.patches[0].matrix.apply(known))[window])
        guess = self.last if self.before is None else 2.0 * self.last - self.before
        found = _solved(system, right, np.ascontiguousarray(guess[window]), self.data.options)
        if not found.converged:
            raise ConvergenceError(
                f"march: no convergence at time {time:g}, residual {found.residuals[-1]:.1e} after {found.iterations} "
                "iterations: raise max_iterations or the tolerance"
            )
        new = known.copy()
        new[window] = found.x
        self.time, self.before, self.last, self.load = time, self.last, new, load
        log.info("time %g: %d iterations", time, found.iterations)
        return found.iterations

    def _equation(self, load: Array) -> tuple[System, Array]:
        """Return the system of a step and its right-hand side, (c, n_u, n_v, n_w)."""
        mass = self.mass.apply
        if self.scheme == "trapezoidal":  # (A + s M) new = f_new + f + (s M - A) last, s = 2 / dt
            shifted = self.matrix.apply(self.last)
            return self.system, load + self.load + 2.0 * FACTORS[self.scheme] * self.rate * mass(self.last) - shifted
        if self.before is None:
            return self.data.system(EULER * self.rate), load + EULER * self.rate * mass(self.last)
        return self.system, load + 0.5 * self.rate * mass(4.0 * self.last - self.before)


def _solved(system: System, right: Array, guess: Array, options: IterationOptions) -> LinearResult:
    """Return the solution of a step's system from an initial guess; all arrays have the shape (c, m_u, m_v, m_w)."""
    solver = conjugate_gradients if system.problem.form.symmetric else generalized_residuals
    return solver(system.product, right, system.precondition, options.tolerance, options.max_iterations, guess)
