"""Files of VTK's own writers in every encoding, and cells of every type, against volumes known by hand or by VTK."""

import numpy as np
import pytest
import pyvista
from mesh_files import CUBE, QUADS, TRIANGLES
from reader_files import grid, save
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

from iga_nn.io.vtk import write_bezier
from parameterize.spline.volume import BSplineVolume
from parameterize.surface.readers.vtu import _name
from parameterize.surface.surface import MeshError, load_surface

STRIPS = [[1, 0, 3, 2], [4, 5, 6, 7], [0, 1, 4, 5], [3, 2, 7, 6], [0, 4, 2, 6], [1, 3, 5, 7]]  # outward, two triangles
BOX = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], dtype=float)
TYPES = pyvista.CellType


def ellipsoid():
    """One of the size of its point data, among which one array has the places of another ellipsoid."""
    ball = pyvista.Icosphere(radius=1.0, nsub=1)
    mesh = grid([(TYPES.TRIANGLE, face) for face in ball.regular_faces], ball.points * [3.0, 2.0, 1.0])
    mesh.point_data["temperature"] = np.full(len(ball.points), 20.0)
    mesh.point_data["earlier_place"] = ball.points
    mesh.cell_data["number"] = np.arange(mesh.n_cells)
    return mesh, 6.0 * ball.volume


MODES = [("ascii", False), ("binary", False), ("appended", False), ("appended", True)]
# Bits of the header, order of bytes, bytes of a block: each pair of these is together once.
LAYOUTS = [(32, "little", 1 << 15), (32, "big", 1 << 8), (64, "little", 1 << 8), (64, "big", 1 << 15)]


@pytest.mark.parametrize("compressor", [None, "ZLib", "LZ4", "LZMA"])
@pytest.mark.parametrize(("mode", "encoded"), MODES)
def test_every_encoding_gives_the_same_surface(mode, encoded, compressor, tmp_path):
    mesh, volume = ellipsoid()
    for header, order, block in LAYOUTS:
        path = save(mesh, tmp_path / "body.vtu", mode, compressor, header, order, block, encoded)
        surface = load_surface(path)
        assert surface.volume == pytest.approx(volume, rel=1e-6), (header, order, block)
        assert len(surface.faces) == mesh.n_cells and surface.notices == ()


@pytest.mark.parametrize("points", [np.float32, np.float64])
@pytest.mark.parametrize("wide", [False, True])
def test_integers_and_points_of_either_width_are_read(points, wide, tmp_path):
    mesh, volume = ellipsoid()
    mesh.points = mesh.points.astype(points)
    cells = mesh.GetCells()
    assert cells.ConvertTo64BitStorage() if wide else cells.ConvertTo32BitStorage()
    assert load_surface(save(mesh, tmp_path / "body.vtu")).volume == pytest.approx(volume, rel=1e-6)


TETS = [[0, 1, 4, 10], [0, 4, 3, 10], [0, 3, 9, 10], [0, 9, 6, 10], [0, 6, 7, 10], [0, 7, 1, 10]]  # the box's half
VOXEL = [1, 2, 4, 5, 7, 8, 10, 11]
HEXAHEDRON = [1, 2, 5, 4, 7, 8, 11, 10]
HEXAGON = [[2, 0], [1, 2], [-1, 2], [-2, 0], [-1, -2], [1, -2]]  # area 12
PENTAGON = [[2, 0], [1, 2], [-1, 2], [-1, -2], [1, -2]]  # area 10
PRISM = [[x, y, z] for z in (0, 3) for x, y in ([0, 0], [2, 0], [0, 2])]


def prism(outline, height):
    return [[x, y, z] for z in (0, height) for x, y in outline]


