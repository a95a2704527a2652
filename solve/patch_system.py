"""Defines PatchProblem, a problem on one patch of a body, and PatchSystem, its matrix, preconditioner and loads."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import BSplineVolume

from .assembly import Assembled
from .discretization.grouped import BodyMatrix
from .discretization.operator import FormOperator, Operator
from .discretization.space import TrialSpace
from .forms.boundary_value_problem import BoundaryValueProblem


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
    data fix, zero elsewhere. loads: of all coefficients, before the known ones are subtracted.
    """

    matrix: Operator | FormOperator
    known: Array
    loads: Array

    def at_rest(self) -> "PatchSystem":
        """Return the same system with the value zero wherever values are given."""
        return replace(self, known=np.zeros_like(self.known))


def systems_of(patches: Sequence[PatchProblem], found: Assembled) -> tuple[PatchSystem, ...]:
    """Return the systems of all patches from what is assembled on them."""
    rows = zip(patches, found.matrix.parts, found.loads, found.known, strict=True)
    return tuple(
        PatchSystem(patch.volume, patch.problem, patch.space, matrix=own, known=known, loads=loads)
        for patch, own, loads, known in rows
    )


def operators_of(matrix: BodyMatrix, components: int) -> list[tuple[Operator, ...]]:
    """Return for each patch the scalar operator of each component, a single one where it serves all."""
    is_scalar = isinstance(matrix.parts[0], Operator)
    each = [matrix.parts] if is_scalar else [matrix.block(i).parts for i in range(components)]
    return list(zip(*each, strict=True))
