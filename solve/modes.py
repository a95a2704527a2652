"""Computes modes by LOBPCG: the lowest vibrations of a body, or eigenfunctions of any symmetric law."""

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.display import Brief
from parameterize.files import save_arrays
from parameterize.spline.body import BodyLike
from parameterize.threads import one_blas_thread

from .answer import Answer
from .ask import Ask, asks_of
from .diagnostics import TOO_STIFF, ConvergenceError, bending_notices
from .discretization.grading import Grading
from .field import BodyField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.owners import Owner, demand_positive, of_each_patch
from .linear.direct import factorized, price_of, sparse
from .linear.inverse import RoughInverse
from .lowest import Lowest, Pencil, Product, by_columns, of_unit_mass
from .options import SolveOptions
from .preparation import discretized
from .rigid import rigid_motions
from .system import System

OF_SECTOR = "modes of a sector are those of nodal diameter zero, which turn with it: the whole body has others, too"
DOUBTFUL = 1e-3  # share of an eigenvalue from which on an error of it is told
FACTORED = 15_000  # most unknowns of a matrix that is factorized: of a cube matrix and factor take 0.5 GB

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False, repr=False)
class Modes(Brief):
    """Hold the lowest modes of a body.

    Attributes
    ----------
    frequencies : (n,) array
        omega / (2 pi) for K phi = omega^2 M phi: in Hz where the units are consistent and time is in seconds.
    shapes : tuple of n BodyField
        phi with unit mass: the integral of density phi . phi is 1. The largest coefficient is positive.
    residuals : (n,) array
        Residuals `|K phi - omega^2 M phi| / |K phi|` of the free coefficients, in the norm of K^-1 where the system
        was factorized, as those of up to 15 000 unknowns are where conjugate gradients take long.
    iterations : int
        Number of iterations of LOBPCG.
    rigid : int
        Number of motions that take no energy; their frequency is zero, and they are left out. It is known before the
        modes are sought: six for each part of an elastic body that nothing holds, fewer with supports.
    notices : tuple of str
        Why the frequencies are doubtful, where they are.
    answers : tuple of Answer
        The asked frequencies, in the order of the asks.

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
    shapes: tuple[BodyField, ...]
    residuals: Array
    iterations: int
    rigid: int = 0
    notices: tuple[str, ...] = ()
    answers: tuple[Answer, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers of the modes for report.json."""
        asked = {"asked": [answer.as_dict() for answer in self.answers]} if self.answers else {}
        return asked | {
            "frequencies": self.frequencies,
            "residuals": self.residuals,
            "iterations": self.iterations,
            "rigid": self.rigid,
            "notices": list(self.notices),
        }

    def save(self, path: str | Path) -> None:
        """Write degrees, knots_u, knots_v, knots_w, coefficients (n, m_u, m_v, m_w, ..) and frequencies atomically.

        Of several patches there are p0_degrees, .., p0_coefficients, p1_degrees, .. in their place.
        """
        each = zip(*(shape.patches for shape in self.shapes), strict=True)
        stacked = [np.stack([field.coefficients for field in fields]) for fields in each]
        save_arrays(path, **self.shapes[0].arrays(stacked), frequencies=self.frequencies)

    def __str__(self) -> str:
        rows = [f"{i:4d} {frequency:10.4g}" for i, frequency in enumerate(self.frequencies, start=1)]
        return "\n".join(["mode  frequency", *rows])


