"""Tests solutions on several patches as MFEM reads them, from the mesh and the grid function beside it."""

import numpy as np
import pytest
from bodies import ring, turned

from iga_nn.io.mfem_writer import write_mfem, write_mfem_field
from parameterize.spline.body import Body
from solve import Elasticity, Poisson, solve_problem

mfem = pytest.importorskip("mfem.ser")


TURNS = [((0, 1, 2), (False,) * 3), ((1, 2, 0), (True, False, False)), ((1, 0, 2), (False, True, False))]  # one left


def turned_ring():
    """Return a ring of three patches whose parameters run in other ways."""
    patches = ring(3, shape=(4, 3, 3), degrees=(2, 2, 2)).patches
    return Body.from_patches([turned(patch, *turn) for patch, turn in zip(patches, TURNS, strict=True)])


def read(folder, solution, body):
    """Return MFEM's mesh and grid function of a solution."""
    write_mfem(folder / "body.mesh", body, solution)
    write_mfem_field(folder / "body.gf", solution, body)
    mesh = mfem.Mesh(str(folder / "body.mesh"), 1, 0)
    return mesh, mfem.GridFunction(mesh, str(folder / "body.gf"))


def points_and_values(mesh, field, components):
    """Return points (m, 3) in elements, and the field's values (m, c) there."""
    points, values = [], []
    for element in range(mesh.GetNE()):
        for where in ((0.5, 0.5, 0.5), (0.1, 0.7, 0.2)):
            point = mfem.IntegrationPoint()
            point.Set3(*where)
            points.append([*mesh.GetElementTransformation(element).Transform(point)])
            value = mfem.Vector(components)
            if components == 1:
                values.append([field.GetValue(element, point)])
            else:
                field.GetVectorValue(element, point, value)
                values.append(value.GetDataArray().copy())
    return np.array(points), np.array(values)


@pytest.mark.parametrize("refine", [0, 2])
def test_mfem_has_the_values_of_a_solution_on_several_patches(tmp_path, refine):
    body = turned_ring()
    solution = solve_problem(body, Poisson(exact="exp(x+z)*sin(y)"), refine=refine)
    points, values = points_and_values(*read(tmp_path, solution.field, body), 1)
    assert solution.probe(points, clip=True) == pytest.approx(values[:, 0], abs=1e-10)


def test_mfem_has_the_values_of_a_displacement_on_several_patches(tmp_path):
    body = turned_ring()
    solution = solve_problem(body, Elasticity(exact=("x*y", "z*z", "y")), refine=0)
    points, values = points_and_values(*read(tmp_path, solution.field, body), 3)
    assert solution.probe(points, clip=True) == pytest.approx(values, abs=1e-10)
