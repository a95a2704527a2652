"""Defines BoundaryValueProblem: a law and its data in the volume and on its boundary, as the solver evaluates them."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from copy import copy
from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import BodyLike
from parameterize.spline.volume import FACE_NAMES

from ..field import MultiPatchField, SplineField
from .condition import WITH_FACTOR, Condition
from .data import ByPatch, Data, Datum, PerPatch, demand, finite, parse
from .form import Form, check_shapes, strong_form, strong_terms
from .frame import UnitFrame
from .jets import Jet, Numbers, coordinates, known
from .parser import Expression
from .region import Part

PATCH_FACE = re.compile(r"p(\d+)_([uvw][01])")  # the face of one patch of several, as in "p2_u0"

Natural = Mapping[str, Data | None]
Robin = Mapping[str, tuple[Data, Data | None]]


class BoundaryValueProblem:
    """Evaluate a law and its data at points (3, ...), components first: the interface of a problem to the solver.

    Data have roles: exact, source, boundary; "neumann u0", "robin u0" and "robin u0: alpha" of a face; and those of the
    law's own coefficients. Every method raises ExpressionError where data are not finite.
    """

    form: Form
    exact: Data | None
    of_coordinates: ClassVar[bool] = False  # whether functions as data take three arrays x, y, z
    labels: ClassVar[Mapping[str, str]] = {}  # role -> its name in messages, where it has another
    natural: tuple[str, ...]  # faces on which the flux through them is given
    dirichlet: tuple[str, ...]  # faces on which u itself is given
    conditions: tuple[Condition, ...]  # on regions of the boundary; where there are any, all else of it is free
    prefix: str = ""  # of the names of faces, "p2_" for patch 2 of several
    data: Mapping[str, Datum]  # by role

    def _set(
        self,
        given: Mapping[str, PerPatch | None],
        neumann: Natural,
        robin: Robin,
        conditions: tuple[Condition, ...] = (),
        **counts: int,
    ) -> None:
        """Parse the data. Raises ValueError where the data do not fit together or cannot be derived.

        counts: by role, the number of entries of a datum, where it is not the number of the law's components.
        """
        self._check_components()
        self._check_faces(neumann, robin)
        on_faces = {f"neumann {face}": entry for face, entry in neumann.items()}
        for face, (alpha, entry) in robin.items():
            on_faces |= {f"robin {face}: alpha": alpha, f"robin {face}": entry}
        on_regions = {role: pair for condition in conditions for role, pair in condition.given().items()}
        data = self._parsed({**given, **on_faces}, counts)
        for role, (entry, size) in on_regions.items():
            if entry is not None:
                data[role] = parse(role, entry, size or self.form.components, of_coordinates=self.of_coordinates)
        dirichlet = tuple(face for face in FACE_NAMES if face not in neumann and face not in robin)
        if conditions:
            if on_faces or given.get("boundary") is not None:
                raise ValueError(
                    f"give data on regions, or on faces by {self.label('boundary')}, {self.label('neumann')} and "
                    'robin, not both: a face of the cube is a region, too, as in "u0"'
                )
            strong = {face for condition in conditions if condition.is_strong for face in condition.region.faces}
            dirichlet = tuple(face for face in FACE_NAMES if face in strong)
        for name, value in (
            ("data", data),
            ("natural", tuple(neumann)),
            ("dirichlet", dirichlet),
            ("conditions", conditions),
        ):
            object.__setattr__(self, name, value)
        for role in ("source", *on_faces, *on_regions):
            if role not in data:
                self._check_derived(role)

    def _check_components(self) -> None:
        """Raise ValueError for a law whose number of components is not a whole number."""
        count = self.form.components
        if not isinstance(count, int) or count < 1:
            raise ValueError(
                f"{type(self.form).__name__}.components must be a whole number, 1 or more, got {count!r:.80}"
            )

    def _check_faces(self, neumann: Natural, robin: Robin) -> None:
        """Raise ValueError for names of no face, for faces with two kinds of data, and for incomplete Robin data."""
        for name, faces in ((self.label("neumann"), neumann), ("robin", robin)):
            if not isinstance(faces, Mapping):
                raise ValueError(f'{name} must be a dictionary of face names such as {{"u0": ...}}, got {faces!r:.80}')
            for face in faces:
                if face not in FACE_NAMES and not PATCH_FACE.fullmatch(str(face)):
                    names = f"{', '.join(FACE_NAMES)}, and p2_u0 of patch 2 of several"
                    raise ValueError(f"{name}: {face!r} is no face of the cube; the faces are {names}")
        if wrong := [face for face, pair in robin.items() if not isinstance(pair, tuple | list) or len(pair) != 2]:
            raise ValueError(f"robin {wrong[0]}: give two entries (alpha, g), got {robin[wrong[0]]!r:.80}")
        if both := neumann.keys() & robin.keys():
            raise ValueError(f"face {min(both)} has both Neumann and Robin data; give only one")

    def _parsed(self, given: Mapping[str, PerPatch | None], counts: Mapping[str, int]) -> dict[str, Datum]:
        """Return the data of the volume and of faces by role, without roles that have no data."""
        data: dict[str, Datum] = {}
        for role, entry in given.items():
            if entry is not None:
                count = counts.get(role, 1 if role.endswith(": alpha") else self.form.components)
                face = role.split(":")[0].partition(" ")[2]
                name, of_coordinates = self.label(role), self.of_coordinates
                if not isinstance(entry, Mapping):
                    data[role] = parse(name, entry, count, face, of_coordinates=of_coordinates)
                    continue
                if wrong := [key for key in entry if not isinstance(key, int) or key < 0]:
                    raise ValueError(f"{name}: {wrong[0]!r} is no number of a patch, as in {{0: ..., 1: ...}}")
                each = {}
                for patch, own in entry.items():  # kappa may be a number here and a tensor there
                    of_patch = len(own) if role in counts and isinstance(own, list) else count
                    each[patch] = parse(f"{name} of p{patch}", own, of_patch, face, of_coordinates=of_coordinates)
                data[role] = ByPatch.of(name, each, face)
        return data

    def _check_derived(self, role: str) -> None:
        """Raise ValueError where data that are not given do not follow from `exact`."""
        name, exact = self.label(role), self.data.get("exact")
        if exact is None:
            zero = '"0"' if self.form.components == 1 else '("0", ...)'
            raise ValueError(f"{name} has no data: give {name}={zero} for none, or the solution as formulas in exact")
        why = (
            ""
            if exact.is_formula
            else "exact is a function, a field or a choice (where, min, max), whose derivatives are unknown"
        )
        why = why or (self.not_differentiable if role == "source" else "")
        if why:
            raise ValueError(f"{name} has no data: {why}; give {name}=... too, or formulas")

    def label(self, role: str) -> str:
        """Return the name of the datum of a role for messages."""
        first, _, rest = role.partition(" ")
        return f"{self.labels.get(first, first)} {rest}".rstrip()

    @property
    def formulas(self) -> list[tuple[str, Datum, Expression]]:
        """Return the data that are formulas: role, datum, and each formula of the datum."""
        return [(role, datum, entry) for role, datum in self.data.items() for entry in datum.formulas]

    def on(self, body: BodyLike) -> Self:
        """Return the same problem with X, Y, Z measured in a body, which has size 1 in X, Y, Z and its middle at 0.

        The middle is that of the bounding box. Raises ValueError for a field of another volume.
        """
        for datum in self.data.values():
            if not all(entry.fits(body) for entry in datum.entries if isinstance(entry, SplineField | MultiPatchField)):
                raise ValueError(
                    f"{datum.name}: the field was found on another volume; give one of the volume that is solved on"
                )
        return self.placed(UnitFrame.of(body)) if self.is_scaled else self

    @property
    def patch_faces(self) -> set[str]:
        """Return the faces of single patches, as "p2_u0", that data or regions name."""
        on_faces = {role.split(":")[0].partition(" ")[2] for role in self.data if role.startswith(("neumann", "robin"))}
        in_regions = {name for condition in self.conditions for name in condition.region.patch_faces}
        return {name for name in (*on_faces, *self.natural) if PATCH_FACE.fullmatch(name)} | in_regions

    @property
    def by_patch(self) -> dict[str, set[int]]:
        """Return the numbers of the patches for which data are given one by one, by the name of the datum."""
        return {datum.name: set(datum.patches) for datum in self.data.values() if isinstance(datum, ByPatch)}

    def on_patch(self, patch: int, outer: Collection[str]) -> Self:
        """Return the problem of one patch of several, with data on the patch's outer faces alone.

        Data of "p2_u0" belong to a face of patch 2, data of "u0" to this face of every patch that has no own data.
        """
        other = copy(self)
        prefix = f"p{patch}_"
        data = {
            role: datum.on_patch(patch)
            for role, datum in self.data.items()
            if not role.startswith(("neumann ", "robin "))
        }
        given = {kind: self._given_on(kind) for kind in ("neumann", "robin")}
        natural: list[str] = []
        robin: list[str] = []
        for face in outer:
            kind, name = next(
                ((kind, name) for name in (prefix + face, face) for kind in given if name in given[kind]), ("", "")
            )
            if kind:
                (natural if kind == "neumann" else robin).append(face)
                for ending in ("", ": alpha"):
                    if (role := f"{kind} {name}{ending}") in self.data:
                        data[f"{kind} {face}{ending}"] = self.data[role].on_patch(patch)
        dirichlet = tuple(face for face in outer if face not in natural and face not in robin)
        if self.conditions:
            strong = {face for condition in self.conditions if condition.is_strong for face in condition.region.faces}
            dirichlet = tuple(face for face in outer if not strong.isdisjoint((face, prefix + face)))
        for name, value in (
            ("prefix", prefix),
            ("data", data),
            ("natural", tuple(natural)),
            ("dirichlet", dirichlet),
        ):
            object.__setattr__(other, name, value)
        return other

    def _given_on(self, kind: str) -> set[str]:
        """Return the names of faces with data of a kind, "neumann" or "robin"."""
        if kind == "neumann":
            return set(self.natural)
        return {role.removeprefix("robin ").removesuffix(": alpha") for role in self.data if role.endswith(": alpha")}

    def strong_role(self, face: str) -> str | None:
        """Return the role of the condition that holds all of u on a face, None where none does."""
        names = {face, self.prefix + face}
        return next((c.role for c in self.conditions if c.is_strong and not names.isdisjoint(c.region.faces)), None)

    def demand_held(self) -> None:
        """Raise ValueError where the data alone show that nothing fixes the solution."""

    @property
    def is_scaled(self) -> bool:
        """Return whether X, Y or Z occurs in a formula or in the condition of a region."""
        return any(formula.is_scaled for _, _, formula in self.formulas) or any(
            condition.region.is_scaled for condition in self.conditions
        )

    def on_surface(self, part: Part) -> Self:
        """Return the same problem, whose regions find faces and groups on a part's surface mesh."""
        other = copy(self)
        regions = (replace(condition, region=condition.region.placed(surface=part)) for condition in self.conditions)
        object.__setattr__(other, "conditions", tuple(regions))
        return other

    @property
    def needs_surface(self) -> bool:
        """Return whether a region names a face or a group of the part, and the surface of the part is unknown."""
        return any(c.region.needs_surface and c.region.surface is None for c in self.conditions)

    @property
    def fixes_nothing(self) -> bool:
        """Return whether there are neither given values of u nor an exchange with the outside."""
        if self.conditions:
            return not any(c.is_essential or c.kind in WITH_FACTOR for c in self.conditions)
        return len(self.natural) == len(FACE_NAMES)

    def placed(self, frame: UnitFrame) -> Self:
        """Return the same problem with X, Y, Z measured in a frame."""
        other = copy(self)
        object.__setattr__(other, "data", {role: datum.placed(frame) for role, datum in self.data.items()})
        regions = (replace(condition, region=condition.region.placed(frame)) for condition in self.conditions)
        object.__setattr__(other, "conditions", tuple(regions))
        return other

    @property
    def not_differentiable(self) -> str:
        """Return why the derivatives of the law's coefficients are unknown; "" where they are known.

        Raises LawError first where the law's results have wrong shapes.
        """
        try:
            strong_form(self.form, [Jet(np.ones(1))] * self.form.components, np.ones((3, 1)))
        except Exception as error:  # whatever a user's law does with jets
            check_shapes(self.form)
            return f"the law {type(self.form).__name__} does not run on jets ({error})"
        return ""

    @property
    def exact_formulas(self) -> list[Expression]:
        """Return the formulas of `exact`; an empty list where it is not given as formulas."""
        exact = self.data.get("exact")
        return exact.formulas if exact and exact.is_formula else []

    def source_at(self, x: Array) -> Array:
        """Return the source f (c, ...) at points x (3, ...)."""
        return self.data["source"](x) if "source" in self.data else self.source_of_exact(x)

    def source_of_exact(self, x: Array) -> Array:
        """Return -div flux + react (c, ...) of the formulas `exact` at points x (3, ...)."""
        found = strong_form(self.form, self._exact_jets(x), x)
        return finite(f"{self.label('source')} (from exact)", found, x, self._first_formula)

    def size_of_exact(self, x: Array) -> float:
        """Return the size of the largest term in -div flux + react of the formulas `exact`; terms may cancel."""
        return max(float(np.abs(t).max()) for row in strong_terms(self.form, self._exact_jets(x), x) for t in row)

    def _exact_jets(self, x: Array, hessian: Numbers = (0.0,) * 6) -> list[Jet]:
        return [formula.jet(coordinates(np.asarray(x), hessian)) for formula in self.exact_formulas]

    def boundary_at(self, x: Array, face: str = "") -> Array:
        """Return the values of u (c, ...) given on the boundary, or the values of `exact`, or zero.

        face: the face on which the points lie, where regions give a face its own values.
        """
        for role in (self.strong_role(face), "boundary", "exact"):
            if role in self.data:
                return self.data[role](x)  # type: ignore[index]
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
        flux = self._flux_of_exact(role, x, normal)
        return alpha, flux if alpha is None else flux + alpha * self.data["exact"](x)

    def _flux_of_exact(self, role: str, x: Array, normal: Array) -> Array:
        """Return flux . n (c, ...) of the formulas `exact`; role: the role that messages name."""
        u, grad = known(self._exact_jets(x, ()), x.shape[1:])
        flux = (np.asarray(self.form.flux(u, grad, x), dtype=np.float64) * normal).sum(axis=1)
        return finite(f"{self.label(role)} (from exact)", flux, x, self._first_formula)

    def values_on(self, condition: Condition, direction: Array, x: Array) -> Array:
        """Return the values (m,) of an essential condition along a direction (c, m) at points (3, m)."""
        role = condition.role if condition.role in self.data else "exact"
        found = self.data[role](x)
        return found[0] if len(found) != len(direction) else np.asarray((found * direction).sum(axis=0))

    def flux_on(self, condition: Condition | None, x: Array, normal: Array) -> Array:
        """Return the flux (c, m) into the body that a condition gives at points (3, m) with normals (3, m).

        A condition None is the rest of the boundary, with the flux of `exact` or without flux. For a condition with a
        factor, the flux is that for u = 0.
        """
        if condition is None or (condition.data is None and condition.role not in self.data):
            if not self.exact_formulas:
                return np.zeros((self.form.components, *x.shape[1:]))
            return self._flux_of_exact("flux" if condition is None else condition.role, x, normal)
        if condition.kind in WITH_FACTOR:
            factor = self.factor_on(condition, x)
            if condition.role in self.data:
                return np.asarray(factor * self.data[condition.role](x))
            return self._flux_of_exact(condition.role, x, normal) + factor * self.data["exact"](x)
        found = self.data[condition.role](x)
        return -found[0] * normal if condition.kind == "pressure" else found

    def factor_on(self, condition: Condition, x: Array) -> Array:
        """Return the factor (m,) of an exchange or a spring at points (3, m)."""
        role = f"{condition.role}: factor"
        factor = self.data[role](x)[0]
        demand(factor >= 0.0, role, "zero or positive", x)
        return factor

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
