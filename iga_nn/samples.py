"""Makes small closed surfaces by formula, for the demo and the tests: the same numbers every time."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.files import save_text
from parameterize.surface.surface import Surface, surface_from_arrays

from .errors import did_you_mean

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def sample(name: str) -> Surface:
    """Return the surface of that name (1 500 to 4 000 vertices), checked like one from a file.

    Parameters
    ----------
    name : str
        "bean", "bumpy_ball", "cube", "ellipsoid" or "seashell".

    Raises
    ------
    ValueError
        For any other name; the message names the samples.

    Examples
    --------
    >>> import iga_nn
    >>> iga_nn.sample("ellipsoid").vertices.shape
    (2500, 3)
    """
    if not isinstance(name, str) or name not in SAMPLES:
        raise ValueError(f"no sample {name!r}: choose one of {', '.join(SAMPLES)}{did_you_mean(str(name), SAMPLES)}")
    vertices, faces = SAMPLES[name]()
    return surface_from_arrays(vertices, faces, name)


def write_obj(surface: Surface, path: str | Path) -> None:
    """Write a surface as OBJ; atomic."""
    save_text(path, obj_text(surface))


def obj_text(surface: Surface) -> str:
    """Return a surface as OBJ in the user's units, with every digit of its coordinates."""
    # trimesh writes a fixed number of decimals: small surfaces would lose all digits
    rows = [f"# {surface.name}: {len(surface.vertices)} vertices, {len(surface.faces)} faces"]
    rows += [f"v {x!r} {y!r} {z!r}" for x, y, z in surface.vertices.tolist()]
    rows += [f"f {a} {b} {c}" for a, b, c in (surface.faces + 1).tolist()]
    return "\n".join(rows) + "\n"


def ball(count: int) -> tuple[Array, IntArray]:
    """Return evenly spread points (count, 3) of the unit sphere (Fibonacci lattice) and their Delaunay triangles."""
    k = np.arange(count)
    z = 1.0 - (2.0 * k + 1.0) / count
    radius = np.sqrt(1.0 - z**2)
    points = np.stack([radius * np.cos(GOLDEN_ANGLE * k), radius * np.sin(GOLDEN_ANGLE * k), z], axis=1)
    return points, outward_hull(points)


def outward_hull(points: Array) -> IntArray:
    """Return the triangles (m, 3) of the convex hull of points (n, 3) around the origin, oriented outward."""
    from scipy.spatial import ConvexHull

    faces = ConvexHull(points).simplices.astype(np.int64)
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = np.sum(np.cross(b - a, c - a) * a, axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces


def _ellipsoid() -> tuple[Array, IntArray]:
    """Return an ellipsoid with half axes 1.5, 1 and 0.7."""
    points, faces = ball(2500)
    return points * [1.5, 1.0, 0.7], faces


def _bumpy_ball() -> tuple[Array, IntArray]:
    """Return a ball with rounded bumps."""
    points, faces = ball(3000)
    x, y, z = 4.5 * points.T
    radius = 1.0 + 0.13 * (np.sin(x) * np.sin(y + 0.5) + np.sin(y) * np.sin(z + 1.0) + np.sin(z) * np.sin(x + 1.5))
    return radius[:, None] * points, faces


def _bean() -> tuple[Array, IntArray]:
    """Return an ellipsoid bent around a circle, with a dent inside the bend."""
    points, faces = ball(2500)
    x, y, z = (points * [1.9, 0.75, 0.65]).T
    x, y = x * (1.0 + 0.08 * points[:, 0]), y * (1.0 + 0.12 * points[:, 0])
    y = y + 0.22 * np.exp(-((2.0 * points[:, 0]) ** 2)) * np.maximum(-points[:, 1], 0.0) ** 2
    bend = 1.6  # radius of the circle the long axis is laid on
    angle, out = x / bend, bend + y
    return np.stack([out * np.sin(angle), out * np.cos(angle) - bend, z], axis=1), faces


def _cube() -> tuple[Array, IntArray]:
    """Return a cube of side 1, its faces cut into triangles."""
    n = 16
    grid = np.stack(np.meshgrid(*[np.arange(n + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([corner, corner + n + 1, corner + n + 2, corner + 1], axis=1)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    points: list[IntArray] = []
    faces: list[IntArray] = []
    for axis in range(3):
        for side in (0, 1):
            face = np.empty((len(grid), 3), dtype=np.int64)
            face[:, axis], face[:, (axis + 1) % 3], face[:, (axis + 2) % 3] = side * n, grid[:, 0], grid[:, 1]
            faces.append((triangles if side else triangles[:, ::-1]) + len(grid) * len(points))
            points.append(face)
    unique, index = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    return unique / n, index.reshape(-1)[np.concatenate(faces)].astype(np.int64)


def _seashell() -> tuple[Array, IntArray]:
    """Return a conch-like shell: a pointed spire of spiral whorls and a flared lip.

    The radius around the axis is a function of angle and height, so the surface cannot meet itself.
    """
    points, faces = ball(4000)
    way = (1.0 - points[:, 2]) / 2.0  # 0 at the apex, 1 at the end of the canal
    theta = np.arctan2(points[:, 1], points[:, 0])
    phase = theta + 11.0 * np.log(way + 0.1)
    whorl = np.cos(phase) + 0.2 * np.cos(2.0 * phase - 0.9)
    fade = _smooth_step(way / 0.1) * _smooth_step((0.9 - way) / 0.3)  # no spiral at the two poles
    spire = 0.28 + 0.9 * np.exp(-(((way - 0.6) / np.where(way < 0.6, 0.27, 0.2)) ** 2))
    lip = 0.3 * np.exp(-(((way - 0.62) / 0.18) ** 2) + 2.0 * (np.cos(theta - 0.6) - 1.0))
    width = spire * (1.0 + 0.15 * fade * whorl) + lip
    return np.stack([width * points[:, 0], width * points[:, 1], 1.8 * points[:, 2]], axis=1), faces


def _smooth_step(x: Array) -> Array:
    inside = np.clip(x, 0.0, 1.0)
    return inside**2 * (3.0 - 2.0 * inside)


SAMPLES: dict[str, Callable[[], tuple[Array, IntArray]]] = {
    "bean": _bean,
    "bumpy_ball": _bumpy_ball,
    "cube": _cube,
    "ellipsoid": _ellipsoid,
    "seashell": _seashell,
}
