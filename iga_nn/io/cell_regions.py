"""Says which cells of a grid, and which faces of patches, lie in regions of a problem and in groups of a part.

Cells are those of each patch between its cuts, and count u fastest. A cell counts where the middle of its face on the
boundary lies in the region.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from parameterize.arrays import IntArray, Mask
from parameterize.spline.body import Body
from parameterize.spline.interface import axis_side
from parameterize.spline.orientation import orientations
from parameterize.spline.volume import FACE_NAMES
from parameterize.surface.part import PartSurface
from solve.discretization.on_regions import codes_on
from solve.discretization.surface_rule import Faces
from solve.forms.boundary_value_problem import BoundaryValueProblem

from .elements import Alike, Cuts

if TYPE_CHECKING:
    import pyvista

    from parameterize.arrays import Array


@dataclass(frozen=True, eq=False)
class Covered:
    """Say where the faces of alike patches lie in a region.

    region: its name. numbers: (k,), the patches. face: in the order of FACE_NAMES. cells: (k, a, b), of each cell along
    the face.
    """

    region: str
    numbers: IntArray
    face: int
    cells: Mask


def enter_regions(
    grid: pyvista.UnstructuredGrid,
    body: Body,
    order: Sequence[int],
    cuts: Sequence[Cuts],
    problem: BoundaryValueProblem | None,
    part: PartSurface | None,
) -> None:
    """Enter for each region cell data of its name: 1 for cells that have a face in it, else 0.

    order: the patches as their cells follow each other. cuts: of each patch, in the body's order.
    """
    found: dict[str, list[Array]] = {}
    shapes = [tuple(len(row) - 1 for row in own) for own in cuts]
    for covered in covered_faces(body, cuts, problem, part):
        if not covered.cells.any():
            continue
        masks = found.setdefault(covered.region, [np.zeros(shape, dtype=np.uint8) for shape in shapes])
        axis, side = divmod(covered.face, 2)
        for number, own in zip(covered.numbers.tolist(), covered.cells, strict=True):
            np.moveaxis(masks[number], axis, 0)[-side] |= own
    for name, masks in found.items():
        free = name if name not in grid.cell_data else f"group {name}"
        grid.cell_data[free] = np.concatenate([masks[number].ravel(order="F") for number in order])


def covered_faces(
    body: Body, cuts: Sequence[Cuts], problem: BoundaryValueProblem | None, part: PartSurface | None
) -> Iterator[Covered]:
    """Yield where the faces of patches on the boundary lie in the regions of conditions and in the groups of a part.

    problem: on any volume; None where there is none.
    """
    if not (problem is not None and problem.conditions) and not (part is not None and part.groups):
        return
    placed = None if problem is None else problem.on(body)
    for some in _alike(body, cuts):
        whole = body.groups[some.group]
        group, hands = whole.rows(some.places), orientations(whole)[some.places]
        middles = [0.5 * (row[1:] + row[:-1]) for row in some.cuts]
        for face, name in enumerate(FACE_NAMES):
            axis, side = axis_side(name)
            own = np.flatnonzero(~body.glued[some.numbers, face])
            if not len(own):
                continue
            lines = [row for a, row in enumerate(middles) if a != axis]
            across = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
            owners, faces = np.repeat(own, len(across)), Faces(group, axis, side, hands)
            x, area = faces.points_and_areas(owners, np.tile(across, (len(own), 1)))
            normal = area / np.linalg.norm(area, axis=0)
            for region, here in regions_at(faces, name, (x, normal), owners, body.is_single, placed, part):
                yield Covered(region, some.numbers[own], face, here.reshape(len(own), *map(len, lines)))


def regions_at(
    faces: Faces,
    face: str,
    seen: tuple[Array, Array],
    owners: IntArray,
    is_single: bool,
    problem: BoundaryValueProblem | None,
    part: PartSurface | None,
) -> Iterator[tuple[str, Mask]]:
    """Yield the name of each region with which of the points (m,) on faces it holds.

    face: the name that the faces have on their patches. seen: points and outward unit normals (3, m). owners: (m,), the
    places of their patches among those of `faces`. problem: placed in the body. Names are those of the conditions, by
    kind and number, and of the groups.
    """
    x, normal = seen
    if problem is not None and problem.conditions:
        names = [face if is_single else f"p{number}_{face}" for number in faces.group.numbers.tolist()]
        codes = codes_on(problem, faces.nets, names)(x, normal, owners)
        for i, condition in enumerate(problem.conditions, 1):
            yield f"{condition.kind}_{i}", codes >> i & 1 == 1
    if part is not None and part.groups:
        nearest = part.nearest(x.T, normal.T)
        for group, triangles in part.groups.items():
            yield group, np.isin(nearest, triangles)


def _alike(body: Body, cuts: Sequence[Cuts]) -> Iterator[Alike]:
    """Yield the patches of one group with the same cuts together."""
    for label, group in enumerate(body.groups):
        classes = defaultdict(list)
        for place, number in enumerate(group.numbers.tolist()):
            classes[tuple(row.tobytes() for row in cuts[number])].append(place)
        for members in classes.values():
            chosen = np.array(members)
            numbers = group.numbers[chosen]
            yield Alike(label, chosen, numbers, cuts[int(numbers[0])])
