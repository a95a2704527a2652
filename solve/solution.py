"""Defines Solution, the spline that a solve returns, and SolveReport, its numbers."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array
from parameterize.display import Shown, above
from parameterize.spline.body import Body
from parameterize.spline.volume import BSplineVolume

from .answer import Answer
from .discretization.error_norms import Errors
from .field import BodyField, SplineField
from .forms.boundary_value_problem import BoundaryValueProblem
from .forms.form import Quantity
from .forms.rigid import RigidMotion
from .outside import all_extremes_outside, extremes_outside
from .quantities import Extremes, all_extremes, at_points, extremes, on_grid
from .reactions import Balance
from .singular import SingularPlaces, singular_places

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure

NORMS = {  # name in report.json -> name as shown
    "l2_relative": "relative L2",
    "l2": "L2",
    "h1_relative": "relative H1",
    "h1_seminorm": "H1",
    "error_estimate_relative": "estimated relative L2",
    "error_estimate": "estimated L2",
    "error_estimate_energy_relative": "estimated relative energy",
}


def _known(part: str, norm: str) -> property:
    """Return a property for a norm of a report's errors or estimate, None where the norm is unknown."""
    return property(lambda report: getattr(getattr(report, part), norm, None))


@dataclass(frozen=True)
class LoadStep:
    """Hold the numbers of one load step that is in equilibrium.

    Attributes
    ----------
    factor : float
        The share of the load.
    iterations : int
        Newton steps.
    displacement : float
        The largest coefficient of the displacement, which is near to the largest displacement.
    plastic_strain : float or None
        The largest equivalent plastic strain at a Gauss point; None for a law without one.

    Examples
    --------
    >>> from solve.solution import LoadStep
    >>> LoadStep(0.5, 3, 0.01).as_dict()
    {'factor': 0.5, 'iterations': 3, 'displacement': 0.01}
    """

    factor: float
    iterations: int
    displacement: float
    plastic_strain: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of report.json."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True)