SOLIDS = {
    "voxel": ([(TYPES.VOXEL, range(8))], CUBE, 1.0),
    "hexahedron": ([(TYPES.HEXAHEDRON, [0, 1, 3, 2, 4, 5, 7, 6])], CUBE, 1.0),
    "collapsed to a wedge": ([(TYPES.HEXAHEDRON, [0, 1, 3, 3, 4, 5, 7, 7])], CUBE, 0.5),
    "wedge": ([(TYPES.WEDGE, range(6))], PRISM, 6.0),
    "wedge, inside out": ([(TYPES.WEDGE, [3, 4, 5, 0, 1, 2])], PRISM, 6.0),
    "pyramid": ([(TYPES.PYRAMID, [0, 1, 3, 2, 7])], CUBE, 1.0 / 3.0),
    "two tetrahedra": ([(TYPES.TETRA, [0, 1, 2, 4]), (TYPES.TETRA, [1, 2, 4, 7])], CUBE, 0.5),
    "the same twice": ([(TYPES.TETRA, [0, 1, 2, 4]), (TYPES.TETRA, [1, 2, 0, 4])], CUBE, 1.0 / 6.0),
    "hexagonal prism": ([(TYPES.HEXAGONAL_PRISM, range(12))], prism(HEXAGON, 2), 24.0),
    "pentagonal prism": ([(TYPES.PENTAGONAL_PRISM, range(10))], prism(PENTAGON, 2), 20.0),
    "tetrahedra and voxel": ([*((TYPES.TETRA, tet) for tet in TETS), (TYPES.VOXEL, VOXEL)], BOX, 2.0),
    "tetrahedra and hexahedron": ([*((TYPES.TETRA, tet) for tet in TETS), (TYPES.HEXAHEDRON, HEXAHEDRON)], BOX, 2.0),
    "voxel and pyramid": ([(TYPES.VOXEL, VOXEL), (TYPES.PYRAMID, [1, 4, 10, 7, 12])], [*BOX, [0.5, 0.5, 0.5]], 7 / 6),
    "voxel and its faces": ([(TYPES.VOXEL, range(8)), *((TYPES.TRIANGLE, t) for t in TRIANGLES)], CUBE, 1.0),
    "tetrahedra and a quad on them": (
        [*((TYPES.TETRA, tet) for tet in TETS), (TYPES.QUAD, [1, 4, 10, 7]), (TYPES.QUAD, [0, 3, 9, 6])],
        BOX,
        1.0,
    ),
    "quads": ([(TYPES.QUAD, quad) for quad in QUADS], CUBE, 1.0),
    "pixels": ([(TYPES.PIXEL, np.array(quad)[[0, 1, 3, 2]]) for quad in QUADS], CUBE, 1.0),
    "polygons": ([(TYPES.POLYGON, quad) for quad in QUADS], CUBE, 1.0),
    "strips": ([(TYPES.TRIANGLE_STRIP, strip) for strip in STRIPS], CUBE, 1.0),
    "one strip and triangles": (
        [
            (TYPES.TRIANGLE_STRIP, [0, 1, 4, 5, 6, 7, 2, 3, 0, 1]),
            *((TYPES.TRIANGLE, TRIANGLES[i]) for i in range(8, 12)),
        ],
        CUBE,
        1.0,
    ),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_cells_of_every_linear_type_have_their_volume(name, tmp_path):
    cells, points, volume = SOLIDS[name]
    surface = load_surface(save(grid(cells, points), tmp_path / "body.vtu"))
    assert surface.volume == pytest.approx(volume, rel=1e-9)
    assert not any("winding" in line or "inverted" in line for line in surface.notices), surface.notices


def test_solids_of_many_cells_have_the_volume_that_vtk_says(tmp_path):
    cube = pyvista.ImageData(dimensions=(5, 4, 3)).cast_to_unstructured_grid()
    for mesh in (cube, cube.triangulate(), pyvista.StructuredGrid(*np.mgrid[0:3, 0:4, 0:2] * 1.5)):
        mesh = pyvista.UnstructuredGrid(mesh)
        surface = load_surface(save(mesh, tmp_path / "body.vtu"))
        assert surface.volume == pytest.approx(mesh.volume, rel=1e-6)


def shifted(cells, count):
    return [(kind, np.array(corners) + count) for kind, corners in cells]


@pytest.mark.parametrize("name", ["strips", "pixels", "polygons", "voxel", "quads"])
@pytest.mark.parametrize("first", ["quads", "voxel", "two tetrahedra"])
def test_a_second_body_of_any_cells_is_counted(first, name, tmp_path):
    one, other = SOLIDS[first], SOLIDS[name]
    mesh = grid([*one[0], *shifted(other[0], 8)], np.vstack([one[1], np.array(other[1]) + [3, 0, 0]]))
    assert len(load_surface(save(mesh, tmp_path / "body.vtu")).solids) == 2


REFUSED = {
    "quadratic_triangle": (TYPES.QUADRATIC_TRIANGLE, 6),
    "quadratic_polygon": (TYPES.QUADRATIC_POLYGON, 8),
    "quadratic_tetra": (TYPES.QUADRATIC_TETRA, 10),
    "quadratic_linear_quad": (TYPES.QUADRATIC_LINEAR_QUAD, 6),
    "bezier_triangle": (TYPES.BEZIER_TRIANGLE, 6),
    "bezier_quadrilateral": (TYPES.BEZIER_QUADRILATERAL, 9),
    "lagrange_tetrahedron": (TYPES.LAGRANGE_TETRAHEDRON, 10),
    "triquadratic_hexahedron": (TYPES.TRIQUADRATIC_HEXAHEDRON, 27),
    "convex_point_set": (TYPES.CONVEX_POINT_SET, 7),
}


@pytest.mark.parametrize("name", REFUSED)
def test_cells_that_are_not_read_are_named(name, tmp_path):
    kind, size = REFUSED[name]
    points = np.random.default_rng(0).normal(size=(8 + size, 3))
    mesh = grid([*SOLIDS["voxel"][0], (kind, np.arange(8, 8 + size))], points)
    with pytest.raises(MeshError, match=f"holds 1 cells of type {name}: save linear cells"):
        load_surface(save(mesh, tmp_path / "body.vtu"))


def test_points_and_lines_are_left_out_with_a_notice(tmp_path):
    cells = [(TYPES.VERTEX, [0]), (TYPES.POLY_VERTEX, [1, 2, 3]), (TYPES.LINE, [0, 1]), (TYPES.POLY_LINE, [0, 1, 2])]
    cells += [(TYPES.QUADRATIC_EDGE, [0, 1, 2]), (TYPES.LAGRANGE_CURVE, [0, 1, 2])]
    surface = load_surface(save(grid([*SOLIDS["quads"][0], *cells]), tmp_path / "body.vtu"))
    assert surface.volume == pytest.approx(1.0)
    said = "left out cells without area: 1 vertex, 1 poly_vertex, 1 line, 2 poly_line, 1 line3"
    assert surface.notices[0] == said


def test_overlapping_cells_are_refused(tmp_path):
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3]]
    mesh = grid([(TYPES.TETRA, [0, 1, 2, k]) for k in (3, 4, 5)], points)
    with pytest.raises(MeshError, match="1 faces have more than two cells: cells overlap"):
        load_surface(save(mesh, tmp_path / "body.vtu"))


