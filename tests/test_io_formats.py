"""Every file is read back by a program that did not write it, at 50 random points."""

from __future__ import annotations

import json
import os
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from bodies import turned
from foreign_files import geopdes
from rational_shapes import bent_bar, octant, quarter_ring
from volumes import spans_at

from iga_nn.cli.commands import main
from iga_nn.errors import InputError
from iga_nn.io.beginnings import is_volume
from iga_nn.io.export import export
from iga_nn.io.formats import load_volume
from parameterize.spline.bernstein import binomials, elevation
from parameterize.spline.body import Body
from parameterize.spline.bspline import open_uniform_knots
from parameterize.spline.orientation import orientation
from parameterize.spline.volume import BSplineVolume
from solve import Poisson, solve_problem
from solve.field import SplineField
from solve.forms.frame import UnitFrame
from solve.study import benchmark_volume

POINTS = np.random.default_rng(7).random((50, 3))


def volume_of(degrees, knots):
    """Irregular control points: an order mistaken anywhere shows."""
    n = tuple(len(k) - p - 1 for k, p in zip(knots, degrees, strict=True))
    grid = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, m) for m in n], indexing="ij"), axis=-1)
    return BSplineVolume(degrees, knots, grid + 0.03 * np.random.default_rng(3).normal(size=grid.shape))


VOLUMES = {
    "cubic": volume_of((3, 3, 3), (open_uniform_knots(7, 3), open_uniform_knots(5, 3), open_uniform_knots(6, 3))),
    "mixed": volume_of(
        (2, 3, 1),
        (
            np.array([0, 0, 0, 0.2, 0.5, 0.5, 1, 1, 1]),
            open_uniform_knots(5, 3),
            np.array([0, 0, 0.3, 0.9, 1, 1]),
        ),
    ),
    "one span": volume_of((1, 2, 3), (open_uniform_knots(2, 1), open_uniform_knots(3, 2), open_uniform_knots(4, 3))),
}


@pytest.fixture(params=VOLUMES)
def volume(request, in_folder):
    """One of them, saved as volume.npz in the current folder."""
    VOLUMES[request.param].save("volume.npz")
    return VOLUMES[request.param]


def largest(difference):
    return float(np.abs(difference).max())


def mfem_point(*where):
    mfem = pytest.importorskip("mfem.ser")
    point = mfem.IntegrationPoint()
    (point.Set3 if len(where) == 3 else point.Set2)(*where)
    return point


def read_vtu(path):
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def cell_values(grid, volume, points, name=None):
    """VTK's own evaluation of its cells: places (m, 3), or the point data of that name (m, 1) or (m, 3)."""
    found = []
    for number, local in zip(*spans_at(volume, points), strict=True):
        cell = grid.GetCell(int(number))
        place, weights = [0.0] * 3, [0.0] * cell.GetNumberOfPoints()
        cell.EvaluateLocation(sys.modules["vtkmodules.vtkCommonCore"].reference(0), local.tolist(), place, weights)
        nodes = [cell.GetPointId(i) for i in range(len(weights))]
        held = None if name is None else [grid.GetPointData().GetArray(name).GetTuple(i) for i in nodes]
        found.append(place if held is None else np.dot(weights, held))
    return np.array(found)


def test_gismo_reads_its_xml(volume):
    pygismo = pytest.importorskip("pygismo")
    spline = pygismo.nurbs.gsTensorBSpline3()
    pygismo.io.gsFileData(str(export("volume.npz", "gismo"))).getId(100, spline)
    assert largest(spline.eval(POINTS.T).T - volume(POINTS)) < 1e-12


def test_mfem_reads_its_mesh(volume):
    mfem = pytest.importorskip("mfem.ser")
    mesh = mfem.Mesh(str(export("volume.npz", "mfem")), 1, 0)
    places = zip(*spans_at(volume, POINTS), strict=True)
    read = [np.array(mesh.GetElementTransformation(int(e)).Transform(mfem_point(*local))) for e, local in places]
    assert largest(np.array(read) - volume(POINTS)) < 1e-12
    assert mesh.GetNE() == np.prod([len(np.unique(k)) - 1 for k in volume.knots])


