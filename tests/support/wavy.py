"""A wavy cube as a spline, and points on the boundary of its parameters."""

import numpy as np

from parameterize.cube.cube import nearest_faces
from parameterize.optimization.adjacent_faces import next_faces
from parameterize.optimization.sliding import fold
from parameterize.spline.bspline import greville, open_uniform_knots
from parameterize.spline.spline_map import ControlNets
from parameterize.spline.volume import BSplineVolume
from parameterize.training.target_shapes import nearest_on_cube

DEGREE = 3
KNOTS = (open_uniform_knots(6, DEGREE), open_uniform_knots(5, DEGREE), open_uniform_knots(7, DEGREE))
NETS = ControlNets(DEGREE, (KNOTS,))


def wavy_control(amplitude=0.02):
    rows = [greville(k, DEGREE) for k in KNOTS]
    points = np.stack(np.meshgrid(*rows, indexing="ij"))
    points = points + amplitude * np.random.default_rng(0).uniform(-1.0, 1.0, points.shape)
    return points.reshape(3, -1)


def as_volume(control):
    return BSplineVolume((DEGREE,) * 3, KNOTS, np.moveaxis(NETS.of_block(control, 0), 0, -1))


def on_the_cube(count, seed=0):
    parameters = nearest_on_cube(np.random.default_rng(seed).uniform(-0.2, 1.2, (count, 3)))
    return parameters, nearest_faces(parameters)


def folded_over_edges(nets, parameters, cube_faces, fixed=None):
    """Copies of parameters and faces after steps that left a face go on on the neighbouring one; blocks are cubes."""
    parameters, cube_faces = parameters.copy(), cube_faces.copy()
    held = np.zeros(parameters.shape, dtype=bool) if fixed is None else fixed
    for n in range(len(parameters)):
        fold((next_faces(nets), np.ones((len(nets.knots), 3))), parameters, cube_faces, held, n)
    return parameters, cube_faces
