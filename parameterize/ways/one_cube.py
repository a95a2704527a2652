"""What the ways to a map of one cube have in common: their bodies, the surface laid on the cube, the first fit."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from ..arrays import Array
from ..cube.constrained import Constrained
from ..cube.cube import CORNERS, CubeLayout, project_radially, snap
from ..cube.cutting import cut_along_rays, subdivide_finely
from ..cube.sphere import lay_on_sphere
from ..cube.turning import best_turn
from ..optimization.least_squares import fit_pairs
from ..optimization.rounds import coarse_knots
from ..optimization.sliding import SlidingParameters
from ..optimization.surface_distance import Correspondence
from ..spline.spline_map import ControlNets, SplineMap
from .mapping_task import MOST_POINTS, MappingTask
from .way import Suits, Way

MORE_ROUNDS = 4  # than after a trained network: such shapes are hard
COARSE = 5 / 9  # of the spans a direction, in the first rounds: enough for the shape, at a fraction of the time
_BOUNDARY_SHARE = 0.2  # weight of the surface's samples; those inside have the rest of 1, and so decide where F folds
_TOLERANCE = 1e-3  # of the fit: the rounds move the map much farther
_FAIRNESS = 1e-7  # of the fit: determines coefficients without samples, and hardly moves the rest


class OneCube(Way):
    """Describe a way to a map of one cube."""

    def suits(self, task: MappingTask) -> Suits:
        """Return whether the body has no handles and no cavities, and the options do not ask for several blocks."""
        return Suits(task.surface.is_plain and task.surface.genus == 0 and (task.config.blocks or 1) == 1)


def surface_on_cube(task: MappingTask, turn: int) -> CubeLayout:
    """Return the layout of the surface on the cube, without a flipped triangle, made from the layout on the sphere.

    Long edges of the mesh are cut; the mesh's own vertices stay first. turn: the turn of the cube; 0 is the best turn
    among those that the seed draws, 1 the next best, and so on. Corners that the user gives decide it.
    """
    surface = task.surface
    sphere = lay_on_sphere(surface.unit_vertices, surface.faces, task.report["progress"], task.checkpoints)
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


def correspondence(
    task: MappingTask, layout: CubeLayout, coarse: float, kept: Constrained | None = None
) -> Correspondence:
    """Return the surface's points with their first parameters on the boundary of the cube (section 4.3.2, step 1).

    coarse: the number of spans a direction in the first rounds, as a share of that in the last rounds. kept:
    the points that slide along the cube's edges alone.
    """
    spline = task.config.spline
    nets = ControlNets(spline.degree, (coarse_knots(spline, coarse),))
    faces, fixed = (None, None) if kept is None else (kept.faces, kept.fixed)
    return task.correspondence(SlidingParameters(nets, layout.places, faces, layout.faces, fixed), layout.points)


def first_spline(inside: Array, places: Array, fit: Correspondence) -> SplineMap:
    """Return the spline fitted by least squares to places (k, 3) and points (k, 3), and to the boundary.

    inside: the points in the solid. places: their places in the cube. fit: the points of the surface with their
    parameters. This is step 2 of section 4.3.2.
    """
    weights = [
        np.full(len(inside), (1.0 - _BOUNDARY_SHARE) / max(len(inside), 1)),
        np.full(len(fit.points), _BOUNDARY_SHARE / len(fit.points)),
    ]
    return fit_pairs(
        np.concatenate([places, fit.sliding.parameters]),
        np.concatenate([inside, fit.points]),
        np.concatenate(weights),
        fit.sliding.knots,
        fit.sliding.nets.degree,
        fairness=_FAIRNESS,
        tolerance=_TOLERANCE,
    )
