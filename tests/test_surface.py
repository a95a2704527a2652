import base64
import gzip
import lzma
import os
import re
import struct
import zlib
from functools import partial
from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh
from mesh_files import (
    CUBE,
    QUADS,
    TETRAHEDRON,
    TRIANGLES,
    ball,
    binary_stl,
    flagged_ply,
    joined,
    obj,
    off,
)
from surface_files import ACCEPTED, REFUSED

from parameterize.surface.geometry import signed_volume
from parameterize.surface.readers.common import BYTES_AT_LEAST
from parameterize.surface.solid import Solid
from parameterize.surface.surface import MeshError, load_surface, surface_from_arrays
from parameterize.surface.triangulation import triangulate

MODELS = Path(os.environ.get("IGA_NN_DATA", Path(__file__).parents[2] / "shared" / "models"))


def write(folder, name, content):
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def is_unit_cube(surface):
    assert surface.vertices.shape == (8, 3)
    assert surface.faces.shape == (12, 3)
    assert signed_volume(surface.vertices, surface.faces) == pytest.approx(1.0)
    assert surface.volume == pytest.approx(1.0)
    return True


@pytest.mark.parametrize("name", ACCEPTED)
def test_accepts_and_says_so(name, tmp_path):
    content, notice = ACCEPTED[name]
    surface = load_surface(write(tmp_path, name, content))
    assert is_unit_cube(surface)
    assert surface.name == name.split(".")[0]
    if notice is None:
        assert surface.notices == ()
    else:
        assert any(notice in line for line in surface.notices), surface.notices


