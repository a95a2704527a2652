"""Lays the surface on the cube without a flipped triangle; growth and the start along sharp edges use this layout."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..cube.cube import CORNERS, project_radially, snap
from ..cube.cube_layout import CubeLayout
from ..cube.cutting import cut_along_rays, subdivide_finely
from ..cube.turning import best_turn
from .start import MOST_POINTS, Task

MORE_ROUNDS = 4  # than after a trained network: such shapes are hard


def surface_on_cube(task: Task, turn: int) -> CubeLayout:
    """Return the layout of the surface on the cube, without a flipped triangle, made from the layout on the sphere.

    Long edges of the mesh are cut; the mesh's own vertices stay first. turn: the turn of the cube; 0 is the best turn
    among those that the seed draws, 1 the next best, and so on. Corners that the user gives decide it.
    """
    sphere = task.sphere
    if task.given_corners is None:
        rotation = best_turn(sphere, np.random.default_rng(task.seed), turn)
    else:
        rotation = Rotation.align_vectors(CORNERS - 0.5, sphere.places[task.given_corners])[0].as_matrix()
    columns = np.hstack([sphere.points, sphere.places @ rotation.T])
    longest = task.config.spline.longest_edge
    columns, faces = subdivide_finely(columns, sphere.faces, longest, sphere.n_own + MOST_POINTS)
    points, places = columns[:, :3], 0.5 + project_radially(columns[:, 3:])
    cut = cut_along_rays(places, faces).laid_out(CubeLayout(points, faces, places, sphere.n_own))
    return replace(cut, places=snap(cut.places))
