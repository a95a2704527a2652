"""Evaluates data of a problem: formulas in x, y, z and X, Y, Z, functions or fields, checked at every point."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from parameterize.arrays import Array

from ..field import FieldOnBody
from .frame import UnitFrame
from .jets import Jet
from .owners import Owner, entry_of
from .parser import Expression, ExpressionError

LARGEST = 1e100  # of data: their squares, summed over all points, must not overflow
SMALLEST = 1.0 / LARGEST  # of a law's coefficients, by which data are divided
WORDS = {2: "two", 3: "three"}
NOT_SMOOTH = "a function, a field or a choice (where, min, max), whose derivatives are unknown"
USUAL_SIZE = 5.0  # of coordinates in which formulas are written

Scalar = str | float | FieldOnBody | Callable[..., ArrayLike]
Data = Scalar | Sequence[Scalar]  # a sequence has one entry a component
PerPatch = Data | Mapping[Owner, Data]  # a datum of the body, or one of each patch or solid
Entry = Expression | FieldOnBody | Callable[[Array], ArrayLike]


@dataclass(frozen=True)
class Datum:
    """Hold one datum of a problem.

    name: the name in messages. entries: one entry a component, or one function or field for all components. face: the
    only face with this datum; "" for the whole volume.
    """

    name: str
    entries: tuple[Entry, ...]
    components: int = 1
    face: str = ""

    @cached_property
    def formulas(self) -> list[Expression]:
        """Return the entries that are formulas."""
        return [entry for entry in self.entries if isinstance(entry, Expression)]

    @cached_property
    def is_formula(self) -> bool:
        """Return whether all derivatives of the datum are known, as for formulas without where, min and max."""
        return len(self.formulas) == len(self.entries) and all(formula.is_smooth for formula in self.formulas)

    @property
    def is_constant(self) -> bool:
        """Return whether all entries are formulas without variables."""
        return len(self.formulas) == len(self.entries) and not any(entry.variables for entry in self.formulas)

    @property
    def is_zero(self) -> bool:
        """Return whether all entries are formulas of the constant zero."""
        constant = [entry for entry in self.formulas if not entry.variables and not np.any(entry(*np.zeros((3, 1))))]
        return len(constant) == len(self.entries)

    def placed(self, frame: UnitFrame) -> "Datum":
        """Return the same datum with X, Y, Z measured in a frame."""
        return replace(self, entries=tuple(e.placed(frame) if isinstance(e, Expression) else e for e in self.entries))

    def on_patch(self, patch: int, solid: str = "") -> "Datum":
        """Return the datum on one patch of several, which belongs to a solid; fields are those of the patch."""
        if not any(isinstance(entry, FieldOnBody) for entry in self.entries):
            return self
        own = (entry.patches[patch] if isinstance(entry, FieldOnBody) else entry for entry in self.entries)
        return replace(self, entries=tuple(own))

    def __call__(self, x: Array) -> Array:
        """Return values (c, ...) at points (3, ...).

        Raises ExpressionError where values are not finite, ValueError where a function fails or returns another shape
        or kind.
        """
        each = x.shape[1:] if len(self.entries) == self.components else (self.components, *x.shape[1:])
        parts = []
        for entry in self.entries:
            if isinstance(entry, Expression):
                found = entry(*np.asarray(x))
            else:
                found = np.asarray(entry.at(x) if isinstance(entry, FieldOnBody) else self._called(entry, x))
                if found.dtype.kind not in "iuf":
                    raise ValueError(f"{self.name} must return real numbers, got {found.dtype}")
            found = found[0] if found.shape == (1, *each) else found  # one component, written as (c, ...)
            try:
                found = np.broadcast_to(found, each)
            except ValueError:
                message = f"{self.name} must return shape {each} at points {x.shape}, got {found.shape}"
                raise ValueError(message) from None
            parts.append(finite(self.name, found, x, entry))
        return np.stack(parts).reshape(self.components, *x.shape[1:])

    def at(self, x: Any) -> Any:
        """Return values (c, ...) at points (3, ...), or c jets at jets of points (3,).

        On jets, derivatives of a function are not numbers.
        """
        if x.dtype != object:
            return self(x)
        if self.is_formula:
            return [formula.jet(list(x)) for formula in self.formulas]
        values = self(np.stack(np.broadcast_arrays(*(jet.value for jet in x))))
        return [Jet(value, (np.nan,) * 3, ()) for value in values]

    def _called(self, function: Callable[[Array], ArrayLike], x: Array) -> ArrayLike:
        """Return the values of a user's function. Raises a ValueError that names the datum where the function fails."""
        try:
            return function(x)
        except Exception as error:
            raise ValueError(f"{self.name} fails: {type(error).__name__}: {error}") from error