@pytest.mark.parametrize("name", REFUSED)
def test_refuses_in_one_line(name, tmp_path):
    content, defect = REFUSED[name]
    path = write(tmp_path, name, content)
    with pytest.raises(MeshError) as caught:
        load_surface(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert defect in message
    assert "\n" not in message


def test_refuses_missing_files_and_directories(tmp_path):
    with pytest.raises(MeshError, match="no such file"):
        load_surface(tmp_path / "absent.obj")
    folder = tmp_path / "folder.obj"
    folder.mkdir()
    with pytest.raises(MeshError, match="is a directory"):
        load_surface(folder)


def test_a_gzip_bomb_stops_at_the_limit(tmp_path):
    zeros = gzip.compress(b"v 0 0 0\n" * (BYTES_AT_LEAST // 8 + 1000), compresslevel=1)
    with pytest.raises(MeshError, match="unpacks to more than"):
        load_surface(write(tmp_path, "bomb.obj.gz", zeros), max_faces=4)


@pytest.mark.parametrize(
    ("compressor", "pack"), [("ZLib", partial(zlib.compress, level=1)), ("LZMA", partial(lzma.compress, preset=0))]
)
def test_a_bomb_in_an_array_of_a_vtu_stops_at_the_limit(compressor, pack, tmp_path):
    packed = pack(bytes(BYTES_AT_LEAST + 10_000))
    header = np.array([1, BYTES_AT_LEAST + 10_000, 0, len(packed)], dtype=np.uint32)
    array = base64.b64encode(header.tobytes()) + base64.b64encode(packed)
    path = tmp_path / "bomb.vtu"
    meshio.write(path, meshio.Mesh(CUBE, [("quad", np.array(QUADS))]), binary=False)
    content = re.sub(rb"ascii(.*?>)[^<]*", lambda match: b"binary" + match[1] + array, path.read_bytes(), count=1)
    content = content.replace(b"<VTKFile ", b'<VTKFile compressor="vtk%bDataCompressor" ' % compressor.encode())
    with pytest.raises(MeshError, match="unpacks to more than"):
        load_surface(write(tmp_path, "bomb.vtu", content), max_faces=4)


def test_compressed_arrays_of_a_vtu_are_read(tmp_path):
    mesh = meshio.Mesh(CUBE, [("quad", np.array(QUADS))])
    for compression in ("zlib", "lzma"):
        meshio.write(tmp_path / "cube.vtu", mesh, compression=compression)
        assert is_unit_cube(load_surface(tmp_path / "cube.vtu"))


def appended_vtu(encode, points=CUBE):
    """Bytes of a .vtu whose zlib-compressed arrays stand in one block at its end, as ParaView writes them."""
    rows, block = "", b""
    cells = {"connectivity": np.ravel(QUADS), "offsets": np.arange(4, 25, 4), "types": np.full(6, 9)}
    for name, values in {"Points": np.asarray(points, dtype=float), **cells}.items():
        kind = f'type="{"Float64" if name == "Points" else "Int64"}" Name="{name}" format="appended"'
        kind += f' offset="{len(block)}" NumberOfComponents="{3 if name == "Points" else 1}"'
        rows += ("<Points>{}</Points><Cells>" if name == "Points" else "{}").format(f"<DataArray {kind}/>")
        packed = zlib.compress(values.tobytes())
        block += encode(struct.pack("<4I", 1, values.nbytes, 0, len(packed))) + encode(packed)
    head = '<VTKFile type="UnstructuredGrid" compressor="vtkZLibDataCompressor" byte_order="LittleEndian">'
    head += f'<UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="6">{rows}</Cells></Piece></UnstructuredGrid>'
    name = "raw" if encode is bytes else "base64"
    return head.encode() + f'<AppendedData encoding="{name}">_'.encode() + block + b"\n</AppendedData></VTKFile>"


@pytest.mark.parametrize("encode", [bytes, base64.b64encode])
def test_appended_arrays_of_a_vtu_are_read_within_the_limit(encode, tmp_path):
    assert is_unit_cube(load_surface(write(tmp_path, "cube.vtu", appended_vtu(encode))))
    bomb = appended_vtu(encode, np.zeros(BYTES_AT_LEAST // 8 + 1000))
    with pytest.raises(MeshError, match="unpacks to more than"):
        load_surface(write(tmp_path, "bomb.vtu", bomb), max_faces=4)


def test_concave_faces_with_further_properties_are_cut_inside(tmp_path):
    """A prism over a dart, whose fan from the first corner would leave it."""
    outline = np.array([[2, 1], [0, 0.5], [-2, 1], [0, 0]])
    vertices = np.vstack([np.c_[outline, np.full(4, z)] for z in (0.0, 1.0)])
    sides = [[i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4] for i in range(4)]
    content = flagged_ply([[3, 2, 1, 0], [4, 5, 6, 7], *sides], vertices, binary=True)
    surface = load_surface(write(tmp_path, "dart.ply", content))
    ends = surface.vertices[surface.faces[:4]]
    areas = np.linalg.norm(np.cross(ends[:, 1] - ends[:, 0], ends[:, 2] - ends[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(2.0)
    assert surface.notices == ("6 polygons cut into 12 triangles",)


def test_max_faces_is_checked_before_and_after_parsing(tmp_path):
    for name, content in (("a.obj", obj(faces=TRIANGLES)), ("a.stl", binary_stl()), ("a.off", off(faces=TRIANGLES))):
        with pytest.raises(MeshError, match="12 faces, more than max_faces=11"):
            load_surface(write(tmp_path, name, content), max_faces=11)
    path = write(tmp_path, "quads.obj", obj())
    with pytest.raises(MeshError, match="12 faces, more than max_faces=8"):
        load_surface(path, max_faces=8)
    assert is_unit_cube(load_surface(path, max_faces=12))


def test_the_first_defect_is_named_by_its_place():
    vertices, faces = ball()
    corner = faces[7]
    with pytest.raises(MeshError) as caught:
        surface_from_arrays(10.0 * vertices, np.delete(faces, 7, axis=0), "pierced")
    place = str(caught.value).split("at (")[1].split(")")[0]
    found = np.array([float(x) for x in place.split(",")])
    assert np.linalg.norm(10.0 * vertices[corner] - found, axis=1).min() < 1e-4
    assert str(caught.value).startswith("pierced: open surface: 1 boundary loop (3 edges)")


def test_counts_handles():
    torus = trimesh.creation.torus(1.0, 0.3, major_sections=24, minor_sections=12)
    surface = surface_from_arrays(torus.vertices, torus.faces)
    assert surface.genus == 1 and surface.summary()["genus"] == 1
    assert surface_from_arrays(*ball(subdivisions=1)).genus == 0


def test_lists_components_and_takes_the_one_asked_for():
    pair = joined(ball(subdivisions=1), ball(2.0, (5, 0, 0)))
    both = surface_from_arrays(*pair)
    assert both.notices == ("2 bodies are kept (0: 320 faces, 1: 80 faces): --component takes one",)
    small = surface_from_arrays(*pair, component=1)
    assert len(small.faces) == 80
    assert any("component 1 taken of 2" in line for line in small.notices)
    assert surface_from_arrays(*pair, component=0).center == pytest.approx([5, 0, 0], abs=0.05)
    with pytest.raises(MeshError, match="component 2 does not exist: there are 2, counted from 0"):
        surface_from_arrays(*pair, component=2)


@pytest.mark.parametrize("subdivisions", [1, 3])  # the shell inside may have more faces
@pytest.mark.parametrize("turned", [1, -1])
def test_a_shell_inside_is_a_cavity_however_it_is_wound(turned, subdivisions):
    outer, (vertices, faces) = ball(2.0, subdivisions=2), ball(1.0, subdivisions=subdivisions)
    surface = surface_from_arrays(*joined(outer, (vertices, faces[:, ::turned])))
    rest = surface_from_arrays(*outer).volume - surface_from_arrays(vertices, faces).volume
    assert surface.volume == pytest.approx(rest) and (surface.shells, surface.genus) == (2, 0)
    assert surface.solids == ("",) and not surface.is_plain and not len(surface.crossings)
    assert 1.0 < np.linalg.norm(surface.center) < 2.0  # the deepest point lies between the shells
    assert any(line.startswith("1 cavity is kept, ") for line in surface.notices)
    assert surface.summary()["shells"] == 2


def test_touching_sheets_of_a_closed_mesh_are_not_welded():
    """Two vertices in one place are no defect; where the numbering joins them, they are split into two again."""
    vertices, faces = ball(subdivisions=3)
    north, south = np.argmax(vertices[:, 2]), np.argmin(vertices[:, 2])
    vertices[north] = vertices[south] = 0.0  # two dents that meet in the centre
    apart = surface_from_arrays(vertices, faces)
    assert len(apart.vertices) == len(vertices)
    joined_there = surface_from_arrays(vertices, np.where(faces == south, north, faces))
    assert len(joined_there.vertices) == len(vertices) and joined_there.volume == pytest.approx(apart.volume)
    assert any("split 1 vertex where sheets touch, the first at (0, 0, 0)" in line for line in joined_there.notices)


def test_collapses_edges_without_length():
    vertices, faces = ball()
    a, b = faces[0, :2]
    vertices[b] = vertices[a]
    surface = surface_from_arrays(vertices, faces)
    assert (len(surface.vertices), len(surface.faces)) == (len(vertices) - 1, len(faces) - 2)
    assert "dropped 2 degenerate faces" in surface.notices


def test_refuses_a_flat_sheet_and_a_single_point():
    square = CUBE * [1, 1, 0]
    with pytest.raises(MeshError, match="encloses no volume"):
        surface_from_arrays(np.vstack([CUBE[:4], [[0.5, 0.5, 0]]]) * [1, 1, 0], pyramid())
    with pytest.raises(MeshError):
        surface_from_arrays(square, TRIANGLES)
    with pytest.raises(MeshError, match="single point or far too small"):
        surface_from_arrays(np.zeros((8, 3)), TRIANGLES)


def pyramid():
    return [[0, 2, 3], [0, 3, 1], [0, 1, 4], [1, 3, 4], [3, 2, 4], [2, 0, 4]]


@pytest.mark.parametrize("size", [1e12, 1e-9, 1e40, 1e-40])
def test_accepts_any_size_and_scales_back(size, tmp_path):
    vertices, faces = ball()
    surface = load_surface(write(tmp_path, "ball.obj", obj(vertices * size, faces)))
    assert surface.vertices.shape == vertices.shape
    assert surface.volume / size**3 == pytest.approx(signed_volume(vertices, faces))
    assert any("unusual size" in line for line in surface.notices)
    assert signed_volume(surface.unit_vertices, surface.faces) == pytest.approx(1.0)


def test_refuses_sizes_beyond_double_precision():
    with pytest.raises(MeshError, match="choose a larger unit"):
        surface_from_arrays(CUBE * 1e200, TRIANGLES)


def test_says_when_the_surface_is_far_from_the_origin():
    surface = surface_from_arrays(CUBE + 1e7, TRIANGLES)
    assert any("far from the origin" in line for line in surface.notices)


def test_warns_of_slivers_and_names_the_first():
    vertices, faces = CUBE.copy(), TRIANGLES.tolist()
    face = faces.pop(0)  # an extra vertex all but on one of its edges
    vertices = np.vstack([vertices, (vertices[face[0]] + vertices[face[1]]) / 2 + [1e-4, 0, 0]])
    faces += [[8, face[1], face[2]], [8, face[2], face[0]], [face[0], face[1], 8]]
    surface = surface_from_arrays(vertices, faces)
    assert any(line.startswith("1 slivers (an angle below 0.5 degrees)") for line in surface.notices)


def test_refuses_a_one_sided_surface():
    """The real projective plane with six vertices: closed, every edge between two faces, no orientation."""
    faces = [
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
        [0, 4, 5],
        [0, 5, 1],
        [1, 2, 4],
        [2, 3, 5],
        [3, 4, 1],
        [4, 5, 2],
        [5, 1, 3],
    ]
    points = np.random.default_rng(0).normal(size=(6, 3))
    with pytest.raises(MeshError, match="one-sided"):
        surface_from_arrays(points, faces)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.ones((4, 3)) + 1j, [[0, 1, 2]], "vertices must be real numbers, got complex128"),
        ([["a", "b", "c"]], [[0, 1, 2]], "vertices must be real numbers, got <U1"),
        ([[0, 0, 0], [1, 0]], [[0, 1, 2]], "vertices must be rows of three, got rows of several lengths"),
        ([[0, 0, 0]] * 3, [[0, 1, 2], [0, 1]], "faces must be rows of three, got rows of several lengths"),
    ],
)
def test_arrays_of_other_entries_are_named(vertices, faces, message, recwarn):
    with pytest.raises(MeshError, match=message):
        surface_from_arrays(vertices, faces)
    assert not recwarn.list


def test_arrays_of_the_wrong_kind_are_named():
    with pytest.raises(MeshError, match=r"vertices must have shape \(n, 3\), got \(8, 2\)"):
        surface_from_arrays(CUBE[:, :2], TRIANGLES)
    with pytest.raises(MeshError, match="faces must be integers"):
        surface_from_arrays(CUBE, TRIANGLES.astype(float))
    with pytest.raises(MeshError, match="out of range, the first is -1"):
        surface_from_arrays(CUBE, np.where(TRIANGLES == 7, -1, TRIANGLES))


def test_equal_input_gives_equal_surfaces_and_other_input_other_hashes():
    first, second = surface_from_arrays(CUBE, TRIANGLES), surface_from_arrays(CUBE, TRIANGLES)
    assert first.sha256 == second.sha256
    assert np.array_equal(first.center, second.center)
    assert surface_from_arrays(CUBE * 2, TRIANGLES).sha256 != first.sha256


def test_the_summary_is_the_input_section_of_the_report(tmp_path):
    path = write(tmp_path, "cube.obj", obj(2.0 * CUBE))
    summary = load_surface(path).summary()
    assert (summary["file"], summary["vertices"], summary["faces"]) == (str(path), 8, 12)
    assert summary["volume"] == pytest.approx(8.0)
    assert summary["bbox"] == [[0, 0, 0], [2, 2, 2]]
    assert summary["notices"] == ["6 polygons cut into 12 triangles"]
    assert len(summary["sha256"]) == 64


def test_placement_puts_the_deepest_point_in_the_middle_and_volume_to_one():
    box = surface_from_arrays(CUBE * [2.0, 4.0, 3.0] + [10.0, 0.0, 0.0], TRIANGLES)
    assert box.center[0] == pytest.approx(11.0, abs=2e-3)
    assert box.to_unit(box.center) == pytest.approx([0.5, 0.5, 0.5])
    assert box.scale == pytest.approx(24 ** (-1 / 3))
    assert box.from_unit(box.unit_vertices) == pytest.approx(box.vertices, abs=1e-6)  # single precision


def test_the_deepest_point_of_a_tetrahedron_is_its_incenter():
    """Corner tetrahedron: r = 3 V / A = (1/2) / (3/2 + sqrt(3)/2), incentre (r, r, r)."""
    radius = 1.0 / (3.0 + np.sqrt(3.0))
    point, depth = Solid(*TETRAHEDRON).deepest()
    assert depth == pytest.approx(radius, rel=1e-3)
    assert depth <= radius
    assert point == pytest.approx([radius] * 3, rel=0.02)


def test_the_deepest_point_of_an_angle_is_in_its_elbow():
    """Two arms of width 1: (t, t) in the elbow is t from both walls and (1 - t) sqrt 2 from the inner corner."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]], dtype=float)
    vertices = np.vstack([np.c_[outline, np.full(6, z)] for z in (0.0, 4.0)])
    sides = [[i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    faces = triangulate(vertices, [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *sides])
    surface = surface_from_arrays(vertices, faces)
    assert (surface.volume, surface.notices) == (pytest.approx(12.0), ())
    assert surface.center[:2] == pytest.approx([2 - np.sqrt(2)] * 2, abs=0.02)


@pytest.mark.parametrize("size", [1.0, 1e-40, 1e40])
@pytest.mark.parametrize(
    "outline",
    [
        [[0, 0], [2, 1], [0, 0.5], [-2, 1]],  # a dart
        [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]],  # a U: no corner sees all of it
        [[0, 0], [4, 0], [4, 4], [0, 4], [0, 0], [1, 1], [1, 3], [3, 3], [3, 1], [1, 1]],  # a slit to a hole
        [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [2, 1], [1, 1], [0, 1]],  # corners in a row
        [[0, 0], [1, 0], [1, 1], [1 - 1e-6, 1], [0, 1]],
    ],
)
def test_concave_polygons_are_cut_inside(outline, size):
    """Triangles turned like the polygon that add up to its area (shoelace formula) neither overlap nor leave it."""
    points = np.c_[outline, np.zeros(len(outline))]
    x, y = points[:, :2].T
    area = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2
    triangles = triangulate(points * size, [list(range(len(points)))])
    a, b, c = (points[triangles[:, i]] for i in range(3))
    areas = np.cross(b - a, c - a)[:, 2] / 2
    assert len(areas) == len(points) - 2
    assert areas.min() > 0
    assert areas.sum() == pytest.approx(area)


@pytest.mark.parametrize("seed", range(20))
def test_polygons_not_quite_plane_keep_their_sides(seed):
    """An L, turned in space and rounded as files are: 4 triangles that turn like it."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    outline = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0], [1, 2, 0], [0, 2, 0]], dtype=float)
    points = np.round(outline @ turn.T, 3)
    corners = points[triangulate(points, [[0, 1, 2, 3, 4, 5]])]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ np.cross(*turn.T[:2]) / 2
    assert len(areas) == 4
    assert areas.min() > 0.1
    assert areas.sum() == pytest.approx(3.0, abs=0.01)


def test_repeated_corners_leave_no_hole():
    surface = surface_from_arrays(CUBE, triangulate(CUBE, [[*quad, quad[-1], quad[0]] for quad in QUADS]))
    assert is_unit_cube(surface)
    assert surface.notices == ("dropped 12 degenerate faces",)


def test_polygons_keep_their_order():
    triangles = triangulate(CUBE, [QUADS[0], TRIANGLES[2].tolist(), QUADS[1]])
    assert [set(t) <= set(QUADS[0]) for t in triangles.tolist()] == [True, True, False, False, False]
    assert triangles[2].tolist() == TRIANGLES[2].tolist()


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("cube.mesh", {}),
        ("cube.msh", {"file_format": "gmsh", "binary": True}),
        ("cube.msh", {"file_format": "gmsh", "binary": False}),
        ("cube.msh", {"file_format": "gmsh22", "binary": True}),
        ("cube.msh", {"file_format": "gmsh22", "binary": False}),
        ("cube.vtu", {}),
        ("cube.vtu.gz", {"binary": False}),
    ],
)
def test_tetrahedra_give_their_boundary(name, options, tmp_path):
    """A cube of five tetrahedra, two of them inside out."""
    tetrahedra = np.array([[0, 1, 2, 4], [1, 3, 2, 7], [1, 4, 7, 5], [2, 7, 4, 6], [1, 2, 7, 4]])
    path = tmp_path / name.removesuffix(".gz")
    meshio.write(path, meshio.Mesh(CUBE, [("tetra", tetrahedra)]), **options)
    if name.endswith(".gz"):
        path = write(tmp_path, name, gzip.compress(path.read_bytes()))
    assert is_unit_cube(load_surface(path))


def test_surfaces_in_volume_formats_and_other_cells(tmp_path):
    path = tmp_path / "surface.vtu"
    meshio.write(path, meshio.Mesh(CUBE, [("quad", np.array(QUADS))]))
    assert is_unit_cube(load_surface(path))
    meshio.write(path, meshio.Mesh(CUBE, [("hexahedron", np.array([[0, 1, 3, 2, 4, 5, 7, 6]]))]))
    assert is_unit_cube(load_surface(path))
    meshio.write(path, meshio.Mesh(CUBE, [("tetra", np.array([[0, 1, 2, 40]]))]))
    with pytest.raises(MeshError, match="out of range, the first is 40"):
        load_surface(path)


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(MODELS.glob("*.obj")), ids=lambda path: path.stem)
def test_real_models_are_accepted_unchanged(path):
    surface = load_surface(path)
    rows = [line.split() for line in path.read_text().splitlines()]
    given = np.array([[float(x) for x in row[1:4]] for row in rows if row[:1] == ["v"]])
    assert np.array_equal(surface.vertices, given)
    assert len(surface.faces) == sum(row[:1] == ["f"] for row in rows)
    _, depth = Solid(surface.unit_vertices, surface.faces).deepest()
    assert 0.2 < depth < 0.62035  # the ball of volume 1 has radius 0.62035


def test_a_path_that_is_none_is_refused_with_the_remedy():
    with pytest.raises(TypeError, match=r"path .*None.*surface_from_arrays"):
        load_surface(None)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"max_faces": "9"}, "max_faces must be a whole number, at least 4, got '9'"),
        ({"max_faces": float("nan")}, "max_faces must be a whole number, at least 4, got nan"),
        ({"component": "0"}, "component must be a whole number, counted from 0, or 'largest', got '0'"),
        ({"component": -1}, "component must be a whole number, counted from 0, or 'largest', got -1"),
        ({"close": "some"}, "close must be True, False or 'all', got 'some'"),
    ],
)
def test_limits_of_another_kind_are_refused(given, says):
    with pytest.raises(MeshError, match=says):
        load_surface(trimesh.creation.icosphere(1), **given)


def test_what_is_no_regular_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.obj")
    with pytest.raises(MeshError, match="no regular file"):
        load_surface(tmp_path / "pipe.obj")
