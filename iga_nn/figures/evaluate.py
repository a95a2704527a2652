"""Evaluates the content of figures: points of a body on the cubes' faces and sections, and the values there.

A body is a volume or several patches; a volume is treated as a body of one patch. Where something is listed for the
faces and sections of all patches, each patch has nine entries: six faces, in the order of FACE_NAMES, three sections.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from parameterize.arrays import Array
from parameterize.quality.distortion import arap_in_box, arap_on, own_box
from parameterize.spline.body import BodyLike, as_body
from parameterize.spline.volume import AXES, FACE_NAMES, BSplineVolume
from solve.field import Points
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.frame import UnitFrame

Grid = tuple[Array, Array, Array]  # parameters of a tensor grid; one direction has a single value

SECTIONS = tuple(f"{axis} = 1/2" for axis in AXES)
PER_PATCH = len(FACE_NAMES) + len(SECTIONS)  # faces and sections
MAP = "viridis"  # colour map; perceptually uniform
FACE_COLORS = ("#4477aa", "#66ccee", "#228833", "#ccbb44", "#ee6677", "#aa3377")  # also distinct for the colour-blind


def face_window(parameter: ArrayLike, half: float, samples: int) -> Grid:
    """Return the parameters of the part of a face within `half` of a point (3,) on the cube's boundary."""
    place = np.asarray(parameter, dtype=np.float64)
    axis = int(np.abs(place - 0.5).argmax())
    low, high = np.clip(place - half, 0.0, 1.0), np.clip(place + half, 0.0, 1.0)
    u, v, w = (place[[a]] if a == axis else np.linspace(low[a], high[a], samples) for a in range(3))
    return u, v, w


def all_grids(samples: int) -> list[Grid]:
    """Return the grids, samples x samples, of the six faces in the order of FACE_NAMES, then those of SECTIONS."""
    places = [(axis, side) for axis in range(3) for side in (0.0, 1.0)] + [(axis, 0.5) for axis in range(3)]
    even, grids = np.linspace(0.0, 1.0, samples), []
    for axis, value in places:
        u, v, w = (np.array([value]) if a == axis else even for a in range(3))
        grids.append((u, v, w))
    return grids


def points_on(volume: BSplineVolume, grid: Grid) -> Array:
    """Return the points (samples, samples, 3) of a grid on a face or section."""
    return flat(volume.grid(*grid))


def outer_faces(body: BodyLike) -> list[int]:
    """Return the places of the faces that are not glued among the nine faces and sections of each patch."""
    each = enumerate(as_body(body).outer)
    return [PER_PATCH * i + FACE_NAMES.index(name) for i, names in each for name in names]


def arap_of(body: BodyLike) -> list[Callable[[Grid], Array]]:
    """Return for each patch the function that gives the ARAP distortion (n_u, n_v, n_w) on a tensor grid.

    A volume is measured at volume 1, each of several patches against its own box.
    """
    glued = as_body(body)
    if not glued.is_single:
        return [_in_box(patch) for patch in glued]
    scale = 1.0 / UnitFrame.of(glued).length
    return [lambda grid: arap_on(glued.only, *grid, scale)]


def _in_box(patch: BSplineVolume) -> Callable[[Grid], Array]:
    box = own_box(patch)
    return lambda grid: arap_in_box(patch, *grid, box)


def problems_on(problem: BoundaryValueProblem, body: BodyLike) -> list[BoundaryValueProblem]:
    """Return the problem on each patch, with X, Y, Z measured in the body."""
    return problem.on(body).on_patches(as_body(body))


def error_at(found: Array, problem: BoundaryValueProblem, x: Points) -> Array:
    """Return |u - u_h| at points x (3, ...). found: u_h there, (...), or vectors (..., 3)."""
    exact, _ = problem.exact_at(x)
    if found.ndim < x.ndim:
        return np.abs(found - exact[0])
    return np.asarray(np.linalg.norm(found - np.moveaxis(exact, 0, -1), axis=-1))


def face_labels() -> list[str]:
    """Return the legend of the six colours, such as "u0: u = 0"."""
    return [f"{name}: {name[0]} = {name[1]}" for name in FACE_NAMES]


def flat(values: Array) -> Array:
    """Return the values of a grid without the direction that has a single parameter."""
    axis = next(a for a in range(3) if values.shape[a] == 1)
    return np.asarray(values.squeeze(axis))
