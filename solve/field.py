"""Defines SplineField, a function of the parameters as solution.npz stores it, and points with known parameters."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array, Knots
from parameterize.display import Brief
from parameterize.files import array_names, load_arrays, save_arrays
from parameterize.quality.distances import nearest_on_boundary
from parameterize.spline.body import Body, BodyLike
from parameterize.spline.bspline import evaluate_at, evaluate_grid
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.spline.volume import BSplineVolume, checked_knots, load_spline, save_spline

ARRAYS = ("degrees", "knots_u", "knots_v", "knots_w", "coefficients")  # of a patch in solution.npz
FARTHEST = 1e4  # of the volume's size: from there rounding hides which point of it is nearest


class Points(np.ndarray[Any, Any]):
    """Hold points (3, ...) of a volume with their parameters, so that fields can be evaluated there.

    rows: the parameters of a tensor grid, an array a direction; None where they are unknown, as for a part of the
    array. order: the directions along which the axes (...) run. places: the parameters (m, 3) of points (3, m) without
    a grid.
    """

    rows: Sequence[ArrayLike] | None = None
    order: tuple[int, ...] = (0, 1, 2)
    places: Array | None = None

    @classmethod
    def of(cls, x: Array, rows: Sequence[ArrayLike], order: tuple[int, ...] = (0, 1, 2)) -> Self:
        """Return the points x (3, ...) with the parameters `rows` of a tensor grid."""
        points = x.view(cls)
        points.rows, points.order = rows, order
        return points

    @classmethod
    def at(cls, x: Array, places: Array) -> Self:
        """Return the points x (3, m) with the parameters `places` (m, 3)."""
        points = x.view(cls)
        points.places = places
        return points

    @classmethod
    def on(cls, volume: BSplineVolume, u: Array, v: Array, w: Array) -> Self:
        """Return the points (3, len(u), len(v), len(w)) of a volume on a tensor grid of parameters."""
        return cls.of(np.moveaxis(volume.grid(u, v, w), -1, 0), (u, v, w))


@dataclass(frozen=True, eq=False, repr=False)
class SplineField(Brief):
    """Evaluate a function of the parameters.

    Parameters
    ----------
    degrees : three int
        The degrees of the three directions.
    knots : three arrays
        Open knot vectors on [0, 1].
    coefficients : (m_u, m_v, m_w) array
        The coefficients; (m_u, m_v, m_w, c) with c components.
    geometry : BSplineVolume, optional
        The volume on which the field was found; None for a function on any volume.

    Raises
    ------
    ValueError
        Where the parts do not fit together.

    Examples
    --------
    >>> import iga_nn
    >>> from solve import benchmark_volume
    >>> volume = benchmark_volume(2)
    >>> field = iga_nn.solve(volume, iga_nn.Poisson(exact="1+x")).field
    >>> bool(abs(field([[0.2, 0.5, 0.5]]) - volume([[0.2, 0.5, 0.5]])[:, 0] - 1) < 1e-6)
    True
    """

    degrees: tuple[int, int, int]
    knots: Knots
    coefficients: Array
    geometry: BSplineVolume | None = None

    def __post_init__(self) -> None:
        shape = np.shape(self.coefficients)
        if len(self.degrees) != 3 or len(self.knots) != 3 or len(shape) not in (3, 4):
            raise ValueError("a field has three degrees, three knot vectors, coefficients (m_u, m_v, m_w) or (.., c)")
        object.__setattr__(self, "knots", checked_knots(self.degrees, self.knots, shape[:3], "coefficients"))

    def __call__(self, points: ArrayLike) -> Array:
        """Return the values (m,) or (m, c) at parameters (m, 3)."""
        return evaluate_at(self.degrees, self.knots, self.coefficients, points)

    def probe(self, points: ArrayLike, *, clip: bool = False) -> Array:
        """Return the values (m,) or (m, c) at points (m, 3) in space, in the volume's units; NaN outside of the volume.

        clip: whether points outside have the value of the nearest point of the boundary. Raises ValueError for points
        that are not finite or of another shape, and for a field without a volume.
        """
        if self.geometry is None:
            raise ValueError(
                "points in space require a field with a volume: dataclasses.replace(field, geometry=volume)"
            )
        where = self.geometry.locate(points)
        outside = np.isnan(where[:, 0])
        if clip and outside.any():
            beyond = np.atleast_2d(np.asarray(points, dtype=np.float64))[outside]
            middle = self.geometry.control_points.mean(axis=(0, 1, 2))
            if np.abs(beyond - middle).max() > FARTHEST * np.ptp(self.geometry.control_points, axis=(0, 1, 2)).max():
                raise ValueError(
                    f"a point lies more than {FARTHEST:g} times the volume's size away: its nearest point is not found"
                )
            _, where[outside], _ = nearest_on_boundary(beyond, self.geometry, SampledBoundary.of(self.geometry))
            outside[:] = False
        values = np.full((len(where), *self.coefficients.shape[3:]), np.nan)
        values[~outside] = self(where[~outside])
        return values

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return the values (len(u), len(v), len(w)) or (.., c) on a tensor grid of parameters."""
        return evaluate_grid(self.degrees, self.knots, self.coefficients, (u, v, w))

    def at(self, x: Array) -> Array:
        """Return the values (...) or (c, ...) at points x (3, ...) of the solver, as a law or a datum receives them.

        For parameters use `field(uvw)`. Raises ValueError for points whose parameters are unknown.
        """
        if isinstance(x, Points) and x.places is not None:
            return np.moveaxis(self(x.places), 0, -1)
        if not isinstance(x, Points) or x.rows is None:
            raise ValueError(
                "a field is a function of the parameters: evaluate with field(uvw), uvw of shape (m, 3) from 0 to 1, "
                "or field.grid(u, v, w); for points in space use field.probe(points); `at` requires the solver's own "
                "points x, as a law or a datum receives them, without a change"
            )
        values = np.moveaxis(self.grid(*x.rows), -1, 0) if self.coefficients.ndim == 4 else self.grid(*x.rows)[None]
        single = [axis for axis in range(3) if axis not in x.order]  # directions of one parameter
        values = values.transpose(0, *(1 + axis for axis in (*x.order, *single))).reshape(-1, *x.shape[1:])
        return values if self.coefficients.ndim == 4 else values[0]

    def fits(self, body: BodyLike) -> bool:
        """Return whether the field may be a datum on a body: its own volume is the body, or it has none."""
        own, volume = self.geometry, body
        if isinstance(volume, Body):
            return False
        if own is None or own is volume:
            return True
        parts = zip((*own.knots, own.homogeneous), (*volume.knots, volume.homogeneous), strict=True)
        return own.degrees == volume.degrees and all(np.array_equal(*pair) for pair in parts)

    def save(self, path: str | Path) -> None:
        """Write solution.npz (degrees, knots_u, knots_v, knots_w, coefficients) atomically."""
        save_spline(path, self.degrees, self.knots, coefficients=self.coefficients)

    @staticmethod
    def load(path: str | Path) -> "SplineField":
        """Read the field of a solution.npz, without its map and report.

        Raises FileNotFoundError, or a ValueError that names the defect of the file.
        """
        degrees, knots, coefficients = load_spline(path, "coefficients")
        if coefficients.dtype.kind != "f" or not np.all(np.isfinite(coefficients)):
            raise ValueError(f"{path}: coefficients must be finite numbers")
        try:
            return SplineField(degrees, knots, coefficients)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None


