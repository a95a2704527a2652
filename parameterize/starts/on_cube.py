"""The surface on the cube without a flipped triangle, from which growth and extension start."""

import numpy as np

from ..cube.cube import project_radially, snap
from ..cube.cutting import cut_along_rays, subdivide_finely
from ..cube.flips import Layout
from ..cube.turning import best_turn
from .start import MOST_POINTS, Task

MORE_ROUNDS = 4  # than after a trained network: such shapes are hard
USUAL_STEPS = (40, 12, 8, 8, 8, 7, 6, 6, 6)  # of Newton's method in the rounds of most runs: tells the time left


def surface_on_cube(task: Task, turn: int) -> Layout:
    """Lay the surface, laid on the sphere, on the cube without a flipped triangle, its long edges cut.

    The mesh's own vertices stay first. turn: of the ways the cube may be turned, which the seed draws, 0 takes the
    best, 1 the next, ...
    """
    sphere, options = task.sphere, task.config.layout
    rotation = best_turn(sphere, options, np.random.default_rng(task.seed), turn)
    columns = np.hstack([sphere.vertices, sphere.places @ rotation.T])
    longest = task.config.spline.longest_edge
    columns, faces = subdivide_finely(columns, sphere.faces, longest, task.own + MOST_POINTS)
    points, places = columns[:, :3], 0.5 + project_radially(columns[:, 3:])
    cut = cut_along_rays(places, faces, options.path_snap)
    return Layout(cut.carry(points), cut.faces, snap(cut.carry(places)))
