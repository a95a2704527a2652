"""Defines BoundaryValueProblem: a law and its data in the volume and on its boundary, as the solver evaluates them."""

from __future__ import annotations

import warnings
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from copy import copy
from typing import Any, ClassVar, Self

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.body import Body, BodyLike, as_body
from parameterize.spline.volume import FACE_NAMES

from ..field import FieldOnBody
from .conditions import Condition, Flux, OnFaces, Robin, Value, listed, on_faces, on_regions, shares_out
from .data import ByPatch, Data, Datum, PerPatch, finite, parse_each
from .form import Form, check_shapes, strong_form, strong_terms
from .frame import UnitFrame
from .jets import Jet, Numbers, coordinates, known
from .owners import Owner, demand_owners
from .parser import Expression
from .region import Part

FORMER = {"inflow": "conditions=[iga_nn.Flux(region, data), ...]", "force": "body_force=..."}  # keyword -> its new form


class BoundaryValueProblem:
    """Evaluate a law and its data at points (3, ...), components first: the interface of a problem to the solver.

    Data in the volume have roles: exact, source, and those of the law's own coefficients. Data on the boundary are
    conditions: those on regions, or those of whole faces, where the keywords of faces give them. Every method raises
    ExpressionError where data are not finite.
    """

    form: Form
    exact: Data | None
    of_coordinates: ClassVar[bool] = False  # whether functions as data take three arrays x, y, z
    labels: ClassVar[Mapping[str, str]] = {}  # role -> its name in messages, where it has another
    keywords: ClassVar[Mapping[str, type[Condition]]] = {}  # of conditions on regions
    conditions: tuple[Condition, ...]  # on regions of the boundary; where there are any, all else of it is free
    faces: tuple[Condition, ...]  # on whole faces, which have data without regions
    dirichlet: tuple[str, ...]  # faces on which u itself is given
    prefix: str = ""  # of the names of faces, "p2_" for patch 2 of several
    data: Mapping[str, Datum]  # by role

    def _assign(self, **values: Any) -> Self:
        for name, value in values.items():
            object.__setattr__(self, name, value)
        return self

    def _read_keywords(self) -> None:
        """Turn the keywords of regions into conditions, and former keywords into those of today."""
        for name in FORMER.keys() & vars(self).keys():
            if getattr(self, name) is not None:
                warnings.warn(f"{name}: write {FORMER[name]}", DeprecationWarning, stacklevel=4)
        made = [one for name, kind in self.keywords.items() for one in on_regions(kind, getattr(self, name))]
        self._assign(conditions=(*listed(self.conditions), *made), **dict.fromkeys(self.keywords))

    def _set(
        self,
        given: Mapping[str, PerPatch | None],
        boundary: Any,
        neumann: OnFaces | None,
        robin: OnFaces | None = None,
        **counts: int,
    ) -> None:
        """Parse the data. Raises ValueError where the data do not fit together or cannot be derived.

        counts: by role, the number of entries of a datum, where it is not the number of the law's components.
        """
        self._check_components()
        natural: Mapping[str, tuple[type[Condition], OnFaces]]
        natural = {self.label("neumann"): (Flux, neumann or {}), "robin": (Robin, robin or {})}
        faces = on_faces(natural, self.label("boundary"), boundary)
        if self.conditions:
            if neumann or robin or boundary is not None:
                raise ValueError(
                    f"give data on regions, or on faces by {self.label('boundary')}, {self.label('neumann')} and "
                    'robin, not both: a face of the cube is a region, too, as in "u0"'
                )
            faces = []
        components, of_coordinates = self.form.components, self.of_coordinates
        data = {
            role: parse_each(
                self.label(role),
                entry,
                counts.get(role, components),
                of_coordinates=of_coordinates,
                counts_own=role in counts,
            )
            for role, entry in given.items()
            if entry is not None
        }
        how = {"has_exact": "exact" in data, "of_coordinates": of_coordinates}
        faces, conditions = ([one.stated(components, **how) for one in some] for some in (faces, self.conditions))
        self._assign(data=data, faces=tuple(faces), conditions=tuple(conditions))
        self._assign(dirichlet=tuple(filter(self.strong_on, FACE_NAMES)))
        if "source" not in data:
            self._check_derived("source")
        for condition in self._all:
            if condition.datum is None and not condition.is_essential and not condition.is_coupled:
                self._check_derived(condition.role)

    @property
    def _all(self) -> tuple[Condition, ...]:
        return (*self.faces, *self.conditions)

    @property
    def _datums(self) -> Iterator[tuple[str, Datum]]:
        yield from self.data.items()
        for condition in self._all:
            yield from condition.parsed.items()

    def _check_components(self) -> None:
        """Raise ValueError for a law whose number of components is not a whole number."""
        count = self.form.components
        if not isinstance(count, int) or count < 1:
            raise ValueError(
                f"{type(self.form).__name__}.components must be a whole number, 1 or more, got {count!r:.80}"
            )

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
        return self.labels.get(role, role)

    @property
    def formulas(self) -> list[tuple[str, Datum, Expression]]:
        """Return the data that are formulas: role, datum, and each formula of the datum."""
        return [(role, datum, entry) for role, datum in self._datums for entry in datum.formulas]

    def on(self, body: BodyLike) -> Self:
        """Return the same problem with X, Y, Z measured in a body, which has size 1 in X, Y, Z and its middle at 0.

        The middle is that of the bounding box. Raises ValueError for a field of another volume.
        """
        for _, datum in self._datums:
            if not all(entry.fits(body) for entry in datum.entries if isinstance(entry, FieldOnBody)):
                raise ValueError(
                    f"{datum.name}: the field was found on another volume; give one of the volume that is solved on"
                )
        needs_size = bool(self.conditions) and not as_body(body).is_single  # small faces are looked at less closely
        return self.placed(UnitFrame.of(body)) if self.is_scaled or needs_size else self

    @property
    def patch_faces(self) -> set[str]:
        """Return the faces of single patches, as "p2_u0", that conditions name."""
        return {name for condition in self._all for name in condition.region.patch_faces}

    @property
    def by_patch(self) -> dict[str, Collection[Owner]]:
        """Return the patches or solids for which data are given one by one, by the name of the datum."""
        return {datum.name: datum.patches.keys() for _, datum in self._datums if isinstance(datum, ByPatch)}

    @property
    def in_volume(self) -> Hashable:
        """Return what the law and its data in the volume are made of: the same for patches where they are the same."""
        return tuple((role, datum.entries) for role, datum in self.data.items())

    @property
    def on_boundary(self) -> Hashable:
        """Return what the values on faces are made of: the same for patches where they are the same."""
        strong = {face: self.strong_on(face) for face in self.dirichlet}
        given = ((face, one and one.datum and one.datum.entries) for face, one in strong.items())
        exact = self.data.get("exact")
        return tuple(sorted(given, key=lambda one: one[0])), exact and exact.entries

    @property
    def on_regions(self) -> Hashable:
        """Return what the data on regions are made of: the same for patches where they are the same."""
        return tuple(datum.entries for one in self.conditions for datum in one.parsed.values())

    @property
    def loads(self) -> list[str]:
        """Return the names of the source and of the fluxes that are given, without those that are zero."""
        acting = (one.datum for one in self._all if not one.is_support)
        return [datum.name for datum in (self.data.get("source"), *acting) if datum is not None and not datum.is_zero]

    @property
    def places(self) -> list[tuple[str, str]]:
        """Return the kind and the region of each condition."""
        return [(condition.kind, condition.region.text) for condition in self._all]

    def on_patches(self, body: Body) -> list[Self]:
        """Return the problem of each patch of a body; of a single patch the problem itself.

        Raises ValueError for data given by patch or by solid that are not those of the body.
        """
        for name, owners in self.by_patch.items():
            demand_owners(name, owners, body.solids)
        solids = body.solids.of_patches
        if body.is_single:
            return [self.of_patch(0, solids[0]) if self.by_patch else self]
        each = enumerate(zip(solids, body.outer, strict=True))
        return [self.on_patch(patch, outer, solid) for patch, (solid, outer) in each]

    def of_patch(self, patch: int, solid: str = "") -> Self:
        """Return the problem with the data of a patch and its solid."""
        return copy(self)._assign(
            data={role: datum.on_patch(patch, solid) for role, datum in self.data.items()},
            faces=tuple(one.on_patch(patch, solid) for one in self.faces),
            conditions=tuple(one.on_patch(patch, solid) for one in self.conditions),
        )

    def on_patch(self, patch: int, outer: Collection[str], solid: str = "") -> Self:
        """Return the problem of one patch of several, with data on the patch's outer faces alone.

        Data of "p2_u0" belong to a face of patch 2, data of "u0" to this face of every patch that has no own data.
        """
        prefix = f"p{patch}_"
        own = {face: self._of(prefix + face) or self._of(face) for face in outer}
        won = [(one, [face for face in outer if own[face] is one]) for one in self.faces]
        faces = tuple(one.on_patch(patch, solid, names) for one, names in won if names)
        other = self.of_patch(patch, solid)._assign(prefix=prefix, faces=faces)
        return other._assign(dirichlet=tuple(filter(other.strong_on, outer)))

    def sharing(self, conditions: Sequence[Condition]) -> Self:
        """Return the same problem with what its totals come to at each point, as conditions of the whole body say."""
        pairs = zip(self.conditions, conditions, strict=True)
        own = tuple(one.sharing(other) if shares_out(one) and shares_out(other) else one for one, other in pairs)
        return copy(self)._assign(conditions=own)

    @property
    def has_totals(self) -> bool:
        """Return whether a condition states something in total."""
        return any(map(shares_out, self.conditions))

    def nominal(self) -> Self:
        """Return the same problem, whose totals have some field of their kind where they have none yet."""
        own = tuple(one.nominal() if shares_out(one) else one for one in self.conditions)
        return copy(self)._assign(conditions=own)

    def with_conditions(self, conditions: Sequence[Condition]) -> Self:
        """Return the same problem with other conditions on regions, whose data are parsed."""
        return copy(self)._assign(conditions=tuple(conditions))

    def _of(self, face: str) -> Condition | None:
        """Return the condition of a whole face; None where regions have the data."""
        return next((one for one in self.faces if face in one.faces), None)

    def strong_on(self, face: str) -> Value | None:
        """Return the condition that holds all of u on a face, None where none does."""
        names = {face, self.prefix + face}
        found = (one for one in self._all if isinstance(one, Value) and one.is_strong)
        return next((one for one in found if not names.isdisjoint(one.faces)), None)

    def key_on(self, face: str) -> Hashable:
        """Return what is equal for the patches of a body with the same data on a face, beside `in_volume`."""
        found = self._of(face) or self.strong_on(face)
        entries = () if found is None else (id(entry) for datum in found.parsed.values() for entry in datum.entries)
        return type(found), *entries

    @property
    def has_fields(self) -> bool:
        """Return whether fields are among the data, which are evaluated at parameters of one patch."""
        return any(isinstance(entry, FieldOnBody) for _, datum in self._datums for entry in datum.entries)

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
        return copy(self)._assign(conditions=tuple(one.placed(surface=part) for one in self.conditions))

    @property
    def needs_surface(self) -> bool:
        """Return whether a region names a face or a group of the part, and the surface of the part is unknown."""
        return any(one.region.needs_surface and one.region.surface is None for one in self.conditions)

    @property
    def fixes_nothing(self) -> bool:
        """Return whether there are neither given values of u nor an exchange with the outside."""
        return not any(condition.is_support for condition in self._all)

    def placed(self, frame: UnitFrame) -> Self:
        """Return the same problem with X, Y, Z measured in a frame."""
        return copy(self)._assign(
            data={role: datum.placed(frame) for role, datum in self.data.items()},
            faces=tuple(one.placed(frame) for one in self.faces),
            conditions=tuple(one.placed(frame) for one in self.conditions),
        )

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

    def is_held(self, face: str) -> bool:
        """Return whether the data of a whole face answer loads: values of u, or a flux that depends on u."""
        return face in self.dirichlet or any(face in one.faces for one in self.faces if one.is_support)

    def boundary_at(self, x: Array, face: str) -> Array:
        """Return the values of u (c, ...) given on a face, or the values of `exact`, or zero."""
        if (condition := self.strong_on(face)) is not None:
            return condition.values_at(self, x)
        return self.exact_values(x) if "exact" in self.data else np.zeros((self.form.components, *x.shape[1:]))

    def on_face(self, face: str, x: Array, normal: Array) -> tuple[Array | None, Array]:
        """Return alpha (...) and g (c, ...) of flux . n + alpha u = g on a face; alpha is None for Neumann's data.

        normal: (3, ...), outward unit normals.
        """
        condition = self._of(face)
        assert condition is not None
        return self.factor_on(face, x), condition.flux_at(self, x, normal)

    def factor_on(self, face: str, x: Array) -> Array | None:
        """Return alpha (...) of a face with data of its own; None where its flux does not depend on u."""
        condition = self._of(face)
        return None if condition is None or condition.factor is None else condition.factor_at(x)

    def exact_values(self, x: Array) -> Array:
        """Return u (c, ...) of the exact solution at points (3, ...)."""
        return self.data["exact"](x)

    def exact_flux(self, name: str, x: Array, normal: Array) -> Array:
        """Return flux . n (c, ...) of the formulas `exact`; zero without them. name: the datum, for messages."""
        if not self.exact_formulas:
            return np.zeros((self.form.components, *x.shape[1:]))
        u, grad = known(self._exact_jets(x, ()), x.shape[1:])
        flux = (np.asarray(self.form.whole_flux(u, grad, x), dtype=np.float64) * normal).sum(axis=1)
        return finite(f"{name} (from exact)", flux, x, self._first_formula)

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