def pieces(path, meshes):
    """A file of several pieces, each as VTK writes it, in text."""
    texts = []
    for mesh in meshes:
        text = save(mesh, path, "ascii").read_text()
        texts.append(text[text.index("<Piece") : text.index("</UnstructuredGrid>")])
        head, end = text[: text.index("<Piece")], text[text.index("</UnstructuredGrid>") :]
    path.write_text(head + "".join(texts) + end)
    return path


def test_pieces_are_joined_where_they_touch(tmp_path):
    """Two voxels, each with points of its own; the second piece holds the first one's voxel, too, as a ghost."""
    points = CUBE + [1, 0, 0]
    both = np.vstack([CUBE, points])
    first, second = grid([(TYPES.VOXEL, range(8))]), grid([(TYPES.VOXEL, range(8))], points)
    surface = load_surface(pieces(tmp_path / "body.vtu", [first, second]))
    assert surface.volume == pytest.approx(2.0) and "2 pieces joined" in surface.notices
    ghost = grid([(TYPES.VOXEL, range(8, 16)), (TYPES.VOXEL, range(8))], both)
    surface = load_surface(pieces(tmp_path / "body.vtu", [first, ghost]))
    assert surface.volume == pytest.approx(2.0)
    assert "left out 1 cells that are given twice" in surface.notices
    halves = [grid(SOLIDS["quads"][0][:3]), grid(SOLIDS["quads"][0][3:])]
    assert load_surface(pieces(tmp_path / "body.vtu", halves)).volume == pytest.approx(1.0)
    wrong = pieces(tmp_path / "body.vtu", halves).read_text().replace("0 2 3 1", "0 2 3 99", 1)
    (tmp_path / "body.vtu").write_text(wrong)
    with pytest.raises(MeshError, match="out of range, the first is 99"):
        load_surface(tmp_path / "body.vtu")


