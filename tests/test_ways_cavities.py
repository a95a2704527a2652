"""Ways for bodies with cavities, and for several solids."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_files import CUBE, TRIANGLES, joined

from parameterize.config import preset
from parameterize.layouts.rods.along_skeleton import LayoutError
from parameterize.run import given_corners
from parameterize.surface.surface import surface_from_arrays
from parameterize.ways.hexahedra import HEXAHEDRA
from parameterize.ways.mapping_task import MappingTask
from parameterize.ways.strategy import WAYS, first_way

WHOLE = ("sharp edges", "network", "growth", "stiff growth", "last growth", "blocks", "body with stubs")


def of(*cubes):
    """The task of a surface of cubes, each (side, lowest corner)."""
    surface = surface_from_arrays(*joined(*((CUBE * side + low, TRIANGLES) for side, low in cubes)))
    return MappingTask(surface, preset("fast"), 0, "cpu", "float32", None, {}, {})


def test_planes_divide_a_body_with_a_cavity_and_no_other_way_without_edges_takes_it():
    hollow = of((4.0, 0.0), (1.0, 1.5))
    way, suits = first_way(hollow, WAYS)
    assert way.name == "planes" and suits.why == "bounded by planes: 26 exact blocks"
    assert not any(way.suits(hollow).applies for way in WAYS if way.name in WHOLE)
    with pytest.raises(ValueError, match="corners are those of one cube, and this body has cavities"):
        given_corners(hollow.surface, np.arange(8), hollow.config)


def test_no_way_of_one_solid_takes_two():
    two = of((1.0, 0.0), (1.0, (0, 0, 1)))
    assert two.surface.shells == 1 and not two.surface.is_plain
    for way in WAYS:
        if way.name in (*WHOLE, "planes", "stacks"):
            assert not way.suits(two).applies, way.name
    with pytest.raises(LayoutError, match="none of the ways asked for suits this body"):
        first_way(two, tuple(way for way in WAYS if way.name in WHOLE))


def test_hexahedra_of_triangles_take_two_solids_without_a_model():
    task = of((1.0, 0.0), (1.0, (0, 0, 1)))
    assert HEXAHEDRA.suits(task).applies
    solids = HEXAHEDRA.lay(task).nets.solids
    assert len(np.unique(solids.numbers)) == 2