@dataclass(frozen=True, eq=False, repr=False)
class MultiPatchField(Brief):
    """Evaluate a function on several patches.

    Parameters
    ----------
    patches : tuple of SplineField
        The function on each patch, with the patch as its volume.

    Examples
    --------
    >>> import iga_nn
    >>> halves = [iga_nn.BSplineVolume.from_function(lambda u, v, w, a=a: (u + a, v, w), 4) for a in (0, 1)]
    >>> rod = iga_nn.Body.from_patches(halves)
    >>> heat = iga_nn.solve(rod, iga_nn.Poisson(exact="x")).field
    >>> heat.probe([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]]).round(9)
    array([0.5, 1.5])
    """

    patches: tuple[SplineField, ...]

    def save(self, path: str | Path) -> None:
        """Write solution.npz of several patches (p0_degrees, .., p0_coefficients, p1_degrees, ..) atomically."""
        save_arrays(path, **arrays_of(self.patches, [patch.coefficients for patch in self.patches]))

    @staticmethod
    def load(path: str | Path) -> "MultiPatchField":
        """Read the field of a solution.npz of several patches, without its maps and report.

        Raises FileNotFoundError, or a ValueError that names the defect of the file.
        """
        count = sum(name.endswith("_degrees") for name in array_names(path))
        if count == 0:
            raise ValueError(f"{path}: holds no solution on several patches")
        arrays = load_arrays(path, tuple(f"p{number}_{name}" for number in range(count) for name in ARRAYS))
        patches = []
        for number in range(count):
            degrees, *knots, coefficients = (arrays[f"p{number}_{name}"] for name in ARRAYS)
            if coefficients.dtype.kind != "f" or not np.all(np.isfinite(coefficients)):
                raise ValueError(f"{path}: patch {number}: coefficients must be finite numbers")
            try:
                p_u, p_v, p_w = degrees.tolist()
                patches.append(SplineField((p_u, p_v, p_w), (knots[0], knots[1], knots[2]), coefficients))
            except (TypeError, ValueError) as error:
                raise ValueError(f"{path}: patch {number}: {error}") from None
        return MultiPatchField(tuple(patches))

    def probe(self, points: ArrayLike) -> Array:
        """Return the values (m,) or (m, c) at points (m, 3) in space, in the body's units; NaN outside of the body.

        Raises ValueError for points that are not finite or of another shape.
        """
        found = self.patches[0].probe(points)
        for patch in self.patches[1:]:
            missing = np.isnan(found.reshape(len(found), -1)).any(axis=1)
            if missing.any():
                found[missing] = patch.probe(np.atleast_2d(np.asarray(points, dtype=np.float64))[missing])
        return found

    def at(self, x: Array) -> Array:
        """Raise ValueError: points of the solver have the values of the field of their patch."""
        raise ValueError("a field on several patches has values at points of a patch: use its `patches`, or probe")

    def fits(self, body: BodyLike) -> bool:
        """Return whether the field may be a datum on a body: its own patches are those of the body."""
        return (
            isinstance(body, Body)
            and len(body) == len(self.patches)
            and all(field.fits(volume) for field, volume in zip(self.patches, body.patches, strict=True))
        )


def arrays_of(patches: Sequence[SplineField], coefficients: Sequence[Array]) -> dict[str, Array]:
    """Return the arrays of an .npz of several patches by their names, such as p0_degrees and p0_coefficients."""
    found: dict[str, Array] = {}
    for number, (patch, values) in enumerate(zip(patches, coefficients, strict=True)):
        parts = (np.array(patch.degrees), *patch.knots, values)
        found |= {f"p{number}_{name}": array for name, array in zip(ARRAYS, parts, strict=True)}
    return found
