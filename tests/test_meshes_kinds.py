"""Nodes stand where VTK has them, and the exact matrices reproduce polynomials."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from vtkmodules.vtkCommonDataModel import vtkHigherOrderHexahedron, vtkLagrangeTetra

from parameterize.meshes.bezier import net_matrix
from parameterize.meshes.kinds import SERENDIPITY, hexahedron, kind_named, node_count, tetra


@pytest.mark.parametrize("degrees", [(1, 1, 1), (2, 2, 2), (3, 3, 3), (2, 1, 3), (4, 4, 4)])
def test_hexahedra_are_numbered_as_in_vtk(degrees):
    lattice = hexahedron(*degrees).lattice
    numbers = [vtkHigherOrderHexahedron.PointIndexFromIJK(*row, list(degrees)) for row in lattice.tolist()]
    assert numbers == list(range(len(lattice)))


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5, 6])
def test_tetrahedra_are_numbered_as_in_vtk(degree):
    cell, count = vtkLagrangeTetra(), node_count("tetra", degree)
    cell.GetPoints().SetNumberOfPoints(count)
    cell.GetPointIds().SetNumberOfIds(count)
    cell.Initialize()
    for number, row in enumerate(tetra(degree).lattice.tolist()):
        place = [0, 0, 0, 0]
        cell.ToBarycentricIndex(number, place)
        assert place[:3] == row


@pytest.mark.parametrize("kind", [hexahedron(2), SERENDIPITY, hexahedron(3), tetra(2), tetra(3)], ids=str)
def test_control_points_of_a_linear_function_are_its_values_at_greville_points(kind):
    values = [
        Fraction(int(row[0]), kind.degrees[0]) + 3 * Fraction(int(row[2]), kind.degrees[2]) for row in kind.lattice
    ]
    found = [sum(w * x for w, x in zip(row, values, strict=True)) for row in net_matrix(kind)]
    p = kind.degrees[0]
    expected = sorted(
        Fraction(int(i), p) + 3 * Fraction(int(k), p)
        for i, j, k in np.ndindex(p + 1, p + 1, p + 1)
        if kind.shape == "hexahedron" or i + j + k <= p
    )
    assert sorted(found) == expected


def test_names_are_those_of_meshio():
    assert kind_named("hexahedron20") == SERENDIPITY
    assert kind_named("hexahedron") == hexahedron(1) and kind_named("tetra20") == tetra(3)
    with pytest.raises(ValueError, match="wedge"):
        kind_named("wedge")
