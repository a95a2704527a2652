"""Defines CubeLayout: a closed surface together with the places of its points on the cube."""

from dataclasses import dataclass

from ..arrays import Array, IntArray


@dataclass(frozen=True, eq=False)
class CubeLayout:
    """Hold a closed surface and its layout on the boundary of the cube, vertex by vertex.

    points: (n, 3), on the surface; the mesh's own vertices come first, the vertices of cut edges follow.

    faces: (m, 3), the triangles between the points, outward.

    places: (n, 3), the points' places on the boundary of the cube, or near it as long as the layout has to be
    untangled. In the layout on the sphere (sphere.py, turning.py) the places are unit vectors from the origin.

    n_own: the number of the mesh's own vertices.
    """

    points: Array
    faces: IntArray
    places: Array
    n_own: int