def test_mfem_knows_the_faces_by_their_attributes(volume):
    mfem = pytest.importorskip("mfem.ser")
    mesh = mfem.Mesh(str(export("volume.npz", "mfem")), 1, 0)
    faces = {1: (2, 0), 2: (2, 1), 3: (1, 0), 4: (0, 1), 5: (1, 1), 6: (0, 0)}  # axis, side
    corners = {number: [] for number in faces}
    for element in range(mesh.GetNBE()):
        shape = mesh.GetBdrElementTransformation(element)
        corners[mesh.GetBdrAttribute(element)] += [
            np.array(shape.Transform(mfem_point(s, t))) for s in (0, 1) for t in (0, 1)
        ]
    ends = np.indices((2, 2, 2)).reshape(3, 8).T
    for number, (axis, side) in faces.items():
        for place in volume(ends[ends[:, axis] == side]):
            assert np.linalg.norm(np.array(corners[number]) - place, axis=1).min() < 1e-12


def test_mfem_reads_a_solution_on_its_mesh(volume):
    mfem = pytest.importorskip("mfem.ser")
    solution = solve_problem(volume, Poisson(exact="x*y+z"), refine=1)
    solution.save("solution.npz")
    mesh = mfem.Mesh(str(export("volume.npz", "mfem", solution="solution.npz")), 1, 0)
    field = mfem.GridFunction(mesh, "volume.gf")
    read = []
    for element, local in zip(*spans_at(volume.refined(), POINTS), strict=True):
        read.append([*mesh.GetElementTransformation(int(element)).Transform(mfem_point(*local))])
        read[-1].append(field.GetValue(int(element), mfem_point(*local)))
    assert largest(np.array(read)[:, :3] - volume(POINTS)) < 1e-12
    assert largest(np.array(read)[:, 3] - solution(POINTS)) < 1e-12


def field_on(volume, components=()):
    """A solution on finer spans than the map's, saved as solution.npz: coefficients that no order repeats."""
    finer = volume.refined()
    coefficients = np.random.default_rng(5).normal(size=finer.shape + components)
    found = SplineField(finer.degrees, finer.knots, coefficients)
    found.save("solution.npz")
    return found


@pytest.fixture(params=["number", "displacement"])
def field(request, volume):
    return field_on(volume, (3,) if request.param == "displacement" else ())


def test_gismo_reads_a_solution_beside_the_volume(volume, field):
    pygismo = pytest.importorskip("pygismo")
    for path, known in (
        (export("volume.npz", "gismo", solution="solution.npz"), volume),
        (Path("volume_u.xml"), field),
    ):
        spline = pygismo.nurbs.gsTensorBSpline3()
        pygismo.io.gsFileData(str(path)).getId(100, spline)
        assert largest(spline.eval(POINTS.T).T - known(POINTS).reshape(50, -1)) < 1e-12


def test_splinepy_reads_a_solution_beside_the_volume(volume, field):
    splinepy = pytest.importorskip("splinepy")
    for path, known in ((export("volume.npz", "json", solution="solution.npz"), volume), ("volume_u.json", field)):
        (spline,) = splinepy.io.json.load(str(path))
        assert largest(spline.evaluate(POINTS) - known(POINTS).reshape(50, -1)) < 1e-12


def test_mfem_reads_displacements_on_its_mesh(volume, field):
    mfem = pytest.importorskip("mfem.ser")
    mesh = mfem.Mesh(str(export("volume.npz", "mfem", solution="solution.npz")), 1, 0)
    function, read = mfem.GridFunction(mesh, "volume.gf"), []
    for element, local in zip(*spans_at(volume.refined(), POINTS), strict=True):
        value = mfem.Vector()
        function.GetVectorValue(int(element), mfem_point(*local), value)
        read.append(value.GetDataArray().copy())
    assert largest(np.array(read) - field(POINTS).reshape(50, -1)) < 1e-12


def test_vtk_reads_displacements_in_its_cells(volume, field):
    grid = read_vtu(export("volume.npz", "vtk", solution="solution.npz"))
    values = cell_values(grid, volume.refined(), POINTS, "u")
    assert largest(values.reshape(50, -1) - field(POINTS).reshape(50, -1)) < 1e-12


