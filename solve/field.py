"""Defines the functions on a body as solution.npz stores them, and points with known parameters."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array, Knots
from parameterize.display import Brief
from parameterize.files import array_names, load_arrays, save_arrays
from parameterize.quality.distances import nearest_on_boundary
from parameterize.spline.archive import BASIS, load_patch_arrays, named_arrays
from parameterize.spline.body import Body, BodyLike, all_control_points, as_body
from parameterize.spline.bspline import evaluate_at, evaluate_grid
from parameterize.spline.sampled_boundary import SampledBoundary
from parameterize.spline.volume import BSplineVolume, checked_knots, load_spline, save_spline

ARRAYS = (*BASIS, "coefficients")  # of a patch in solution.npz
MORE = ("pressure", "state")  # arrays that only some solutions have
FARTHEST = 1e4  # of the volume's size: from there rounding hides which point of it is nearest


class Points(np.ndarray[Any, Any]):
    """Hold points (3, ...) of a volume with their parameters, so that fields can be evaluated there.

    rows: the parameters of a tensor grid, an array a direction; None where they are unknown, as for a part of the
    array. order: the directions along which the axes (...) run. places: the parameters (m, 3) of points (3, m) without
    a grid. pressure: the pressure (...) there of a solution that has one, as a law's quantities receive it. state: the
    internal variables (k, ...) there of a law with a history.
    """

    rows: Sequence[ArrayLike] | None = None
    order: tuple[int, ...] = (0, 1, 2)
    places: Array | None = None
    pressure: Array | None = None
    state: Array | None = None

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


def part_of(x: Points, points: Any) -> Points:
    """Return some of the points (3, m) with known parameters."""
    assert x.places is not None
    return Points.at(np.ascontiguousarray(x[:, points]), x.places[points])


class FieldOnBody:
    """Describe a function on a body: a SplineField on its only patch, or a BodyField with one on each patch."""

    if TYPE_CHECKING:  # BodyField would take this property for the default of its own `patches`

        @property
        def patches(self) -> "tuple[SplineField, ...]":
            """Return the function on each patch."""

    @property
    def on_body(self) -> Body:
        """Return the body of the function. Raises ValueError where it is unknown."""
        raise NotImplementedError

    def probe(self, points: ArrayLike, *, clip: bool = False) -> Array:
        """Return the values (m,) or (m, c) at points (m, 3) in space, in the body's units; NaN outside of the body.

        clip: whether points outside have the value of the nearest point of the boundary. Raises ValueError for points
        that are not finite or of another shape, and for a field without a volume.
        """
        body = self.on_body
        owners, where = body.locate(points)
        outside = owners < 0
        if clip and outside.any():
            beyond = np.atleast_2d(np.asarray(points, dtype=np.float64))[outside]
            middle = all_control_points(body).mean(axis=0)
            if np.abs(beyond - middle).max() > FARTHEST * body.size:
                raise ValueError(
                    f"a point lies more than {FARTHEST:g} times the volume's size away: its nearest point is not found"
                )
            owners[outside], where[outside], _ = nearest_on_boundary(beyond, body, SampledBoundary.of(body))
        values = np.full((len(where), *self.patches[0].coefficients.shape[3:]), np.nan)
        for number, patch in enumerate(self.patches):
            own = owners == number
            if own.any():
                values[own] = patch(where[own])
        return values

    def at(self, x: Array) -> Array:
        """Return the values (...) or (c, ...) at points x (3, ...) of the solver, as a law or a datum receives them."""
        raise NotImplementedError

    def fits(self, body: BodyLike) -> bool:
        """Return whether the field may be a datum on a body: its own patches are those of the body, or unknown."""
        patches = as_body(body).patches
        return len(self.patches) == len(patches) and all(map(_is_on, self.patches, patches))


@dataclass(frozen=True, eq=False, repr=False)
class SplineField(Brief, FieldOnBody):
    """Evaluate a function of the parameters of one patch.

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
    pressure : (m_u, m_v, m_w) array, optional
        The coefficients of the pressure of a nearly incompressible body, with the displacement as the field.
    state : (m_u, m_v, m_w, k) array, optional
        The coefficients of the internal variables of a law with a history, such as the plastic strain.

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
    pressure: Array | None = field(default=None, repr=False)
    state: Array | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        shape = np.shape(self.coefficients)
        if len(self.degrees) != 3 or len(self.knots) != 3 or len(shape) not in (3, 4):
            raise ValueError("a field has three degrees, three knot vectors, coefficients (m_u, m_v, m_w) or (.., c)")
        if self.pressure is not None and np.shape(self.pressure) != shape[:3]:
            raise ValueError(
                f"pressure must have the shape {shape[:3]} of the coefficients, got {np.shape(self.pressure)}"
            )
        if self.state is not None and (np.ndim(self.state) != 4 or np.shape(self.state)[:3] != shape[:3]):
            raise ValueError(f"state must have the shape ({shape[:3]}, k), got {np.shape(self.state)}")
        object.__setattr__(self, "knots", checked_knots(self.degrees, self.knots, shape[:3], "coefficients"))

    def __call__(self, points: ArrayLike) -> Array:
        """Return the values (m,) or (m, c) at parameters (m, 3)."""
        return evaluate_at(self.degrees, self.knots, self.coefficients, points)

    @property
    def patches(self) -> "tuple[SplineField, ...]":
        """Return the field itself, that of the only patch."""
        return (self,)

    @property
    def on_body(self) -> Body:
        """Return the volume as a body. Raises ValueError where it is unknown."""
        if self.geometry is None:
            raise ValueError(
                "points in space require a field with a volume: dataclasses.replace(field, geometry=volume)"
            )
        return as_body(self.geometry)

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

    @property
    def columns(self) -> Array:
        """Return the coefficients (m_u, m_v, m_w, c) of all components, then of the state, and last of a pressure."""
        parts = [self.coefficients.reshape(*self.coefficients.shape[:3], -1)]
        parts += [] if self.state is None else [self.state]
        parts += [] if self.pressure is None else [self.pressure[..., None]]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-1)

    def save(self, path: str | Path) -> None:
        """Write solution.npz (degrees, knots_u, .., coefficients, pressure and state if any) atomically."""
        save_spline(path, self.degrees, self.knots, coefficients=self.coefficients, **_more_of(self))

    @staticmethod
    def load(path: str | Path) -> "SplineField":
        """Read the field of a solution.npz, without its map and report.

        Raises FileNotFoundError, or a ValueError that names the defect of the file.
        """
        degrees, knots, coefficients = load_spline(path, "coefficients")
        return _checked(str(path), np.array(degrees), knots, coefficients, load_arrays(path, (), MORE))


