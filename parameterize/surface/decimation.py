"""Reduces the number of triangles of a surface, where the user asks for it, or of the copy a map is fitted on.

A map costs by the vertices it is fitted to, while a spline of some 30 x 30 control points a face cannot follow more
than some ten thousand of them. So surfaces of more than `MOST_FITTED` faces are laid out and fitted on a copy.
"""

from dataclasses import replace

import igl
import numpy as np

from ..arrays import Array, IntArray
from .errors import MeshError, check_face_limit
from .geometry import doubled_areas
from .groups import renumbered
from .nearest import distance_to_mesh
from .surface import Surface, surface_from_arrays

MOST_FITTED = 40_000  # faces: a surface of more is fitted on a copy; below, the copy would hardly be faster
FITTED = 30_000  # faces of the copy
_LOST = 0.01  # share of its volume that a body may lose or gain in silence: thin plates lose more


def decimate(surface: Surface, max_faces: int) -> Surface:
    """Return the surface with at most `max_faces` triangles, or itself where it has no more.

    Edges are collapsed by quadric errors (Garland, Heckbert, SIGGRAPH 1997), and where that makes triangles intersect,
    once more without the collapses that do. A notice has the counts, the largest distance moved, and the change of the
    volume if it is large, as of thin bodies; `sha256` is that of the new arrays. Raises MeshError for a limit below 4,
    and where the surface cannot be brought below it.
    """
    check_face_limit(max_faces)
    before = len(surface.faces)
    if before <= max_faces:
        return surface
    smaller, moved = _reduced(surface, max_faces)
    notice = f"decimated from {before} to {len(smaller.faces)} faces: moved by at most {moved:.3g} at vertices"
    if abs(lost := _lost(surface, smaller)) > _LOST:
        notice += f"; its volume is {_change(lost)} than the input's: raise --max-faces"
    # Earlier notices concern the given surface, later ones the decimated surface.
    return replace(smaller, notices=(*surface.notices, notice, *smaller.notices))


def fitted_copy(surface: Surface) -> tuple[Surface, str]:
    """Return the surface that maps are laid out and fitted on, and a notice; itself, and "", where it is small."""
    before = len(surface.faces)
    if before <= MOST_FITTED:
        return surface, ""
    try:
        copy, moved = _reduced(surface, FITTED)
        if abs(lost := _lost(surface, copy)) > _LOST:
            raise MeshError(f"the volume of a copy is {_change(lost)}")
    except MeshError as error:  # such as a surface that meets itself, whose copy tears
        return surface, f"laid out and fitted with all its {before} faces, which takes long: {error}"
    return replace(copy, sharp=surface.sharp), (
        f"laid out and fitted on a copy of {len(copy.faces)} faces, at most {moved:.3g} away at vertices; "
        f"measured on all {before}"
    )


def _reduced(surface: Surface, max_faces: int) -> tuple[Surface, float]:
    """Return the surface with at most `max_faces` triangles, its notices those of the new arrays, and how far it moved.

    Raises MeshError where there is none.
    """
    whole = np.asfortranarray(surface.unit_vertices), surface.faces
    if not len(surface.crossings):
        from .collapses import collapsed

        vertices, faces = collapsed(surface.unit_vertices, surface.faces, max_faces)
        try:
            found = _checked(surface, vertices, faces, max_faces)
            if not len(found[0].crossings):
                return found
        except MeshError:
            pass  # triangles that meet may end up as one
    vertices, faces, *_ = igl.qslim(*whole, max_faces, block_intersections=True)
    return _checked(surface, vertices, faces, max_faces)


def _lost(surface: Surface, smaller: Surface) -> float:
    """Return the share of the surface's volume that the smaller surface has lost; below zero, gained."""
    return 1.0 - smaller.volume / surface.volume


def _change(lost: float) -> str:
    return f"{100.0 * abs(lost):.2g} % {'smaller' if lost > 0.0 else 'larger'}"


def _checked(surface: Surface, vertices: Array, faces: IntArray, max_faces: int) -> tuple[Surface, float]:
    """Return the surface of fewer triangles, by their placed vertices (n, 3), and how far vertices moved."""
    if len(faces) > max_faces:
        name = surface.source or surface.name
        raise MeshError(f"{name}: cannot be decimated below {len(faces)} faces: raise --max-faces")
    one, other = (surface.unit_vertices, surface.faces), (vertices, faces)
    moved = max(distance_to_mesh(one[0], *other).max(), distance_to_mesh(other[0], *one).max()) / surface.scale
    smaller = surface_from_arrays(surface.from_unit(vertices), faces, surface.name, max_faces=max_faces)
    smaller = replace(smaller, source=surface.source, unit=surface.unit)
    labelled = surface.groups or surface.brep or len(surface.solids) > 1
    return _labelled(surface, smaller) if labelled else smaller, float(moved)


def _labelled(surface: Surface, smaller: Surface) -> Surface:
    """Return the smaller surface whose faces have the groups, the exact face and the solid of the nearest face."""
    middles = smaller.vertices[smaller.faces].mean(axis=1)
    nearest = surface.part.nearest(middles, doubled_areas(smaller.vertices, smaller.faces))
    return replace(
        smaller,
        groups=renumbered(surface.groups, nearest),
        brep=surface.brep,
        shapes=surface.shapes,
        brep_faces=surface.brep_faces[nearest],
        solids=surface.solids,
        owners=surface.owners[nearest],
        walls=surface.walls,
    )
