"""Polygons of a surface cut into triangles: of all ways, the one with the least area.

Triangles that fill a plane polygon have its area in all, others more: the least area neither overlaps nor leaves the
polygon, be it concave, slit to a hole (the slit's edge runs both ways) or not quite plane. Every way has n - 2
triangles, so no hole ever opens. The minimum follows from the minima of shorter chains of corners (Barequet and Sharir,
"Filling gaps in the boundary of a polyhedron", CAGD 12, 1995).
"""

from itertools import chain

import numpy as np

from ..arrays import Array, IntArray
from .errors import MeshError

MAX_CORNERS = 256  # time grows with the cube: 256 corners take some hundredths of a second


def triangulate(vertices: Array, polygons: list[list[int]], most: int = MAX_CORNERS) -> IntArray:
    """Return triangles (m, 3) in the polygons' order, wound like them; a polygon of n corners gives n - 2.

    Vertex numbers must be in range and coordinates finite; a triangle may repeat a corner only where its polygon does.
    Raises MeshError for a polygon of more than `most` corners.
    """
    sizes = np.array([len(polygon) for polygon in polygons])
    if sizes.max() > most:
        raise MeshError(f"a face has {sizes.max()} corners, more than {most}: triangulate it")
    corners = np.fromiter(chain.from_iterable(polygons), dtype=np.int64, count=sizes.sum())
    if sizes.max() == 3:
        return corners.reshape(-1, 3)
    from .triangulation_kernels import cut_all

    starts = np.cumsum(sizes) - sizes
    placed = vertices[corners] - np.repeat(vertices[corners[starts]], sizes, axis=0)
    size = np.maximum.reduceat(abs(placed).max(axis=1), starts)
    placed /= np.repeat(np.maximum(size, 1e-300), sizes)[:, None]
    return corners[cut_all(placed, sizes)]
