"""Defines PatchProblem, a problem on one patch of a body, and PatchSystem, its matrix, preconditioner and loads."""

from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from .assembly import assemble_data
from .discretization.operator import FormOperator, Operator, with_mass
from .discretization.space import TrialSpace
from .discretization.weak import WeakFace
from .forms.boundary_value_problem import BoundaryValueProblem
from .linear.preconditioner import FastDiagonalization, blocks_of
from .options import SolveOptions


@dataclass(frozen=True, eq=False)
class PatchProblem:
    """State a problem on one patch: its volume, the problem with the patch's data, and the trial space."""

    volume: BSplineVolume
    problem: BoundaryValueProblem
    space: TrialSpace


@dataclass(frozen=True, eq=False, kw_only=True)
class PatchSystem(PatchProblem):
    """Hold the linear system of one patch.

    matrix: the products with all coefficients (c, n_u, n_v, n_w) of the patch. known: the coefficients that Dirichlet
    data fix, zero elsewhere. loads: of all coefficients, before the known ones are subtracted. operators: the scalar
    operator of each component, a single one where it serves all. blocks: their preconditioners, natural on faces that
    are glued; None for a patch without unknowns.
    """

    matrix: Operator | FormOperator
    known: Array
    loads: Array
    operators: tuple[Operator, ...]
    blocks: tuple[FastDiagonalization | None, ...]

    @classmethod
    def of(cls, patch: PatchProblem, options: SolveOptions, shift: float = 0.0) -> "PatchSystem":
        """Return the system of a patch, with `shift` times the mass in its matrix."""
        volume, problem, space = patch.volume, patch.problem, patch.space
        matrix, loads, known = assemble_data(volume, problem, space, options)
        if shift != 0.0:
            matrix = with_mass(volume, matrix, problem.form, shift)
        operators = scalar_operators(matrix, len(known))
        return cls(
            volume,
            problem,
            space,
            matrix=matrix,
            known=known,
            loads=loads,
            operators=operators,
            blocks=blocks_of(operators),
        )

    @property
    def weak(self) -> list[WeakFace]:
        """Return the faces of the patch with terms of conditions on regions."""
        return [face for face in self.matrix.faces.values() if isinstance(face, WeakFace)]

    @property
    def right(self) -> Array:
        """Return the loads minus the matrix times the known coefficients."""
        return self.loads - self.matrix.apply(self.known)

    def with_matrix(self, matrix: Operator | FormOperator) -> "PatchSystem":
        """Return the same system whose matrix shares its arrays with those of other patches."""
        return replace(self, matrix=matrix, operators=(matrix,) if isinstance(matrix, Operator) else self.operators)

    def at_rest(self) -> "PatchSystem":
        """Return the same system with the value zero wherever values are given."""
        return replace(self, known=np.zeros_like(self.known))


def scalar_operators(matrix: Operator | FormOperator, components: int) -> tuple[Operator, ...]:
    """Return the scalar operator of each component, a single one where it serves all."""
    return (matrix,) if isinstance(matrix, Operator) else tuple(map(matrix.block, range(components)))
