"""PLY, MSH, OFF, OBJ and Medit files as many programs write them: all hold the same solid, or say what they hold."""

import itertools

import meshio
import numpy as np
import pytest
from mesh_files import CUBE, MIXED, QUADS, TRIANGLES, medit, obj, off, ply
from reader_files import (
    NUMBERS,
    ORDERS,
    PLACES,
    TYPES,
    Ply,
    beside,
    faces,
    msh2,
    msh2_binary,
    msh41,
    msh41_binary,
    section,
    vertices,
)

from parameterize.surface.readers.common import SurfaceFile
from parameterize.surface.readers.ply import read_ply
from parameterize.surface.surface import MeshError, load_surface


def read(folder, name, content):
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return load_surface(path)


def is_cube(surface):
    return surface.volume == pytest.approx(1.0) and len(surface.faces) == 12


UV = ("list uchar float texcoord", (0.0, 1.0, 0.5, 0.5, 1.0, 0.0))
EDGES = ("edge", ["int vertex1", "int vertex2"], [(0, 1), (2, 3)])
PLYS = {
    "flags": Ply(vertices(), beside(faces(), after=["uchar flags"], values_after=[7])),
    "flags first": Ply(vertices(), beside(faces(), before=["short id"], values_before=[-7])),
    "texture places": Ply(vertices(), beside(faces(), after=[UV[0], "int texnumber"], values_after=[UV[1], 0])),
    "texture places first": Ply(vertices(), beside(faces(), before=[UV[0]], values_before=[UV[1]])),
    "index": Ply(vertices(), faces(properties=["list uchar uint vertex_index"])),
    "lists on vertices": Ply(beside(vertices(), before=["list int double w"], values_before=[(1.0, 2.0)]), faces()),
    "normals and colours": Ply(
        beside(vertices(), after=["float nx", "uchar red", "list uchar short more"], values_after=[0.5, 9, ()]), faces()
    ),
    "z first": Ply(("vertex", ["double z", "double x", "double y"], CUBE[:, [2, 0, 1]].tolist()), faces()),
    "faces first": Ply(faces(), vertices()),
    "comments": Ply(
        vertices(), faces(), comments=("the end_header follows", "vertex_index", "element face 99", "end_header 2")
    ),
    "other elements first": Ply(EDGES, ("material", [UV[0]], [(UV[1],), ((),)]), vertices(), faces()),
    "edges": Ply(vertices(), faces(), EDGES),
    "an element without properties": Ply(vertices(), ("nothing", [], []), faces()),
    "strips": Ply(
        vertices(),
        ("tristrips", ["list int int vertex_indices"], [((0, 1, 4, 5, 6, 7, 2, 3, 0, 1, -1, 0, 4, 2, 6, -1),)]),
        faces(TRIANGLES[10:]),
    ),
}


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("form", ["ascii", *ORDERS])
@pytest.mark.parametrize("name", PLYS)
def test_ply_of_any_properties_in_any_order(name, form, newline, tmp_path):
    kept = PLYS[name]
    surface = read(tmp_path, "cube.ply", Ply(*kept.elements, comments=kept.comments, newline=newline).content(form))
    assert is_cube(surface)
    others = [line for line in surface.notices if "other elements" in line]
    assert bool(others) == (EDGES in kept.elements)


@pytest.mark.parametrize("form", ORDERS)
def test_lists_of_every_type_are_read(form):
    """The corners as they are written; that a surface is made of them is tested once a form above."""
    for count, item, rows in itertools.product(TYPES, TYPES, (MIXED, QUADS, TRIANGLES)):
        content = Ply(vertices(), faces(rows, [f"list {count} {item} vertex_indices"])).content(form)
        found = read_ply(SurfaceFile(content, 12, None))
        assert np.array_equal(found.vertices, CUBE), (count, item)
        assert found.polygons == [list(row) for row in rows], (count, item)


