"""Defines Problem, a user's own law with its data, and the base class of laws that are their own problem."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field

from .boundary_value_problem import BoundaryValueProblem, Natural, Robin
from .condition import GivenRegions, conditions_of
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
    value : dict of region to datum or None, or regions, optional
        Values of u on regions of the boundary, zero for regions alone. Where a region is given, all of the boundary
        that no region names has no flux, or that of `exact`; `boundary`, `neumann` and `robin` are left out then.
    inflow : dict of region to datum or None, optional
        flux . n on regions.
    exchange : dict of region to (entry, datum or None), optional
        (alpha, outside) of flux . n = alpha (outside - u) on regions; alpha not negative.

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
    neumann: Natural = field(default_factory=dict)
    robin: Robin = field(default_factory=dict)
    value: GivenRegions | None = None
    inflow: GivenRegions | None = None
    exchange: GivenRegions | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.form, Form):
            raise TypeError(f"form must be an instance of a subclass of Form, got {self.form!r}")
        given = {role: getattr(self, role) for role in ("exact", "source", "boundary")}
        on_regions = {"value": self.value, "flux": self.inflow, "exchange": self.exchange}
        self._set(
            given, self.neumann or {}, self.robin or {}, conditions_of(self.form.components, self.exact, **on_regions)
        )