class SolveReport:
    """Hold the numbers of one solve, an entry of `poisson.levels` in report.json.

    `l2`, `l2_relative`, `h1_seminorm`, `h1_relative`, `error_estimate`, `error_estimate_relative` and
    `error_estimate_energy_relative` are float, None where they are unknown; absolute ones in the units of u, and of u
    times length^(3/2). The last is the error in the energy norm, whose square is an elastic body's energy: that of
    stresses, in the mean.

    Attributes
    ----------
    elements, dofs : int
        Numbers of elements and of unknowns; unknowns that boundary data fix are included.
    h : float
        Longest straight edge of a mapped element, in the volume's units.
    iterations : int
    converged : bool
    residual : float
        Norm of the residual at the end, over that of the right-hand side.
    seconds : dict of str to float
        Process CPU seconds of setup, solve and errors.
    errors : Errors or None
        Norms of the errors, None without an exact solution.
    estimate : Errors or None
        Estimate of the L2 and the energy error from the residual, where there is no exact solution, or on request.
    notices : tuple of str
        Warnings about these numbers, one line each.
    meaningful : bool
        False where a formula does not vary on the domain, or the mesh does not resolve the exact solution.
    residuals : tuple of float
        Relative norms of the residual before the first and after every iteration.
    traffic : dict of str to float
        With several processes, the bytes that all send together in a step of the linear solver: for copies of rows
        ("halo"), and in the preconditioner ("transposition", "substitution").
    memory : tuple of float
        With several processes, the most resident memory that each has had so far, in megabytes, the program included.
    balance : Balance or None
        The loads on the body and the reactions of its supports.
    formulation : str
        "mixed" for displacement and pressure of a nearly incompressible body, otherwise "displacement".
    asked : tuple of Answer
        The asked quantities, in the order of the asks.
    load_steps : tuple of LoadStep
        The load steps of a law that is not linear, up to the last one that is in equilibrium.
    interrupted : bool
        Whether the user, or the clock, interrupted the load steps.
    rigid : tuple of RigidMotion
        The motions of rigid regions.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> report = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(source="1")).report
    >>> report.converged, report.dofs, report.l2, report.error_estimate > 0
    (True, 125, None, True)
    """

    elements: int
    dofs: int
    h: float
    iterations: int
    converged: bool
    residual: float
    seconds: dict[str, float]
    errors: Errors | None = None
    estimate: Errors | None = None
    notices: tuple[str, ...] = ()
    meaningful: bool = True
    residuals: tuple[float, ...] = field(default=(), repr=False)
    traffic: Mapping[str, float] = field(default_factory=dict)
    balance: Balance | None = None
    formulation: str = "displacement"
    memory: tuple[float, ...] = ()
    asked: tuple[Answer, ...] = ()
    load_steps: tuple[LoadStep, ...] = ()
    interrupted: bool = False
    rigid: tuple[RigidMotion, ...] = ()

    l2 = _known("errors", "l2")
    l2_relative = _known("errors", "l2_relative")
    h1_relative = _known("errors", "h1_relative")
    h1_seminorm = _known("errors", "h1_seminorm")
    error_estimate = _known("estimate", "l2")
    error_estimate_relative = _known("estimate", "l2_relative")
    error_estimate_energy_relative = _known("estimate", "energy_relative")

    @property
    def load_factor(self) -> float | None:
        """Return the share of the load that is in equilibrium with the solution; None without load steps."""
        return self.load_steps[-1].factor if self.load_steps else None

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of report.json; unknown errors are absent."""
        names = ("elements", "dofs", "h", *NORMS, "iterations", "converged", "residual", "meaningful", "seconds")
        found: dict[str, Any] = {"asked": [answer.as_dict() for answer in self.asked]} if self.asked else {}
        found |= {name: value for name in names if (value := getattr(self, name)) is not None}
        found |= self.balance.as_dict() if self.balance and self.balance.is_told else {}
        found |= {"rigid": [motion.as_dict() for motion in self.rigid]} if self.rigid else {}
        found |= {} if self.formulation == "displacement" else {"formulation": self.formulation}
        if self.load_steps:
            found |= {"load_factor": self.load_factor, "load_steps": [step.as_dict() for step in self.load_steps]}
        found |= {"traffic": dict(self.traffic)} if self.traffic else {}
        return found | ({"memory_mb": list(self.memory)} if self.memory else {})

    def __str__(self) -> str:
        parts = [f"{self.elements} elements", f"{self.dofs} dofs", f"h {self.h:.4g}"]
        found = {shown: getattr(self, norm) for norm, shown in NORMS.items()}
        parts += [f"{shown} {value:.4e}" for shown, value in found.items() if value is not None]
        state = "" if self.converged else f", NOT CONVERGED (residual {self.residual:.1e})"
        answers = [str(self.balance)] if self.balance and self.balance.reactions and self.balance.is_told else []
        level = ", ".join([*parts, f"{self.iterations} iterations{state}"])
        return "\n".join([*map(str, self.asked), level, *answers, *map(str, self.rigid), *self.notices])


@dataclass(frozen=True, eq=False, repr=False)
class PatchSolution(SplineField):
    """Hold the discrete solution on one patch: a spline of the parameters, its map, and the problem on this patch.

    Attributes
    ----------
    geometry : BSplineVolume
        The map.
    problem : Poisson, Elasticity or Problem
        The problem with the data of this patch.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> (patch,) = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z")).patches
    >>> patch.quantity("gradient", [[0.5, 0.5, 0.5]]).shape
    (1, 1, 3)
    """

    geometry: BSplineVolume
    problem: BoundaryValueProblem = field(kw_only=True, repr=False)

    @property
    def field(self) -> SplineField:
        """Return the spline alone, as a datum for another problem on the same volume."""
        return SplineField(self.degrees, self.knots, self.coefficients, self.geometry, self.pressure, self.state)

    def quantity(self, what: str | Quantity, points: ArrayLike) -> Array:
        """Return a quantity (m, ...) at parameters (m, 3); `what` as in `Solution.quantity`."""
        return at_points(self, self.problem.form, what, points)

    def quantity_grid(self, what: str | Quantity, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return a quantity (len(u), len(v), len(w), ...) on a tensor grid of parameters."""
        return on_grid(self, self.problem.form, what, u, v, w)

    def extremes(self, what: str | Quantity) -> Extremes:
        """Return the least and the largest value of a quantity of one number a point, and their places."""
        return extremes(self, what)

    def all_extremes(self) -> dict[str, Extremes]:
        """Return the extremes of a report, by name (`problem.form.reported`), from one search for all quantities."""
        return all_extremes(self)