def test_a_body_that_begins_with_a_line_end_is_not_cut(tmp_path):
    """The first coordinate's first byte is that of the character line feed, after a header whose lines end with CR."""
    places = CUBE.copy()
    places[0, 0] = np.frombuffer(b"\n\0\0\0", "<f4")[0]
    for newline in ("\r", "\n", "\r\n"):
        given = Ply(("vertex", PLACES, places.tolist()), faces(), newline=newline)
        assert is_cube(read(tmp_path, "cube.ply", given.content("binary_little_endian")))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (Ply(vertices(), faces(properties=["list uchar int corners"])), "elements face lack a list vertex_indices"),
        (Ply(("vertex", PLACES[:2], CUBE[:, :2].tolist()), faces()), "elements vertex lack coordinates x, y and z"),
        (
            Ply(vertices(), faces([[0, 1, 0.5]] * 4, ["list uchar float vertex_indices"])),
            "no whole numbers|needs vertex numbers",
        ),
        (Ply(vertices(), faces([[0, 1, 99]] * 4)), "out of range, the first is 99"),
    ],
)
def test_ply_that_lacks_something_says_what(given, says, tmp_path):
    for form in ("ascii", *ORDERS):
        with pytest.raises(MeshError, match=says):
            read(tmp_path, "cube.ply", given.content(form))


@pytest.mark.parametrize(
    ("find", "put", "says"),
    [
        (b"property float x", b"property half x", "the PLY's property 'x' has the type 'half'"),
        (b"format ascii", b"format binary_middle_endian", "the format 'binary_middle_endian', expected one of ascii"),
        (b"format ascii 1.0\n", b"", "the PLY has the format '', expected one of ascii"),
    ],
)
def test_ply_headers_are_checked(find, put, says, tmp_path):
    assert find in ply()
    with pytest.raises(MeshError, match=says):
        read(tmp_path, "cube.ply", ply().replace(find, put))


# Gmsh


COMMENTS = section("Comments", "$Nodes\nare described here\n")


@pytest.mark.parametrize(
    "content",
    [
        msh2(),
        COMMENTS + msh2(),
        msh2(more=COMMENTS + section("PhysicalNames", '1\n2 1 "skin"\n')),
        msh2(NUMBERS).replace("\n", "\r\n"),
        msh2() + section("NodeData", "1\n"),
        msh41(),
        COMMENTS + msh41(),
        *(msh41(parametric=1, dimension=k) for k in (1, 2, 3)),
        msh41(version="4"),
        msh41(version="4", parametric=1),
    ],
)
def test_msh_with_any_sections_and_node_numbers(content, tmp_path):
    surface = read(tmp_path, "cube.msh", content)
    assert is_cube(surface) and surface.notices == ()


@pytest.mark.parametrize("order", "<>")
@pytest.mark.parametrize("write", [msh41_binary, msh2_binary])
@pytest.mark.parametrize("variant", [0, 1])
def test_binary_msh_of_either_byte_order(write, order, variant, tmp_path):
    assert is_cube(read(tmp_path, "cube.msh", COMMENTS.encode() + write(order, variant)))


FORMATS = {".msh": "gmsh22", ".mesh": "medit", ".vtu": "vtu"}
TETRAHEDRA = [[0, 1, 2, 4], [1, 3, 2, 7], [1, 4, 7, 5], [2, 7, 4, 6], [1, 2, 7, 4]]


@pytest.mark.parametrize("suffix", [".msh", ".mesh", ".vtu"])
@pytest.mark.parametrize(
    ("cells", "volume"),
    [
        ([("hexahedron", [[0, 1, 3, 2, 4, 5, 7, 6]])], 1.0),
        ([("wedge", [[0, 1, 2, 4, 5, 6], [1, 3, 2, 5, 7, 6]])], 1.0),
        ([("wedge", [[0, 1, 2, 4, 5, 6]]), ("tetra", [[1, 3, 2, 5], [3, 2, 5, 7], [2, 5, 7, 6]])], 1.0),
        ([("tetra", TETRAHEDRA), ("triangle", [[0, 1, 2], [1, 2, 4]])], 1.0),
        ([("hexahedron", [[0, 1, 3, 2, 4, 5, 7, 6]]), ("quad", QUADS), ("line", [[0, 1]])], 1.0),
    ],
)
def test_solid_cells_of_every_format_give_their_volume(cells, volume, suffix, tmp_path):
    path = tmp_path / f"body{suffix}"
    meshio.write(path, meshio.Mesh(CUBE, [(kind, np.array(held)) for kind, held in cells]), FORMATS[suffix])
    assert load_surface(path).volume == pytest.approx(volume)