def test_view_holds_displacements_and_the_length_of_their_error(volume):
    field = field_on(volume, (3,))
    Path("report.json").write_text(json.dumps({"schema": 1, "elasticity": {"exact": "x*y;0;sin(z)"}}))
    grid = read_vtu(export("volume.npz", "view", solution="solution.npz"))
    data = grid.GetPointData()
    x, y, z = np.array([grid.GetPoint(i) for i in range(grid.GetNumberOfPoints())]).T
    error = np.array(data.GetArray("u")) - np.stack([x * y, np.zeros_like(x), np.sin(z)], axis=1)
    assert largest(np.array(data.GetArray("error")) - np.linalg.norm(error, axis=1)) < 1e-12
    corner = int(np.argmin(np.linalg.norm(np.array([x, y, z]).T - volume([(1.0, 0.0, 1.0)]), axis=1)))
    assert largest(np.array(data.GetArray("u"))[corner] - field([(1.0, 0.0, 1.0)])) < 1e-12


def test_vtk_reads_its_bezier_cells(volume):
    grid = read_vtu(export("volume.npz", "vtk"))
    assert {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())} == {79}
    assert grid.GetCellData().GetHigherOrderDegrees().GetTuple(0) == volume.degrees
    assert grid.GetPointData().GetRationalWeights().GetRange() == (1.0, 1.0)
    assert largest(cell_values(grid, volume, POINTS) - volume(POINTS)) < 1e-12


@pytest.mark.parametrize("degree", [None, 2, 4])
def test_vtk_reads_a_solution_of_another_degree_on_finer_spans(degree, in_folder):
    volume = benchmark_volume(2)
    volume.save("volume.npz")
    solution = solve_problem(volume, Poisson(exact="x*y+z"), refine=1, degree=degree)
    solution.save("solution.npz")
    grid = read_vtu(export("volume.npz", "vtk", solution="solution.npz"))
    finer = volume.refined()
    assert largest(cell_values(grid, finer, POINTS) - volume(POINTS)) < 1e-12
    assert largest(cell_values(grid, finer, POINTS, "u")[:, 0] - solution(POINTS)) < 1e-12


def test_view_holds_the_spline_and_its_fields_at_its_nodes(volume):
    solution = solve_problem(volume, Poisson(exact="x*y+z*z"), refine=1)
    solution.save("solution.npz")
    Path("report.json").write_text(json.dumps({"schema": 1, "poisson": {"exact": "x*y+z*z"}}))
    grid = read_vtu(export("volume.npz", "view", solution="solution.npz"))
    axes = []
    for knots in solution.knots:
        breaks = np.unique(knots)
        axes.append(np.unique(np.concatenate([np.linspace(a, b, 4) for a, b in pairwise(breaks)])))
    where = np.stack([values.ravel(order="F") for values in np.meshgrid(*axes, indexing="ij")], axis=1)
    nodes = np.array([grid.GetPoint(i) for i in range(grid.GetNumberOfPoints())])
    fields = {
        grid.GetPointData().GetArrayName(i): np.array(grid.GetPointData().GetArray(i))
        for i in range(grid.GetPointData().GetNumberOfArrays())
    }
    assert {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())} == {12}
    assert largest(nodes - volume(where)) < 1e-12
    x, y, z = nodes.T
    assert largest(fields["u"] - solution(where)) < 1e-12
    assert largest(fields["error"] - np.abs(solution(where) - (x * y + z * z))) < 1e-12
    sigma = np.linalg.svd(volume.jacobian(where), compute_uv=False)
    assert largest(np.abs(fields["det J"]) - sigma.prod(axis=1)) < 1e-12
    upright = fields["det J"] > 0.0
    at_volume_1 = sigma / UnitFrame.of(volume).length
    assert largest(fields["arap"][upright] - ((at_volume_1 - 1.0) ** 2).sum(axis=1)[upright]) < 1e-10


def test_a_degree_raised_is_the_same_polynomial():
    t = np.linspace(0.0, 1.0, 9)
    bernstein = [
        binomials(q) * t[:, None] ** np.arange(q + 1) * (1 - t[:, None]) ** np.arange(q, -1, -1) for q in (2, 5)
    ]
    assert largest(bernstein[1] @ elevation(2, 5) - bernstein[0]) < 1e-14


@pytest.mark.parametrize("to", ["gismo", "mfem", "json"])
def test_what_was_exported_is_read_again(to, volume):
    pytest.importorskip("splinepy")
    again = load_volume(export("volume.npz", to))
    assert again.degrees == volume.degrees
    assert np.array_equal(again.control_points, volume.control_points)
    assert all(np.array_equal(a, b) for a, b in zip(again.knots, volume.knots, strict=True))


