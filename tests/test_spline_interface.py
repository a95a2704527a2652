"""Faces of patches, seen from outside."""

import numpy as np
import pytest

from parameterize.spline.interface import axis_side, face_layer, outward
from parameterize.spline.volume import FACE_NAMES

CORNERS = np.moveaxis(np.indices((2, 2, 2)).astype(float), 0, -1)  # [u][v][w] of the unit cube


@pytest.mark.parametrize("name", FACE_NAMES)
def test_the_directions_of_a_face_and_the_way_out_are_right_handed(name):
    layer = outward(face_layer(CORNERS, name), name)
    axis, side = axis_side(name)
    normal = np.cross(layer[1, 0] - layer[0, 0], layer[0, 1] - layer[0, 0])
    assert np.array_equal(normal, (1.0 if side else -1.0) * np.eye(3)[axis])