@pytest.mark.parametrize("suffix", [".msh", ".mesh", ".vtu"])
def test_a_second_body_of_triangles_beside_solid_cells_is_counted(suffix, tmp_path):
    cells = [("tetra", np.array(TETRAHEDRA)), ("triangle", TRIANGLES + 8)]
    path = tmp_path / f"body{suffix}"
    meshio.write(path, meshio.Mesh(np.vstack([CUBE, CUBE + [3, 0, 0]]), cells), FORMATS[suffix])
    assert len(load_surface(path).solids) == 2


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (msh2(elements=[(1, 9, 2, 1, 1, 1, 2, 3, 4, 5, 6)]), "holds 1 cells of type triangle6: save linear"),
        (msh2(elements=[(1, 21, 2, 1, 1, *range(1, 9), 1, 2)]), "holds 1 cells of type triangle10: save linear"),
        (msh2(elements=[(1, 140, 2, 1, 1, *range(1, 11))]), "holds elements of Gmsh type 140: save linear"),
        (msh2(elements=[(1, 2, 2, 1, 1, 1, 2, 77)]), "an element has node 77, which the .msh does not hold"),
        (msh2([1, 2, 3, 4, 5, 6, 7, 7]), "node 7 is given twice"),
        (msh2(elements=[(1, 2, -2, 1, 1, 1, 2, 3)]), "an element with -2 tags"),
        (msh41(dimension=4), "entity of dimension 4"),
        (msh2().replace("0 8", "0 4", 1).replace("2.2 0", "2.2 1"), "numbers of 4 bytes in the .msh, expected 8"),
        (msh2().replace("0.0", "zero", 1), "has a word that is no number"),
    ],
)
def test_msh_that_is_not_read_says_why(content, says, tmp_path):
    with pytest.raises(MeshError, match=says):
        read(tmp_path, "cube.msh", content)


# OFF

PLAIN = off()
HEAD, POINTS, FACES = "OFF\n8 6 0\n", "".join(PLAIN.splitlines(True)[2:10]), "".join(PLAIN.splitlines(True)[10:])
NORMALS = POINTS.replace("\n", " 0 0 1\n")
COLOURS = POINTS.replace("\n", " 0.5 0.5 0.5 1\n")
OFFS = {
    "a number a line": PLAIN.replace(" ", "\n"),
    "all in one line": PLAIN.replace("\n", " "),
    "a face on two lines": PLAIN.replace("\n4 0 2", "\n4\n0 2"),
    "faces on two lines": HEAD + POINTS + FACES.replace("4 ", "4\n", 3),
    "two vertices a line": HEAD
    + " ".join(POINTS.split()[:6])
    + "\n"
    + "\n".join(POINTS.splitlines()[2:])
    + "\n"
    + FACES,
    "two faces a line": HEAD + POINTS + FACES.replace("\n", " ", 1),
    "counts in the first line": PLAIN.replace("OFF\n", "OFF "),
    "counts after the word": PLAIN.replace("OFF\n", "OFF"),
    "counts on three lines": PLAIN.replace("8 6 0", "8\n6\n0"),
    "no count of edges": PLAIN.replace("8 6 0", "8 6"),
    "comments": "# a\n" + PLAIN.replace("\n", " # 1 2 3\n\n"),
    "colours of faces": HEAD + POINTS + FACES.replace("\n", " 255 0 0\n"),
    "colours of some faces": HEAD + POINTS + FACES.replace("\n", " 0.5 0 0 1\n", 3),
    "colours of faces on two lines": HEAD + POINTS + FACES.replace("\n", " 255 0 0\n").replace("4 ", "4\n", 1),
    "colours": "C" + HEAD + COLOURS + FACES,
    "colours of three": "C" + HEAD + POINTS.replace("\n", " 255 0 0\n") + FACES,
    "colours that no word announces": HEAD + COLOURS + FACES,
    "normals": "N" + HEAD + NORMALS + FACES,
    "normals in words": "N" + (HEAD + NORMALS + FACES).replace("\n", " "),
    "colours in words": "C" + (HEAD + COLOURS + FACES).replace("\n", " "),
    "colours on a line of their own": "C" + HEAD + COLOURS.replace(" 0.5 0.5 0.5 1", "\n0.5 0.5 0.5 1") + FACES,
    "all": "STCN" + HEAD + COLOURS.replace("\n", " 0 0 1 0.5 0.5\n") + FACES,
    "small letters": "coff" + HEAD[3:] + COLOURS + FACES,
    "line ends": PLAIN.replace("\n", "\r"),
}


