"""Polygons of a surface cut into triangles."""

from __future__ import annotations

import numpy as np

from .arrays import Array, IntArray
from .mesh_common import MeshError

MAX_CORNERS = 256


def triangulate(vertices: Array, polygons: list[list[int]]) -> IntArray:
    """Triangles (m, 3) in the polygons' order; concave polygons are cut inside (VTK's ear cutting).

    Vertex numbers must be in range and coordinates finite. A polygon of n corners gives n - 2 triangles, fewer where
    corners repeat. Raises MeshError for a polygon of more than 256 corners.
    """
    if all(len(polygon) == 3 for polygon in polygons):
        return np.array(polygons, dtype=np.int64)
    if max(map(len, polygons)) > MAX_CORNERS:
        raise MeshError(f"a face has {max(map(len, polygons))} corners, more than {MAX_CORNERS}: triangulate it")
    import pyvista

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    placed = (vertices - low) / max(float((high - low).max()), 1e-300)  # VTK takes a very small polygon for a point
    cut = pyvista.PolyData.from_irregular_faces(placed, polygons).triangulate()
    return np.asarray(cut.regular_faces, dtype=np.int64)