@dataclass(frozen=True, eq=False, repr=False)
class BodyField(Brief, FieldOnBody):
    """Evaluate a function on a body of one patch or several.

    On one patch it has the parts of its SplineField: `degrees`, `knots`, `coefficients`, `geometry`, values at
    parameters and `grid`. On several it raises ValueError for them.

    Parameters
    ----------
    patches : tuple of SplineField
        The function on each patch, with the patch as its volume.
    body : Body, optional
        The body that these patches make.

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
    body: Body | None = field(default=None, repr=False)

    @property
    def on_body(self) -> Body:
        """Return the body of the function. Raises ValueError where it is unknown."""
        volumes = [patch.geometry for patch in self.patches if patch.geometry is not None]
        if self.body is None and len(volumes) < len(self.patches):
            raise ValueError("points in space require a field with a body: dataclasses.replace(field, body=body)")
        return self.body or Body(tuple(volumes))

    @property
    def is_single(self) -> bool:
        """Return whether the function is that of one patch which is not glued to itself."""
        return len(self.patches) == 1 and (self.body is None or self.body.is_single)

    @property
    def only(self) -> SplineField:
        """Return the function on the patch of a body of one. Raises ValueError for several."""
        if len(self.patches) > 1:
            raise ValueError(f"this field has {len(self.patches)} patches: use field.patches[i], or probe")
        return self.patches[0]

    @property
    def degrees(self) -> tuple[int, int, int]:
        """Return the degrees of the three directions, of one patch."""
        return self.only.degrees

    @property
    def knots(self) -> Knots:
        """Return the three knot vectors, of one patch."""
        return self.only.knots

    @property
    def coefficients(self) -> Array:
        """Return the coefficients (m_u, m_v, m_w) or (m_u, m_v, m_w, c), of one patch."""
        return self.only.coefficients

    @property
    def geometry(self) -> BodyLike | None:
        """Return the volume, or the body of several patches; None where it is unknown."""
        return self.only.geometry if self.body is None else self.body.simplest

    def __call__(self, points: ArrayLike) -> Array:
        """Return the values (m,) or (m, c) at parameters (m, 3) of one patch."""
        return self.only(points)

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return the values (len(u), len(v), len(w)) or (.., c) on a tensor grid of parameters of one patch."""
        return self.only.grid(u, v, w)

    def at(self, x: Array) -> Array:
        """Return the values (...) or (c, ...) at points x (3, ...) of the solver, which belong to one patch."""
        return self.only.at(x)

    def arrays(self, coefficients: Sequence[Array] = ()) -> dict[str, Array]:
        """Return the arrays of solution.npz by their names: degrees, .., of several patches p0_degrees, ..

        coefficients: those of each patch, by default its own.
        """
        parts = [
            dict(zip(ARRAYS, (np.array(patch.degrees), *patch.knots, values), strict=True)) | _more_of(patch)
            for patch, values in zip(self.patches, coefficients or self._coefficients, strict=True)
        ]
        return parts[0] if self.is_single else named_arrays(parts)

    @property
    def _coefficients(self) -> list[Array]:
        return [patch.coefficients for patch in self.patches]

    def save(self, path: str | Path) -> None:
        """Write solution.npz (degrees, .., coefficients; of several patches p0_degrees, ..) atomically."""
        save_arrays(path, **self.arrays())

    @staticmethod
    def load(path: str | Path) -> "BodyField":
        """Read the field of a solution.npz of one patch or several, without its maps and report.

        Raises FileNotFoundError, or a ValueError that names the defect of the file.
        """
        if not any(name.endswith("_degrees") for name in array_names(path)):
            return BodyField((SplineField.load(path),))
        patches = []
        for number, arrays in enumerate(load_patch_arrays(path, ("coefficients",), MORE)):
            degrees, *knots, coefficients = (arrays[name] for name in ARRAYS)
            patches.append(_checked(f"{path}: patch {number}", degrees, knots, coefficients, arrays))
        return BodyField(tuple(patches))


