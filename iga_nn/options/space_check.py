"""Checks the trial spaces that options define: levels, degrees, and the number of unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..errors import InputError

if TYPE_CHECKING:
    from parameterize.spline.body import BodyLike

MAX_REFINE = 6
MAX_DOFS = 20_000_000  # some 15 GB at degree 3


def check_space(refine: Sequence[int], degree: int | None) -> None:
    """Raise InputError for levels or a degree that cannot be run."""
    if not refine:
        raise InputError("refine is empty: give one or more levels, such as 0 1")
    if min(refine) < 0 or len(set(refine)) != len(refine):
        raise InputError(f"refine {refine}: give distinct levels, 0 or larger")
    check_level(max(refine))
    from solve.discretization.space import MOST_DEGREE

    if degree is not None and not 1 <= degree <= MOST_DEGREE:
        raise InputError(f"degree {degree}: must lie between 1 and {MOST_DEGREE}")


def check_level(level: int) -> None:
    """Raise InputError for a level that has too many unknowns on any map."""
    if level > MAX_REFINE:
        raise InputError(f"refine {level}: at most {MAX_REFINE}; each level has 8 times the unknowns")


def check_size(body: BodyLike, refine: int, degree: int | None, components: int = 1, processes: int = 1) -> int:
    """Return the number of unknowns on a mesh of the body, those at interfaces counted for each patch.

    Raises InputError where there are too many unknowns for this number of processes.
    """
    from parameterize.spline.body import as_body
    from solve.discretization.space import trial_space

    dofs = components * sum(trial_space(patch, refine, degree).dofs for patch in as_body(body))
    if dofs > (most := MAX_DOFS * processes):
        raise InputError(f"refine {refine} gives {dofs:,} unknowns, more than {most:,}: lower refine or degree")
    return dofs
