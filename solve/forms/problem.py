"""Defines Problem, a user's own law with its data, and the base class of laws that are their own problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field
from typing import ClassVar

from .boundary_value_problem import BoundaryValueProblem
from .conditions import OF_SCALARS, Condition, GivenRegions, OnFaces
from .data import Data
from .form import Form


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
    neumann: OnFaces = field(default_factory=dict)
    robin: OnFaces = field(default_factory=dict)
    conditions: Sequence[Condition] = ()  # type: ignore[assignment]  # a tuple once the problem is made
    value: GivenRegions | None = None
    inflow: GivenRegions | None = None
    exchange: GivenRegions | None = None

    keywords: ClassVar = OF_SCALARS

    def __post_init__(self) -> None:
        if not isinstance(self.form, Form):
            raise TypeError(f"form must be an instance of a subclass of Form, got {self.form!r}")
        self._read_keywords()
        self._set({"exact": self.exact, "source": self.source}, self.boundary, self.neumann, self.robin)
