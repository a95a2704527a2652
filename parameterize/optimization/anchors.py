"""Draws F towards the surface at anchors, which are points on the boundary: on edges, and of several blocks on faces.

The edges of the cube may have no parameter of a vertex of the mesh. F keeps a small crease along these edges, and
without anchors it could leave the surface there, most of all at the eight corners, and inflate the elements. Anchors
suit a map that is nearly on the surface: on a rough map the nearest points belong to another part of the surface, and
the anchors would hold F at that part: those of one cube are aimed in the last rounds alone. In the first rounds they
earned nothing on twelve models (ARAP and distance 1.00 times without them).

Several blocks, whose anchors always act, start as a skeleton of the solid, so a face may lie in a crease between two
others, where no point of the surface is near: nothing but anchors on the faces draws it out. Without them a hand and
a limbed body end 1.05 times as far from their surfaces; before its palm was cut into strips another hand ended 33 times
as far, most of it in two creases. The faces of one cube have points of the surface everywhere.

Corners that the user gives are held until the map is certified; in the last rounds they may move a little, because the
boundary crosses itself beside corners that are held to the end.
"""

import numpy as np

from ..arrays import Array, IntArray
from ..cube.cube import CORNERS, EDGES, face_number
from ..spline.bspline import divided_spans
from ..spline.spline_map import ControlNets
from ..surface.nearest import nearest_on_mesh
from .sliding import SlidingParameters
from .surface_distance import TANGENTIAL, Correspondence
from .term import RoundWeights

_A_SPAN = 2
_EDGES = 0.03  # share of the surface's weight: the data of the surface decide, the anchors hold the rest
_FACES = 0.1  # the same of anchors on edges and faces, which are more
_GIVEN_CORNER = 0.5  # weight, in all directions, of a corner that the user gives


def edge_points(nets: ControlNets) -> tuple[Array, IntArray]:
    """Return points (k, 3) on the edges of all faces that belong to the boundary, and these faces (k,).

    The points are the corners, and the ends and the midpoints of the spans along the edges, once for each block.
    """
    points, faces = [], []
    for block, knots in enumerate(nets.knots):
        exposed = nets.exposed[6 * block : 6 * block + 6]
        own = [np.empty((0, 3))]
        for i, j in EDGES:
            direction = CORNERS[j] - CORNERS[i]
            if exposed[_faces_at(CORNERS[i], CORNERS[j])].any():
                along = divided_spans(knots[int(direction.argmax())], _A_SPAN)
                own.append(CORNERS[i] + along[:, None] * direction)
        points.append(np.unique(np.concatenate(own), axis=0))
        on_face = np.stack([points[-1][:, axis] == side for axis in range(3) for side in (0.0, 1.0)], axis=1)
        faces.append(6 * block + (on_face & exposed).argmax(axis=1))
    return np.concatenate(points), np.concatenate(faces)


def _faces_at(first: Array, second: Array) -> list[int]:
    """Return the numbers of the cube's two faces that meet in the edge between two corners."""
    return [int(face_number(axis, first[axis])) for axis in range(3) if first[axis] == second[axis]]


def face_points(nets: ControlNets) -> tuple[Array, IntArray]:
    """Return points (k, 3) inside all faces that belong to the boundary, where knots meet, and these faces (k,)."""
    points, faces = [np.empty((0, 3))], [np.empty(0, dtype=np.int64)]
    for face in np.flatnonzero(nets.exposed).tolist():
        block, inside = divmod(face, 6)
        axis, side = divmod(inside, 2)
        rows = [divided_spans(row, 1)[1:-1] for row in nets.knots[block]]
        rows[axis] = np.array([float(side)])
        points.append(np.stack(np.meshgrid(*rows, indexing="ij"), axis=-1).reshape(-1, 3))
        faces.append(np.full(len(points[-1]), face))
    return np.concatenate(points), np.concatenate(faces)


class Anchors(Correspondence):
    """Hold the anchors as points with fixed parameters; anchors have no effect until `aim` is called."""

    def __init__(self, surface: Correspondence) -> None:
        nets = surface.sliding.nets
        kinds = (edge_points,) if nets.is_single else (edge_points, face_points)
        points, faces = map(np.concatenate, zip(*(of(nets) for of in kinds), strict=True))
        self._surface, self._share = surface, _EDGES if nets.is_single else _FACES
        shares = np.full(len(points), 1.0 / len(points))
        super().__init__(SlidingParameters(nets, points, faces), points, np.zeros((len(points), 3, 3)), shares)

    def weight(self, weights: RoundWeights) -> float:
        """Return the weight of the anchors in a round, a share of the weight of the surface's data."""
        return self._share * weights.surface

    def aim(self, control: Array) -> None:
        """Set as goals the points of the surface that are nearest to F, with the normals of their triangles."""
        here = self.residuals(control) + self.points
        points, normals = nearest_on_mesh(here, self._surface.points, self._surface.sliding.triangles)
        self.set_goals(points, normals[:, :, None] * normals[:, None, :] + TANGENTIAL * np.eye(3))

    def release(self) -> None:
        """Remove all goals but the given corners, until `aim` is called again."""
        points, quadrics = self.points.copy(), np.zeros((len(self.points), 3, 3))
        if (given := self._surface.given_corners) is not None:
            corner = np.isin(self.sliding.parameters, (0.0, 1.0)).all(axis=1)  # in the order of the given ones
            points[corner], quadrics[corner] = given, _GIVEN_CORNER * np.eye(3)
        self.set_goals(points, quadrics)

    def restore(self, points: Array, relaxation: Array) -> None:
        """Set the state of a checkpoint, so that later distances round as they would without an interruption."""
        self.set_goals(points, np.zeros((len(points), 3, 3)))
        self.relax(relaxation)
