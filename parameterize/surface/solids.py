"""The solids of a file that has several: one is taken before points are welded, so that those that touch stay apart."""

from dataclasses import replace

import numpy as np

from .bodies import LARGEST, LISTED, Choice, check_choice
from .errors import MeshError
from .geometry import signed_volume
from .groups import renumbered
from .readers.common import SolidPart, Solids
from .readers.file import RawMesh


def one_solid(raw: RawMesh, component: Choice) -> tuple[RawMesh, Choice]:
    """Return the mesh of one solid, and the component of it that is to be taken; raise MeshError where none is chosen.

    Solids are numbered as components are: 0 has most faces. A mesh that is not of several solids is returned as it is.
    """
    check_choice(component)
    if not raw.solids:
        return raw, component
    solids = distinct_solids(raw)
    copies = len(raw.solids) - len(solids)
    told = (f"dropped copies of solids in the same place: {copies}",) if copies else ()
    if len(solids) == 1:
        return _only(raw, solids[0], told), component
    sizes = "; ".join(f"{k}: {_described(solid)}" for k, solid in enumerate(solids[:LISTED]))
    sizes += f"; and {len(solids) - LISTED} more" if len(solids) > LISTED else ""
    if component is None:
        raise MeshError(
            f"{len(solids)} solids ({sizes}): choose one with --component largest or --component N, take each with "
            "`iga-nn batch --split`, or unite them in the program that made them"
        )
    volumes = [abs(signed_volume(raw.vertices, raw.faces[one.triangles])) for one in solids]
    chosen = int(np.argmax(volumes)) if component == LARGEST else int(component)
    if chosen >= len(solids):
        raise MeshError(f"component {component} does not exist: there are {len(solids)} solids, from 0 ({sizes})")
    rest = sum(volumes) - volumes[chosen]
    taken = (
        f"solid {chosen} taken of {len(solids)} ({sizes}), of volume {volumes[chosen]:.3g}; the others have {rest:.3g}"
    )
    return _only(raw, solids[chosen], (*told, taken)), "largest"  # with its voids filled


def _described(solid: SolidPart) -> str:
    """Return the name of a solid, where it has one, and how many triangles it has."""
    return f"{solid.name!r:.40}, " * bool(solid.name) + f"{len(solid.triangles)} faces"


def distinct_solids(raw: RawMesh) -> Solids:
    """Return the solids without copies in the same place, those of most faces first."""
    found: dict[bytes, SolidPart] = {}
    for solid in raw.solids:
        found.setdefault(raw.vertices[raw.faces[solid.triangles]].tobytes(), solid)
    return tuple(sorted(found.values(), key=lambda solid: (-len(solid.triangles), int(solid.triangles[0]))))


def _only(raw: RawMesh, solid: SolidPart, notices: tuple[str, ...]) -> RawMesh:
    """Return the mesh of one solid, with notices."""
    used, corners = np.unique(raw.faces[solid.triangles], return_inverse=True)
    return replace(
        raw,
        vertices=raw.vertices[used],
        faces=corners.reshape(-1, 3),
        notices=(*raw.notices, *notices),
        groups=renumbered(raw.groups, solid.triangles),
        solids=(),
        brep=solid.brep,
    )
