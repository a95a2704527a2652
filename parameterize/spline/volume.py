"""BSplineVolume: a trivariate tensor-product B-spline F from the unit cube to space (paper, eq. 1)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..files import load_arrays, save_arrays
from .bspline import (
    apply_along,
    check_knots,
    evaluate_at,
    evaluate_grid,
    insert_knots,
    midpoints,
    open_uniform_knots,
    real_array,
)

AXES = "uvw"
FACE_NAMES = ("u0", "u1", "v0", "v1", "w0", "w1")
LARGEST = 1e100  # coordinate: determinants of larger ones leave double precision

Knots = tuple[Array, Array, Array]


def checked_knots(degrees: Sequence[int], knots: Sequence[ArrayLike], counts: Sequence[int], what: str) -> Knots:
    """Return the three knot vectors as float arrays; `counts` are the numbers of functions, which errors call `what`.

    Raises ValueError where one is not open from 0 to 1, or does not fit its degree and count.
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


@dataclass(frozen=True, eq=False)
class BSplineVolume:
    """A trivariate B-spline.

    Parameters
    ----------
    degrees : three int
        One a parametric direction.
    knots : three arrays
        Open knot vectors on [0, 1], of n + degree + 1 numbers.
    control_points : (n_u, n_v, n_w, 3) array
        In the user's units.

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
    knots: tuple[Array, Array, Array]
    control_points: Array

    def __post_init__(self) -> None:
        if len(self.degrees) != 3 or len(self.knots) != 3:
            raise ValueError("a volume has three degrees and three knot vectors")
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

    @classmethod
    def uniform(cls, control_points: ArrayLike, degree: int = 3) -> "BSplineVolume":
        """Make a volume with the same degree and equal spans in the three directions."""
        points = real_array(control_points, "control_points")
        knots = tuple(open_uniform_knots(n, degree) for n in points.shape[:3])
        return cls((degree, degree, degree), knots, points)  # type: ignore[arg-type]

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the number of control points per direction."""
        return self.control_points.shape[:3]

    def __call__(self, points: ArrayLike) -> Array:
        """Return F at points (m, 3) of the unit cube: (m, 3)."""
        return self._at(points, (0, 0, 0))

    def jacobian(self, points: ArrayLike) -> Array:
        """Return J[i, a, b] = dF_a / du_b at points (m, 3): (m, 3, 3)."""
        units = np.eye(3, dtype=int)
        return np.stack([self._at(points, tuple(row)) for row in units], axis=-1)

    def hessian(self, points: ArrayLike) -> Array:
        """Return H[i, a, b, c] = d2F_a / du_b du_c at points (m, 3): (m, 3, 3, 3)."""
        units = np.eye(3, dtype=int)
        rows = [[self._at(points, tuple(units[b] + units[c])) for c in range(3)] for b in range(3)]
        return np.moveaxis(np.array(rows), (0, 1), (2, 3))

    def _at(self, points: ArrayLike, derivative: tuple[int, ...]) -> Array:
        return evaluate_at(self.degrees, self.knots, self.control_points, points, derivative)

    def grid(self, u: ArrayLike, v: ArrayLike, w: ArrayLike, derivative: tuple[int, int, int] = (0, 0, 0)) -> Array:
        """Return F or one of its partial derivatives on a tensor grid: (len(u), len(v), len(w), 3)."""
        return evaluate_grid(self.degrees, self.knots, self.control_points, (u, v, w), derivative)

    def grid_jacobian(self, u: ArrayLike, v: ArrayLike, w: ArrayLike) -> Array:
        """Return the Jacobian on a tensor grid: (len(u), len(v), len(w), 3, 3), last index the parametric direction."""
        return np.stack([self.grid(u, v, w, d) for d in ((1, 0, 0), (0, 1, 0), (0, 0, 1))], axis=-1)

    def refined(self, levels: int = 1) -> "BSplineVolume":
        """Return the same map with every span halved `levels` times, exactly (knot insertion)."""
        if levels < 0:
            raise ValueError(f"levels must be non-negative, got {levels}")
        volume = self
        for _ in range(levels):
            knots, points = [], volume.control_points
            for a in range(3):
                finer, matrix = insert_knots(volume.knots[a], volume.degrees[a], midpoints(volume.knots[a]))
                points = apply_along(matrix, points, a)
                knots.append(finer)
            volume = BSplineVolume(self.degrees, tuple(knots), points)  # type: ignore[arg-type]
        return volume

    def face(self, axis: int, side: int) -> Array:
        """Return the control points of a boundary face, e.g. (n_v, n_w, 3) for axis 0; side 0 or 1."""
        return np.take(self.control_points, 0 if side == 0 else -1, axis=axis)

    def transformed(self, scale: float, offset: ArrayLike) -> "BSplineVolume":
        """Return the map scale * F + offset."""
        return BSplineVolume(self.degrees, self.knots, scale * self.control_points + np.asarray(offset))

    def save(self, path: str | Path) -> None:
        """Write volume.npz (degrees, knots_u, knots_v, knots_w, control_points); atomic."""
        save_spline(path, self.degrees, self.knots, control_points=self.control_points)

    @classmethod
    def load(cls, path: str | Path) -> "BSplineVolume":
        """Read volume.npz. Raises FileNotFoundError, or ValueError naming what is wrong with the file."""
        degrees, knots, points = load_spline(path, "control_points")
        try:
            return cls(degrees, knots, points)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None
