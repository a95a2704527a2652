"""A map that does not need the network: the cube grows into the solid (for shapes that are hard to train).

The surface is laid on the cube one-to-one before anything else, so that the boundary never has to be untangled. The
first map is a cube in the solid's middle. Round after round the surface's data draw it more strongly, while the
penalties on det J act from the start: what is never folded need not be unfolded (compare Schueller, Kavan, Panozzo,
Sorkine-Hornung, SGP 2013).
"""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from .arrays import Array, Knots
from .config import GrowthConfig, LayoutConfig, SplineConfig
from .cube.cube import project_radially, snap
from .cube.cutting import cut_along_rays, subdivide_finely
from .cube.flips import Layout
from .cube.turning import best_turn
from .spline.bspline import greville
from .surface.geometry import vertex_weights


def growing(spline: SplineConfig, growth: GrowthConfig) -> SplineConfig:
    """Return the options of a spline stage that begins with the rounds in which F grows."""
    rounds = len(growth.shares)
    return replace(
        stiffened(spline, growth),
        growth=growth,
        penalties=(growth.penalty,),
        rounds=rounds + growth.rounds,
        coarse=growth.coarse,
        coarse_rounds=rounds,
        usual_steps=(growth.steps,) * rounds + growth.usual_steps,
        far=max(spline.far, growth.far),
        parted=max(spline.parted, growth.far),
        patient_rounds=growth.patient_rounds,
        firm_rounds=growth.firm_rounds,
    )


def stiffened(spline: SplineConfig, growth: GrowthConfig) -> SplineConfig:
    """Return the options of a spline stage with what such a growth keeps to the end."""
    return replace(spline, fairness=growth.stiffness * spline.fairness, least_floor=growth.least_floor)


def surface_on_cube(
    sphere: Layout, own: int, spline: SplineConfig, options: LayoutConfig, *, seed: int, turn: int
) -> Layout:
    """Lay a closed surface, laid on the sphere, on the cube without a flipped triangle, its long edges cut.

    own: how many vertices are the mesh's; these stay first. seed: draws how the cube may be turned; turn: 0 takes the
    best of these ways, 1 the next, ...
    """
    rotation = best_turn(sphere, options, np.random.default_rng(seed), turn)
    columns = np.hstack([sphere.vertices, sphere.places @ rotation.T])
    columns, faces = subdivide_finely(columns, sphere.faces, spline.longest_edge, own + spline.most_points)
    points, places = columns[:, :3], 0.5 + project_radially(columns[:, 3:])
    cut = cut_along_rays(places, faces, options.path_snap)
    return Layout(cut.carry(points), cut.faces, snap(cut.carry(places)))


def first_cube(layout: Layout, own: int, knots: Knots, degree: int) -> Array:
    """Return control points (3, n_u, n_v, n_w) of the unit cube, turned so that it faces the surface as laid out."""
    weights = vertex_weights(layout.vertices, layout.faces, own)
    rotation, _ = Rotation.align_vectors(layout.vertices - 0.5, layout.places - 0.5, weights)
    points = np.stack(np.meshgrid(*(greville(row, degree) for row in knots), indexing="ij"), axis=-1) - 0.5
    return np.ascontiguousarray(np.moveaxis(0.5 + points @ rotation.as_matrix().T, -1, 0))
