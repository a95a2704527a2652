"""Holds the options that laws share which are solved along the load, and where the load steps are kept."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ..errors import InputError, input_errors
from .bodies import BodyOptions
from .space_check import check_space

if TYPE_CHECKING:
    from parameterize.checkpoint import Checkpoints
    from parameterize.spline.body import BodyLike
    from solve import Solution, SolveOptions
    from solve.forms.boundary_value_problem import BoundaryValueProblem
    from solve.forms.nonlinear_body import NonlinearBody

MOST_ITERATIONS = 3000  # of the linear solver in a Newton step
OF_LINEAR_LAWS = {  # options that a law has only if it is linear, and why
    "exact": "a law that is not linear takes no exact solution",
    "ask": "intervals are known of linear laws alone",
    "accuracy": "the error of linear laws alone is estimated",
    "rigid": "motions of rigid regions are found in linear problems only",
    "cyclic": "regions are coupled in linear problems only",
}


@dataclass(frozen=True)
class LoadStepOptions(BodyOptions, ABC):
    """State a body whose law is not linear, and the steps in which its load grows.

    Attributes:
        refine: levels to solve on; level n halves every knot span of the map n times.
        steps: number of equal steps in which loads and given displacements grow; a step without a solution is halved,
            and the load ends where halving does.
    """

    refine: tuple[int, ...] = (0,)
    steps: int = 10

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, why in OF_LINEAR_LAWS.items():
            if getattr(self, name):
                raise InputError(f"--{name}: {why}; leave it out")
        if self.steps < 1:
            raise InputError(f"--steps must be at least 1, got {self.steps}")

    def problem(self) -> NonlinearBody:
        """Return the problem of these options. Raises InputError."""
        check_space(self.refine, self.degree)
        if not self.is_loaded:
            raise InputError(
                "nothing acts on the body, no load is given: --load 'nz > 0.9=0;0;-1', --pressure, "
                "--body-force '0;0;-1' or a displacement"
            )
        body = self._stated()
        with input_errors():
            body.demand_held()
        return body

    def check_law(self) -> None:
        """Raise InputError for all but loads and supports that are missing."""
        check_space(self.refine, self.degree)
        replace(self, fix=self.fix or ("u0",))._stated()

    def _stated(self) -> NonlinearBody:
        """Return the problem, whether the body is held or not. Raises InputError."""
        with input_errors():
            return self.of_material(**self.of_body())

    @abstractmethod
    def of_material(self, **data: Any) -> NonlinearBody:
        """Return the problem of supports and loads with its material. Raises ValueError."""

    def solve_options(self) -> SolveOptions:
        """Return the options of the solve on the finest mesh."""
        return replace(super().solve_options(), max_iterations=MOST_ITERATIONS, load_steps=self.steps)

    def solved(
        self, body: BodyLike, problem: BoundaryValueProblem, options: SolveOptions, checkpoints: Checkpoints
    ) -> Solution:
        """Return the solution on one level, whose load steps are kept."""
        return super().solved(body, problem, replace(options, keep=_Kept(checkpoints)), checkpoints)


@dataclass(frozen=True)
class _Kept:
    """Keep the last load step as a checkpoint."""

    checkpoints: Checkpoints

    def save(self, arrays: Mapping[str, Any], state: Mapping[str, Any]) -> None:
        """Keep a load step in the place of the one before."""
        self.checkpoints.save("steps", arrays, state)

    def load(self) -> tuple[Mapping[str, Any], Mapping[str, Any]] | None:
        """Return the load step that was kept last; None for none."""
        return self.checkpoints.load("steps")
