"""How the cube is turned within a layout on the sphere, so that its edges keep out of hollows.

det J > 0 needs the faces of the solid to meet at less than 180 degrees along the cube's edges, seen from inside. An
edge in a hollow cannot lie on the surface; one along a ridge suits it best.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from ..arrays import Array
from ..config import LayoutConfig
from ..surface.geometry import doubled_areas, edge_triangles
from .cube import CORNERS, EDGES, project_radially
from .sphere import SphereLayout


def turned(layout: SphereLayout, options: LayoutConfig, generator: np.random.Generator) -> SphereLayout:
    """Return the layout, turned by that one of some random rotations which leaves the edges least in hollows."""
    middles, along, bends = _bends(layout)
    rotations = Rotation.random(options.turns, rng=generator).as_matrix()
    costs = [_hollowness(middles @ r.T, along @ r.T, bends, options.edge_width) for r in rotations]
    best = rotations[int(np.argmin(costs))]
    return SphereLayout(layout.vertices, layout.faces, layout.directions @ best.T)


def _bends(layout: SphereLayout) -> tuple[Array, Array, Array]:
    """Return of each mesh edge middle and direction on the sphere (e, 3), and how much the surface bends there (e,).

    That is the angle between the two triangles, positive in a hollow, times the edge's length on the sphere.
    """
    vertices, faces, places = layout.vertices, layout.faces, layout.directions
    edges, owners = edge_triangles(faces)
    here, there = owners.T
    normals = doubled_areas(vertices, faces)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    angle = np.arccos(np.clip((normals[here] * normals[there]).sum(axis=1), -1.0, 1.0))
    middle_there = vertices[faces[there]].mean(axis=1) - vertices[edges[:, 0]]
    hollow = np.where((middle_there * normals[here]).sum(axis=1) > 0.0, angle, -angle)
    step = places[edges[:, 1]] - places[edges[:, 0]]
    length = np.linalg.norm(step, axis=1)
    middles = places[edges].mean(axis=1)
    return middles, step / np.maximum(length, 1e-300)[:, None], length * hollow


def _hollowness(middles: Array, along: Array, bends: Array, width: float) -> float:
    """Return the sum of the bends (e,) near the cube's edges, those across them above all."""
    radial, total = project_radially(middles), 0.0
    for i, j in EDGES:
        edge = CORNERS[j] - CORNERS[i]
        away = radial + 0.5 - CORNERS[i]
        away = away - np.clip(away @ edge, 0.0, 1.0)[:, None] * edge
        near = np.exp(-0.5 * (away**2).sum(axis=1) / width**2)
        total += float((bends * near * (along @ edge) ** 2).sum())
    return total