def test_a_bezier_volume_of_this_package_is_named_not_called_damaged(tmp_path):
    cube = BSplineVolume.uniform(np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, 4)] * 3, indexing="ij"), axis=-1), 2)
    write_bezier(tmp_path / "volume.vtu", cube)
    with pytest.raises(MeshError, match="cells of type bezier_hexahedron: save linear cells") as caught:
        load_surface(tmp_path / "volume.vtu")
    assert "damaged" not in str(caught.value)


@pytest.mark.parametrize(
    ("find", "put", "says"),
    [
        ('compressor="vtkZLibDataCompressor"', 'compressor="vtkBrotli"', "compressed by 'vtkBrotli', which is unknown"),
        ('header_type="UInt32"', 'header_type="Int7"', "the header_type is 'Int7', expected UInt32 or UInt64"),
        ('type="Float64" Name="Points"', 'type="String" Name="Points"', "has the type 'String'"),
        ('NumberOfPoints="8"', 'NumberOfPoints="9"', "where"),
        ('format="binary"', 'format="other"', "an array has the format 'other'"),
    ],
)
def test_what_a_header_says_is_checked(find, put, says, tmp_path):
    path = save(grid(SOLIDS["quads"][0]), tmp_path / "body.vtu", "binary", "ZLib")
    text = path.read_text()
    assert find in text
    path.write_text(text.replace(find, put))
    with pytest.raises(MeshError, match=says):
        load_surface(path)


@pytest.mark.parametrize("compressor", ["ZLib", "LZ4", "LZMA"])
def test_a_damaged_block_is_refused_in_one_line(compressor, tmp_path, capfd):
    path = save(ellipsoid()[0], tmp_path / "body.vtu", "appended", compressor)
    data = bytearray(path.read_bytes())
    start = data.index(b"_", data.index(b"<AppendedData"))
    data[start:-60] = bytes(byte ^ (255 * (i % 7 == 6)) for i, byte in enumerate(data[start:-60]))
    data[start : start + 1] = b"_"
    path.write_bytes(data)
    with pytest.raises(MeshError) as caught:
        load_surface(path)
    assert "\n" not in str(caught.value) and capfd.readouterr() == ("", "")


@pytest.mark.parametrize("mode", ["ascii", "binary", "appended"])
@pytest.mark.parametrize("compressor", [None, "ZLib"])
def test_empty_pieces_and_arrays_are_nothing(mode, compressor, tmp_path):
    empty = save(pyvista.UnstructuredGrid(), tmp_path / "body.vtu", mode, compressor)
    with pytest.raises(MeshError, match="has no faces and no solid cells"):
        load_surface(empty)
    if mode != "appended":
        held = [pyvista.UnstructuredGrid(), grid(SOLIDS["quads"][0])]
        assert load_surface(pieces(tmp_path / "body.vtu", held)).volume == pytest.approx(1.0)


def test_the_first_time_step_is_taken_with_a_notice(tmp_path):
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(tmp_path / "body.vtu"))
    writer.SetDataModeToAppended()
    writer.SetNumberOfTimeSteps(3)
    mesh = grid(SOLIDS["quads"][0])
    writer.SetInputData(mesh)
    writer.Start()
    for time in (1.0, 2.0, 4.0):
        mesh.points = CUBE * time
        writer.WriteNextTime(time)
    writer.Stop()
    surface = load_surface(tmp_path / "body.vtu")
    assert surface.volume == pytest.approx(1.0)
    assert "the first of 3 time steps read" in surface.notices


def test_every_kind_of_vtk_has_a_name_and_no_warning(recwarn):
    names = [_name(number) for number in range(90)]
    assert names[52] == "parametric_surface" and names[79] == "bezier_hexahedron" and names[89] == "VTK 89"
    assert not recwarn.list