@dataclass(frozen=True)
class ByPatch(Datum):
    """Hold a datum that is another one on each patch or solid, such as the material; `entries` are those of all."""

    patches: Mapping[Owner, Datum] = field(default_factory=dict)

    @classmethod
    def of(cls, name: str, patches: Mapping[Owner, Datum], face: str = "") -> "ByPatch":
        """Return the datum from the data of the patches or solids."""
        return cls(name, tuple(entry for datum in patches.values() for entry in datum.entries), 1, face, patches)

    def placed(self, frame: UnitFrame) -> "ByPatch":
        """Return the same datum with X, Y, Z measured in a frame."""
        placed = {patch: datum.placed(frame) for patch, datum in self.patches.items()}
        return self.of(self.name, placed, self.face)

    def on_patch(self, patch: int, solid: str = "") -> Datum:
        """Return the datum of a patch, or of its solid."""
        own: Datum = entry_of(self.patches, patch, solid)
        return own.on_patch(patch)

    def __call__(self, x: Array) -> Array:
        """Raise ValueError: points alone do not say on which patch they lie."""
        raise ValueError(f"{self.name} is given by patch or by solid, which needs a body")


def parse(name: str, data: Data, components: int = 1, face: str = "", *, of_coordinates: bool = False) -> Datum:
    """Return a user's datum of c components as a Datum; a number is the formula of that constant.

    of_coordinates: whether functions take three arrays x, y, z instead of one array (3, ...). Raises ExpressionError
    for a refused formula, ValueError for an object that is no datum; both messages name the datum.
    """
    data = data.tolist() if isinstance(data, np.ndarray) else data
    is_vector = isinstance(data, Sequence) and not isinstance(data, str | bytes)
    given: list[Any] = list(data) if is_vector else [data]  # type: ignore[arg-type]
    if not all(np.isfinite(entry) for entry in given if isinstance(entry, int | float)):
        raise ExpressionError(f"{name} must be finite, got {data!r:.80}")
    entries = [repr(float(entry)) if isinstance(entry, int | float) else entry for entry in given]
    if len(entries) != components and (is_vector or isinstance(entries[0], str)):
        count = WORDS.get(components, str(components))
        raise ValueError(f"{name} must have {count} entries, one a component, got {data!r}")
    for entry in entries:
        wanted = () if len(entries) == components else (components,)
        if isinstance(entry, FieldOnBody) and _shape(entry) != wanted:
            raise ValueError(f"{name}: the field must have {components if wanted else 1} component(s) here")
        if not isinstance(entry, str) and not callable(entry):
            of = "x, y, z" if of_coordinates else "points x"
            raise ValueError(f"{name} must be a number, a formula, a function of {of} or a field, got {entry!r:.80}")
    try:
        parsed = [Expression(entry) if isinstance(entry, str) else entry for entry in entries]
    except ExpressionError as error:
        raise ExpressionError(f"{name}: {error}") from None
    if of_coordinates:
        parsed = [e if isinstance(e, Expression | FieldOnBody) else partial(_of_coordinates, e) for e in parsed]
    return Datum(name, tuple(parsed), components, face)


