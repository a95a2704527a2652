"""Curves straight tetrahedra onto the part, as far as det J stays positive.

The nodes on the part go to their places there. Inner nodes near tetrahedra that are not proved move (smoothing.py),
inner edges are split (splitting.py). What is still not proved steps back towards its straight shape, level by level.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...arrays import Array, IntArray, Mask
from .determinant import determinant_coefficients
from .mesh import TetrahedralMesh
from .smoothing import distortion_of, neighbourhood
from .splitting import chords, split

LEAST = 1e-3  # of a bound on det J that is proved, as a share of the straight tetrahedron's
_WANTED = 0.05  # of the bounds where no node is moved
_FLOORS = (0.3, 0.1)  # of det J in the energy, sweep by sweep
_SPLITS = 2  # times that edges are split, at most
_LEVELS = np.array([1.0, 0.97, 0.9, 0.75, 0.5, 0.25, 0.0])  # of a displacement that steps back


@dataclass(frozen=True, eq=False)
class CurvedMesh:
    """A tetrahedral mesh with the places (k, 3) of its cubic nodes, and what they lack to be on the part (k,)."""

    mesh: TetrahedralMesh
    nodes: Array
    misses: Array

    @cached_property
    def bounds(self) -> Array:
        """Return a lower bound (t,) of det J of each tetrahedron, over that of the straight one."""
        return determinant_coefficients(self.nodes[self.mesh.numbering.cells]).min(axis=1)

    @property
    def unproved(self) -> Mask:
        """Return whether det J of each tetrahedron (t,) is not bounded from below."""
        return self.bounds < LEAST

    @property
    def rank(self) -> tuple[int, float]:
        """Return the number of tetrahedra that are not proved, and the least bound: a lower rank is better."""
        return int(np.count_nonzero(self.unproved)), -float(self.bounds.min())

    @property
    def farthest(self) -> float:
        """Return the largest distance of the mesh from the part: of its nodes, and of its triangles between them."""
        return max(float(self.misses.max()), float(self.mesh.gaps.max(initial=0.0)))

    @property
    def is_proved(self) -> bool:
        """Return whether det J of all tetrahedra is bounded from below."""
        return not self.unproved.any()


def curved(mesh: TetrahedralMesh) -> CurvedMesh:
    """Return a mesh that is curved onto the part, with as few tetrahedra that are not proved as can be found."""
    best = _smoothed(_on_part(mesh))
    for _ in range(_SPLITS):
        wanted = chords(best.mesh, best.bounds < _WANTED)
        if best.is_proved or not wanted.any():
            break
        other = _smoothed(_on_part(split(best.mesh, wanted)))
        if other.rank >= best.rank:
            break
        best = other
    return best


def stepped_back(found: CurvedMesh) -> CurvedMesh:
    """Return the mesh whose nodes have gone back towards their straight places until all tetrahedra are proved."""
    straight, cells = found.mesh.straight, found.mesh.numbering.cells
    displacements, levels = found.nodes - straight, np.zeros(len(straight), dtype=np.int64)
    bounds, nodes = found.bounds.copy(), found.nodes
    while (bounds < LEAST).any():
        back = np.zeros(len(straight), dtype=bool)
        back[cells[bounds < LEAST]] = True
        back &= levels < len(_LEVELS) - 1
        if not back.any():
            break
        levels[back] += 1
        nodes = straight + _LEVELS[levels][:, None] * displacements
        again = back[cells].any(axis=1)
        bounds[again] = determinant_coefficients(nodes[cells[again]]).min(axis=1)
    misses = (1.0 - _LEVELS[levels]) * np.linalg.norm(displacements, axis=1)
    return replace(found, nodes=nodes, misses=found.misses + np.where(found.mesh.on_part, misses, 0.0))


def pulled_back(found: CurvedMesh, chosen: IntArray, share: float) -> CurvedMesh:
    """Return the mesh whose nodes of chosen tetrahedra keep a share of their displacements, and the rest is proved."""
    pulled = np.zeros(len(found.nodes), dtype=bool)
    pulled[found.mesh.numbering.cells[chosen]] = True
    straight = found.mesh.straight
    displacements = found.nodes - straight
    nodes = straight + np.where(pulled, share, 1.0)[:, None] * displacements
    misses = np.where(pulled & found.mesh.on_part, (1.0 - share) * np.linalg.norm(displacements, axis=1), 0.0)
    return stepped_back(replace(found, nodes=nodes, misses=found.misses + misses))


def _on_part(mesh: TetrahedralMesh) -> CurvedMesh:
    """Return the mesh with all nodes on the part in their places: inner faces follow their edges."""
    numbering, straight = mesh.numbering, mesh.straight
    moved = np.where(mesh.on_part[:, None], numbering.gathered(mesh.nodes) - straight, 0.0)
    inner = ~mesh.on_part[numbering.first_face :]
    first = numbering.vertices + 2 * numbering.edges_of_faces[inner]
    moved[numbering.first_face :][inner] = 0.25 * (moved[first] + moved[first + 1]).sum(axis=1)
    return CurvedMesh(mesh, straight + moved, np.zeros(len(straight)))


def _smoothed(found: CurvedMesh) -> CurvedMesh:
    """Return the best of the mesh and of those after each sweep of smoothing around what is not proved."""
    if not found.unproved.any():
        return found
    cells = found.mesh.numbering.cells
    near = neighbourhood(cells, found.bounds < _WANTED)
    distortion = distortion_of(cells, found.nodes, near, found.mesh.on_part)
    best, nodes = found, found.nodes
    for floor in _FLOORS if len(distortion.free) else ():
        nodes = distortion.smoothed(nodes, floor)
        best = min(best, replace(found, nodes=nodes), key=lambda one: one.rank)
        if best.rank[0] == 0:
            break
    return best
