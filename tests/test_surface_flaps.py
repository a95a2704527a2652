from __future__ import annotations

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES

from parameterize.surface.errors import MeshError
from parameterize.surface.surface import surface_from_arrays

TIPS = np.vstack([CUBE, [[2.0, 2.0, 2.0], [2.0, 0.0, 3.0]]])
FLAP = [[0, 1, 8], [0, 8, 9]]  # hangs on the edge 0-1


def test_loose_faces_are_dropped_with_their_area():
    surface = surface_from_arrays(TIPS, np.concatenate([FLAP, TRIANGLES]))
    assert len(surface.faces) == 12 and surface.volume == pytest.approx(1.0)
    area = 0.5 * sum(np.linalg.norm(np.cross(*(TIPS[[b, c]] - TIPS[a]))) for a, b, c in FLAP)
    assert any(f"dropped 2 loose faces (area {area:.3g})" in line for line in surface.notices)


def test_they_stay_where_the_body_is_open_too():
    with pytest.raises(MeshError, match="1 non-manifold edges"):
        surface_from_arrays(TIPS, np.concatenate([FLAP, TRIANGLES[:-1]]), close=True)
