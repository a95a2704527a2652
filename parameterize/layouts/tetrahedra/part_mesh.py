"""Finds tetrahedra that can be curved onto a part, with shorter edges where they cannot, in a few tries."""

import logging
from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np

from ...arrays import Array
from .curving import CurvedMesh, curved, stepped_back
from .mesh import TetrahedralMesh
from .mesher import MesherError, Sizes

_log = logging.getLogger(__name__)

Mesher = Callable[[Sizes], TetrahedralMesh]

_LARGEST = (0.25, 0.12, 0.06)  # of the diagonal: the largest edge, the next where the mesher fails
_GROWTH = (0.7, 0.5, 0.3)
AROUND = 8  # edges around a full circle: a cubic one of an eighth is 1e-5 of its radius from it
_TRIES = 4  # meshes, each with shorter edges where the one before steps back too far
_SHORTER = 0.5  # times the edges there
_CLOSE = 2e-4  # of the diagonal: nodes and triangles that are less far from the part are close enough


def curved_tetrahedra(mesher: Mesher, diagonal: float) -> CurvedMesh:
    """Return the curved tetrahedra of a part that step back least from it. Raises MesherError if there are none.

    diagonal: of the part's box.
    """
    sizes, mesh = _first(mesher, diagonal)
    best = _fitted(mesh)
    found = best
    for _ in range(_TRIES - 1):
        if found.farthest <= _CLOSE * diagonal:
            return found
        sizes = replace(sizes, places=np.concatenate([sizes.places, _shorter(found, _CLOSE * diagonal)]))
        try:
            found = _fitted(mesher(sizes))
        except MesherError as error:
            _log.info("%s with shorter edges", error)
            break
        best = min(best, found, key=lambda one: one.farthest)
    return best


def _first(mesher: Mesher, diagonal: float) -> tuple[Sizes, TetrahedralMesh]:
    """Return the first sizes with which the mesher succeeds, and its tetrahedra. Raises MesherError."""
    for share, growth in zip(_LARGEST, _GROWTH, strict=True):
        sizes = Sizes(share * diagonal, AROUND, growth)
        try:
            return sizes, mesher(sizes)
        except MesherError as error:
            _log.info("%s; with finer tetrahedra", error)
            last = error
    raise last


def _fitted(mesh: TetrahedralMesh) -> CurvedMesh:
    """Return the mesh as close to the part as its tetrahedra are proved."""
    found = curved(mesh)
    back = stepped_back(found)
    _log.info(
        "%d tetrahedra, %d of which are not proved on the part: they are %.2g from it at most",
        len(mesh.cells),
        found.rank[0],
        back.farthest,
    )
    return back


def _shorter(found: CurvedMesh, close: float) -> Array:
    """Return places (k, 4) on tetrahedra and triangles that are farther than `close`, with shorter edges there."""
    mesh = found.mesh
    far = (found.misses > close)[mesh.numbering.cells].any(axis=1)
    corners = [mesh.points[mesh.cells[far]], mesh.points[mesh.triangles[np.flatnonzero(mesh.gaps > close)]]]
    return np.concatenate([_halved(one) for one in corners])


def _halved(corners: Array) -> Array:
    """Return the centres and corners (k, 4) of simplices by their corners (k, n, 3), with shorter edges there."""
    pairs = np.array(list(combinations(range(corners.shape[1]), 2)))
    edges = np.linalg.norm(corners[:, pairs[:, 0]] - corners[:, pairs[:, 1]], axis=2)
    places = np.concatenate([corners, corners.mean(axis=1, keepdims=True)], axis=1)
    lengths = np.broadcast_to(_SHORTER * edges.mean(axis=1)[:, None, None], (*places.shape[:2], 1))
    return np.concatenate([places, lengths], axis=2).reshape(-1, 4)
