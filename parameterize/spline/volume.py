"""BSplineVolume: a trivariate tensor-product spline F from the unit cube to space (paper, eq. 1), or a rational one."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, Knots
from ..display import Brief, Shown, above
from ..files import load_arrays, save_arrays
from .bspline import (
    apply_along,
    between,
    check_knots,
    evaluate_at,
    evaluate_grid,
    greville,
    halved,
    insertion_into,
    interpolate_grid,
    open_uniform_knots,
    real_array,
    with_full_knots,
)
from .rational import Orders, homogeneous, projected, quotients

if TYPE_CHECKING:
    import pyvista
    from matplotlib.figure import Figure

AXES = "uvw"
FACE_NAMES = ("u0", "u1", "v0", "v1", "w0", "w1")
LARGEST = 1e100  # coordinate, or weight: determinants of larger ones leave double precision
UNITS: tuple[Orders, ...] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))  # orders of the first derivatives


def checked_knots(degrees: Sequence[int], knots: Sequence[ArrayLike], counts: Sequence[int], what: str) -> Knots:
    """Return the three knot vectors as float arrays.

    counts: the numbers of basis functions. what: their name in errors. Raises ValueError where one is not open from 0
    to 1, or does not fit its degree and count.
    """
    checked = []
    for axis, degree, row, n in zip(AXES, degrees, knots, counts, strict=True):
        values = check_knots(row, int(degree))
        if len(values) != n + degree + 1:
            raise ValueError(f"direction {axis}: {n} {what} of degree {degree} need {n + degree + 1} knots")
        if values[0] != 0.0 or values[-1] != 1.0:
            raise ValueError(f"direction {axis}: knots must run from 0 to 1, got {values[0]} to {values[-1]}")
        checked.append(values)
    u, v, w = checked
    return u, v, w


def save_spline(path: str | Path, degrees: Sequence[int], knots: Sequence[Array], **content: Array) -> None:
    """Write an .npz of degrees, knots_u, knots_v, knots_w and the named content; atomic."""
    named = {f"knots_{a}": k for a, k in zip(AXES, knots, strict=True)}
    save_arrays(path, degrees=np.array(degrees), **named, **content)


def load_spline(path: str | Path, content: str) -> tuple[tuple[int, int, int], Knots, Array]:
    """Read degrees, knots and the array named `content`. Raises FileNotFoundError, or ValueError for another file."""
    data = load_arrays(path, ("degrees", "knots_u", "knots_v", "knots_w", content))
    if data["degrees"].shape != (3,) or data["degrees"].dtype.kind not in "iu":
        raise ValueError(f"{path}: degrees must be three integers")
    p_u, p_v, p_w = data["degrees"].tolist()
    return (p_u, p_v, p_w), (data["knots_u"], data["knots_v"], data["knots_w"]), data[content]


@dataclass(frozen=True, eq=False, repr=False)
class BSplineVolume(Brief, Shown):
    """A trivariate B-spline, or with weights a rational one (NURBS).

    With control points P_i, weights w_i and B-splines N_i it is F = sum w_i P_i N_i / sum w_i N_i.

    Parameters
    ----------
    degrees : three int
        One a parametric direction.
    knots : three arrays
        Open knot vectors on [0, 1], of n + degree + 1 numbers.
    control_points : (n_u, n_v, n_w, 3) array
        In the user's units; with weights, too, the points P_i themselves.
    weights : (n_u, n_v, n_w) array, optional
        Positive; None for a polynomial volume. Weights that are all equal become None.

    Raises
    ------
    ValueError
        Where the parts do not fit together.

    Examples
    --------
    >>> import numpy as np
    >>> import iga_nn
    >>> grid = np.stack(np.meshgrid(*[np.linspace(0, 1, 4)] * 3, indexing="ij"), axis=-1)
    >>> rod = iga_nn.BSplineVolume.uniform(grid * [4, 1, 1])  # control points (4, 4, 4, 3)
    >>> rod([[0.5, 0.5, 0.5]]).round(12)
    array([[2. , 0.5, 0.5]])
    >>> rod.jacobian([[0.5, 0.5, 0.5]])[0].diagonal().round(12)
    array([4., 1., 1.])
    >>> rod.refined().shape  # the same map
    (5, 5, 5)
    """

    degrees: tuple[int, int, int]
    knots: Knots
    control_points: Array
    weights: Array | None = None

    def __post_init__(self) -> None:
        if not all(isinstance(part, Sequence | np.ndarray) and len(part) == 3 for part in (self.degrees, self.knots)):
            raise ValueError("a volume has three degrees, then three knot vectors, then its control points")
        if not all(isinstance(degree, Integral) for degree in self.degrees):
            raise ValueError(f"degrees must be whole numbers, got {self.degrees!r:.80}")
        points = real_array(self.control_points, "control_points")
        if points.ndim != 4 or points.shape[3] != 3:
            raise ValueError(f"control_points must have shape (n_u, n_v, n_w, 3), got {points.shape}")
        if not np.all(np.isfinite(points)):
            raise ValueError("control_points must be finite")
        if np.abs(points).max(initial=0.0) > LARGEST:
            raise ValueError(f"control_points must not exceed {LARGEST:g} in magnitude; choose other units")
        knots = checked_knots(self.degrees, self.knots, points.shape[:3], "control points")
        object.__setattr__(self, "degrees", tuple(int(p) for p in self.degrees))
        object.__setattr__(self, "knots", knots)
        object.__setattr__(self, "control_points", points)
        object.__setattr__(self, "weights", _checked_weights(self.weights, points.shape[:3]))

    @classmethod
    def uniform(cls, control_points: ArrayLike, degree: int = 3) -> "BSplineVolume":
        """Make a volume with the same degree and equal spans in the three directions."""
        points = real_array(control_points, "control_points")
        knots = tuple(open_uniform_knots(n, degree) for n in points.shape[:3])
        return cls((degree, degree, degree), knots, points)  # type: ignore[arg-type]

    @classmethod
    def from_function(
        cls, function: Callable[..., Any], control_points: int | Sequence[int] = 8, degree: int = 3
    ) -> "BSplineVolume":
        """Make the volume that equals x, y, z = function(u, v, w) at the Greville points, on equal spans.

        function: takes three arrays of one shape, 0 to 1, and returns three: arrays of that shape, or numbers.
        control_points: how many, one number or one a direction. A polynomial of that degree a direction is met exactly.
        Raises ValueError where the values are not finite or not three, or the control points too few for the degree.
        """
        wanted = np.asarray(control_points)
        if wanted.dtype.kind not in "iu" or wanted.shape not in ((), (3,)):
            raise ValueError(f"control_points must be a whole number, or three of them, got {control_points!r:.80}")
        counts = np.broadcast_to(wanted, 3).tolist()
        knots = tuple(open_uniform_knots(n, degree) for n in counts)
        grid = np.meshgrid(*[greville(row, degree) for row in knots], indexing="ij")
        values = function(*grid)
        if not isinstance(values, tuple | list | np.ndarray) or len(values) != 3:
            found = len(values) if isinstance(values, tuple | list) else repr(values)[:80]
            raise ValueError(f"function must return three values, x, y and z; it returned {found}")
        parts = [real_array(value, "values of function") for value in values]
        if any(part.shape not in ((), tuple(counts)) for part in parts):
            raise ValueError(f"function must return arrays of shape {tuple(counts)} or numbers")
        net = np.stack([np.broadcast_to(part, counts) for part in parts], axis=-1)
        if not np.all(np.isfinite(net)):
            raise ValueError("function must return finite numbers for all u, v, w from 0 to 1")
        return cls((degree, degree, degree), knots, interpolate_grid(knots, degree, net))  # type: ignore[arg-type]

    @classmethod
    def from_splinepy(cls, spline: Any) -> "BSplineVolume":
        """Make the volume of a spline of splinepy, its knots scaled to run from 0 to 1; the map stays.

        Raises TypeError for another object, ValueError for a spline that does not map 3 parameters to 3 coordinates.
        """
        return above("io.splinepy").from_splinepy(spline)

    def to_splinepy(self) -> Any:
        """Return the same map as a splinepy.BSpline, or NURBS. Raises InputError where splinepy is missing."""
        return above("io.splinepy").to_splinepy(self)

    def to_pyvista(self, samples: int | None = None) -> "pyvista.UnstructuredGrid":
        """Return the volume as a grid of pyvista: exact Bezier cells, or linear cells.

        samples: None for the exact cells, one a knot span; else the number of linear cells a span and direction, with
        the distortion `arap` and `det J` as point data. VTK's slices, clips and contours are right on these alone.
        """
        return above("io.view").grid(self, samples=samples)

    def plot(self, what: str = "faces", file: str | Path | None = None) -> "Figure":
        """Return a figure of the volume, drawn off screen; report.html shows the same.

        what: "faces", "lines", "cut" or "distortion". file: PNG to write the figure to, too.
        Raises ValueError for another name, RuntimeError where VTK cannot draw on this machine.
        """
        return above("figures.map").plot_body(self, what, file)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the number of control points per direction."""
        return self.control_points.shape[:3]

    def __call__(self, points: ArrayLike) -> Array:
        """Return F at points (m, 3) of the unit cube: (m, 3)."""
        return self._at(points, [(0, 0, 0)])[0]

    def locate(self, points: ArrayLike) -> Array:
        """Return the parameters (m, 3) of points (m, 3) in space, NaN for points outside.

        A point closer to the volume than 1e-10 of its size counts as inside.
        Raises ValueError for points of another shape or that are not finite.
        """
        from .location import locate

        return locate((self,), points)[1]

    def jacobian(self, points: ArrayLike) -> Array:
        """Return J[i, a, b] = dF_a / du_b at points (m, 3): (m, 3, 3)."""
        return np.stack(self._at(points, UNITS), axis=-1)

    def hessian(self, points: ArrayLike) -> Array:
        """Return H[i, a, b, c] = d2F_a / du_b du_c at points (m, 3): (m, 3, 3, 3)."""
        units = np.eye(3, dtype=int)
        orders = [tuple((units[b] + units[c]).tolist()) for b in range(3) for c in range(3)]
        rows = np.array(self._at(points, orders))
        return np.moveaxis(rows.reshape(3, 3, *rows.shape[1:]), (0, 1), (2, 3))

    def _at(self, points: ArrayLike, orders: Sequence[Orders]) -> list[Array]:
        """Return partial derivatives (m, 3) at points (m, 3)."""
        return self._derivatives(lambda net, order: evaluate_at(self.degrees, self.knots, net, points, order), orders)

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike, derivative: tuple[int, int, int] = (0, 0, 0)) -> Array:
        """Return F or one of its partial derivatives on a tensor grid: (len(u), len(v), len(w), 3)."""
        return self._on_grid((u, v, w), [derivative])[0]

    def grid_jacobian(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return the Jacobian on a tensor grid: (len(u), len(v), len(w), 3, 3), last index the parametric direction."""
        return np.stack(self._on_grid((u, v, w), UNITS), axis=-1)

    def _on_grid(self, rows: Sequence[ArrayLike], orders: Sequence[Orders]) -> list[Array]:
        """Return partial derivatives (len(u), len(v), len(w), 3) on the tensor grid of three rows."""
        return self._derivatives(lambda net, order: evaluate_grid(self.degrees, self.knots, net, rows, order), orders)

    def _derivatives(self, evaluate: Callable[[Array, Orders], Array], orders: Sequence[Orders]) -> list[Array]:
        """Return partial derivatives of F; evaluate: returns that of the spline of given coefficients."""
        if self.weights is None:
            return [evaluate(self.control_points, order) for order in orders]
        return quotients(partial(evaluate, self.homogeneous), orders)

    @property
    def homogeneous(self) -> Array:
        """Return the coefficients (n_u, n_v, n_w, 4) of sum w_i P_i N_i and of sum w_i N_i; weights 1 without any."""
        ones = np.ones(self.shape)
        return homogeneous(self.control_points, ones if self.weights is None else self.weights)

    def refined(self, levels: int = 1) -> "BSplineVolume":
        """Return the same map with every span halved `levels` times, exactly (knot insertion). Raises ValueError."""
        if not isinstance(levels, Integral) or levels < 0:
            raise ValueError(f"levels must be a whole number, at least 0, got {levels!r:.80}")
        volume = self
        for _ in range(levels):
            u, v, w = map(halved, volume.knots)
            volume = volume.on_knots((u, v, w))
        return volume

    def on_knots(self, finer: Knots) -> "BSplineVolume":
        """Return the same map on finer knots, exactly (knot insertion).

        Raises ValueError where these lack one of the map's own knots.
        """
        net = self.control_points if self.weights is None else self.homogeneous
        for a in range(3):
            net = apply_along(insertion_into(self.knots[a], self.degrees[a], finer[a]), net, a)
        parts = (net,) if self.weights is None else projected(net)
        return BSplineVolume(self.degrees, finer, *parts)

    def divided(
        self, u: Sequence[float] = (), v: Sequence[float] = (), w: Sequence[float] = ()
    ) -> "tuple[BSplineVolume, ...]":
        """Return the volumes into which cuts at parameters divide the map, exactly; along w one comes after the other.

        u, v, w: the parameters of the cuts, between 0 and 1; each volume's own parameters run from 0 to 1 again.
        Raises ValueError for other parameters.

        Examples
        --------
        >>> import iga_nn
        >>> rod = iga_nn.BSplineVolume.from_function(lambda u, v, w: (4 * u, v, w), control_points=5)
        >>> left, right = rod.divided(u=[0.25])
        >>> right([[0, 0, 0], [1, 0, 0]])[:, 0].round(12)
        array([1., 4.])
        """
        if not all(isinstance(cuts, Sequence | np.ndarray) for cuts in (u, v, w)):
            raise ValueError(f"cuts must be lists of parameters, such as u=[0.5], got {(u, v, w)!r:.80}")
        ends = [[0.0, *sorted(cuts), 1.0] for cuts in (u, v, w)]
        if any(not 0.0 <= a < b <= 1.0 for row in ends for a, b in pairwise(row)):
            raise ValueError(f"cuts must be different parameters between 0 and 1, got {(u, v, w)!r:.80}")
        finer = map(with_full_knots, self.knots, self.degrees, (row[1:-1] for row in ends))
        whole = self.on_knots(tuple(finer))  # type: ignore[arg-type]
        return tuple(whole._between(part) for part in product(*map(pairwise, ends)))

    def _between(self, ends: Sequence[tuple[float, float]]) -> "BSplineVolume":
        """Return the part between two parameters in each direction, at which the spline is only continuous."""
        parts = zip(self.knots, self.degrees, ends, strict=True)
        window, rows = zip(*(between(row, degree, *own) for row, degree, own in parts), strict=True)
        weights = None if self.weights is None else self.weights[window]
        return BSplineVolume(self.degrees, rows, self.control_points[window], weights)

    def face(self, axis: int, side: int) -> Array:
        """Return the control points of a boundary face, e.g. (n_v, n_w, 3) for axis 0; side 0 or 1."""
        return np.take(self.control_points, 0 if side == 0 else -1, axis=axis)

    def transformed(self, scale: float, offset: ArrayLike) -> "BSplineVolume":
        """Return the map scale * F + offset."""
        return replace(self, control_points=scale * self.control_points + np.asarray(offset))

    def save(self, path: str | Path) -> None:
        """Write volume.npz (degrees, knots_u, knots_v, knots_w, control_points; weights where it has any); atomic."""
        weights = {} if self.weights is None else {"weights": self.weights}
        save_spline(path, self.degrees, self.knots, control_points=self.control_points, **weights)

    @classmethod
    def load(cls, path: str | Path) -> "BSplineVolume":
        """Read volume.npz. Raises FileNotFoundError, or ValueError that names the defect of the file."""
        degrees, knots, points = load_spline(path, "control_points")
        weights = load_arrays(path, (), ("weights",)).get("weights")
        try:
            return cls(degrees, knots, points, weights)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None


def _checked_weights(given: ArrayLike | None, shape: tuple[int, ...]) -> Array | None:
    """Return weights (n_u, n_v, n_w) as a float array, None where all are equal; raise ValueError for others."""
    if given is None:
        return None
    weights = real_array(given, "weights")
    if weights.shape != shape:
        raise ValueError(f"weights must have shape {shape}, one for each control point, got {weights.shape}")
    if np.any(refused := ~((weights >= 1.0 / LARGEST) & (weights <= LARGEST))):  # NaN included
        first = weights[refused][0]
        raise ValueError(f"weights must be positive, from {1.0 / LARGEST:g} to {LARGEST:g}, got {first:g}")
    return None if np.all(weights == weights.flat[0]) else weights


def demand_volume(volume: object) -> None:
    """Raise TypeError for an object that is not a BSplineVolume."""
    if not isinstance(volume, BSplineVolume):
        raise TypeError(f"volume must be a BSplineVolume, got {type(volume).__name__}")
