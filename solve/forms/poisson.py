"""Defines Poisson: the law and the data of -div(kappa grad u) + c u = f."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from parameterize.arrays import Array

from ..field import FieldOnBody
from .conditions import OF_SCALARS, Condition, GivenRegions, OnFaces
from .data import NOT_SMOOTH, Data, PerPatch, demand, demand_definite, demand_size
from .jets import PAIRS, SYMMETRIC
from .problem import LawWithData

IDENTITY = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)  # the six entries
DEFAULT_EXACT = "exp(X+Z)*sin(Y)"  # the paper's solution (section 5.5), at volume 1: it means the same in any unit


@dataclass(frozen=True)
class Poisson(LawWithData):
    """-div(kappa grad u) + c u = f in the volume's own coordinates, with conditions on the boundary.

    Each entry is a formula in x, y, z and in X, Y, Z, the same scaled to volume 1 (`frame.UnitFrame`), a function of
    three arrays x, y, z of equal shape, or a field on the same volume (`solution.field`). Where no face and no reaction
    fix the solution's constant, its mean is that of `exact`, or zero.

    Parameters
    ----------
    exact : entry, optional
        The solution, where it is known; "exp(X+Z)*sin(Y)" where neither it nor source nor boundary is given. As a
        formula it gives source and boundary data, and the report's errors; a function needs them beside it, and leaves
        the H1 seminorm out, for its derivatives are unknown.
    source : entry, optional
        f; overrides the one that follows from `exact`.
    boundary : entry, optional
        Values of u on the faces that are in neither `neumann` nor `robin`; default: `exact`, or zero.
    kappa : one, six or nine entries, or three rows of three, optional
        A scalar; or a symmetric tensor as six entries xx, xy, xz, yy, yz, zz, as nine by rows, or as three rows: lists
        or a 3 x 3 array; default 1. Positive definite. On several patches or solids also a dictionary:
        an entry for each patch, {0: ..., 1: ...}, or for each solid, {"steel": ..., "pad": ...}.
    reaction : entry, optional
        c, not negative; default 0. Also a dictionary, as `kappa`.
    neumann : dict of face name to entry or None
        kappa grad u . n on the faces "u0", "u1", "v0", "v1", "w0", "w1", n the outward unit normal; None: from `exact`.
    robin : dict of face name to (entry, entry or None)
        (alpha, g) of kappa grad u . n + alpha u = g; alpha not negative; None for g: from `exact`.
    conditions : sequence of Value, Flux or Exchange, optional
        Data on regions of the boundary. Where a region is given, the rest of the boundary has no flux, or that of
        `exact`; the source is zero unless it is given or follows from `exact`; and `boundary`, `neumann` and `robin`
        are left out.
    value, exchange : dict of region to data, optional
        Short forms of `Value` and `Exchange`: `value="u0"` is zero there, `exchange={"u1": (alpha, outside)}`.
    inflow : dict of region to entry or None, optional
        The former short form of `Flux`.

    Raises
    ------
    ExpressionError
        For a formula that is refused.
    ValueError
        Where data cannot be known or do not fit.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> hot = iga_nn.Poisson(source="0", boundary="1", robin={"u1": ("2", "0")}, kappa="1+x*x")
    >>> solution = iga_nn.solve(benchmark_volume(2), hot)
    >>> bool(0 < solution([[1.0, 0.5, 0.5]])[0] < 1)  # cooled there
    True
    """

    exact: Data | None = None
    source: Data | None = None
    boundary: Data | None = None
    kappa: PerPatch | None = None
    reaction: PerPatch | None = None
    neumann: OnFaces = field(default_factory=dict)
    robin: OnFaces = field(default_factory=dict)
    value: GivenRegions | None = None
    inflow: GivenRegions | None = None
    exchange: GivenRegions | None = None
    conditions: Sequence[Condition] = ()  # type: ignore[assignment]  # a tuple once the problem is made

    keywords: ClassVar = OF_SCALARS

    def __post_init__(self) -> None:
        self._read_keywords()
        given = {role: getattr(self, role) for role in ("exact", "source", "reaction")}
        if self.conditions and self.exact is None and self.source is None:
            given["source"] = "0"
        elif self.exact is None and self.source is None and self.boundary is None:
            object.__setattr__(self, "exact", DEFAULT_EXACT)
            given["exact"] = DEFAULT_EXACT
        kappa = _six(self.kappa)
        count = len(kappa) if isinstance(kappa, list) else 1
        self._set({**given, "kappa": kappa}, self.boundary, self.neumann, self.robin, kappa=count)

    def flux(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the flux kappa grad u, (1, 3, ...)."""
        if "kappa" not in self.data:
            return grad
        kappa = self.data["kappa"].at(x)
        if len(kappa) == 1:
            return kappa[0] * grad
        rows = [sum(kappa[SYMMETRIC[i][j]] * grad[:, j] for j in range(3)) for i in range(3)]
        return np.stack(rows, axis=1)

    @property
    def reported(self) -> tuple[str, ...]:
        """Return the names of the value and of the lengths of gradient and flux; without kappa, the two are equal."""
        return super().reported if "kappa" in self.data else ("u", "gradient_magnitude")

    def react(self, u: Any, grad: Any, x: Any) -> Any:
        """Return the reaction c u, (1, ...)."""
        return self.data["reaction"].at(x)[0] * u if self.has_reaction else 0.0

    @property
    def has_reaction(self) -> bool:
        """Return whether there is a term c u."""
        return "reaction" in self.data

    @property
    def not_differentiable(self) -> str:
        """Return why the derivatives of kappa, or the values of c on jets, are unknown; "" where they are known."""
        if "kappa" in self.data and not self.data["kappa"].is_formula:
            return f"kappa is {NOT_SMOOTH}"
        fields = [] if not self.has_reaction else self.data["reaction"].entries
        return "reaction is a field" if any(isinstance(e, FieldOnBody) for e in fields) else ""

    def tensor(self, x: Array, component: int = 0) -> Array:
        """Return kappa (6, ...). Raises ExpressionError where it is not positive definite."""
        found = self.data["kappa"](x) if "kappa" in self.data else np.ones((1, *x.shape[1:]))
        if len(found) == 1:
            demand(found[0] > 0.0, "kappa", "positive", x)
            demand_size(found[0], "kappa", x)
            return found * np.reshape(IDENTITY, (6, *(1,) * (x.ndim - 1)))
        demand_definite(found, "kappa", x)
        return found

    def mass(self, x: Array, component: int = 0) -> Array:
        """Return the reaction c. Raises ExpressionError where it is negative."""
        found: Array = self.data["reaction"](x)[0] if self.has_reaction else np.zeros(x.shape[1:])
        demand(found >= 0.0, "reaction", "zero or positive", x)
        return found