def modes(
    body: BodyLike,
    law: BoundaryValueProblem,
    density: float | Mapping[Owner, float] = 1.0,
    n: int = 6,
    *,
    refine: int = 0,
    degree: int | None = None,
    grading: Grading | None = None,
    threads: int | None = None,
    quadrature: str = SolveOptions.quadrature,
    tolerance: float = 1e-4,
    max_iterations: int = 200,
    ask: Any = (),
) -> Modes:
    """Return the lowest modes of a body: K phi = omega^2 M phi, K the stiffness of a law and M the mass.

    Faces on which the law gives u are held, at rest whatever the value, the others are free; loads do not matter. The
    rigid motions that no support holds are known, and left out: the modes are sought among all other motions.

    Parameters
    ----------
    body : BSplineVolume or Body
        The body.
    law : Elasticity, Poisson or Problem
        A symmetric law; only the data of held faces, and Robin's alpha, have an effect.
    density : float, or dict of solid or patch to float
        Mass per volume, of the whole body or for each of its solids, {"steel": 7850.0, "pad": 1100.0}.
    n : int
        Number of modes.
    refine, degree, grading, threads, quadrature
        As in `iga_nn.solve`.
    tolerance : float
        Tolerance of the residuals `|K phi - omega^2 M phi| / |K phi|`, of a factorized system in the norm of K^-1; its
        square is about the relative error of a frequency.
    max_iterations : int
        Largest number of iterations of LOBPCG.
    ask : Ask or str, or a list of these
        Frequencies to answer, such as "frequency 1".

    Returns
    -------
    Modes

    Raises
    ------
    ValueError
        For arguments out of range, and a law that is not symmetric or not positive.
    ConvergenceError
        Where a residual stays above the tolerance, after `max_iterations` or as soon as residuals fall no more.

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
    asks = asks_of(ask)
    demand_frequencies(asks, n)
    if not law.form.linear:
        raise ValueError(f"{type(law.form).__name__} is not linear: it has modes about a state only, and no others")
    if not law.form.symmetric:
        raise ValueError(f"{type(law.form).__name__} is not symmetric: its modes need not be real, and are not sought")
    options = SolveOptions(refine=refine, degree=degree, grading=grading, threads=threads, quadrature=quadrature)
    system = discretized(body, law, options, is_loose=True).at_rest()
    densities = of_each_patch("density", density, system.body.solids)
    largest = float(densities.max())  # the iteration sees densities near 1, in any units
    mass = by_columns(system.weighted_mass(densities / largest).matvec)
    motions = rigid_motions(system)
    rigid = motions.shape[1]
    if n + rigid > len(system.load):
        raise ValueError(f"n {n}: the space has {len(system.load)} unknowns, fewer modes; raise refine or lower n")
    pencil = Pencil(by_columns(system.operator.matvec), mass, _inverse(system), of_unit_mass(motions, mass))
    with one_blas_thread():
        found = pencil.lowest(n, tolerance, max_iterations)
    stiff = [TOO_STIFF] if law.form.caveat else []
    sector = [OF_SECTOR] if system.matrix.couplings else []
    notices = (*_notices(found), *bending_notices(system.patches), *stiff, *sector)
    if found.worst > tolerance:
        remedy = "raise max_iterations or the tolerance, or ask for some more modes where several lie close together"
        raise ConvergenceError(
            f"modes: residual {found.worst:.1e} after {found.iterations} iterations, tolerance {tolerance:.0e}: "
            f"{'; '.join(notices) or remedy}"
        )
    if law.loads:
        notices = (*notices, f"loads do not matter to vibrations: {', '.join(law.loads)}")
    for notice in notices:
        log.warning("%s", notice)
    frequencies = np.sqrt(found.values / largest) / (2.0 * math.pi)
    answers = tuple(Answer(one.text, float(frequencies[one.number - 1]), dimension="frequency") for one in asks)
    shapes = tuple(system.field(_upright(x) / math.sqrt(largest)) for x in found.vectors.T)
    return Modes(frequencies, shapes, found.residuals, found.iterations, rigid, notices, answers)


def demand_frequencies(asks: Sequence[Ask], n: int) -> None:
    """Raise ValueError for asks of anything but the frequency of one of n modes."""
    for ask in asks:
        if ask.kind != "frequency":
            raise ValueError(f"{ask.role}: of modes only frequencies are asked, as in 'frequency 1'")
        if ask.number > n:
            raise ValueError(f"{ask.role}: {n} modes are sought; raise the number of modes")


def check_modes(
    density: float | Mapping[Owner, float], n: int, tolerance: float = 0.5, max_iterations: int = 1
) -> None:
    """Raise ValueError for arguments of `modes` that are out of range."""
    demand_positive("density", density)
    for name, count in (("number of modes n", n), ("max_iterations", max_iterations)):
        if not (isinstance(count, Integral) and count >= 1):
            raise ValueError(f"{name} must be a whole number, at least 1, got {count!r:.80}")
    if not (isinstance(tolerance, Real) and 0.0 < tolerance < 1.0):
        raise ValueError(f"tolerance must be a number between 0 and 1, got {tolerance!r:.80}")


def _notices(found: Lowest) -> tuple[str, ...]:
    """Return what makes the modes doubtful: rounding, and a space that does not contain the rigid motions."""
    notices = []
    if (share := found.rounding.max(initial=0.0)) > DOUBTFUL:
        notices.append(
            f"rounding changes the square of frequency {found.rounding.argmax() + 1} by {share:.1g} of its value: the "
            "body is too slender, or its supports too soft, for double precision"
        )
    if (share := found.leak / found.values.min(initial=np.inf)) > DOUBTFUL:
        notices.append(
            f"the trial space contains the rigid motions only nearly, they have {share:.1g} of the energy of the first "
            "mode: refine until the frequencies stay, or take at least the degree of the map"
        )
    return tuple(notices)


def _inverse(system: System) -> RoughInverse:
    """Return an approximate inverse of the stiffness."""
    matrices = [patch.matrix for patch in system.patches]
    price = price_of(system.unknowns, matrices, len(system.right)) if len(system.load) <= FACTORED else math.inf

    def factorize() -> Product | None:
        return factorized(sparse(system.unknowns, system.matrix, len(system.right)), system.points)

    return RoughInverse(system.operator.matvec, system.preconditioner.matvec, factorize, price)


def _upright(x: Array) -> Array:
    """Return a vector with the sign for which its largest entry in size is positive."""
    return x * np.sign(x[np.abs(x).argmax()])