def test_a_mesh_that_mfem_wrote_is_read(volume):
    mfem = pytest.importorskip("mfem.ser")
    mfem.Mesh(str(export("volume.npz", "mfem")), 1, 0).Print("printed.mesh", 17)
    assert largest(load_volume("printed.mesh")(POINTS) - volume(POINTS)) < 1e-12


def test_xml_that_gismo_wrote_is_read(volume):
    pygismo = pytest.importorskip("pygismo")
    patches, written = pygismo.core.gsMultiPatch(), pygismo.io.gsFileData()
    pygismo.io.gsFileData(str(export("volume.npz", "gismo"))).getId(0, patches)
    written.setFloatPrecision(17)
    written.add(patches)
    written.save("written.xml")
    assert largest(load_volume("written.xml")(POINTS) - volume(POINTS)) < 1e-12


def test_knots_on_another_interval_are_brought_to_the_unit_cube(volume):
    splinepy = pytest.importorskip("splinepy")
    text = export("volume.npz", "json").read_text()
    content = json.loads(text)
    content["SplineList"][0]["knot_vectors"] = [
        [3.0 + 8.0 * t for t in k] for k in content["SplineList"][0]["knot_vectors"]
    ]
    Path("moved.json").write_text(json.dumps(content))
    original = splinepy.io.json.load("moved.json")[0]
    assert largest(load_volume("moved.json")(POINTS) - original.evaluate(3.0 + 8.0 * POINTS)) < 1e-12


def test_a_volume_from_elsewhere_is_checked_and_solved(in_folder, capsys):
    pytest.importorskip("splinepy")
    benchmark_volume(3).save("map.npz")
    for to in ("gismo", "mfem", "json"):
        assert main(["export", "map.npz", "--to", to, "--out", f"{to}{export_ending(to)}"]) == 0
        name = capsys.readouterr().out.strip()
        assert is_volume(name)
        assert main(["check", name]) == 0
        assert "certified" in capsys.readouterr().out
    for name in ("gismo.xml", "map.npz"):
        assert main(["solve", "poisson", name, "--refine", "0", "--source", "x", "--boundary", "y", "--quiet"]) == 0
    ours, foreign = (SplineField.load(f"{folder}/solution.npz") for folder in ("map", "gismo"))
    assert largest(ours.coefficients - foreign.coefficients) < 1e-12


def test_a_solution_of_another_volume_with_the_same_knots_is_refused(in_folder, capsys):
    benchmark_volume(3).save("map.npz")
    assert main(["solve", "poisson", "map.npz", "--refine", "0", "1", "--quiet"]) == 0
    benchmark_volume(3).transformed(2.0, (0.0, 0.0, 0.0)).save("other.npz")
    capsys.readouterr()
    assert main(["export", "other.npz", "--to", "vtk", "--solution", "map/solution.npz"]) == 2
    assert "belongs to another volume: the longest edge" in capsys.readouterr().err
    assert main(["export", "map.npz", "--to", "vtk", "--solution", "map/solution.npz"]) == 0
    Path("map/report.json").write_text('{"schema": 1, "poisson": {"levels": [{"dofs": 1}]}}')  # nothing to compare with
    assert main(["export", "other.npz", "--to", "vtk", "--solution", "map/solution.npz"]) == 0


def export_ending(to):
    return {"gismo": ".xml", "mfem": ".mesh", "json": ".json", "geopdes": ".txt"}[to]


def edited(to, old, new, count=1):
    """The text of a file of a cube with something replaced."""
    cube = BSplineVolume.uniform(np.stack(np.indices((2, 2, 2)), axis=-1), degree=1)
    if to == "geopdes":
        text = geopdes(Body((cube,)))
    else:
        cube.save("cube.npz")
        text = export("cube.npz", to, force=True).read_text()
    assert old in text
    return text.replace(old, new, count)


BOMB = '<!DOCTYPE xml [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><xml>'


