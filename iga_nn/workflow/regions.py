"""What regions are on the surface of a part: looked at before anything is computed."""

import numpy as np

from parameterize.surface.geometry import doubled_areas
from parameterize.surface.surface import Surface
from solve.forms.problem import BoundaryValueProblem
from solve.forms.region import Region

_SAMPLES = 20_000  # points of the surface, beside its vertices
_SEED = 0


def check_regions(equation: BoundaryValueProblem, surface: Surface) -> None:
    """Raise ValueError where a region of a problem holds at no point of a surface, or names what it lacks.

    equation: with its regions placed. Regions of the cube's faces are not known yet.
    """
    for condition in equation.conditions:
        if not condition.region.needs_cube and not share_of(condition.region, surface):
            low, high = surface.bbox
            raise ValueError(
                f"{condition.role}: no point of the surface lies there; x runs from {low[0]:.6g} to {high[0]:.6g}, "
                f"y from {low[1]:.6g} to {high[1]:.6g}, z from {low[2]:.6g} to {high[2]:.6g}"
            )


def share_of(region: Region, surface: Surface) -> float:
    """Return the share of a surface's area that a region has, of points without a pattern on it.

    A region without any of them, but with vertices, has the least share that is not zero.
    """
    rng = np.random.default_rng(_SEED)
    cross = doubled_areas(surface.vertices, surface.faces)
    size = np.linalg.norm(cross, axis=1)
    chosen = rng.choice(len(size), _SAMPLES, p=size / size.sum())
    a, b = np.sort(rng.uniform(size=(2, _SAMPLES)), axis=0)
    weights = np.stack([a, b - a, 1.0 - b], axis=1)
    points = np.einsum("mk,mkd->dm", weights, surface.vertices[surface.faces[chosen]])
    found = region.holds(points, (cross[chosen] / size[chosen, None]).T)
    if found.any():
        return float(found.mean())
    corners = surface.vertices[surface.faces].reshape(-1, 3).T
    normals = np.repeat(cross / np.where(size > 0.0, size, 1.0)[:, None], 3, axis=0).T
    return 1.0 / _SAMPLES if region.holds(corners, normals).any() else 0.0
