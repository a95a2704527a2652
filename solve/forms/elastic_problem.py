"""Elasticity: the data of -div sigma(u) = f, isotropic, with displacement or traction on each face."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES

from .data import Data, Parsed, ProblemData, check_faces, finite, parse, values
from .formula import Expression
from .problem import SYMMETRIC

VectorData = Sequence[Data]  # three entries, one a component


@dataclass(frozen=True)
class Elasticity(ProblemData):
    """Linear elasticity of an isotropic body: -div sigma = f, sigma = lambda div(u) I + mu (grad u + grad u^T).

    Each vector is given as three entries, formulas in x, y, z and X, Y, Z (as in `Poisson`) or functions of three
    arrays x, y, z of equal shape.
    exact: the displacement u, where it is known. As formulas it gives force and boundary data, and the report's errors;
        functions need them beside it, and leave the H1 seminorm out.
    force: f, per volume; overrides what follows from `exact`.
    displacement: values of u on the faces that are not in `traction`; default: `exact`, or zero.
    traction: face name -> sigma n, n the outward unit normal; None in place of the vector: from `exact`.
    young, poisson_ratio: E > 0 and -1 < nu < 1/2. `lame` converts from lambda and mu.

    Raises ExpressionError for a formula that is refused, ValueError where data cannot be known or do not fit.
    """

    exact: VectorData | None = None
    force: VectorData | None = None
    displacement: VectorData | None = None
    traction: Mapping[str, VectorData | None] = field(default_factory=dict)
    young: float = 1.0
    poisson_ratio: float = 0.3
    _parsed: dict[str, tuple[Parsed, ...]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (self.young > 0.0 and np.isfinite(self.young)):
            raise ValueError(f"young must be positive and finite, got {self.young}")
        if not -1.0 < self.poisson_ratio < 0.5:
            raise ValueError(f"poisson_ratio must lie between -1 and 1/2, got {self.poisson_ratio}")
        check_faces("traction", self.traction)
        if not self.dirichlet:
            raise ValueError("traction on all six faces leaves the body free to move: leave one face to displacement")
        given = {name: getattr(self, name) for name in ("exact", "force", "displacement")}
        given |= {f"traction {face}": data for face, data in self.traction.items()}
        parsed = {name: _parse_vector(name, data) for name, data in given.items() if data is not None}
        object.__setattr__(self, "_parsed", parsed)
        derived = [name for name in ("force", *(f"traction {face}" for face in self.traction)) if name not in parsed]
        if derived and not all(isinstance(entry, Expression) for entry in parsed.get("exact", (None,))):
            raise ValueError(f"{derived[0]} has no data: give them, or the solution as formulas in exact")

    @staticmethod
    def lame(first: float, shear: float) -> dict[str, float]:
        """`young` and `poisson_ratio` of Lame's lambda (`first`) and mu (`shear`), to be passed on as arguments."""
        if not (shear > 0.0 and 3.0 * first + 2.0 * shear > 0.0):
            raise ValueError(f"Lame's constants must have mu > 0 and 3 lambda + 2 mu > 0, got {first} and {shear}")
        total = first + shear
        return {"young": shear * (3.0 * first + 2.0 * shear) / total, "poisson_ratio": first / (2.0 * total)}

    @property
    def constants(self) -> tuple[float, float]:
        """Lame's constants lambda and mu."""
        nu = self.poisson_ratio
        return self.young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), self.young / (2.0 * (1.0 + nu))

    @property
    def dirichlet(self) -> tuple[str, ...]:
        """The faces on which the displacement is given."""
        return tuple(face for face in FACE_NAMES if face not in self.traction)

    def force_at(self, x: Array, y: Array, z: Array) -> Array:
        """Body force (3, ...) at points given by arrays of equal shape. Raises ExpressionError where not finite."""
        if "force" in self._parsed:
            return self._values("force", x, y, z)
        hessians = np.stack([entry.hessian(x, y, z)[2] for entry in self._formulas()])
        return finite("force (from exact)", -self._divergence(hessians), x, y, z)

    def _divergence(self, hessian: Array) -> Array:
        """The divergence of the stress, (lambda + mu) grad div u + mu Laplace u, from the Hessian (3, 6, ...) of u."""
        lam, mu = self.constants
        slopes = [sum(hessian[j, SYMMETRIC[i][j]] for j in range(3)) for i in range(3)]  # of div u
        found: Array = (lam + mu) * np.stack(slopes) + mu * (hessian[:, 0] + hessian[:, 3] + hessian[:, 5])
        return found

    @property
    def is_differentiable(self) -> bool:
        """Whether the coefficients' derivatives are known: they are constant."""
        return True

    def residual_at(self, value: Array, gradient: Array, hessian: Array, x: Array, y: Array, z: Array) -> Array:
        """Values (3, ...) of f + div sigma(u) from the Hessian (3, 6, ...) of u."""
        return self.force_at(x, y, z) + self._divergence(hessian)

    def symbol_at(self, wave: Array, x: Array, y: Array, z: Array) -> Array:
        """The value mu |k|^2 of shear waves, the least, for wave vectors k (3, ...)."""
        found: Array = self.constants[1] * (wave * wave).sum(axis=0)
        return found

    def displacement_at(self, x: Array, y: Array, z: Array) -> Array:
        """Displacement (3, ...) prescribed at points of the boundary."""
        for name in ("displacement", "exact"):
            if name in self._parsed:
                return self._values(name, x, y, z)
        return np.zeros((3, *x.shape))

    def traction_at(self, face: str, points: Array, normal: Array) -> Array:
        """Traction (3, ...) on a face, at points (3, ...) with outward unit normals (3, ...)."""
        name = f"traction {face}"
        if name in self._parsed:
            return self._values(name, *points)
        gradient = np.stack([entry.gradient(*points)[1] for entry in self._formulas()])  # (3, 3, ...)
        lam, mu = self.constants
        both = gradient + np.moveaxis(gradient, 0, 1)
        pull = lam * np.trace(gradient) * normal + mu * (both * normal).sum(axis=1)
        return finite(f"{name} (from exact)", pull, *points)

    def exact_at(self, x: Array, y: Array, z: Array) -> tuple[Array, Array | None]:
        """Exact u (3, ...) and its gradient (3, 3, ...), derivatives last but for the points; None for functions."""
        value = self._values("exact", x, y, z)
        if not all(isinstance(entry, Expression) for entry in self._parsed["exact"]):
            return value, None
        gradient = np.stack([entry.gradient(x, y, z)[1] for entry in self._formulas()])
        return value, finite("gradient of exact", gradient, x, y, z)

    def _formulas(self) -> list[Expression]:
        return [entry for entry in self._parsed["exact"] if isinstance(entry, Expression)]

    def _values(self, name: str, x: Array, y: Array, z: Array) -> Array:
        return np.stack([values(name, entry, x, y, z) for entry in self._parsed[name]])


def _parse_vector(name: str, data: VectorData) -> tuple[Parsed, ...]:
    if isinstance(data, str) or not isinstance(data, Sequence) or len(data) != 3:
        raise ValueError(f"{name} must have three entries, one a component, got {data!r}")
    return tuple(parse(name, entry) for entry in data)