@pytest.mark.parametrize("name", OFFS)
def test_off_as_words_and_as_lines(name, tmp_path):
    surface = read(tmp_path, "cube.off", OFFS[name])
    assert is_cube(surface)
    assert surface.notices == ("6 polygons cut into 12 triangles",)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("4" + PLAIN, "4OFF is not supported"),
        ("nOFF\n3\n" + PLAIN[4:], "nOFF is not supported"),
        (HEAD + POINTS + FACES.replace("4 0 2", "4 0 x", 1), "line 11: a face needs vertex numbers, got '0 x 3 1'"),
        (HEAD + POINTS.replace("0.0", "zero", 1) + FACES, "line 3: a vertex needs three numbers"),
        ("OFF\n8\n", "lacks the counts"),
        ("OFF", "lacks the counts"),
    ],
)
def test_off_that_is_not_read_says_why(content, says, tmp_path):
    with pytest.raises(MeshError, match=says):
        read(tmp_path, "cube.off", content)


def test_words_after_the_last_face_are_left_out_with_a_notice(tmp_path):
    surface = read(tmp_path, "cube.off", PLAIN + "0 1\n1 2\n")
    assert is_cube(surface) and "left out 4 words after the last face" in surface.notices


# OBJ, Medit


@pytest.mark.parametrize("number", [9, 999_999, -9, -77])
def test_obj_numbers_out_of_range_are_named_as_in_the_file(number, tmp_path):
    with pytest.raises(MeshError, match=f"line 15: vertex number {number} is out of range, there are 8 vertices"):
        read(tmp_path, "cube.obj", obj() + f"f 1 2 {number}\n")
    assert is_cube(read(tmp_path, "cube.obj", "\n".join(sorted(obj().splitlines(), key=lambda line: line[0]))))


def test_obj_records_that_are_no_part_of_the_surface_are_named(tmp_path):
    surface = read(tmp_path, "cube.obj", obj() + "l 1 2 \\\n3\np 4\nl 1 2\ncstype bezier\ncurv2 1 2\nx\n")
    said = "left out records that are no vertices or faces: 2 'l', 1 'p', 1 'curv2', 1 'x'"
    assert is_cube(surface) and said in surface.notices
    with pytest.raises(MeshError, match="line 15: a record 'surf', which is not read"):
        read(tmp_path, "cube.obj", obj() + "surf 0 1 0 1 1 2 3 4\n")


def test_medit_numbers_and_curved_cells_are_named(tmp_path):
    with pytest.raises(MeshError, match=r"out of range, the first is 99 \(counted from 1\)"):
        read(tmp_path, "cube.mesh", medit().replace("1 3 4 0", "1 3 99 0"))
    with pytest.raises(MeshError, match="holds 1 curved cells, TetrahedraP2"):
        read(tmp_path, "cube.mesh", medit(more="TetrahedraP2\n1\n1 2 3 4 5 6 7 8 1 2 0\n"))
    assert is_cube(read(tmp_path, "cube.mesh", medit(more="TetrahedraP2\n0\nEdgesP2\n1\n1 2 3 0\n")))


@pytest.mark.parametrize("broken", [np.nan, np.inf, 1e300])
@pytest.mark.parametrize("suffix", [".obj", ".ply", ".off", ".msh", ".vtu"])
def test_a_place_that_no_face_uses_may_be_no_number(suffix, broken, tmp_path, capfd):
    places = np.vstack([CUBE, [[broken, 0.0, broken]]])
    path = tmp_path / f"cube{suffix}"
    if suffix in (".msh", ".vtu"):
        meshio.write(path, meshio.Mesh(places, [("tetra", np.array(TETRAHEDRA))]), FORMATS[suffix])
        capfd.readouterr()
    else:
        content = {".obj": obj(places), ".off": off(places), ".ply": ply(places)}[suffix]
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    surface = load_surface(path)
    assert is_cube(surface) and capfd.readouterr().err == ""
    assert surface.notices[0].startswith("1 vertices without a valid place") or surface.notices[1].startswith("1 vert")
