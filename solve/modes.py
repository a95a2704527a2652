"""Computes modes by LOBPCG: the lowest vibrations of a body, or eigenfunctions of any symmetric law."""

import math
import warnings
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse.linalg import LinearOperator, lobpcg

from parameterize.arrays import Array
from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.display import Brief
from parameterize.files import save_arrays
from parameterize.spline.multipatch import MultiPatch, as_multipatch, size_of
from parameterize.spline.volume import BSplineVolume

from .diagnostics import ConvergenceError
from .field import MultiPatchField, arrays_of
from .forms.boundary_value_problem import BoundaryValueProblem
from .options import SolveOptions
from .solver import discretized
from .system import System

SPARE = 4  # vectors more than are wanted, and half as many as these again: the last ones converge slowly
ROUND = 8  # iterations before the first look at the residuals; each round is as long as all before
AT_REST = 1e-7  # share of the shift below which an eigenvalue is that of a rigid motion
INNER, INNER_MOST = 0.1, 500  # tolerance and iterations of the solves that precondition: K of a slender body is hard
RIGID = {1: 1, 3: 6}  # motions of a free part of a body that take no energy, by the law's components


@dataclass(frozen=True, eq=False, repr=False)
class Modes(Brief):
    """Hold the lowest modes of a body.

    Attributes
    ----------
    frequencies : (n,) array
        omega / (2 pi) for K phi = omega^2 M phi: in Hz where the units are consistent and time is in seconds.
    shapes : tuple of n SplineField, of several patches MultiPatchField
        phi with unit mass: the integral of density phi . phi is 1. The largest coefficient is positive.
    residuals : (n,) array
        Residuals `|K phi - omega^2 M phi| / |K phi|` of the free coefficients.
    iterations : int
        Number of iterations of LOBPCG.
    rigid : int
        Number of motions of a free body that need no energy; their frequency is zero, and they are left out.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> print(iga_nn.modes(benchmark_volume(2), iga_nn.Poisson(source="0"), n=2))
    mode  frequency
       1     0.8939
       2      1.253
    """

    frequencies: Array
    shapes: tuple[Any, ...]  # SplineField, or MultiPatchField
    residuals: Array
    iterations: int
    rigid: int = 0

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers of the modes for report.json."""
        return {
            "frequencies": self.frequencies,
            "residuals": self.residuals,
            "iterations": self.iterations,
            "rigid": self.rigid,
        }

    def save(self, path: str | Path) -> None:
        """Write degrees, knots_u, knots_v, knots_w, coefficients (n, m_u, m_v, m_w, ..) and frequencies atomically.

        Of several patches there are p0_degrees, .., p0_coefficients, p1_degrees, .. in their place.
        """
        first = self.shapes[0]
        if isinstance(first, MultiPatchField):
            each = zip(*(shape.patches for shape in self.shapes), strict=True)
            stacked = [np.stack([field.coefficients for field in fields]) for fields in each]
            save_arrays(path, **arrays_of(first.patches, stacked), frequencies=self.frequencies)
            return
        rows = dict(zip(("knots_u", "knots_v", "knots_w"), first.knots, strict=True))
        coefficients = np.stack([shape.coefficients for shape in self.shapes])
        degrees = np.array(first.degrees)
        save_arrays(path, degrees=degrees, **rows, coefficients=coefficients, frequencies=self.frequencies)

    def __str__(self) -> str:
        rows = [f"{i:4d} {frequency:10.4g}" for i, frequency in enumerate(self.frequencies, start=1)]
        return "\n".join(["mode  frequency", *rows])


def modes(
    body: BSplineVolume | MultiPatch,
    law: BoundaryValueProblem,
    density: float = 1.0,
    n: int = 6,
    *,
    refine: int = 0,
    degree: int | None = None,
    threads: int | None = None,
    quadrature: str = SolveOptions.quadrature,
    tolerance: float = 1e-4,
    max_iterations: int = 200,
) -> Modes:
    """Return the lowest modes of a body: K phi = omega^2 M phi, K the stiffness of a law and M the mass.

    Faces on which the law gives u are held, at rest whatever the value, the others are free; loads do not matter. Where
    nothing holds the body, K gets a multiple of M while the modes are sought, and its rigid motions are left out.

    Parameters
    ----------
    body : BSplineVolume or MultiPatch
        The body.
    law : Elasticity, Poisson or Problem
        A symmetric law; only the data of held faces, and Robin's alpha, have an effect.
    density : float
        Mass per volume.
    n : int
        Number of modes.
    refine, degree, threads, quadrature
        As in `iga_nn.solve`.
    tolerance : float
        Tolerance of the residuals `|K phi - omega^2 M phi| / |K phi|`; its square is about the relative error of a
        frequency.
    max_iterations : int
        Largest number of iterations of LOBPCG.

    Returns
    -------
    Modes

    Raises
    ------
    ValueError
        For arguments out of range and a law that is not symmetric.
    ConvergenceError
        Where a residual stays above the tolerance.

    Examples
    --------
    >>> import iga_nn
    >>> rod = iga_nn.BSplineVolume.from_function(lambda u, v, w: (2 * u, v, w), control_points=5)
    >>> free = dict.fromkeys(("u0", "u1", "v0", "v1", "w0", "w1"), ["0", "0", "0"])
    >>> found = iga_nn.modes(rod, iga_nn.Elasticity(traction=free, young=100.0, poisson_ratio=0.0), n=4)
    >>> found.rigid, len(found.shapes)
    (6, 4)
    """
    check_modes(density, n, tolerance, max_iterations)
    if not law.form.linear:
        raise ValueError(f"{type(law.form).__name__} is not linear: it has modes about a state only, and no others")
    if not law.form.symmetric:
        raise ValueError(f"{type(law.form).__name__} is not symmetric: its modes need not be real, and are not sought")
    shift = _stiffness(body, law) if is_free(law) else 0.0
    options = SolveOptions(refine=refine, degree=degree, threads=threads, quadrature=quadrature)
    system = discretized(body, law, options, shift)
    system = system.at_rest()
    of_part = RIGID.get(len(system.right), len(system.right))
    rigid = of_part * len(as_multipatch(body).parts) if shift else 0
    if n + rigid > len(system.load):
        raise ValueError(f"n {n}: the space has {len(system.load)} unknowns, fewer modes; raise refine or lower n")
    values, vectors, residuals, iterations = _lowest(system, n + rigid, tolerance, max_iterations)
    if residuals.max() > tolerance:
        raise ConvergenceError(
            f"modes: residual {residuals.max():.1e} after {iterations} iterations, tolerance {tolerance:.0e}: raise "
            "max_iterations or the tolerance, or ask for some more modes where several lie close together"
        )
    rigid = int(np.count_nonzero(values - shift < AT_REST * shift))
    chosen = slice(rigid, rigid + n)
    omega = np.sqrt(np.maximum(values[chosen] - shift, 0.0) / density)
    shapes = tuple(system.field(_upright(x) / math.sqrt(density)) for x in vectors[:, chosen].T)
    return Modes(omega / (2.0 * math.pi), shapes, residuals[chosen], iterations, rigid)


def check_modes(density: float, n: int, tolerance: float = 0.5, max_iterations: int = 1) -> None:
    """Raise ValueError for arguments of `modes` that are out of range."""
    if not (isinstance(density, Real) and 0.0 < density < math.inf):
        raise ValueError(f"density must be a positive number, got {density!r:.80}")
    for name, count in (("number of modes n", n), ("max_iterations", max_iterations)):
        if not (isinstance(count, Integral) and count >= 1):
            raise ValueError(f"{name} must be a whole number, at least 1, got {count!r:.80}")
    if not (isinstance(tolerance, Real) and 0.0 < tolerance < 1.0):
        raise ValueError(f"tolerance must be a number between 0 and 1, got {tolerance!r:.80}")


def is_free(law: BoundaryValueProblem) -> bool:
    """Return whether nothing may hold a body; regions count as nothing, because they can leave motions free."""
    on_faces = not law.dirichlet and (bool(law.conditions) or len(law.natural) == 6)
    return on_faces and not law.form.has_reaction


def _stiffness(body: BSplineVolume | MultiPatch, law: BoundaryValueProblem) -> float:
    """Return the law's factor in the middle of a patch over the squared length, which estimates the eigenvalues."""
    glued, placed = as_multipatch(body), law.on(body)
    own = placed.on_patch(0, glued.outer[0]) if isinstance(body, MultiPatch) else placed
    x = glued.patches[0].grid([0.5], [0.5], [0.5]).reshape(3, 1)
    length = size_of(glued)
    return float(own.form.tensor(x)[0, 0] / length**2)