def _more_of(field: SplineField) -> dict[str, Array]:
    """Return the arrays of a field's pressure and state by their names in a file; none for what it has not."""
    return {name: values for name in MORE if (values := getattr(field, name)) is not None}


def _checked(
    place: str, degrees: Array, knots: Sequence[Array], coefficients: Array, others: Mapping[str, Array]
) -> SplineField:
    """Return the field of a file, whose pressure and state are among other arrays, if it has them.

    Raises ValueError, which begins with the place in the file.
    """
    more: dict[str, Any] = {name: others[name] for name in MORE if name in others}
    for name, values in {"coefficients": coefficients, **more}.items():
        if values.dtype.kind != "f" or not np.all(np.isfinite(values)):
            raise ValueError(f"{place}: {name} must be finite numbers")
    try:
        (p_u, p_v, p_w), (k_u, k_v, k_w) = degrees.tolist(), knots
        return SplineField((p_u, p_v, p_w), (k_u, k_v, k_w), coefficients, **more)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{place}: {error}") from None


def _is_on(field: SplineField, volume: BSplineVolume) -> bool:
    """Return whether a field belongs to a volume, or to none."""
    own = field.geometry
    if own is None or own is volume:
        return True
    parts = zip((*own.knots, own.homogeneous), (*volume.knots, volume.homogeneous), strict=True)
    return own.degrees == volume.degrees and all(np.array_equal(*pair) for pair in parts)
