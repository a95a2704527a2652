"""Finds the axes of a material at points, from formulas, fields, or the parameters of a map, and turns tensors to them.

Entries may be numbers or jets.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import UNITS, BSplineVolume

from ..field import FieldOnBody, Points
from .data import Datum, demand
from .jets import Jet

PARAMETERS = "uvw"
PARALLEL = 1e-6  # sine of the angle below which two axes are parallel


@dataclass(frozen=True, eq=False)
class Tangents(FieldOnBody):
    """Give the derivatives of a body's map by one of its parameters, as a field: vectors along its lines.

    volumes: of the patches. axis: 0, 1 or 2 for u, v or w.
    """

    volumes: Sequence[BSplineVolume]
    axis: int

    @classmethod
    def of(cls, body: BodyLike, parameter: str) -> "Tangents":
        """Return the tangents of a body along u, v or w."""
        return cls(as_body(body).patches, PARAMETERS.index(parameter))

    @property
    def patches(self) -> tuple["Tangents", ...]:  # type: ignore[override]
        """Return the field of each patch."""
        return tuple(Tangents((volume,), self.axis) for volume in self.volumes)

    def fits(self, body: BodyLike) -> bool:
        """Return whether the patches are those of a body."""
        return list(map(id, self.volumes)) == list(map(id, as_body(body).patches))

    def at(self, x: Array) -> Array:
        """Return the tangents (3, ...) at points x (3, ...) of one patch, whose parameters are known."""
        assert isinstance(x, Points)
        if x.places is not None:
            return np.ascontiguousarray(self.volumes[0].jacobian(x.places)[:, :, self.axis].T)
        assert x.rows is not None
        u, v, w = x.rows
        tangents = np.moveaxis(self.volumes[0].grid(u, v, w, UNITS[self.axis]), -1, 0)
        single = (axis for axis in range(3) if axis not in x.order)  # directions of one parameter
        turned = tangents.transpose(0, *(1 + axis for axis in (*x.order, *single)))
        return np.ascontiguousarray(turned).reshape(3, *x.shape[1:])


def along(axes: Any, tensor: Any) -> Any:
    """Return the entries (3, 3, ...) along axes (3, 3, ...), row by row, of a tensor (3, 3, ...) in space."""
    half = [[sum(axes[a][i] * tensor[i][j] for i in range(3)) for j in range(3)] for a in range(3)]
    return _table([[sum(half[a][j] * axes[b][j] for j in range(3)) for b in range(3)] for a in range(3)])


def in_space(axes: Any, tensor: Any) -> Any:
    """Return the tensor (3, 3, ...) in space of entries (3, 3, ...) along axes (3, 3, ...): the inverse of `along`."""
    return along([[axes[a][i] for a in range(3)] for i in range(3)], tensor)


def frame(first: Datum, second: Datum | None, x: Any) -> list[list[Any]]:
    """Return three unit vectors at right angles, three entries (...) each, at points x (3, ...) or at jets of points.

    The first is along a datum, the second towards another one; None where any direction across the first will do.
    Raises ExpressionError where the axes are zero or parallel.
    """
    known = None if x.dtype == object else x
    a = _unit(first.at(x), first.name, known)
    towards = _across(a) if second is None else _unit(second.at(x), second.name, known)
    share = sum(p * q for p, q in zip(a, towards, strict=True))
    name = "first_axis" if second is None else f"{second.name} across {first.name}"
    b = _unit([q - share * p for p, q in zip(a, towards, strict=True)], name, known)
    return [a, b, [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]]


def _unit(vector: Sequence[Any], name: str, x: Array | None) -> list[Any]:
    """Return a vector divided by its length. Raises ExpressionError where it is nearly zero at points x."""
    length = (vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]) ** 0.5
    if x is not None:
        demand(np.broadcast_to(length > PARALLEL * np.max(length), x.shape[1:]), name, "longer than zero", x)
    return [entry / length for entry in vector]


def _across(a: Sequence[Any]) -> list[Any]:
    """Return a unit vector across a unit vector, that depends smoothly on it but for the plane z = 0.

    The formula is that of Duff et al., *Building an Orthonormal Basis, Revisited*, J. Comput. Graph. Tech. 6 (2017).
    """
    x, y, z = a
    sign: Any = Jet(np.copysign(1.0, z.value)) if isinstance(z, Jet) else np.copysign(1.0, z)
    share = -1.0 / (sign + z)
    return [1.0 + sign * x * x * share, sign * x * y * share, -sign * x]


def _table(rows: list[list[Any]]) -> Any:
    """Return rows of numbers or arrays as an array (3, 3, ...), rows of jets as an array (3, 3) of objects."""
    entries = [entry for row in rows for entry in row]
    if not any(isinstance(entry, Jet) for entry in entries):
        return np.stack(np.broadcast_arrays(*entries)).reshape(3, 3, *np.broadcast(*entries).shape)
    found = np.empty(9, dtype=object)
    found[:] = entries
    return found.reshape(3, 3)
