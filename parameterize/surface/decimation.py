"""Reduces the number of triangles of a surface, only where the user asks for it."""

from dataclasses import replace

import igl
import numpy as np

from .errors import MeshError, check_face_limit
from .geometry import doubled_areas
from .groups import renumbered
from .surface import Surface, surface_from_arrays


def decimate(surface: Surface, max_faces: int) -> Surface:
    """Return the surface with at most `max_faces` triangles, or itself where it has no more.

    Edges are collapsed by quadric errors (Garland, Heckbert, SIGGRAPH 1997), unless the collapse would make
    triangles intersect. A notice has the counts and the largest distance moved; `sha256` is that of the new arrays.
    Raises MeshError for a limit below 4, and where the surface cannot be brought below it.
    """
    check_face_limit(max_faces)
    before = len(surface.faces)
    if before <= max_faces:
        return surface
    name = surface.source or surface.name
    unit = np.asfortranarray(surface.unit_vertices)
    vertices, faces, *_ = igl.qslim(unit, surface.faces, max_faces, block_intersections=True)
    if len(faces) > max_faces:
        raise MeshError(f"{name}: cannot be decimated below {len(faces)} faces: raise --max-faces")
    moved = igl.hausdorff(unit, surface.faces, vertices, faces) / surface.scale
    notice = f"decimated from {before} to {len(faces)} faces: moved by at most {moved:.3g}"
    smaller = surface_from_arrays(surface.from_unit(vertices), faces, surface.name, max_faces=max_faces)
    old = surface.part.nearest(
        smaller.vertices[smaller.faces].mean(axis=1), doubled_areas(smaller.vertices, smaller.faces)
    )
    groups = renumbered(surface.groups, old)
    # Earlier notices concern the given surface, later ones the decimated surface.
    notices = (*surface.notices, notice, *smaller.notices)
    return replace(smaller, source=surface.source, notices=notices, groups=groups)
