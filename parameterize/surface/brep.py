"""The exact faces of a solid model after the repairs of its triangles."""

import numpy as np

from ..arrays import IntArray
from .geometry import normals_and_areas
from .readers.common import Brep
from .readers.file import RawMesh

LOST = 1e-6  # of the area: triangles of less are degenerate, and the exact faces are what they were


def kept_brep(raw: RawMesh, old: IntArray) -> Brep:
    """Return the B-rep of a mesh whose present triangles had the numbers `old` (m,), -1 for one that was added.

    It has no text where repairs have changed the shape: where holes were filled, or triangles are gone.
    """
    if raw.brep is None:
        return Brep(b"", np.zeros(len(old), dtype=np.int64))
    faces = np.where(old < 0, 0, raw.brep.faces[old])
    areas = normals_and_areas(raw.vertices, raw.faces)[1]
    same = old.min() >= 0 and areas[old].sum() >= (1.0 - LOST) * areas.sum()
    return Brep(raw.brep.text if same else b"", faces)
