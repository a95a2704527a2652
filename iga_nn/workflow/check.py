"""What `iga-nn check` finds out about a file without writing anything."""

from __future__ import annotations

from pathlib import Path
from typing import Any


def check_surface(
    mesh: str, component: int | None, max_faces: int, decimate: bool = False, strict: bool = False
) -> dict[str, Any]:
    """Return the section `input` of report.json for a surface that is accepted. Raises MeshError where it is not.

    decimate: bring a larger surface down to max_faces. strict: refuse a surface that intersects itself, too.
    """
    from ..models import resolve

    surface = resolve(mesh, component=component, max_faces=max_faces, decimate=decimate)
    if strict:
        surface.refuse_crossings()
    return surface.summary()


def check_volume(path: str | Path) -> dict[str, Any]:
    """Certify a saved volume and return what was proved. Raises InputError for a file that is not a volume."""
    from ..io.formats import load_volume
    from .verdict import certified_facts

    return certified_facts(load_volume(path))