@dataclass(frozen=True, eq=False, repr=False)
class Solution(BodyField, Shown):
    """Hold the discrete solution: a spline of the parameters of each patch, the maps, the report and the problem.

    On one patch it has the parts of the spline: `degrees`, `knots`, `coefficients`, values at parameters and `grid`.

    Attributes
    ----------
    patches : tuple of PatchSolution
        The solution on each patch.
    body : Body
        The maps; `geometry` is the same, or the volume of one patch.
    report : SolveReport
        Unknowns, errors, iterations and seconds.
    problem : Poisson, Elasticity or Problem
        The problem that the splines solve.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> solution = iga_nn.solve(benchmark_volume(2), iga_nn.Poisson(exact="x*y*z"))
    >>> solution([[0.5, 0.5, 0.5]]).shape, solution.grid([0.1, 0.9], [0.5], [0.5]).shape
    ((1,), (2, 1, 1))
    >>> halves = [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (u + a, v, w), 4) for a in (0, 1)]
    >>> solution = iga_nn.solve(iga_nn.Body.from_patches(halves), iga_nn.Poisson(exact="x*y*z"))
    >>> solution.report.dofs, solution.probe([[1.5, 0.5, 0.5]]).round(6)
    (112, array([0.375]))
    """

    patches: tuple[PatchSolution, ...]
    body: Body = field(repr=False)
    report: SolveReport
    problem: BoundaryValueProblem

    @classmethod
    def of(
        cls,
        field: BodyField,
        problems: Iterable[BoundaryValueProblem],
        report: SolveReport,
        problem: BoundaryValueProblem,
    ) -> "Solution":
        """Return the solution that is a field, with the problem on each patch."""
        body = field.on_body
        parts = zip(field.patches, body, problems, strict=True)
        patches = (
            PatchSolution(one.degrees, one.knots, one.coefficients, volume, one.pressure, one.state, problem=own)
            for one, volume, own in parts
        )
        return cls(tuple(patches), body, report, problem)

    @cached_property
    def singular(self) -> SingularPlaces:
        """Return the places where the gradient is infinite, as the body's edges and the data say.

        There are none where the exact solution is known.
        """
        if self.problem.exact is not None:
            return SingularPlaces()
        return singular_places(self.body, [one.problem for one in self.patches], [one.knots for one in self.patches])

    @property
    def only(self) -> PatchSolution:
        """Return the solution on the patch of a body of one. Raises ValueError for several."""
        return cast(PatchSolution, super().only)

    @property
    def answers(self) -> tuple[Answer, ...]:
        """Return the answers to the asks of the solve, in their order."""
        return self.report.asked

    @property
    def field(self) -> BodyField:
        """Return the splines without the report, as a datum for another problem on the same body."""
        return BodyField(tuple(patch.field for patch in self.patches), self.body)

    def quantity(self, what: str | Quantity, points: ArrayLike) -> Array:
        """Return a quantity (m, ...) at parameters (m, 3) of one patch, on several at points (m, 3) in space.

        what: a name from the law's quantities, as "gradient", "flux", of elasticity "stress", "von_mises" and others
        (`problem.form.quantities`); or a function of u (c, m), grad (c, 3, m) and x (3, m) that returns (..., m).
        Values are NaN for parameters NaN, and outside of the body. For points in space of one patch:
        solution.quantity(what, solution.geometry.locate(points)), for parameters of one of several:
        solution.patches[i].quantity. Raises ValueError for another name, and for a function that fails or returns
        another shape.
        """
        if self.is_single:
            return self.only.quantity(what, points)
        owners, where = self.body.locate(points)
        first = self.patches[0].quantity(what, np.where((owners == 0)[:, None], where, np.nan))
        for number, patch in enumerate(self.patches[1:], start=1):
            here = owners == number
            if here.any():
                first[here] = patch.quantity(what, where[here])
        return first

    def quantity_grid(self, what: str | Quantity, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return a quantity (len(u), len(v), len(w), ...) on a tensor grid of parameters of one patch."""
        return self.only.quantity_grid(what, u, v, w)

    def extremes(self, what: str | Quantity, everywhere: bool = False) -> Extremes:
        """Return the least and the largest value of a quantity of one number a point, and their places.

        Of a gradient, a flux or a stress they are those outside of the singular places, where it is infinite, unless
        asked for everywhere. Where patches of a body meet, the mean of their gradients counts, unlike in `quantity`.
        """
        return extremes_outside(self, what, SingularPlaces() if everywhere else self.singular)

    def all_extremes(self) -> dict[str, Extremes]:
        """Return the extremes of a report, by name (`problem.form.reported`), from one search for all quantities.

        They are those of `extremes`. The search uses fewer samples on fine meshes.
        """
        return all_extremes_outside(self, self.singular)

    def to_pyvista(
        self, samples: int | None = None, quantities: Iterable[str] | Mapping[str, Quantity] | None = None
    ) -> "pyvista.UnstructuredGrid":
        """Return the body as a grid of pyvista with the solution as point data `u`, of several patches with `patch`.

        samples: None for exact Bezier cells; otherwise the number of linear cells a span of the solution and direction,
        with the distortion `arap`, `det J` and, where the exact solution is known, the `error`. Only linear cells can
        be sliced and clipped. quantities: further point data, as names from the law or a dictionary of functions (as in
        `quantity`); by default stress and von_mises of elasticity, gradient and flux of other laws; () for none. Raises
        ValueError for a name the law does not have, and for quantities without samples.
        """
        return above("io.view").grid(self.body, self, self.problem, samples, quantities)

    def to_splinepy(self) -> Any:
        """Return u_h of one patch as a splinepy.BSpline of one coordinate, or of three for displacements.

        Raises InputError without splinepy.
        """
        return above("io.splinepy").to_splinepy(self.only)

    def plot(self, what: str = "values", file: str | Path | None = None) -> "Figure":
        """Return a figure of the solution, drawn off screen; report.html shows the same figure.

        what: "values", or "error" where the problem has an exact solution. file: the PNG to which the figure is also
        written. Raises ValueError for another name or without an exact solution, RuntimeError where VTK cannot draw
        here.
        """
        return above("figures.solution").plot_solution(self, what, file)
