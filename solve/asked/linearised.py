"""Linearises sums of a quantity over points, at a solution."""

from typing import Any

import numpy as np

from parameterize.arrays import Array

from ..field import Points
from ..forms.form import Quantity
from .parts import Piece, QuantityOf
from .samples import Samples

STEP = 1e-5  # of the largest value: differences from which slopes of a quantity follow, exact for linear ones


def sampled(pieces: list[tuple[Piece, Array]], quantity_of: QuantityOf) -> Samples:
    """Return the linearisation of sums of a quantity over points with weights (m,)."""
    return joined([_of_piece(piece, weights, quantity_of) for piece, weights in pieces])


def _of_piece(piece: Piece, weights: Array, quantity_of: QuantityOf) -> Samples:
    rows = piece.form.components + piece.group.has_pressure
    slopes = piece.values(lambda form: slopes_of(quantity_of(form))) * weights
    return Samples(piece.patches, piece.places, slopes[:rows], slopes[rows:].reshape(piece.form.components, 3, -1))


def joined(parts: list[Samples]) -> Samples:
    """Return the points of several linearisations as one."""
    return Samples(
        np.concatenate([part.patches for part in parts]),
        np.concatenate([part.places for part in parts]),
        np.concatenate([part.of_u for part in parts], axis=1),
        np.concatenate([part.of_grad for part in parts], axis=2),
    )


def slopes_of(quantity: Quantity) -> Quantity:
    """Return the quantity (k, m) of a quantity's derivatives: by u (c, m), by a pressure (m,), and by the gradient.

    Those by the gradient (c, 3, m) come last; a pressure is that of a nearly incompressible body, if there is one.
    """

    def values(u: Any, grad: Any, x: Any) -> Array:
        pressure = getattr(x, "pressure", None)
        parts = [u, *([] if pressure is None else [pressure[None]]), grad.reshape(-1, *grad.shape[2:])]
        ends = np.cumsum([len(part) for part in parts])
        whole = np.concatenate(parts)
        steps = np.repeat(
            [STEP * (float(np.abs(part).max(initial=0.0)) or 1.0) for part in parts], np.diff(ends, prepend=0)
        )

        def at(moved: Array) -> Array:
            points = x if pressure is None else _with_pressure(x, moved[ends[0]])
            found = np.asarray(quantity(moved[: ends[0]], moved[ends[-2] :].reshape(grad.shape), points))
            return np.broadcast_to(found, (*found.shape[: found.ndim - u.ndim + 1], *u.shape[1:])).reshape(u.shape[1:])

        rows = []
        for i, step in enumerate(steps):
            change = np.zeros_like(whole)
            change[i] = step
            rows.append((at(whole + change) - at(whole - change)) / (2.0 * step))
        return np.stack(rows)

    return values


def _with_pressure(x: Points, pressure: Array) -> Points:
    """Return the same points with another pressure there."""
    other = x.view(Points)
    other.rows, other.order, other.places, other.pressure = x.rows, x.order, x.places, pressure
    return other