@pytest.mark.parametrize(
    ("to", "old", "new", "says"),
    [
        ("gismo", "<xml>", BOMB, "entities are not expanded"),
        ("gismo", "</xml>", "", "not well-formed"),
        ("gismo", ">100 100<", ">100 101<", "names Geometry 100 to 101; the file holds 1 of them"),
        ("gismo", 'id_range">100 100<', 'id_index">100 7<', "names Geometry 7, which the file does not hold"),
        ("gismo", "<interfaces />", "<interfaces>100 1 100 2</interfaces>", "p0_u0 = p0_u1: the file says that they"),
        ("gismo", "<interfaces />", "<interfaces>100 1 100 7</interfaces>", "names no patch and side: 100 7"),
        ("gismo", "<interfaces />", "<interfaces>100 1</interfaces>", "names no patch and side"),
        ("gismo", "TensorBSpline3", "TensorBSpline2", "TensorBSpline2; a volume is"),
        ("gismo", "TensorBSplineBasis3", "TensorBSplineBasis999999999", "TensorBSplineBasis999999999"),
        ("gismo", 'degree="1"', 'degree="900000000"', "Geometry 100: has 8 control points; degrees and knots ask for"),
        ("gismo", 'degree="1"', 'degree="0"', "Geometry 100: has the degree 0"),
        ("gismo", "0.0 0.0 1.0 1.0", "0.0 0.0 1.0", "ask for 1 x 2 x 2"),
        ("gismo", "0.0 0.0 1.0 1.0", "0.0 0.1 0.9 1.0", "open"),
        ("gismo", "0.0 0.0 1.0 1.0", "2.0 2.0 2.0 2.0", "span an interval"),
        ("gismo", "0.0 0.0 0.0", "0.0 nan 0.0", "control points must be finite, got 'nan'"),
        ("gismo", "0.0 0.0 0.0", "0.0 1/0 0.0", "must be finite, got '1/0'"),
        ("gismo", "0.0 0.0 0.0", "0.0 0.0", "three numbers each"),
        ("gismo", 'geoDim="3"', 'geoDim="2"', "coefs of geoDim 3"),
        ("gismo", 'geoDim="3"', 'geoDim="3" format="B64Float64"', "B64Float64: save the file with the format ASCII"),
        ("mfem", "weights\n1.0", "weights\n0.0", "patch 0: weights must be positive"),
        ("mfem", "weights\n1.0", "weights\n1e999", "line 51: weights must be finite, got '1e999'"),
        ("mfem", "weights" + 8 * "\n1.0", "weights" + 8 * "\n-1.0", "patch 0: weights must be positive"),
        ("mfem", "elements\n1\n", "elements\n2\n1 5 8 9 10 11 12 13 14 15\n", "names vertex 15, and there are 8"),
        ("mfem", "1 5 0 1 2 3", "1 5 0 2 1 3", "element 0: has no edge between the vertices 0 and 2"),
        ("mfem", "1 5 0 1 2 3", "1 5 0 1 1 3", "element 0 has a vertex twice"),
        ("mfem", "1 5 0 1 2 3", "1 4 0 1 2 3", "line 8: an element has the geometry 4; of volumes it is 5"),
        ("mfem", "0 2 3", "1 2 3", "element 0: its edges in one direction have"),
        ("mfem", "0 2 3", "5 2 3", "names knot vector 5, and there are 3"),
        ("mfem", "dimension\n3", "dimension\n2", "line 4: maps 2 parameters"),
        ("mfem", "knotvectors", "patches\n\nknotvectors", "dimension must follow, got 'weights'"),
        ("mfem", "knotvectors", "periodic\n1 1\nknotvectors", "must follow, got 'periodic'"),
        ("mfem", "weights", "periodic\n1 1\n1 2\n\nweights", "weights must follow, got 'periodic', which is not read"),
        ("mfem", "weights", "mesh_elements\n1\n0\n\nweights", "got 'mesh_elements', which is not read"),
        ("mfem", "v1.0", "v7.0", "MFEM NURBS mesh v7.0"),
        ("mfem", "NURBS mesh", "NURBS NC-patch mesh", "is a 'MFEM NURBS NC-patch mesh v1.0'"),
        ("mfem", "edges\n12", "edges\n13\n0 1 0", "lists an edge twice"),
        ("mfem", "VDim: 3", "NURBS_orders: 1\nVDim: 3", "have a property that is not read: NURBS_orders"),
        ("mfem", "Collection: NURBS", "Collection: H1_3D_P1", "must be those of a FiniteElementCollection NURBS"),
        ("mfem", "weights\n1.0", "weights\n(1.0)*9**9**9", "weights must be numbers, got '(1.0)*9**9**9'"),
        ("mfem", "Ordering: 1", "Ordering: 7", "Ordering of 0 or 1"),
        ("mfem", "1 2 0.0", "1 99999999999 0.0", "ends before knots"),
        ("mfem", "1 2 0.0", "0 2 0.0", "the degree must be 1 to 1"),
        ("geopdes", " 3 3 1", " 2 2 1", "line 5: maps 2 parameters to 2 coordinates"),
        ("geopdes", " 3 3 1", " 3 3 9", "patch 2"),
        ("geopdes", " 3 3 1", " 3 3 0", "holds no patch"),
        ("geopdes", "1 1 1", "1 1", "line 7: the degrees of patch 1 must be 3 numbers in one row, got 2"),
        ("geopdes", "1 1 1", "1 1 0", "line 11: the knots of patch 1 in w must be 3 numbers in one row, got 4"),
        ("geopdes", "1 1 1", "1 1 -1", "must be a whole number, got '-1'"),
        ("geopdes", " 1.0\nSUB", " 0.0\nSUB", "patch 1: weights must be positive"),
        ("geopdes", "0.0 0.0 1.0 1.0", "0.0 0.1 0.9 1.0", "patch 1: the knot vector is not open"),
        ("geopdes", "0.0 0.0 1.0 1.0", "0.0 nan 1.0 1.0", "line 9: the knots of patch 1 in u must be finite"),
        ("json", '"SplineList": [', '"SplineList": [1, ', "as splinepy writes it"),
        ("json", '"para_dim": 3', '"para_dim": 2', "3 parameters"),
        ("json", '"SplineList"', '"Other"', "as splinepy writes it"),
        ("json", "{", "{" + "[" * 100_000, "as splinepy writes it"),
        ("json", '"SplineType": "BSpline"', '"SplineType": "NoSuch"', "splinepy finds no spline in it"),
        ("json", '"degrees"', '"degree"', "splinepy finds no spline in it"),
    ],
)  # fmt: skip
def test_files_that_are_no_volume_are_refused_in_one_line(to, old, new, says, in_folder, capsys):
    if to == "json":
        pytest.importorskip("splinepy")
    Path("bad" + export_ending(to)).write_text(edited(to, old, new))
    before = set(Path().iterdir())
    assert main(["solve", "poisson", "bad" + export_ending(to)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"iga-nn: bad{export_ending(to)}: ") and says in line and len(line) < 400
    assert set(Path().iterdir()) == before


@pytest.mark.parametrize("to", ["gismo", "mfem", "json"])
@pytest.mark.parametrize("rational", [quarter_ring(), octant(), bent_bar()], ids=["ring", "octant", "bar"])
def test_rational_volumes_are_written_and_read(to, rational, in_folder):
    if to == "json":
        pytest.importorskip("splinepy")
    rational.save("rational.npz")
    again = load_volume(export("rational.npz", to))
    if to == "mfem" and orientation(rational) < 0:
        rational = turned(rational, back=(False, False, True))
    assert np.array_equal(again.weights, rational.weights)
    exact = 1e-15 if to == "json" else 0.0  # splinepy keeps homogeneous coordinates
    assert largest(again.control_points - rational.control_points) <= exact


def test_other_programs_read_rational_volumes(in_folder):
    pygismo, mfem = pytest.importorskip("pygismo"), pytest.importorskip("mfem.ser")
    rational = quarter_ring()
    rational.save("ring.npz")
    patches = pygismo.core.gsMultiPatch()
    pygismo.io.gsFileData(str(export("ring.npz", "gismo"))).getId(0, patches)
    assert largest(patches.patch(0).eval(POINTS.T).T - rational(POINTS)) < 1e-12
    mesh = mfem.Mesh(str(export("ring.npz", "mfem")), 1, 0)
    places = zip(*spans_at(rational, POINTS), strict=True)
    read = [np.array(mesh.GetElementTransformation(int(e)).Transform(mfem_point(*local))) for e, local in places]
    assert largest(np.array(read) - rational(POINTS)) < 1e-12


def test_weights_that_are_alike_are_left_out(in_folder):
    splinepy = pytest.importorskip("splinepy")
    splinepy.io.json.export("box.json", [splinepy.helpme.create.box(1, 2, 3).nurbs])
    box = load_volume("box.json")
    assert box.weights is None and box([[0.5, 0.5, 0.5]]) == pytest.approx(np.array([[0.5, 1.0, 1.5]]))
    bent = splinepy.helpme.create.disk(1.0).create.extruded([0, 0, 1])
    for name in ("json", "gismo"):
        getattr(splinepy.io, name).export(f"bent.{name}", [bent])
        body = load_volume(f"bent.{name}")  # a full disk: its first and last angle are one face
        assert [str(interface) for interface in body.interfaces] == ["p0_v0 = p0_v1"]
        lower, upper = bent.parametric_bounds  # the angle runs from 0 to 4
        assert largest(body.patches[0](POINTS) - bent.evaluate(lower + POINTS * (upper - lower))) < 1e-14


def test_a_huge_file_is_refused_before_it_is_read(in_folder):
    with Path("huge.xml").open("wb") as stream:
        stream.write(b"<xml>")
        stream.truncate(1 << 40)
    with pytest.raises(InputError, match="huge.xml: has 1099511627776 bytes, more than"):
        load_volume("huge.xml")


def test_without_splinepy_the_way_to_install_it_is_said(in_folder, monkeypatch, capsys):
    benchmark_volume(2).save("map.npz")
    Path("foreign.json").write_text("{}")
    monkeypatch.setitem(sys.modules, "splinepy", None)
    for arguments in (["export", "map.npz", "--to", "json"], ["solve", "poisson", "foreign.json"]):
        assert main(arguments) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "pip install 'iga-nn[interop]'" in line
    assert {path.name for path in Path().iterdir()} == {"map.npz", "foreign.json"}
    assert main(["export", "map.npz", "--to", "vtk"]) == 0  # the others need no splinepy
    assert main(["check", str(export("map.npz", "gismo"))]) == 0


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["map.npz", "--to", "stl"], "'stl': choose one of gismo, mfem, vtk, view, json, calculix"),
        (["missing.npz", "--to", "vtk"], "missing.npz: no such file"),
        (
            ["words.txt", "--to", "vtk"],
            "is not a spline volume; create one with `iga-nn run poisson words.txt`",
        ),
        ([".", "--to", "vtk"], "is a folder: name the volume.npz in it"),
        (["map.npz", "--to", "vtk", "--out", "."], "is a directory"),
        (["map.npz", "--to", "vtk", "--out", "map.vtk"], "files end in .vtu"),
        (["map.npz", "--to", "vtk", "--out", "no/such/map.vtu"], "no folder"),
        (["map.npz", "--to", "vtk", "--out", "here.vtu"], "--force"),
        (["map.npz", "--to", "json", "--solution", "solution.npz"], "solution.npz: no such file"),
        (["map.npz", "--to", "gismo", "--solution", "raised.npz", "--out", "here.xml"], "here_u.xml: exists; --force"),
        (["map.npz", "--to", "mfem", "--solution", "raised.npz"], "this one has (4, 4, 4)"),
        (["map.npz", "--to", "vtk", "--solution", "map.npz"], "no array named coefficients; it holds control_points,"),
        (["map.npz", "--to", "view", "--solution", "other.npz"], "another volume"),
    ],
)
def test_bad_requests_are_one_line(arguments, says, in_folder, capsys):
    benchmark_volume(2).save("map.npz")
    Path("words.txt").write_text("once upon a time\n")
    for name in ("here.vtu", "here_u.xml"):
        Path(name).write_text("mine\n")
    solve_problem(benchmark_volume(3), Poisson(exact="x")).save("other.npz")
    solve_problem(benchmark_volume(2), Poisson(exact="x"), degree=4).save("raised.npz")
    before = set(Path().iterdir())
    assert main(["export", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("iga-nn:") and says in line
    assert set(Path().iterdir()) == before and Path("here.vtu").read_text() == "mine\n"


def test_force_replaces(in_folder):
    benchmark_volume(2).save("map.npz")
    Path("map_bezier.vtu").write_text("old")
    assert main(["export", "map.npz", "--to", "vtk", "--force"]) == 0
    assert read_vtu("map_bezier.vtu").GetNumberOfCells() == 8


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
@pytest.mark.parametrize("to", ["gismo", "mfem", "vtk", "view", "json"])
def test_a_full_disk_is_one_line_and_leaves_the_old_file(to, in_folder, capsys):
    import resource

    if to == "json":
        pytest.importorskip("splinepy")
    benchmark_volume(6).save("map.npz")
    target = export("map.npz", to)
    before = {path: path.read_bytes() for path in Path().iterdir()}
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        assert main(["export", "map.npz", "--to", to, "--force"]) == 2
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"iga-nn: {target}: cannot be written (File too large)")
    assert {path: path.read_bytes() for path in Path().iterdir()} == before
