"""Shares out what conditions state in total over the quadrature points of their regions, on all patches."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from parameterize.arrays import Array

from ..forms.conditions import Condition, shares_out
from .processes import Processes
from .weak import WeakFace


def shared_out(
    conditions: Sequence[Condition], faces: Sequence[WeakFace], processes: Processes
) -> tuple[Condition, ...]:
    """Return the conditions, those that state something in total with what each point has of it.

    faces: the terms of the conditions on all patches of this process. All processes call it together. A region without
    area keeps its condition as it is. Raises ValueError for a total that a region cannot carry.
    """
    found = []
    for number, condition in enumerate(conditions):
        if shares_out(condition):
            integral = _over(number, faces, processes)
            if float(integral(lambda x, normal: np.ones(x.shape[1]))) > 0.0:
                condition = condition.shared_out(integral)
        found.append(condition)
    return tuple(found)


def _over(
    number: int, faces: Sequence[WeakFace], processes: Processes
) -> Callable[[Callable[[Array, Array], Array]], Array]:
    """Return the integral over the region of a condition, with its number, of functions of points and normals."""
    parts = []
    for face in faces:
        is_free = np.einsum("ccm->m", face.projector) < face.form.components - 0.5  # at rims supports take loads
        here = np.flatnonzero(face.holds(number) & is_free)
        if len(here):
            parts.append((np.asarray(face.x)[:, here], face.normal[:, here], face.weights[here]))
    nowhere = np.zeros((3, 0)), np.zeros((3, 0)), np.zeros(0)

    def integral(function: Callable[[Array, Array], Array]) -> Array:
        own = [(function(x, normal) * weights).sum(axis=-1) for x, normal, weights in (nowhere, *parts)]
        return np.asarray(processes.total(sum(own)))

    return integral
