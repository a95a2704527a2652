"""BoundaryMap: the input's surface laid on the six faces of the parameter cube (boundary.npz)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..files import load_arrays, save_arrays
from ..spline.bspline import real_array
from ..spline.volume import FACE_NAMES
from .flips import orientation


@dataclass(frozen=True, eq=False)
class BoundaryMap:
    """Every vertex of a closed surface with its place on the boundary of the unit cube.

    vertices: (n, 3), in the user's units.
    parameters: (n, 3), on the faces of the cube: all in [0, 1], at least one of the three exactly 0 or 1.
    faces: (m, 3) vertex numbers, outward.

    Raises ValueError where the parts do not fit together or a parameter lies off the cube's faces.
    """

    vertices: Array
    parameters: Array
    faces: NDArray[np.int64]

    def __post_init__(self) -> None:
        vertices = _rows_of_three(self.vertices, "vertices")
        parameters = _rows_of_three(self.parameters, "parameters")
        faces = np.asarray(self.faces)
        if len(parameters) != len(vertices):
            raise ValueError(
                f"parameters must have one row for each of the {len(vertices)} vertices, got {len(parameters)}"
            )
        if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
            raise ValueError(f"faces must be whole numbers of shape (m, 3), got {faces.dtype} of shape {faces.shape}")
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise ValueError(f"faces must number vertices 0 to {len(vertices) - 1}, got {faces.min()} to {faces.max()}")
        inside = np.all((parameters >= 0.0) & (parameters <= 1.0), axis=1)
        off = np.flatnonzero(~(inside & np.any(_on_faces(parameters), axis=1)))
        if off.size:
            raise ValueError(
                f"parameters must lie on the faces of the unit cube: {off.size} do not, the first is vertex {off[0]} "
                f"at {parameters[off[0]].tolist()}; snap one coordinate to exactly 0 or 1"
            )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "parameters", parameters)
        object.__setattr__(self, "faces", faces.astype(np.int64))

    @cached_property
    def cube_faces(self) -> NDArray[np.int64]:
        """Return the cube face of each triangle, (m,) indices into FACE_NAMES; the first of two on an edge.

        Raises ValueError where the corners of a triangle share no face.
        """
        shared = np.all(_on_faces(self.parameters)[self.faces], axis=1)  # (m, 6)
        homeless = np.flatnonzero(~np.any(shared, axis=1))
        if homeless.size:
            raise ValueError(
                f"{homeless.size} triangles do not lie on one face of the cube, the first is {homeless[0]}; "
                "cut the surface along the cube's edges"
            )
        return np.argmax(shared, axis=1).astype(np.int64)

    def flipped(self) -> NDArray[np.int64]:
        """Return the indices of the triangles that do not face outwards, seen from the cube's centre.

        A triangle without area, within rounding error, counts as flipped.
        """
        triple, noise = orientation(self.parameters, self.faces)
        return np.flatnonzero(triple <= noise)

    def save(self, path: str | Path) -> None:
        """Write boundary.npz; atomic."""
        save_arrays(path, vertices=self.vertices, parameters=self.parameters, faces=self.faces)

    @classmethod
    def load(cls, path: str | Path) -> BoundaryMap:
        """Read boundary.npz. Raises FileNotFoundError, or ValueError naming what is wrong with the file."""
        data = load_arrays(path, ("vertices", "parameters", "faces"))
        try:
            return cls(data["vertices"], data["parameters"], data["faces"])
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None


def _rows_of_three(values: Array, name: str) -> Array:
    rows = real_array(values, name)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"{name} must have shape (n, 3), got {rows.shape}")
    if not np.all(np.isfinite(rows)):
        raise ValueError(f"{name} must be finite")
    return rows


def _on_faces(parameters: Array) -> NDArray[np.bool_]:
    """Return which of the six cube faces each parameter lies on, (n, 6) in the order of FACE_NAMES."""
    return np.stack([parameters == 0.0, parameters == 1.0], axis=-1).reshape(-1, len(FACE_NAMES))