def parse_each(
    name: str,
    data: Any,
    components: int = 1,
    face: str = "",
    *,
    of_coordinates: bool = False,
    counts_own: bool = False,
) -> Datum:
    """Return a user's datum as `parse` does, or data given as a dictionary of patches or of solids as one datum.

    counts_own: whether the number of entries may differ from patch to patch: kappa is a number here, a tensor there.
    """
    if not isinstance(data, Mapping):
        return parse(name, data, components, face, of_coordinates=of_coordinates)
    if wrong := [key for key in data if not isinstance(key, str) and not (isinstance(key, int) and key >= 0)]:
        raise ValueError(
            f"{name}: {wrong[0]!r} is neither the number of a patch, as in {{0: ..., 1: ...}}, nor the name of a solid"
        )
    each = {}
    for owner, own in data.items():
        count = len(own) if counts_own and isinstance(own, list) else components
        whose = owner if isinstance(owner, str) else f"p{owner}"
        each[owner] = parse(f"{name} of {whose}", own, count, face, of_coordinates=of_coordinates)
    return ByPatch.of(name, each, face)


def _shape(field: FieldOnBody) -> tuple[int, ...]:
    """Return the shape of a field's values: (), or (c,) with c components."""
    return field.patches[0].coefficients.shape[3:]


def _of_coordinates(function: Callable[[Array, Array, Array], ArrayLike], x: Array) -> ArrayLike:
    return function(*np.asarray(x))


def finite(name: str, found: Array, x: Array, entry: Entry | None = None) -> Array:
    """Return values unchanged; raise ExpressionError at the first point where they are not finite, or beyond LARGEST.

    x: points (3, ...). entry: the source of the values, for the remedy.
    """
    if found.size and not (found.min() >= -LARGEST and found.max() <= LARGEST):  # NaN included
        bad = ~(np.abs(found) <= LARGEST)
        fault = f"exceeds {LARGEST:.0e}" if np.isfinite(found[bad].flat[0]) else "is not finite"
        good = found[~bad]
        elsewhere = f"; elsewhere it runs from {good.min():.3g} to {good.max():.3g}" if good.size else ""
        raise ExpressionError(
            f"{name} {fault} at {_first(bad, x)}, a point of the domain{elsewhere}{in_scaled(entry, x)}"
        )
    return found


def in_scaled(entry: Entry | None, x: Array) -> str:
    """Return the remedy for a formula in x, y, z on a domain far from size 1 or from the origin: a formula in X, Y, Z.

    x: points (3, ...) of the domain.
    """
    if not isinstance(entry, Expression) or entry.scaled_text is None:
        return ""
    size, away = max(float(np.ptp(c)) for c in x), float(np.abs(x).max())
    if away < USUAL_SIZE and (size == 0.0 or size > 1.0 / USUAL_SIZE):  # one point has no size
        return ""
    return f"; X, Y, Z are x, y, z scaled to volume 1 about the middle of the domain: try {entry.scaled_text!r}"


def demand(good: NDArray[np.bool_], name: str, must: str, x: Array) -> None:
    """Raise an ExpressionError that names the first of the points (3, ...) where a condition on the data fails."""
    if not good.all():
        raise ExpressionError(f"{name} must be {must}, and is not at {_first(~good, x)}, a point of the domain")


def demand_definite(tensor: Array, name: str, x: Array) -> None:
    """Raise ExpressionError at the first point (3, ...) where a symmetric tensor (6, ...) is not positive definite."""
    size = np.abs(tensor).max(axis=0)
    xx, xy, xz, yy, yz, zz = tensor / np.where(size > 0.0, size, 1.0)
    minor = xx * yy - xy * xy
    determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    demand((xx > 0.0) & (minor > 0.0) & (determinant > 0.0), name, "positive definite", x)
    demand_size(size, name, x)


def demand_size(size: Array, name: str, x: Array) -> None:
    """Raise ExpressionError at the first point (3, ...) where a law's coefficient is smaller than SMALLEST."""
    demand(size >= SMALLEST, name, f"{SMALLEST:g} or more", x)


def _first(bad: NDArray[np.bool_], x: Array) -> str:
    place = tuple(np.argwhere(bad)[0][bad.ndim - (x.ndim - 1) :])
    return ", ".join(f"{axis}={row[place]:.6g}" for axis, row in zip("xyz", np.asarray(x), strict=True))