def _six(kappa: Any) -> Any:
    """Return the six entries of a symmetric tensor from its nine entries, or from three rows of three; of each patch.

    Raises ValueError for any other number of entries.
    """
    if isinstance(kappa, Mapping):
        return {patch: _six(own) for patch, own in kappa.items()}
    kappa = kappa.tolist() if isinstance(kappa, np.ndarray) else kappa
    if kappa is None or not isinstance(kappa, Sequence) or isinstance(kappa, str):
        return kappa
    entries: list[Any] = [row.tolist() if isinstance(row, np.ndarray) else row for row in kappa]
    if any(isinstance(row, list | tuple) for row in entries):
        if [len(row) if isinstance(row, list | tuple) else 0 for row in entries] != [3, 3, 3]:
            raise ValueError("kappa as rows must be three rows of three entries each")
        entries = [entry for row in entries for entry in row]
    if len(entries) == 9:
        if any(entries[3 * i + j] != entries[3 * j + i] for i, j in PAIRS):
            raise ValueError("kappa is not symmetric: its entries above and below the diagonal must be the same")
        entries = [entries[3 * i + j] for i, j in PAIRS]
    if len(entries) not in (1, 6):
        raise ValueError(
            f"kappa has {len(entries)} entries: give one, the six xx, xy, xz, yy, yz, zz of a symmetric tensor, or nine"
        )
    return entries
