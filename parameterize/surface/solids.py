"""The solids of a file: told apart, or one taken, before points are welded, so that those that touch stay apart."""

from dataclasses import replace

import numpy as np

from .bodies import LARGEST, Choice, check_choice
from .errors import MeshError
from .geometry import signed_volume
from .gluing import CHOOSE
from .groups import renumbered
from .readers.common import SolidPart, Solids
from .readers.file import RawMesh
from .shells import LISTED


def solids_of(raw: RawMesh, component: Choice) -> tuple[RawMesh, Choice]:
    """Return the mesh of all solids, or of the chosen one, and the component of it that is to be taken.

    To choose, solids are numbered as components are: 0 has most faces. Those that are kept stay in their order. A mesh
    that is not of solids is returned as it is. Raises MeshError where all are kept and cannot be taken together.
    """
    check_choice(component)
    if not raw.solids:
        return raw, component
    solids = distinct_solids(raw)
    copies = len(raw.solids) - len(solids)
    told = (f"dropped copies of solids in the same place: {copies}",) if copies else ()
    if len(solids) == 1:
        return only(raw, solids, told), component
    sizes = "; ".join(f"{k}: {_described(solid)}" for k, solid in enumerate(solids[:LISTED]))
    sizes += f"; and {len(solids) - LISTED} more" if len(solids) > LISTED else ""
    if component is None:
        if raw.conflict:
            raise MeshError(f"{len(solids)} solids ({sizes}), {raw.conflict}: {CHOOSE}")
        kept = f"{len(solids)} solids are kept ({sizes}): --component takes one"
        return only(raw, tuple(sorted(solids, key=lambda one: int(one.triangles[0]))), (*told, kept)), None
    volumes = [abs(signed_volume(raw.vertices, raw.faces[one.triangles])) for one in solids]
    chosen = int(np.argmax(volumes)) if component == LARGEST else int(component)
    if chosen >= len(solids):
        raise MeshError(f"component {component} does not exist: there are {len(solids)} solids, from 0 ({sizes})")
    rest = sum(volumes) - volumes[chosen]
    taken = (
        f"solid {chosen} taken of {len(solids)} ({sizes}), of volume {volumes[chosen]:.3g}; the others have {rest:.3g}"
    )
    return only(raw, (solids[chosen],), (*told, taken)), "largest"  # with its voids filled


def _described(solid: SolidPart) -> str:
    """Return the name of a solid, where it has one, and how many triangles it has."""
    return f"{solid.name!r:.40}, " * bool(solid.name) + f"{len(solid.triangles)} faces"


def distinct_solids(raw: RawMesh) -> Solids:
    """Return the solids without copies in the same place, those of most faces first."""
    found: dict[bytes, SolidPart] = {}
    for solid in raw.solids:
        found.setdefault(raw.vertices[raw.faces[solid.triangles]].tobytes(), solid)
    return tuple(sorted(found.values(), key=lambda solid: (-len(solid.triangles), int(solid.triangles[0]))))


def only(raw: RawMesh, solids: Solids, notices: tuple[str, ...] = ()) -> RawMesh:
    """Return the mesh of some of the solids, with notices."""
    rows = np.concatenate([solid.triangles for solid in solids])
    ends = np.cumsum([len(solid.triangles) for solid in solids])
    numbers = np.split(np.arange(len(rows)), ends[:-1])
    used, corners = np.unique(raw.faces[rows], return_inverse=True)
    whole = raw.brep and replace(raw.brep, faces=raw.brep.faces[rows])
    return replace(
        raw,
        vertices=raw.vertices[used],
        faces=corners.reshape(-1, 3),
        notices=(*raw.notices, *notices),
        groups=renumbered(raw.groups, rows),
        solids=tuple(replace(solid, triangles=own) for solid, own in zip(solids, numbers, strict=True)),
        brep=solids[0].brep if len(solids) == 1 else whole,
    )
