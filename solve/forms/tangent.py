"""Computes the derivative of a law that need not be linear, by jets: exactly, from the law as it is written.

A law may have a tangent of its own, such as one whose flow depends on its history.
"""

from typing import Any

import numpy as np

from parameterize.arrays import Array

from .form import Form, as_objects
from .jets import UNITS, Jet, Number

SEEDS = 3  # directions in which a jet carries derivatives


def derivative(form: Form, u: Array, grad: Array, x: Array) -> Array:
    """Return the derivative (c, 4, c, 4, ...) of a law at u (c, ...), grad (c, 3, ...) and points x (3, ...).

    In each axis of length four, the first entry belongs to the reaction or u, the other three to the flux or the
    gradient. Raises ValueError where the law does not accept jets, or returns another shape.
    """
    if (own := form.tangent(u, grad, x)) is not None:
        return own
    c, shape = len(u), u.shape[1:]
    values = [entry for i in range(c) for entry in (u[i], *grad[i])]  # 4 c of them
    where = as_objects([Jet(row, (0.0,) * SEEDS, ()) for row in np.asarray(x)], (3,))
    found = np.zeros((c, 4, len(values), *shape))
    for first in range(0, len(values), SEEDS):
        rows = _law_on_jets(form, _seeded(values, first), where)
        for i, row in enumerate(rows):
            for k, entry in enumerate(row):
                if isinstance(entry, Jet):
                    for seed, slope in enumerate(entry.gradient[: len(values) - first]):
                        found[i, k, first + seed] = slope
    return found.reshape(c, 4, c, 4, *shape)


def _seeded(values: list[Array], first: int) -> list[Jet]:
    """Return the values as jets; the jets from number `first` on are the variables of the derivatives."""
    none = (0.0,) * SEEDS
    return [Jet(value, UNITS[i - first] if first <= i < first + SEEDS else none, ()) for i, value in enumerate(values)]


def _law_on_jets(form: Form, jets: list[Jet], x: Any) -> list[list[Number | Jet]]:
    """Return for each component the reaction and the three entries of the flux; errors are as in `derivative`."""
    c = len(jets) // 4
    table = as_objects(jets, (c, 4))
    u, grad = table[:, 0], table[:, 1:]
    try:
        with np.errstate(all="ignore"):
            flux = np.asarray(form.flux(u, grad, x), dtype=object)
            react = np.broadcast_to(np.asarray(form.react(u, grad, x), dtype=object), u.shape)
    except Exception as error:  # whatever a user's law does with jets
        name = type(form).__name__
        raise ValueError(
            f"{name} has no derivative: it does not run on jets ({type(error).__name__}: {error})"
        ) from error
    if flux.shape != grad.shape:
        raise ValueError(f"{type(form).__name__}.flux must return shape {grad.shape} on jets, got {flux.shape}")
    return [[one, *row] for one, row in zip(react, flux, strict=True)]
