"""Finds the edges of patches on a body's boundary, the angle of the material around each, and the faces that meet."""

from dataclasses import dataclass, replace

import numpy as np

from parameterize.arrays import Array, Floats, IntArray, Mask
from parameterize.spline.body import Body
from parameterize.spline.orientation import hands_of
from parameterize.spline.patch_groups import PatchGroup
from parameterize.spline.volume import FACE_NAMES

INSET = 0.02  # of a patch: how far from an edge its face's conditions are looked at
_FEWEST, _MOST = 3, 48  # samples of an edge
_FLAT = 1e-9  # of the body's size: the length of an edge that has shrunk to a point
ACROSS = np.array([[1, 2], [0, 2], [0, 1]])  # the two other directions of each
_CORNERS = ((0, 0), (0, 1), (1, 0), (1, 1))


@dataclass(frozen=True, eq=False)
class PatchEdges:
    """Hold the edges of all patches at the boundary: n of patches, which are e of the body, with s samples each.

    Attributes
    ----------
    patches, axes : (n,) array of int
        The patch, and the direction along its edge.
    sides : (n, 2) array of int
        The sides, 0 or 1, of the two other directions.
    numbers : (n,) array of int
        The edge of the body.
    ends : (n, 2) array of int
        The numbers of the control points at both ends.
    along : (n, s) array
        The parameters of the samples along the edge, in the order of the body's edge.
    points, tangents : (n, s, 3) array
        The samples, and unit vectors along the edge.
    lengths : (n,) array
        The length of each edge, roughly.
    inward : (n, 2, s, 3) array
        The derivatives of the map along the two other directions, into the patch.
    angles : (n, s) array
        The angles of the material of each patch.
    """

    patches: IntArray
    axes: IntArray
    sides: IntArray
    numbers: IntArray
    ends: IntArray
    along: Array
    points: Array
    tangents: Array
    lengths: Array
    inward: Array
    angles: Array

    @property
    def faces(self) -> IntArray:
        """Return the faces 6 * patch + face (n, 2) at each edge: column i is constant in the i-th other direction."""
        return len(FACE_NAMES) * self.patches[:, None] + 2 * ACROSS[self.axes] + self.sides

    def rows(self, rows: IntArray | Mask) -> "PatchEdges":
        """Return some of the edges."""
        return PatchEdges(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def edges_of(body: Body, spans: int) -> PatchEdges:
    """Return the edges of patches at the boundary, those that have shrunk to a point left out.

    spans: the most of a trial space in a direction.
    """
    samples = (np.arange(count := min(max(_FEWEST, spans), _MOST)) + 0.5) / count
    keys, at_boundary = _keys(body), _at_boundary(body)
    chosen = np.zeros(keys[..., 0].max() + 1, dtype=bool)
    chosen[keys[..., 0][at_boundary]] = True
    is_near = np.any(chosen[keys[..., 0]], axis=(1, 2, 3))
    parts = [_of_axis(group.rows(is_near[group.numbers]), axis, samples) for group in body.groups for axis in range(3)]
    found = PatchEdges(*map(np.concatenate, zip(*parts, strict=True)))
    own = keys[found.patches, found.axes, found.sides[:, 0], found.sides[:, 1]]
    found = replace(found, numbers=own[:, 0], ends=own[:, 2:])
    flipped = own[:, 1] == 1
    for name in ("along", "points", "tangents", "angles"):
        getattr(found, name)[flipped] = getattr(found, name)[flipped][:, ::-1]
    found.tangents[flipped] *= -1.0
    found.inward[flipped] = found.inward[flipped][:, :, ::-1]
    chosen[own[found.lengths <= _FLAT * body.size, 0]] = False
    return found.rows(chosen[own[:, 0]])


def _at_boundary(body: Body) -> Mask:
    """Return whether a face at each edge of each patch is an outer one, (k, 3, 2, 2) as the keys."""
    outer = ~body.glued.reshape(len(body), 3, 2)
    found = np.empty((len(body), 3, 2, 2), dtype=bool)
    for axis, (b, c) in enumerate(ACROSS.tolist()):
        found[:, axis] = outer[:, b, :, None] | outer[:, c, None, :]
    return found


def _keys(body: Body) -> IntArray:
    """Return of each patch's edges the number, whether one runs against the body's, and its ends: (k, 3, 2, 2, 4).

    Edges are one where their control points are.
    """
    found = np.empty((len(body), 3, 2, 2, 4), dtype=np.int64)
    numbers, _ = body.numbering
    rows, places = [], []
    for group in body.groups:
        own = np.stack([numbers[patch] for patch in group.numbers])  # (k, n_u, n_v, n_w)
        for axis in range(3):
            net = np.moveaxis(own, 1 + axis, 3)
            for b, c in _CORNERS:
                rows.append(net[:, -b, -c])
                places.append((group.numbers, axis, b, c))
    total = 0
    for length in sorted({row.shape[1] for row in rows}):
        chosen = [i for i, row in enumerate(rows) if row.shape[1] == length]
        every = np.concatenate([rows[i] for i in chosen])
        backward = every[:, ::-1]
        first = (every != backward).argmax(axis=1)
        each = np.arange(len(every))
        is_reversed = every[each, first] > backward[each, first]
        unique, labels = np.unique(np.where(is_reversed[:, None], backward, every), axis=0, return_inverse=True)
        both = np.stack([labels.ravel() + total, is_reversed, every[:, 0], every[:, -1]], axis=-1)
        total += len(unique)
        begin = 0
        for i in chosen:
            patches, axis, b, c = places[i]
            found[patches, axis, b, c] = both[begin : begin + len(patches)]
            begin += len(patches)
    return found


def _of_axis(group: PatchGroup, axis: int, samples: Array) -> tuple[Floats, ...]:
    """Return the parts of `PatchEdges` of a group's edges along a direction, four a patch; numbers are zero."""
    ends, count = np.array([0.0, 1.0]), len(group)
    u, v, w = (samples if a == axis else ends for a in range(3))
    b, c = (a for a in range(3) if a != axis)
    points = np.moveaxis(group.grid(u, v, w), 1 + axis, 3).reshape(4 * count, len(samples), 3)
    jacobian = np.moveaxis(group.grid_jacobian(u, v, w), 1 + axis, 3)
    jacobian = jacobian.reshape(4 * count, len(samples), 3, 3)
    sides = np.tile(np.array(_CORNERS), (count, 1))
    speeds = np.linalg.norm(jacobian[..., axis], axis=-1)
    tangents = jacobian[..., axis] / np.where(speeds > 0.0, speeds, 1.0)[..., None]
    signs = 1.0 - 2.0 * sides
    inward = np.stack([jacobian[..., b], jacobian[..., c]], axis=1) * signs[:, :, None, None]
    flat = across(inward, tangents[:, None])
    cosines = (flat[:, 0] * flat[:, 1]).sum(axis=-1)
    angles = np.arctan2(np.linalg.norm(np.cross(flat[:, 0], flat[:, 1]), axis=-1), cosines)
    patches = np.repeat(group.numbers, 4)
    zeros = np.zeros(4 * count, dtype=np.int64)
    along = np.tile(samples, (4 * count, 1))
    known = points, tangents, speeds.mean(axis=1), inward, angles
    return patches, zeros + axis, sides, zeros, np.stack([zeros, zeros], axis=1), along, *known


def across(vectors: Array, tangents: Array) -> Array:
    """Return the unit vectors (..., 3) of the parts of vectors at right angles to unit tangents; zero where none is."""
    flat = vectors - (vectors * tangents).sum(axis=-1, keepdims=True) * tangents
    sizes = np.linalg.norm(flat, axis=-1, keepdims=True)
    return np.asarray(flat / np.where(sizes > 0.0, sizes, 1.0))


def outward(body: Body, faces: IntArray, parameters: Array) -> tuple[Array, Array]:
    """Return points (m, 3) and outward unit normals (m, 3) at parameters (m, 3) of faces 6 * patch + face (m,)."""
    patches, numbers = np.divmod(faces, len(FACE_NAMES))
    axes, sides = np.divmod(numbers, 2)
    jacobian, each = body.jacobian(patches, parameters), np.arange(len(faces))
    area = np.cross(jacobian[each, :, (axes + 1) % 3], jacobian[each, :, (axes + 2) % 3])
    area *= (hands_of(body.groups)[patches] * (2 * sides - 1))[:, None]
    sizes = np.linalg.norm(area, axis=1, keepdims=True)
    return body.points(patches, parameters), area / np.where(sizes > 0.0, sizes, 1.0)
