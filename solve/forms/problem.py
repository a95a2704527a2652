"""Poisson: the data of -div(kappa grad u) + c u = f on the volume, with Dirichlet, Neumann or Robin data per face."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from parameterize.arrays import Array
from parameterize.spline.volume import FACE_NAMES

from .data import Data, Parsed, ProblemData, check_faces, demand, finite, parse, values
from .formula import PAIRS, Expression

DEFAULT_EXACT = "exp(X+Z)*sin(Y)"  # the paper's solution (section 5.5), at volume 1: it means the same in any unit
SYMMETRIC = ((0, 1, 2), (1, 3, 4), (2, 4, 5))  # place of a tensor's entry (i, j) among its six: xx, xy, xz, yy, yz, zz


@dataclass(frozen=True)
class Poisson(ProblemData):
    """-div(kappa grad u) + c u = f in the volume's own coordinates, with data on the images of the cube's six faces.

    Each entry is a formula or a function of three arrays x, y, z of equal shape. A formula knows x, y, z, in the
    volume's units, and X, Y, Z, the same scaled to volume 1 about the middle of the volume's bounding box
    (`frame.UnitFrame`): X = (x - c_x) / V^(1/3).
    exact: the solution, where it is known; DEFAULT_EXACT where neither it nor source nor boundary is given. As a
        formula it gives source and boundary data, and the report's errors; a function needs them beside it, and leaves
        the H1 seminorm out, for its derivatives are unknown.
    source: f; overrides the one that follows from `exact`.
    boundary: values of u on the faces that are in neither `neumann` nor `robin`; default: `exact`, or zero.
    kappa: a scalar; or a symmetric tensor as six entries xx, xy, xz, yy, yz, zz or nine by rows; default 1.
        Positive definite.
    reaction: c, not negative; default 0.
    neumann: face name ("u0", "u1", "v0", "v1", "w0", "w1") -> kappa grad u . n, n the outward unit normal.
    robin: face name -> (alpha, g) of kappa grad u . n + alpha u = g; alpha not negative.
        None in place of Neumann's data or of Robin's g: from `exact`.

    Where no face and no reaction fix the solution's constant, its mean is that of `exact`, or zero.
    Raises ExpressionError for a formula that is refused, ValueError where data cannot be known or do not fit.
    """

    exact: Data | None = None
    source: Data | None = None
    boundary: Data | None = None
    kappa: Data | Sequence[Data] | None = None
    reaction: Data | None = None
    neumann: Mapping[str, Data | None] = field(default_factory=dict)
    robin: Mapping[str, tuple[Data, Data | None]] = field(default_factory=dict)
    _parsed: dict[str, tuple[Parsed, ...]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.exact is None and self.source is None and self.boundary is None:
            object.__setattr__(self, "exact", DEFAULT_EXACT)
        if self.source is None and self.exact is None:
            raise ValueError('the problem has no source: give exact="..." or source="..." (source="0" for Laplace)')
        given = {name: getattr(self, name) for name in ("exact", "source", "boundary", "reaction")}
        given |= {f"neumann {face}": data for face, data in self.neumann.items()}
        for face, pair in self.robin.items():
            given |= {f"robin {face}: alpha": pair[0], f"robin {face}": pair[1]}
        parsed = {name: (parse(name, data),) for name, data in given.items() if data is not None}
        object.__setattr__(self, "_parsed", parsed | {"kappa": _parse_kappa(self.kappa)})
        self._check_faces()
        self._check_derivatives()

    @property
    def _kappa(self) -> tuple[Parsed, ...]:
        return self._parsed["kappa"]

    def _values(self, name: str, x: Array, y: Array, z: Array) -> Array:
        return values(name, self._parsed[name][0], x, y, z)

    def _check_faces(self) -> None:
        check_faces("neumann", self.neumann)
        check_faces("robin", self.robin)
        for face in FACE_NAMES:
            if face in self.neumann and face in self.robin:
                raise ValueError(f"face {face} has both Neumann and Robin data; give one of them")

    def _check_derivatives(self) -> None:
        """Whether all that is to follow from `exact` can be derived from it."""
        exact = self._parsed.get("exact", (None,))[0]
        if self.source is None and not isinstance(exact, Expression):
            raise ValueError(
                "exact is a function, whose Laplacian is unknown: give source=... too, or a formula as exact"
            )
        if self.source is None and not self.is_differentiable:
            raise ValueError("kappa is a function, whose derivatives are unknown: give source=... too, or a formula")
        for name in [f"neumann {face}" for face in self.neumann] + [f"robin {face}" for face in self.robin]:
            if name not in self._parsed and not isinstance(exact, Expression):
                raise ValueError(f"{name} has no data: give them, or the solution as a formula in exact")

    @property
    def dirichlet(self) -> tuple[str, ...]:
        """The faces on which u itself is given."""
        return tuple(face for face in FACE_NAMES if face not in self.neumann and face not in self.robin)

    @property
    def is_floating(self) -> bool:
        """Whether the data leave the solution's constant open: Neumann's on all faces, and no reaction."""
        return len(self.neumann) == len(FACE_NAMES) and self.reaction is None

    @property
    def is_differentiable(self) -> bool:
        """Whether kappa's derivatives are known."""
        return all(isinstance(entry, Expression) for entry in self._kappa)

    def source_at(self, x: Array, y: Array, z: Array) -> Array:
        """Source f at points given by arrays of equal shape. Raises ExpressionError where it is not finite."""
        if "source" in self._parsed:
            return self._values("source", x, y, z)
        return self.source_of_exact(x, y, z)

    def source_of_exact(self, x: Array, y: Array, z: Array) -> Array:
        """-div(kappa grad u) + c u of a formula `exact`. Raises ExpressionError where it is not finite."""
        value, gradient, hessian = self._exact_derivatives(x, y, z)
        found = -self._divergence(gradient, hessian, x, y, z)
        if self.reaction is not None:
            found += self.reaction_at(x, y, z) * value
        return finite("source (from exact)", found, x, y, z, self._parsed["exact"][0])

    def exact_hessian(self, x: Array, y: Array, z: Array) -> Array:
        """Second derivatives (6, ...) of a formula `exact`: xx, xy, xz, yy, yz, zz."""
        return self._exact_derivatives(x, y, z)[2]

    def _exact_derivatives(self, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
        exact = self._parsed["exact"][0]
        assert isinstance(exact, Expression)
        return exact.hessian(x, y, z)

    def residual_at(self, value: Array, gradient: Array, hessian: Array, x: Array, y: Array, z: Array) -> Array:
        """Values (1, ...) of f + div(kappa grad u) - c u from u (1, ...), gradient (1, 3, ...) and Hessian (1, 6, ...).

        Needs kappa as formulas.
        """
        found = self.source_at(x, y, z) + self._divergence(gradient[0], hessian[0], x, y, z)
        return (found - self.reaction_at(x, y, z) * value[0])[None]

    def symbol_at(self, wave: Array, x: Array, y: Array, z: Array) -> Array:
        """Values of k . kappa k + c for wave vectors k (3, ...)."""
        kappa = self.kappa_at(x, y, z)
        flux = _times_symmetric(kappa, wave) if len(self._kappa) == 6 else kappa * wave
        found: Array = (flux * wave).sum(axis=0) + self.reaction_at(x, y, z)
        return found

    def _divergence(self, gradient: Array, hessian: Array, x: Array, y: Array, z: Array) -> Array:
        """Values of div(kappa grad u) from the gradient (3, ...) and the Hessian (6, ...) of u."""
        if not self._kappa:
            found: Array = hessian[0] + hessian[3] + hessian[5]
            return found
        entries = [entry.gradient(x, y, z) for entry in self._kappa if isinstance(entry, Expression)]
        total = np.zeros(x.shape)
        if len(entries) == 1:
            value, slopes = entries[0]
            total += value * (hessian[0] + hessian[3] + hessian[5]) + (slopes * gradient).sum(axis=0)
            return total
        for place, (i, j) in enumerate(PAIRS):
            value, slopes = entries[place]
            total += (1.0 if i == j else 2.0) * value * hessian[place] + slopes[i] * gradient[j]
            if i != j:
                total += slopes[j] * gradient[i]
        return total

    def kappa_at(self, x: Array, y: Array, z: Array) -> Array:
        """kappa, a scalar (...) or a tensor (6, ...). Raises ExpressionError where it is not positive."""
        if not self._kappa:
            return np.ones(x.shape)
        entries = [values("kappa", entry, x, y, z) for entry in self._kappa]
        if len(entries) == 1:
            demand(entries[0] > 0.0, "kappa", "positive", x, y, z)
            return entries[0]
        xx, xy, xz, yy, yz, zz = entries
        minor = xx * yy - xy * xy
        determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
        demand((xx > 0.0) & (minor > 0.0) & (determinant > 0.0), "kappa", "positive definite", x, y, z)
        return np.stack(entries)

    def reaction_at(self, x: Array, y: Array, z: Array) -> Array:
        """The reaction c at points given by arrays of equal shape. Raises ExpressionError where it is negative."""
        if self.reaction is None:
            return np.zeros(x.shape)
        found = self._values("reaction", x, y, z)
        demand(found >= 0.0, "reaction", "zero or positive", x, y, z)
        return found

    def boundary_at(self, x: Array, y: Array, z: Array) -> Array:
        """Dirichlet data at points given by arrays of equal shape. Raises ExpressionError where they are not finite."""
        for name in ("boundary", "exact"):
            if name in self._parsed:
                return self._values(name, x, y, z)
        return np.zeros(x.shape)

    def flux_at(self, face: str, points: Array, normal: Array) -> Array:
        """The flux kappa grad u . n on a Neumann face, at points (3, ...) with outward unit normals (3, ...)."""
        name = f"neumann {face}"
        return self._values(name, *points) if name in self._parsed else self._exact_flux(points, normal)

    def robin_at(self, face: str, points: Array, normal: Array) -> tuple[Array, Array]:
        """Alpha and g on a Robin face, at points (3, ...) with outward unit normals (3, ...)."""
        name = f"robin {face}"
        alpha = self._values(f"{name}: alpha", *points)
        demand(alpha >= 0.0, f"{name}: alpha", "zero or positive", *points)
        if name in self._parsed:
            return alpha, self._values(name, *points)
        return alpha, self._exact_flux(points, normal) + alpha * self._values("exact", *points)

    def _exact_flux(self, points: Array, normal: Array) -> Array:
        exact = self._parsed["exact"][0]
        assert isinstance(exact, Expression)
        _, gradient = exact.gradient(*points)
        kappa = self.kappa_at(*points)
        flux = _times_symmetric(kappa, gradient) if len(self._kappa) == 6 else kappa * gradient
        x, y, z = points
        return finite("flux of exact", (flux * normal).sum(axis=0), x, y, z, exact)

    def exact_at(self, x: Array, y: Array, z: Array) -> tuple[Array, Array | None]:
        """Exact u and its gradient (3, ...), None for a function. Raises ExpressionError where they are not finite."""
        exact = self._parsed["exact"][0]
        if isinstance(exact, Expression):
            value, gradient = exact.gradient(x, y, z)
            return finite("exact", value, x, y, z, exact), finite("gradient of exact", gradient, x, y, z, exact)
        return values("exact", exact, x, y, z), None


def _parse_kappa(kappa: Data | Sequence[Data] | None) -> tuple[Parsed, ...]:
    """Nothing, one scalar, or the six entries of a symmetric tensor. Raises ValueError for any other number."""
    if kappa is None:
        return ()
    entries = [kappa] if isinstance(kappa, str) or callable(kappa) else list(kappa)
    if len(entries) == 9:
        for row, column in ((0, 1), (0, 2), (1, 2)):
            if entries[3 * row + column] != entries[3 * column + row]:
                raise ValueError("kappa is not symmetric: its entries above and below the diagonal must be the same")
        entries = [entries[3 * i + j] for i, j in PAIRS]
    if len(entries) not in (1, 6):
        raise ValueError(
            f"kappa has {len(entries)} entries: give one, the six xx, xy, xz, yy, yz, zz of a symmetric tensor, or nine"
        )
    return tuple(parse("kappa", entry) for entry in entries)


def _times_symmetric(tensor: Array, vector: Array) -> Array:
    """Symmetric tensor (6, ...) times vector (3, ...)."""
    return np.stack([sum(tensor[SYMMETRIC[i][j]] * vector[j] for j in range(3)) for i in range(3)])
