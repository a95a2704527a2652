"""Solids that touch: triangles of two solids in the same place are a wall between them, and no outer boundary.

Solids that overlap, or touch in faces that do not match, are refused: no boundary of both together is known there.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, IntArray, in_brackets
from .errors import MeshError
from .geometry import connected, normals_and_areas
from .mesh_repair import MeshRepair
from .sheets import split
from .solid import Solid
from .topology import crossing_faces, crossing_places
from .welding import close_pairs

ASIDE = 1e-6  # of the box's side: so far from a triangle of one solid there is no other one
CHOOSE = "unite them in the program that made them, or choose one with --component largest or --component N"


@dataclass(frozen=True, eq=False)
class Walls:
    """The triangles between solids.

    corners: (k, 3, 3), in the user's units. solids: (k, 2), numbers from 0 on, of the solid out of which the triangle
    is wound and of the one behind. old: (k, 2), the number of the triangle of each in the input, -1 where it was added.
    """

    corners: Array
    solids: IntArray
    old: IntArray


NO_PAIRS = np.empty((0, 2), dtype=np.int64)
NO_WALLS = Walls(np.empty((0, 3, 3)), NO_PAIRS, NO_PAIRS)


@dataclass(frozen=True, eq=False)
class Solids:
    """The outer boundary of solids, and the walls between them.

    owners: (m,), the solid of each face, from 0 on. crossings: (k, 2), the pairs of faces that intersect.
    """

    mesh: MeshRepair
    owners: IntArray
    names: tuple[str, ...]
    crossings: IntArray
    walls: Walls = NO_WALLS

    @property
    def old(self) -> IntArray:
        """Return the numbers in the input of all faces, those of the walls too; -1 for one that was added."""
        return np.concatenate([self.mesh.old, self.walls.old.ravel()])

    def check(self) -> None:
        """Raise MeshError for solids that overlap, or touch in faces that do not match."""
        self._check_apart()
        self._check_contacts()

    def _check_apart(self) -> None:
        """Raise MeshError where faces of two solids are among those that cross."""
        first, second = self.owners[self.crossings].T
        between = np.flatnonzero(first != second)
        if len(between):
            (place,) = crossing_places(self.mesh.vertices, self.mesh.faces, self.crossings[between[:1]])
            pair = sorted((int(first[between[0]]), int(second[between[0]])))
            raise MeshError(f"{self._named(*pair)} cross each other at {in_brackets(place)}: {CHOOSE}")

    def _check_contacts(self) -> None:
        """Raise MeshError where a solid lies in another one, or beside the middle of one of its outer triangles."""
        solids = [self._closed(number) for number in range(len(self.names))]
        normals, _ = normals_and_areas(self.mesh.points, self.mesh.faces)
        middles = self.mesh.points[self.mesh.faces].mean(axis=1)
        for first, second in self._near():
            own = np.flatnonzero(self.owners == first)
            for side in (ASIDE, -ASIDE):
                places = middles[own] + side * normals[own]
                met = np.flatnonzero(solids[second].contains(places))
                if len(met):
                    place = in_brackets(self.mesh.vertices[self.mesh.faces[own[met[0]]]].mean(axis=0))
                    pair = self._named(*sorted((first, second)))
                    raise MeshError(f"{pair} overlap, or touch in faces that do not match, at {place}: {CHOOSE}")

    def _near(self) -> list[tuple[int, int]]:
        """Return the pairs of different solids whose boxes meet."""
        corners = [np.concatenate(self._corners(number)) for number in range(len(self.names))]
        low, high = (np.array([choose(rows, axis=0) for rows in corners]) for choose in (np.min, np.max))
        meet = np.all(low[:, None] <= high[None] + ASIDE, axis=2) & np.all(low[None] <= high[:, None] + ASIDE, axis=2)
        return [(int(i), int(j)) for i, j in np.argwhere(meet) if i != j]

    def _corners(self, number: int) -> Array:
        """Return the triangles (k, 3, 3) all around a solid, in the box."""
        walls = (self.walls.corners - self.mesh.middle) / self.mesh.size
        ahead, behind = (walls[self.walls.solids[:, k] == number] for k in (0, 1))
        return np.concatenate([self.mesh.points[self.mesh.faces[self.owners == number]], ahead, behind[:, ::-1]])

    def _closed(self, number: int) -> Solid:
        corners = self._corners(number)
        return Solid(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))

    def _named(self, first: int, second: int) -> str:
        """Return two solids in words."""
        if not self.names[first] and not self.names[second]:
            return f"components {first} and {second}"
        return f"solids {first} ({self.names[first]!r:.40}) and {second} ({self.names[second]!r:.40})"


def glued(mesh: MeshRepair, owners: IntArray, names: tuple[str, ...]) -> tuple[Solids, list[str]]:
    """Return solids whose faces in the same place are walls, and notices.

    mesh: closed solids, each wound outward; owners: (m,), the solid of each face. Raises MeshError for solids that
    overlap, or touch in faces that do not match.
    """
    faces = _joined(mesh)
    first, second = _pairs(faces, owners)
    outer = np.setdiff1d(np.arange(len(faces)), [first, second])
    if len(outer) < 4:
        raise MeshError(f"solids lie in the same place: {CHOOSE}")
    sides = np.stack([first, second], axis=1)
    walls = Walls(mesh.vertices[mesh.faces[first]], owners[sides], mesh.old[sides])
    joined = replace(mesh, faces=faces).with_faces(outer)
    crossings = _without_neighbours(crossing_faces(joined.points, joined.faces), joined.faces)
    Solids(joined, owners[outer], names, crossings, walls).check()
    parted, touching = split(joined)
    area = float(normals_and_areas(mesh.vertices, mesh.faces[first])[1].sum())
    notices = [f"glued solids over an area of {area:.3g}, {len(first)} faces"] if len(first) else []
    return Solids(parted.compact(), owners[outer], names, crossings, walls), [*notices, *touching]


def _without_neighbours(pairs: IntArray, faces: IntArray) -> IntArray:
    """Return the pairs (k, 2) of faces without a common edge: solids that touch there in one plane do not cross."""
    first, second = faces[pairs[:, 0]], faces[pairs[:, 1]]
    return pairs[(first[:, :, None] == second[:, None]).any(axis=2).sum(axis=1) < 2]


def _joined(mesh: MeshRepair) -> IntArray:
    """Return the faces (m, 3) with one vertex for all that are in the same place."""
    label = connected(close_pairs(mesh.points, mesh.faces), len(mesh.points))
    return np.unique(label, return_index=True)[1][label][mesh.faces]


def _pairs(faces: IntArray, owners: IntArray) -> tuple[IntArray, IntArray]:
    """Return the faces (k,) of one solid and those of another one with the same vertices (k,)."""
    rows = np.sort(faces, axis=1)
    order = np.lexsort((owners, *rows.T))
    same = np.all(np.diff(rows[order], axis=0) == 0, axis=1) & (np.diff(owners[order]) != 0)
    first, second = order[:-1][same], order[1:][same]
    if len(np.unique([first, second])) < 2 * len(first):
        raise MeshError(f"three solids have a face in the same place: {CHOOSE}")
    return first, second
