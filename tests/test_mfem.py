"""The same problems on the same spline space by MFEM, from the exported mesh: an independent program."""

import numpy as np
import pytest
from volumes import spans_at

from iga_nn.io.mfem_writer import write_mfem, write_mfem_field
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve import Poisson, benchmark_volume, solve_problem

mfem = pytest.importorskip("mfem.ser")

POINTS = np.random.default_rng(0).random((200, 3))


class Scalar(mfem.PyCoefficient):
    def __init__(self, function):
        super().__init__()
        self.function = function

    def EvalValue(self, x):
        return self.function(*x)


class Vector(mfem.VectorPyCoefficient):
    def __init__(self, function):
        super().__init__(3)
        self.function = function

    def EvalValue(self, x):
        return list(self.function(*x))


class MfemPoisson:
    """-Laplace u = f in the space of an exported volume."""

    def __init__(self, volume, folder):
        self.volume = volume
        write_mfem(folder / "volume.mesh", volume)
        self.mesh = mfem.Mesh(str(folder / "volume.mesh"), 1, 0)
        self.space = mfem.FiniteElementSpace(self.mesh, self.mesh.GetNodes().OwnFEC())
        self.form, self.load = mfem.BilinearForm(self.space), mfem.LinearForm(self.space)
        self.form.AddDomainIntegrator(mfem.DiffusionIntegrator())

    def solve(self, fixed):
        """The solution; `fixed`: whether it is zero on the boundary."""
        self.form.Assemble()
        self.load.Assemble()
        self.solution = mfem.GridFunction(self.space)
        self.solution.Assign(0.0)
        dofs = mfem.intArray()
        if fixed:
            self.space.GetEssentialTrueDofs(mfem.intArray([1] * self.mesh.bdr_attributes.Max()), dofs)
        matrix, right, x = mfem.OperatorPtr(), mfem.Vector(), mfem.Vector()
        self.form.FormLinearSystem(dofs, self.solution, self.load, matrix, x, right)
        sparse = mfem.OperatorHandle2SparseMatrix(matrix)
        mfem.PCG(sparse, mfem.GSSmoother(sparse), right, x, 0, 3000, 1e-24, 0.0)
        self.form.RecoverFEMSolution(x, self.load, self.solution)

    def values(self, points):
        found = []
        for element, where in zip(*spans_at(self.volume, points), strict=True):
            point = mfem.IntegrationPoint()
            point.Set3(*(float(c) for c in where))
            found.append(self.solution.GetValue(int(element), point))
        return np.array(found)


def compare_robin(volume, folder):
    """Robin's condition with alpha = 1 on all faces, u = exp(x+z) sin(y): both solutions, and MFEM's L2 error."""
    value = Scalar(lambda x, y, z: np.exp(x + z) * np.sin(y))
    source = Scalar(lambda x, y, z: -np.exp(x + z) * np.sin(y))
    slope = Vector(lambda x, y, z: np.exp(x + z) * np.array([np.sin(y), np.cos(y), np.sin(y)]))
    theirs = MfemPoisson(volume, folder)
    one = mfem.ConstantCoefficient(1.0)
    theirs.form.AddBoundaryIntegrator(mfem.BoundaryMassIntegrator(one))
    theirs.load.AddDomainIntegrator(mfem.DomainLFIntegrator(source, 2, 2))
    theirs.load.AddBoundaryIntegrator(mfem.BoundaryNormalLFIntegrator(slope, 2, 2))
    theirs.load.AddBoundaryIntegrator(mfem.BoundaryLFIntegrator(value, 2, 2))
    theirs.solve(fixed=False)
    robin = dict.fromkeys(FACE_NAMES, ("1", None))
    ours = solve_problem(volume, Poisson(exact="exp(x+z)*sin(y)", robin=robin), tolerance=1e-12)
    return ours, theirs, theirs.solution.ComputeL2Error(value)


def test_robin_problem_agrees(tmp_path):
    ours, theirs, l2 = compare_robin(benchmark_volume(4), tmp_path)
    assert ours.report.l2 == pytest.approx(l2, rel=0.02)
    assert np.abs(ours(POINTS) - theirs.values(POINTS)).max() < 0.2 * l2


def test_a_left_handed_volume_is_turned_for_mfem(tmp_path, caplog):
    """MFEM takes det J for the weight of its integrals: the mesh has w reversed, and a notice says so."""
    volume = benchmark_volume(4)
    left = BSplineVolume(volume.degrees, volume.knots, volume.control_points[::-1] * [1.0, 1.0, 1.2])
    ours, theirs, l2 = compare_robin(left, tmp_path)
    assert "left-handed" in caplog.text and "w reversed" in caplog.text
    assert ours.report.l2 == pytest.approx(l2, rel=0.02)
    there = POINTS * [1.0, 1.0, -1.0] + [0.0, 0.0, 1.0]
    assert np.abs(ours(POINTS) - theirs.values(there)).max() < 0.2 * l2
    write_mfem_field(tmp_path / "u.gf", ours.field, left)
    read = mfem.GridFunction(theirs.mesh, str(tmp_path / "u.gf"))
    theirs.solution.Assign(read)
    assert np.abs(ours(POINTS) - theirs.values(there)).max() < 1e-12


def test_dirichlet_problem_agrees(tmp_path):
    volume = benchmark_volume(4)
    theirs, one = MfemPoisson(volume, tmp_path), mfem.ConstantCoefficient(1.0)
    theirs.load.AddDomainIntegrator(mfem.DomainLFIntegrator(one))
    theirs.solve(fixed=True)
    found = solve_problem(volume, Poisson(source="1"), tolerance=1e-12)(POINTS)
    assert np.abs(found - theirs.values(POINTS)).max() < 1e-2 * np.abs(found).max()
