"""Physical groups of Gmsh: of surfaces, and of volumes for faces without a group of a surface.

Elements of version 2 name their physical group, elements of version 4 an entity of the geometry, which may be
in several.
"""

import re
from collections.abc import Mapping

import numpy as np

from ...arrays import IntArray
from ..errors import MeshError
from ..groups import Groups, gathered
from .boundary_file import FACES
from .common import DAMAGED
from .words import Source

Physical = dict[tuple[int, int], list[int]]  # of entities, by their dimension and number: the physical groups
NAME = re.compile(rb'^[ \t]*(\d)[ \t]+(\d{1,9})[ \t]+"([^"\n]*)"', re.MULTILINE)


def physical_names(section: bytes) -> Mapping[tuple[int, int], str]:
    """Return the names of physical groups by dimension and number, of rows `dimension number "name"`."""
    return {(int(row[1]), int(row[2])): row[3].decode("utf-8", errors="replace") for row in NAME.finditer(section)}


def physical_of_entities(source: Source, version: str) -> Physical:
    """Read the entities: their numbers of each dimension, then rows `number box groups ... entities around ...`.

    The box has six numbers, of a point in version 4.1 three. Groups and entities are counted where they begin.
    """
    found: Physical = {}
    for dimension, count in enumerate(source.large(4)):
        for _ in range(count):
            number = source.whole(1)[0]
            source.table(1, [("f8", 3 if dimension == 0 and version == "4.1" else 6)])
            found[dimension, number] = _listed(source)
            if dimension > 0:
                _listed(source)
    return found


def _listed(source: Source) -> list[int]:
    """Read a count and so many numbers."""
    count = source.large(1)[0]
    if count < 0:
        raise MeshError(f"an entity with {count} groups or neighbours in the .msh; {DAMAGED}")
    return source.whole(count) if count else []


def groups_of(
    blocks: list[tuple[str, IntArray]], physical: Physical | None, names: Mapping[tuple[int, int], str]
) -> Groups:
    """Return the cells of each physical group, counted through the blocks, by its name, else by its number.

    blocks: the kind of their cells, and the entity of each (k,); without `physical` that is the group itself, 0 none.
    """
    parts = []
    first = 0
    for kind, owner in blocks:
        dimension = 3 if kind in FACES else 2
        for entity in np.unique(owner).tolist():
            numbers = first + np.flatnonzero(owner == entity)
            for group in [entity] * (entity != 0) if physical is None else physical.get((dimension, entity), []):
                parts.append((names.get((dimension, abs(group)), str(abs(group))), numbers))
        first += len(owner)
    return gathered(parts)
