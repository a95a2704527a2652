"""Finds tetrahedra that can be curved onto a part, with shorter edges where they cannot, in a few tries."""

import logging
from collections.abc import Callable

import numpy as np

from .curving import CurvedMesh, curved, stepped_back
from .mesh import TetrahedralMesh
from .mesher import MesherError, Sizes

_log = logging.getLogger(__name__)

Mesher = Callable[[Sizes], TetrahedralMesh]

_LARGEST = (0.25, 0.12, 0.06)  # of the diagonal: the largest edge, the next where the mesher fails
_GROWTH = (0.7, 0.5, 0.3)
AROUND = 8  # edges around a full circle: a cubic one of an eighth is 1e-5 of its radius from it
_TRIES = 4  # meshes, each with shorter edges where the one before steps back too far
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
        sizes = _finer(sizes, found, _CLOSE * diagonal)
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


def _finer(sizes: Sizes, found: CurvedMesh, close: float) -> Sizes:
    """Return the sizes with shorter edges at tetrahedra and triangles that are farther from the part than `close`."""
    mesh = found.mesh
    far = (found.misses > close)[mesh.numbering.cells].any(axis=1)
    finer = sizes.shorter_at(mesh.points[mesh.cells[far]])
    return finer.shorter_at(mesh.points[mesh.triangles[np.flatnonzero(mesh.gaps > close)]])
