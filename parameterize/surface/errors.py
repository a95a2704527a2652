"""The error that refuses a surface, and the checks that files and arrays share."""

from numbers import Integral

import numpy as np

from ..arrays import Array, IntArray
from .geometry import used_vertices

LARGEST = 1e90  # coordinate: volumes beyond its cube leave double precision


class MeshError(ValueError):
    """A surface is refused. One line: the file, the defect, how many, where the first is, the remedy.

    Examples
    --------
    >>> import iga_nn
    >>> try:
    ...     iga_nn.load_surface("mesh.step")
    ... except iga_nn.MeshError as error:
    ...     print(str(error).partition(":")[0])
    mesh.step
    """


def check_face_count(count: int, max_faces: int) -> None:
    """Raise MeshError where a surface has more faces than allowed, and for a limit that no closed surface meets."""
    check_face_limit(max_faces)
    if count > max_faces:
        raise MeshError(
            f"{count} faces, more than max_faces={max_faces}: raise --max-faces, or bring them down with --decimate"
        )


def check_face_limit(max_faces: int) -> None:
    """Raise MeshError for a limit that no closed surface meets, or that is no whole number."""
    if not isinstance(max_faces, Integral) or max_faces < 4:
        raise MeshError(f"max_faces must be a whole number, at least 4, got {max_faces!r:.80}")


def check_finite(vertices: Array, faces: IntArray) -> None:
    """Raise MeshError where faces use coordinates that are NaN, infinite or too large to compute volumes with."""
    used = used_vertices(faces)
    places = vertices[used]
    broken = used[~np.isfinite(places).all(axis=1)]
    if len(broken):
        raise MeshError(
            f"{len(broken)} vertices with NaN or infinite coordinates, the first is vertex {broken[0]} (from 0): "
            "export the surface again"
        )
    if abs(places).max(initial=0.0) > LARGEST:
        raise MeshError(f"coordinates must not exceed {LARGEST:g} in magnitude: choose a larger unit of length")


def without_unused_defects(vertices: Array, faces: IntArray) -> tuple[Array, tuple[str, ...]]:
    """Return vertices (n, 3) with zeros in place of invalid, unused vertices, and a notice of their number."""
    wrong = ~np.all(abs(vertices) <= LARGEST, axis=1)
    wrong[faces.ravel()] = False
    if not wrong.any():
        return vertices, ()
    return np.where(wrong[:, None], 0.0, vertices), (
        f"{np.count_nonzero(wrong)} vertices without a valid place (NaN, infinite) are used by no face",
    )


def check_indices(vertices: Array, faces: IntArray, *, first: int = 0) -> None:
    """Raise MeshError where faces name vertices that do not exist; `first`: the number of the file's first vertex."""
    numbers = faces.ravel()
    wrong = np.flatnonzero((numbers < 0) | (numbers >= len(vertices)))
    if len(wrong):
        raise MeshError(
            f"{len(wrong)} vertex numbers out of range, the first is {numbers[wrong[0]] + first} (counted from {first})"
            f" where there are {len(vertices)} vertices; export the file again"
        )
