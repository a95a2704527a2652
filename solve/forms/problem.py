"""Problem: a law and its data in the volume and on the images of the cube's six faces."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import KW_ONLY, dataclass, field
from typing import ClassVar, Self

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

from ..field import SplineField
from .data import Data, Datum, demand, finite, parse
from .form import Form, check_shapes, strong_form, strong_terms
from .frame import UnitFrame
from .jets import Jet, Numbers, coordinates, known
from .parser import Expression

Natural = Mapping[str, Data | None]
Robin = Mapping[str, tuple[Data, Data | None]]


class BoundaryValueProblem:
    """What the solver asks of a problem: its law, and its data at points (3, ...), components first.

    Data have roles: exact, source, boundary; "neumann u0", "robin u0" and "robin u0: alpha" of a face; and those of the
    law's own coefficients. Every method raises ExpressionError where data are not finite.
    """

    form: Form
    exact: Data | None
    of_coordinates: ClassVar[bool] = False  # whether functions as data take three arrays x, y, z
    labels: ClassVar[Mapping[str, str]] = {}  # role -> name in messages, where that is another
    natural: tuple[str, ...]  # faces on which the flux through them is given
    dirichlet: tuple[str, ...]  # faces on which u itself is given
    data: Mapping[str, Datum]  # by role

    def _set(self, given: Mapping[str, Data | None], neumann: Natural, robin: Robin, **counts: int) -> None:
        """Parse the data. Raises ValueError where they do not fit together or cannot be known.

        counts: role -> how many entries its datum has, where these are not the law's components.
        """
        if not isinstance(count := self.form.components, int) or count < 1:
            raise ValueError(
                f"{type(self.form).__name__}.components must be a whole number, 1 or more, got {count!r:.80}"
            )
        for name, faces in ((self.label("neumann"), neumann), ("robin", robin)):
            if not isinstance(faces, Mapping):
                raise ValueError(f'{name} must be a dictionary of face names such as {{"u0": ...}}, got {faces!r:.80}')
            for face in faces:
                if face not in FACE_NAMES:
                    raise ValueError(f"{name}: {face!r} is no face of the cube; the faces are {', '.join(FACE_NAMES)}")
        if wrong := [face for face, pair in robin.items() if not isinstance(pair, tuple | list) or len(pair) != 2]:
            raise ValueError(f"robin {wrong[0]}: give two entries (alpha, g), got {robin[wrong[0]]!r:.80}")
        if both := neumann.keys() & robin.keys():
            raise ValueError(f"face {min(both)} has both Neumann and Robin data; give one of them")
        on_faces = {f"neumann {face}": entry for face, entry in neumann.items()}
        for face, (alpha, entry) in robin.items():
            on_faces |= {f"robin {face}: alpha": alpha, f"robin {face}": entry}
        data = {}
        for role, entry in {**given, **on_faces}.items():
            if entry is not None:
                count = counts.get(role, 1 if role.endswith(": alpha") else self.form.components)
                face = role.split(":")[0].partition(" ")[2]
                data[role] = parse(self.label(role), entry, count, face, of_coordinates=self.of_coordinates)
        dirichlet = tuple(face for face in FACE_NAMES if face not in neumann and face not in robin)
        for name, value in (("data", data), ("natural", tuple(neumann)), ("dirichlet", dirichlet)):
            object.__setattr__(self, name, value)
        for role in ("source", *on_faces):
            if role not in data:
                self._check_derived(role)

    def _check_derived(self, role: str) -> None:
        """Raise ValueError where data that are not given do not follow from `exact`."""
        name, exact = self.label(role), self.data.get("exact")
        if exact is None:
            zero = '"0"' if self.form.components == 1 else '("0", ...)'
            raise ValueError(f"{name} has no data: give {name}={zero} for none, or the solution as formulas in exact")
        why = "" if exact.is_formula else "exact is a function or a field, whose derivatives are unknown"
        why = why or (self.not_differentiable if role == "source" else "")
        if why:
            raise ValueError(f"{name} has no data: {why}; give {name}=... too, or formulas")

    def label(self, role: str) -> str:
        """Return the name by which messages call the datum of a role."""
        first, _, rest = role.partition(" ")
        return f"{self.labels.get(first, first)} {rest}".rstrip()

    @property
    def formulas(self) -> list[tuple[str, Datum, Expression]]:
        """The data that are formulas: role, datum, and each of its formulas."""
        return [(role, datum, entry) for role, datum in self.data.items() for entry in datum.formulas]

    def on(self, volume: BSplineVolume) -> Self:
        """Return the same problem with X, Y, Z measured in a volume: its size is 1 in them, the middle of its box 0.

        Raises ValueError for a field that was found on another volume.
        """
        for datum in self.data.values():
            if not all(entry.fits(volume) for entry in datum.entries if isinstance(entry, SplineField)):
                raise ValueError(
                    f"{datum.name}: the field was found on another volume; give one of the volume that is solved on"
                )
        return self.placed(UnitFrame.of(volume)) if self.is_scaled else self

    def demand_held(self) -> None:
        """Raise ValueError where it is plain from the data that nothing fixes the solution."""

    @property
    def is_scaled(self) -> bool:
        """Whether X, Y or Z occurs in a formula."""
        return any(formula.is_scaled for _, _, formula in self.formulas)

    def placed(self, frame: UnitFrame) -> Self:
        """Return the same problem with X, Y, Z measured in a frame."""
        other = copy(self)
        object.__setattr__(other, "data", {role: datum.placed(frame) for role, datum in self.data.items()})
        return other

    @property
    def not_differentiable(self) -> str:
        """Why the derivatives of the law's coefficients are unknown; "" where they are known.

        Raises LawError where the law's results have wrong shapes: that is said first.
        """
        try:
            strong_form(self.form, [Jet(np.ones(1))] * self.form.components, np.ones((3, 1)))
        except Exception as error:  # whatever a user's law does with jets
            check_shapes(self.form)
            return f"the law {type(self.form).__name__} does not run on jets ({error})"
        return ""

    @property
    def exact_formulas(self) -> list[Expression]:
        """The formulas of `exact`; none where it is not given as formulas."""
        exact = self.data.get("exact")
        return exact.formulas if exact and exact.is_formula else []

    def source_at(self, x: Array) -> Array:
        """Return the source f (c, ...)."""
        return self.data["source"](x) if "source" in self.data else self.source_of_exact(x)

    def source_of_exact(self, x: Array) -> Array:
        """Return -div flux + react (c, ...) of the formulas `exact`."""
        found = strong_form(self.form, self._exact_jets(x), x)
        return finite(f"{self.label('source')} (from exact)", found, x, self._first_formula)

    def size_of_exact(self, x: Array) -> float:
        """Return the size of the largest term in -div flux + react of the formulas `exact`, where these may cancel."""
        return max(float(np.abs(t).max()) for row in strong_terms(self.form, self._exact_jets(x), x) for t in row)

    def _exact_jets(self, x: Array, hessian: Numbers = (0.0,) * 6) -> list[Jet]:
        return [formula.jet(coordinates(np.asarray(x), hessian)) for formula in self.exact_formulas]

    def boundary_at(self, x: Array) -> Array:
        """Return the values of u (c, ...) given on the boundary: those of `exact` or zero where none are given."""
        for role in ("boundary", "exact"):
            if role in self.data:
                return self.data[role](x)
        return np.zeros((self.form.components, *x.shape[1:]))

    def on_face(self, face: str, x: Array, normal: Array) -> tuple[Array | None, Array]:
        """Return alpha (...) and g (c, ...) of flux . n + alpha u = g on a face; alpha is None for Neumann's data.

        normal: (3, ...), outward unit normals.
        """
        role, alpha = f"neumann {face}", None
        if face not in self.natural:
            role = f"robin {face}"
            alpha = self.data[f"{role}: alpha"](x)[0]
            demand(alpha >= 0.0, f"{role}: alpha", "zero or positive", x)
        if role in self.data:
            return alpha, self.data[role](x)
        u, grad = known(self._exact_jets(x, ()), x.shape[1:])
        flux = (np.asarray(self.form.flux(u, grad, x), dtype=np.float64) * normal).sum(axis=1)
        finite(f"{self.label(role)} (from exact)", flux, x, self._first_formula)
        return alpha, flux if alpha is None else flux + alpha * self.data["exact"](x)

    def exact_at(self, x: Array) -> tuple[Array, Array | None]:
        """Return exact u (c, ...) and its gradient (c, 3, ...), None where the derivatives are unknown."""
        exact = self.data["exact"]
        if not exact.is_formula:
            return exact(x), None
        value, gradient = known(self._exact_jets(x, ()), x.shape[1:])
        finite("exact", value, x, self._first_formula)
        return value, finite("gradient of exact", gradient, x, self._first_formula)

    @property
    def _first_formula(self) -> Expression | None:
        return self.exact_formulas[0] if len(self.exact_formulas) == 1 else None


class LawWithData(BoundaryValueProblem, Form):
    """A problem that is its own law; functions as data take three arrays x, y, z."""

    of_coordinates = True

    @property
    def form(self) -> Form:  # type: ignore[override]
        """The problem itself."""
        return self


@dataclass(frozen=True)
class Problem(BoundaryValueProblem):
    """A law of one's own, -div flux + react = f, with data on the images of the cube's six faces.

    Each datum is, for c components, a sequence of c entries, or one entry where c = 1. An entry is a formula in x, y, z
    and X, Y, Z, a function of points x (3, ...) that returns (...), or a field (`solution.field`) on the same volume.
    A function or a field may also stand for all components: (c, ...).

    Parameters
    ----------
    form : Form
        The law.
    exact : datum, optional
        The solution, where it is known; as formulas it gives the source and all data on faces.
    source : datum, optional
        f.
    boundary : datum, optional
        Values of u on the faces that are in neither `neumann` nor `robin`; default: `exact`, or zero.
    neumann : dict of face name to datum or None
        flux . n on "u0", ..., "w1", n the outward unit normal; None: from `exact`.
    robin : dict of face name to (entry, datum or None)
        (alpha, g) of flux . n + alpha u = g; alpha one entry, not negative; None for g: from `exact`.

    Raises
    ------
    TypeError
        For what is no instance of a subclass of `Form`.
    ExpressionError
        For a formula that is refused.
    ValueError
        Where data cannot be known or do not fit.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> class Decay(iga_nn.Form):
    ...     def flux(self, u, grad, x):
    ...         return grad
    ...     def react(self, u, grad, x):
    ...         return 5 * u
    >>> problem = iga_nn.Problem(Decay(), exact="exp(X)", neumann={"u1": None})
    >>> iga_nn.solve(benchmark_volume(2), problem, refine=1).report.l2_relative < 1e-3
    True
    """

    form: Form
    _: KW_ONLY
    exact: Data | None = None
    source: Data | None = None
    boundary: Data | None = None
    neumann: Natural = field(default_factory=dict)
    robin: Robin = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.form, Form):
            raise TypeError(f"form must be an instance of a subclass of Form, got {self.form!r}")
        given = {role: getattr(self, role) for role in ("exact", "source", "boundary")}
        self._set(given, self.neumann or {}, self.robin or {})
