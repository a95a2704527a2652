"""Checks regions on the surface of a part, before a run."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from parameterize.arrays import Array, IntArray
from parameterize.surface.geometry import normals_and_areas
from parameterize.surface.solid import Solid
from parameterize.surface.surface import Surface
from solve.ask import Ask
from solve.asked.functional import NEAR
from solve.forms.boundary_value_problem import BoundaryValueProblem
from solve.forms.frame import UnitFrame
from solve.forms.region import Region

from ..errors import InputError, input_errors
from ..new_file import check_new

_SAMPLES = 20_000  # points of the surface, beside its vertices
_SEED = 0
_LATTICE = 40  # points a direction of the box, in which a part of the body is looked for


def check_regions(problem: BoundaryValueProblem, surface: Surface) -> None:
    """Raise ValueError where a region of a problem holds at no point of a surface, or names a group that it lacks.

    problem: the problem with its regions placed. Regions of the cube's faces are unknown before the map exists.
    """
    for condition in problem.conditions:
        if not condition.region.needs_cube and not share_of(condition.region, surface):
            raise ValueError(f"{condition.role}: {_nowhere(surface)}")


def check_asks(asks: Sequence[Ask], surface: Surface) -> None:
    """Raise ValueError for asks that the part cannot have: a place outside of it, or a region without a point of it.

    Regions of the cube's faces are unknown before the map exists.
    """
    solid = Solid(surface.vertices, surface.faces)
    for one in asks:
        ask = one.placed(frame_of(surface), surface.part)
        if ask.place is not None:
            distance = float(solid.signed_distances(np.array([ask.place]))[0])
            if distance > NEAR * float(np.ptp(surface.vertices, axis=0).max()):
                raise ValueError(f"{ask.role}: the place lies outside of the part, {distance:.4g} from its surface")
        region = ask.region
        if region is None or region.needs_cube or region.patch_faces:
            continue
        on_boundary = ask.is_on_boundary or ask.kind in ("reaction", "flow")
        if not share_of(region, surface) and (on_boundary or not _holds_inside(region, surface)):
            raise ValueError(f"{ask.role}: {_nowhere(surface)}")


def _holds_inside(region: Region, surface: Surface) -> bool:
    """Return whether a condition on the position holds at points of a lattice in the surface's box."""
    rows = np.linspace(*surface.bbox, _LATTICE)
    points = np.stack(np.meshgrid(*rows.T, indexing="ij")).reshape(3, -1)
    return bool(region.holds(points, np.zeros_like(points)).any())


def _nowhere(surface: Surface) -> str:
    low, high = surface.bbox
    return (
        f"no point of the surface lies there; x runs from {low[0]:.6g} to {high[0]:.6g}, "
        f"y from {low[1]:.6g} to {high[1]:.6g}, z from {low[2]:.6g} to {high[2]:.6g}"
    )


def frame_of(surface: Surface) -> UnitFrame:
    """Return the frame of X, Y, Z from the surface, before there is a volume."""
    low, high = surface.bbox
    x, y, z = ((low + high) / 2.0).tolist()
    return UnitFrame((x, y, z), 1.0 / surface.scale)


def placed_on(texts: Sequence[str], surface: Surface) -> list[Region]:
    """Return regions from these texts, placed on a surface.

    Raises ExpressionError for a text that is refused, ValueError for a face of the cube, which a surface does not have.
    """
    regions = [Region(text).placed(frame_of(surface), surface.part) for text in texts]
    if cube := next((region for region in regions if region.needs_cube or region.patch_faces), None):
        raise ValueError(f"region {str(cube)!r:.80}: has faces of the cube, which are known once the part is mapped")
    return regions


def looked_at(texts: Sequence[str], surface: Surface, picture: Path | None, force: bool) -> list[dict[str, Any]]:
    """Return the facts of regions of a surface, and draw the regions where a picture is named.

    force: whether an existing picture is replaced. Raises InputError for a region that is refused or empty, and for a
    picture that cannot be drawn or written.
    """
    if picture is not None:
        check_new(picture, ".png", "--picture")
        if picture.exists() and not force:
            raise InputError(f"{picture}: exists; --force replaces it")
    with input_errors():
        regions = placed_on(texts, surface)
        found = [facts_of(region, surface) for region in regions]
        if picture is not None:
            _draw(picture, surface, regions)
    return found


def _draw(picture: Path, surface: Surface, regions: Sequence[Region]) -> None:
    from ..figures.regions import draw_regions
    from ..figures.render import CANNOT_DRAW, can_draw

    if not can_draw():
        raise InputError(CANNOT_DRAW)
    draw_regions(picture, surface, regions)


def facts_of(region: Region, surface: Surface) -> dict[str, Any]:
    """Return a region's text, its area, its share of the surface's area, and the number of triangles mostly in it.

    Raises ValueError where no point of the surface lies in the region.
    """
    if not share_of(region, surface):
        raise ValueError(f"region {str(region)!r:.80}: {_nowhere(surface)}")
    covered, (_, areas) = cover(region, surface), normals_and_areas(surface.vertices, surface.faces)
    area = float(areas @ covered)
    return {
        "region": str(region),
        "area": area,
        "share": area / float(areas.sum()),
        "triangles": int(np.count_nonzero(covered > 0.5)),
    }


def cover(region: Region, surface: Surface) -> Array:
    """Return the share (m,) of each triangle that lies in a region.

    The share is that of points on the triangle; larger triangles have more points.
    """
    _, areas = normals_and_areas(surface.vertices, surface.faces)
    counts = np.maximum(1, np.round(_SAMPLES * areas / areas.sum())).astype(int)
    chosen = np.repeat(np.arange(len(counts)), counts)
    found = region.holds(*_points(surface, chosen, np.random.default_rng(_SEED)))
    return np.asarray(np.bincount(chosen, found, len(counts)) / counts)


def share_of(region: Region, surface: Surface) -> float:
    """Return the share of a surface's area that lies in a region, from points without a pattern on the surface.

    A region without such points, but with vertices, has the least share that is not zero.
    """
    rng = np.random.default_rng(_SEED)
    normals, areas = normals_and_areas(surface.vertices, surface.faces)
    chosen = rng.choice(len(areas), _SAMPLES, p=areas / areas.sum())
    found = region.holds(*_points(surface, chosen, rng))
    if found.any():
        return float(found.mean())
    corners = surface.vertices[surface.faces].reshape(-1, 3).T
    return 1.0 / _SAMPLES if region.holds(corners, np.repeat(normals, 3, axis=0).T).any() else 0.0


def _points(surface: Surface, chosen: IntArray, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return a point without a pattern on each of the chosen triangles (k,), and the unit normals: (3, k) each."""
    corners = surface.vertices[surface.faces[chosen]]
    a, b = np.sort(rng.uniform(size=(2, len(chosen))), axis=0)
    points = np.einsum("mk,mkd->dm", np.stack([a, b - a, 1.0 - b], axis=1), corners)
    return points, normals_and_areas(surface.vertices, surface.faces[chosen])[0].T
