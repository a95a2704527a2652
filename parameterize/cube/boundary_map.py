"""Defines BoundaryMap: the surface laid one-to-one on the faces of the cube, cut along its edges (boundary.npz).

On the outer faces of several blocks it is not cut, see `BoundaryMap.patches`.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array, IntArray, Mask
from ..display import Brief
from ..files import load_arrays, save_arrays
from ..spline.bspline import real_array
from ..spline.volume import FACE_NAMES, BSplineVolume
from ..surface.groups import Groups, as_arrays, checked, from_arrays
from ..surface.part import PartSurface
from .cube import CubeLayout, damped_fit, snap
from .cutting import CutMesh, cut_along_rays
from .flips import orientation, untangle_whole

PART = ("part_faces", "group_names", "group_sizes", "group_faces")  # arrays of boundary.npz that older files lack
PATCHES = "patches"  # another one
_SAME = 1e-7  # share of an edge's length: a cut this close to a vertex takes the vertex
_NUDGE = 1e-4  # by which vertices move where a mesh edge runs through a corner of the cube
_NUDGES = 10  # at most
_FITTING_STEPS = 8  # Gauss-Newton steps of the cut vertices along their edges, at most
_FITTING_DAMPING = 1e-3  # of these steps, against parallel directions
_END_MARGIN = 1e-2  # share of its mesh edge that a cut keeps from either end
_UNDO_ROUNDS = 10  # in which such a step is undone at flipped triangles, before all of it is


@dataclass(frozen=True, eq=False, repr=False)
class BoundaryMap(Brief):
    """Every vertex of a closed surface with its place on the boundary of the unit cube, or of one of several blocks.

    Parameters
    ----------
    vertices : (n, 3) array
        In the user's units.
    parameters : (n, 3) array
        On the faces of the cube: all in [0, 1], at least one of the three exactly 0 or 1.
    faces : (m, 3) array of int
        Vertex numbers, outward.
    part_faces : (k, 3) array of int, optional
        The triangles of the surface before they were cut along the cube's edges; its vertices come first.
    groups : dict of str to array of int
        Triangles of the surface by the names of their groups; numbers are rows of part_faces.
    patches : (n,) array of int, optional
        The block that each vertex lies on, where a body has several; its parameters are those of that block, on one of
        its outer faces. By default all lie on block 0. A vertex on an edge between two blocks belongs to one of them.
        The triangles of several blocks are not cut along the blocks' edges: their corners may lie on different blocks
        or faces, and part_faces are the same triangles.

    Raises
    ------
    ValueError
        Where the parts do not fit together or a parameter lies off the cube's faces.

    Examples
    --------
    >>> import iga_nn
    >>> from parameterize import BoundaryMap
    >>> cube = iga_nn.sample("cube")
    >>> BoundaryMap(cube.vertices, cube.vertices, cube.faces).parameters.shape
    (1538, 3)
    """

    vertices: Array
    parameters: Array
    faces: IntArray
    part_faces: IntArray | None = None
    groups: Groups = field(default_factory=dict)
    patches: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def __post_init__(self) -> None:
        vertices = _rows_of_three(self.vertices, "vertices")
        parameters = _rows_of_three(self.parameters, "parameters")
        if len(parameters) != len(vertices):
            raise ValueError(
                f"parameters must have one row for each of the {len(vertices)} vertices, got {len(parameters)}"
            )
        faces = _checked_faces(self.faces, "faces", len(vertices))
        part_faces = None if self.part_faces is None else _checked_faces(self.part_faces, "part_faces", len(vertices))
        groups = checked(self.groups, len(faces if part_faces is None else part_faces))
        inside = np.all((parameters >= 0.0) & (parameters <= 1.0), axis=1)
        off = np.flatnonzero(~(inside & np.any(on_faces(parameters), axis=1)))
        if off.size:
            raise ValueError(
                f"parameters must lie on the faces of the unit cube: {off.size} do not, the first is vertex {off[0]} "
                f"at {parameters[off[0]].tolist()}; snap one coordinate to exactly 0 or 1"
            )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "parameters", parameters)
        object.__setattr__(self, "faces", faces)
        object.__setattr__(self, "part_faces", part_faces)
        object.__setattr__(self, "groups", groups)
        object.__setattr__(self, "patches", _checked_patches(self.patches, len(vertices)))

    @cached_property
    def part(self) -> PartSurface:
        """Return the surface before it was cut, with its groups; where the file lacks that surface, the cut surface."""
        faces = self.faces if self.part_faces is None else self.part_faces
        return PartSurface(self.vertices[: faces.max(initial=-1) + 1], faces, self.groups)

    @cached_property
    def cube_faces(self) -> IntArray:
        """Return the cube face of each triangle, (m,) indices into FACE_NAMES.

        A triangle on an edge of the cube has the first of its two faces. Raises ValueError where the corners of a
        triangle share no face, and for several blocks, along whose edges the surface is not cut.
        """
        self._demand_cube()
        shared = np.all(on_faces(self.parameters)[self.faces], axis=1)  # (m, 6)
        homeless = np.flatnonzero(~np.any(shared, axis=1))
        if homeless.size:
            raise ValueError(
                f"{homeless.size} triangles do not lie on one face of the cube, the first is {homeless[0]}; "
                "cut the surface along the cube's edges"
            )
        return np.argmax(shared, axis=1).astype(np.int64)

    def flipped(self) -> IntArray:
        """Return the numbers (k,) of the triangles that do not face outwards, seen from the cube's centre.

        A triangle without area, within rounding error, counts as flipped. Raises ValueError for several blocks.
        """
        self._demand_cube()
        triple, noise = orientation(self.parameters, self.faces)
        return np.flatnonzero(triple <= noise)

    def _demand_cube(self) -> None:
        if self.patches.any():
            raise ValueError(
                f"the surface lies on {len(np.unique(self.patches))} blocks, and is not cut along their edges: its "
                "triangles have no face of a cube; `patches` and `parameters` say where its vertices are"
            )

    def save(self, path: str | Path) -> None:
        """Write boundary.npz atomically."""
        part = {} if self.part_faces is None else {"part_faces": self.part_faces, **as_arrays(self.groups)}
        places = {"vertices": self.vertices, "parameters": self.parameters, "faces": self.faces}
        save_arrays(path, **places, patches=self.patches, **part)

    @classmethod
    def load(cls, path: str | Path) -> "BoundaryMap":
        """Read boundary.npz. Raises FileNotFoundError, or a ValueError that names the defect of the file."""
        data = load_arrays(path, ("vertices", "parameters", "faces"), (*PART, PATCHES))
        given: dict[str, Any] = {name: data[name] for name in data if name not in PART}
        try:
            if any(name not in data for name in PART):
                return cls(**given)
            part_faces, names, sizes, numbers = (data[name] for name in PART)
            return cls(**given, part_faces=part_faces, groups=from_arrays(names, sizes, numbers, len(part_faces)))
        except (TypeError, ValueError) as error:
            raise ValueError(f"{path}: {error}") from None


def read_part(path: str | Path) -> PartSurface:
    """Read the surface of a run, with its groups, from boundary.npz.

    Older files contain only the surface cut along the cube's edges, without groups. Raises FileNotFoundError, or a
    ValueError that names the defect of the file.
    """
    return BoundaryMap.load(path).part


def _checked_faces(values: IntArray, name: str, count: int) -> IntArray:
    faces = np.asarray(values)
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise ValueError(f"{name} must be whole numbers of shape (m, 3), got {faces.dtype} of shape {faces.shape}")
    if faces.size and (faces.min() < 0 or faces.max() >= count):
        raise ValueError(f"{name} must number vertices 0 to {count - 1}, got {faces.min()} to {faces.max()}")
    return faces.astype(np.int64)


def _checked_patches(values: IntArray, count: int) -> IntArray:
    """Return the blocks (count,) of vertices; all are on block 0 where none are given."""
    patches = np.asarray(values)
    if not patches.size:
        return np.zeros(count, dtype=np.int64)
    if patches.shape != (count,) or patches.dtype.kind not in "iu" or patches.min() < 0:
        raise ValueError(f"patches must have a whole number from 0 on for each of the {count} vertices")
    return patches.astype(np.int64)


def _rows_of_three(values: Array, name: str) -> Array:
    rows = real_array(values, name)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise ValueError(f"{name} must have shape (n, 3), got {rows.shape}")
    if not np.all(np.isfinite(rows)):
        raise ValueError(f"{name} must be finite")
    return rows


def on_faces(parameters: Array) -> Mask:
    """Return the mask (n, 6) of the cube faces on which each parameter lies, in the order of FACE_NAMES."""
    return np.stack([parameters == 0.0, parameters == 1.0], axis=-1).reshape(-1, len(FACE_NAMES))


def boundary_map(volume: BSplineVolume, layout: CubeLayout) -> BoundaryMap:
    """Return the map of a surface (in the user's units) that is cut where it crosses the cube's edges.

    layout: a layout whose places are the closest points of the volume's boundary. Where the spline smooths a detail,
    the closest points may flip a few triangles, which are untangled first. The cut vertices follow the vertices of the
    mesh, and are fitted to the volume.
    """
    vertices, placed = layout.points, untangle_whole(layout.places, layout.faces)
    for number in range(_NUDGES):
        cut = cut_along_rays(placed, layout.faces, _SAME)
        spread = snap(cut.carry(placed))
        spread[: len(placed)] = placed
        plain = BoundaryMap(cut.carry(vertices), spread, cut.faces)
        turned = plain.flipped()
        if not len(turned):
            break
        placed = _nudged(placed, cut, turned, number)
    closer = plain  # each cut vertex then slides along its mesh edge, and its parameter along the cube's, to meet F
    for _ in range(_FITTING_STEPS):
        share, moved = _fitted_once(volume, cut, closer, len(vertices))
        cut, closer = _without_flips(vertices, cut, closer, share, moved)
    return plain if len(closer.flipped()) > len(plain.flipped()) else closer


def _nudged(placed: Array, cut: CutMesh, turned: IntArray, number: int) -> Array:
    """Move the vertices (n, 3) around degenerate triangles a little: a mesh edge ran through a corner of the cube."""
    corners = np.unique(cut.faces[turned])
    around = np.unique(np.concatenate([corners[corners < len(placed)], cut.parents[corners].ravel()]))
    around = around[around < len(placed)]
    moved = placed.copy()
    moved[around] += _NUDGE * np.random.default_rng(number).uniform(-1.0, 1.0, (len(around), 3))
    return snap(moved)


def _fitted_once(volume: BSplineVolume, cut: CutMesh, best: BoundaryMap, count: int) -> tuple[Array, Array]:
    """Return shares (n,) and parameters (n, 3) after a Gauss-Newton step in these two unknowns of each cut vertex.

    The first `count` vertices are those of the input. Corners of the cube and cuts within a face keep their parameters.
    """
    where, new = best.parameters[count:], best.vertices[count:]
    inner = (where > 0.0) & (where < 1.0)  # (k, 3)
    inner &= inner.sum(axis=1, keepdims=True) == 1  # the cube edge's direction; cut vertices within a face stay
    start, end = best.vertices[cut.parents[count:].T]
    along_cube = np.einsum("kab,kb->ka", volume.jacobian(where), inner.astype(float))
    shift, slide = damped_fit(end - start, -along_cube, volume(where) - new, _FITTING_DAMPING)
    share, moved = cut.share.copy(), best.parameters.copy()
    share[count:] = np.clip(share[count:] + shift, _END_MARGIN, 1.0 - _END_MARGIN)
    moved[count:] = np.where(inner, np.clip(where + slide[:, None], _END_MARGIN**2, 1.0 - _END_MARGIN**2), where)
    return share, moved


def _without_flips(
    vertices: Array, cut: CutMesh, best: BoundaryMap, share: Array, moved: Array
) -> tuple[CutMesh, BoundaryMap]:
    """Undo the steps to `share` and `moved` at flipped triangles; return the old cuts and map if some stay flipped."""
    for _ in range(_UNDO_ROUNDS):
        trial = replace(cut, share=share)
        candidate = BoundaryMap(trial.carry(vertices), moved, cut.faces)
        turned = np.setdiff1d(cut.faces[candidate.flipped()].ravel(), np.arange(len(vertices)))
        if not turned.size:
            return trial, candidate
        share[turned], moved[turned] = cut.share[turned], best.parameters[turned]
    return cut, best
