"""Defines Problem, a user's own law with its data, and the base class of laws that are their own problem."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import ClassVar, Self

from .boundary_value_problem import BoundaryValueProblem
from .conditions import OF_SCALARS, Condition, GivenRegions, OnFaces
from .data import Data
from .form import Form
from .owners import Owner, entry_of

ALIKE = ("components", "symmetric", "linear", "constant", "has_reaction")  # parts in which the laws of solids agree


class LawWithData(BoundaryValueProblem, Form):
    """State a problem that is its own law; functions as data take three arrays x, y, z."""

    of_coordinates = True

    @property
    def form(self) -> Form:  # type: ignore[override]
        """Return the problem itself."""
        return self


@dataclass(frozen=True)
class Problem(BoundaryValueProblem):
    """A law of one's own, -div flux + react = f, with conditions on the boundary.

    Each datum is, for c components, a sequence of c entries, or one entry where c = 1. An entry is a formula in x, y, z
    and X, Y, Z, a function of points x (3, ...) that returns (...), or a field (`solution.field`) on the same volume.
    A function or a field may also stand for all components: (c, ...).

    Parameters
    ----------
    form : Form, or dict of solid or patch to Form
        The law; of several solids also one for each, as in {"steel": Hooke(210000.0), "pad": Rubber(8.0)}.
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
    conditions : sequence of Value, Flux or Exchange, optional
        Data on regions of the boundary. Where a region is given, all of the boundary that no region names has no flux,
        or that of `exact`; `boundary`, `neumann` and `robin` are left out then.
    value, exchange : dict of region to data, optional
        Short forms of `Value` and `Exchange`: `value="u0"` is zero there, `exchange={"u1": (alpha, outside)}`.
    inflow : dict of region to datum or None, optional
        The former short form of `Flux`.

    Raises
    ------
    TypeError
        For a law that is no instance of a subclass of `Form`.
    ValueError
        For laws of solids that differ in their components, or in being symmetric, linear, constant or with a reaction.
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

    form: Form  # the first one of several
    _: KW_ONLY
    exact: Data | None = None
    source: Data | None = None
    boundary: Data | None = None
    neumann: OnFaces = field(default_factory=dict)
    robin: OnFaces = field(default_factory=dict)
    conditions: Sequence[Condition] = ()  # type: ignore[assignment]  # a tuple once the problem is made
    value: GivenRegions | None = None
    inflow: GivenRegions | None = None
    exchange: GivenRegions | None = None

    laws: Mapping[Owner, Form] = field(init=False, repr=False, compare=False)

    keywords: ClassVar = OF_SCALARS

    def __post_init__(self) -> None:
        laws: Mapping[Owner, Form] = self.form if isinstance(self.form, Mapping) else {}
        given = list(laws.values()) or [self.form]
        for form in given:
            if not isinstance(form, Form):
                raise TypeError(f"form must be an instance of a subclass of Form, got {form!r}")
        for name in ALIKE:
            if len({getattr(form, name) for form in given}) > 1:
                raise ValueError(f"form: the laws of a body must agree in {name}")
        self._assign(form=given[0], laws=laws)
        self._read_keywords()
        self._set({"exact": self.exact, "source": self.source}, self.boundary, self.neumann, self.robin)

    @property
    def by_patch(self) -> dict[str, Collection[Owner]]:
        """Return the patches or solids for which data or laws are given one by one, by the name of the datum."""
        return super().by_patch | ({"form": self.laws.keys()} if self.laws else {})

    @property
    def in_volume(self) -> Hashable:
        """Return what law and data in the volume are made of; a user's law is known by its object."""
        return super().in_volume, id(self.form)

    def of_patch(self, patch: int, solid: str = "") -> Self:
        """Return the problem with the data and the law of a patch and its solid."""
        form = entry_of(self.laws or self.form, patch, solid)
        return super().of_patch(patch, solid)._assign(form=form)