def _lowest(system: System, n: int, tolerance: float, most: int) -> tuple[Array, Array, Array, int]:
    """Return n eigenvalues, vectors (N, n) of unit mass, relative residuals, and the number of iterations.

    LOBPCG (Knyazev, SIAM J. Sci. Comput. 23 (2001)) iterates on more vectors than n, and starts again from these
    vectors where the residuals are too large: SciPy's own tolerance is that of |K x - s M x|, which has units. The
    preconditioner is a rough solve with K, so that a slender body needs no more iterations than other bodies.
    """
    a, mass, size = system.operator, system.mass, len(system.load)

    def rough(r: Array) -> Array:
        found = conjugate_gradients(a.matvec, r.ravel(), system.preconditioner.matvec, INNER, INNER_MOST)
        return np.asarray(found.x)

    inverse = LinearOperator(a.shape, matvec=rough, dtype=np.float64)
    block = min(n + n // 2 + SPARE, size)
    vectors, made, limit = np.random.default_rng(0).standard_normal((size, block)), 0, 0.0
    while True:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of residuals, which are judged here
            steps = min(max(ROUND, made), most - made)
            found = lobpcg(
                a, vectors, mass, inverse, tol=limit, maxiter=steps, largest=False, retResidualNormsHistory=True
            )
        values, vectors = np.asarray(found[0]), np.asarray(found[1])
        made += min(steps, len(found[2]) - 1) if len(found) == 3 else 1  # of few unknowns SciPy solves the whole
        forces = a @ vectors[:, :n]
        sizes = np.linalg.norm(forces, axis=0)
        residuals = np.linalg.norm(forces - values[:n] * (mass @ vectors[:, :n]), axis=0) / sizes
        if residuals.max() <= tolerance or made >= most:
            return values[:n], vectors[:, :n], residuals, made
        limit = 0.3 * tolerance * float(sizes.min())


def _upright(x: Array) -> Array:
    """Return a vector with the sign for which its largest entry in size is positive."""
    return x * np.sign(x[np.abs(x).argmax()])
