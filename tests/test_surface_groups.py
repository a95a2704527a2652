"""Groups of faces: of every format, by triangles known from their places, through every step that renumbers them."""

import struct

import meshio
import numpy as np
import pytest
import pyvista
import trimesh
from mesh_files import CUBE, QUADS, TRIANGLES, ball, joined, obj
from reader_files import CORNERS, Ply, grid, msh2, msh2_binary, msh41_binary, rows, save, section, vertices

from iga_nn.cli.commands import main
from parameterize.surface.decimation import decimate
from parameterize.surface.groups import MOST_GROUPS, as_arrays, by_value, from_arrays, gathered, renumbered
from parameterize.surface.surface import MeshError, load_surface, surface_from_arrays

SIDES = [(2, 0), (2, 1), (1, 0), (1, 1), (0, 0), (0, 1)]  # axis and place of QUADS
NAMES = ["bottom", "top", "front", "back", "left", "right"]
TETS = [[0, 1, 3, 7], [0, 1, 7, 5], [0, 5, 7, 4], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7]]  # of the cube
TYPES = pyvista.CellType


def on_sides(surface, sides):
    """The triangles that lie on these sides of the unit cube, by their corners."""
    corners = surface.vertices[surface.faces]
    flags = [np.all(corners[:, :, axis] == place, axis=1) for axis, place in (SIDES[k] for k in sides)]
    return np.flatnonzero(np.any(flags, axis=0)).tolist()


def check_groups(surface, expected):
    """expected: the sides of the cube by the names of the groups."""
    assert {name: numbers.tolist() for name, numbers in surface.groups.items()} == {
        name: on_sides(surface, sides) for name, sides in expected.items()
    }


def write(folder, name, content):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def text_solids(solids):
    """STL text of solids: what follows the word `solid`, and triangles."""
    lines = []
    for name, triangles in solids:
        lines.append(f"solid{name}")
        for face in triangles:
            corners = ["vertex {} {} {}".format(*CUBE[i]) for i in face]
            lines += ["facet normal 0 0 0", "outer loop", *corners, "endloop", "endfacet"]
        lines.append(f"endsolid{name}")
    return "\n".join([*lines, ""])


def test_obj_groups_materials_and_objects(tmp_path):
    places, *records = obj().partition("f ")[0], *("f " + row for row in obj().split("\nf ")[1:])
    marks = ["o box\ng bottom ends", "g top ends\nusemtl steel  grey", "g", "g back", "usemtl brass # soft", ""]
    text = places + "".join(f"{mark}\n{record.strip()}\n" for mark, record in zip(marks, records, strict=True))
    expected = {"bottom": [0], "ends": [0, 1], "top": [1], "back": [3, 4, 5], "steel grey": [1, 2, 3], "brass": [4, 5]}
    check_groups(load_surface(write(tmp_path, "a.obj", text)), {**expected, "box": range(6)})
    assert load_surface(write(tmp_path, "b.obj", obj())).groups == {}


def test_solids_of_an_stl_text(tmp_path):
    solids = [
        (" lower endfacet half", TRIANGLES[[0, 1, 4, 5, 6, 7]]),
        ("", TRIANGLES[[2, 3]]),
        (" rest", TRIANGLES[8:]),
    ]
    content = text_solids(solids)
    for number, text in enumerate((content, content.replace("\n", "\r\n"), "\ufeff" + content)):
        surface = load_surface(write(tmp_path, f"{number}.stl", text))
        check_groups(surface, {"lower endfacet half": [0, 2, 3], "solid 2": [1], "rest": [4, 5]})
    assert "welded" in surface.notices[0]
    assert load_surface(write(tmp_path, "one.stl", text_solids([(" cube", TRIANGLES)]))).groups == {}


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("mixed", [False, True])
def test_whole_numbers_of_ply_faces(form, mixed, tmp_path):
    polygons = [*QUADS[:4], *TRIANGLES[8:].tolist()] if mixed else QUADS
    part = [7, 7, -1, 0, *([5] * (len(polygons) - 4))]
    each = [(part[k], tuple(row), 0.5, 3, k) for k, row in enumerate(polygons)]
    properties = ["int part", *CORNERS, "float heat", "uchar same", "ushort number"]
    surface = load_surface(write(tmp_path, "a.ply", Ply(vertices(), ("face", properties, each)).content(form)))
    numbers = {name: value for name, value in surface.groups.items() if name.startswith("number")}
    assert len(numbers) == len(polygons) and "same=3" not in surface.groups
    for name in numbers:
        surface.groups.pop(name)
    check_groups(surface, {"part=-1": [2], "part=0": [3], "part=5": [4, 5], "part=7": [0, 1]})


def test_a_ply_text_whose_numbers_are_no_integers_has_no_groups(tmp_path):
    each = [("1.0" if k else "2.0", tuple(row)) for k, row in enumerate(QUADS)]
    content = Ply(vertices(), ("face", ["int part", *CORNERS], each)).content("ascii")
    assert load_surface(write(tmp_path, "a.ply", content)).groups == {}


NAMED = section("PhysicalNames", '3\n2 5 "inlet"\n3 9 "steel"\n1 5 "edge"\n')


def test_physical_groups_of_msh_2(tmp_path):
    marks = [5, 5, 0, 0, *[7] * 8]
    elements = [(i + 1, 2, 2, marks[i], 1, *(face + 1)) for i, face in enumerate(TRIANGLES)]
    check_groups(
        load_surface(write(tmp_path, "a.msh", msh2(more=NAMED, elements=elements))),
        {"inlet": [0], "7": [2, 3, 4, 5]},
    )
    check_groups(load_surface(write(tmp_path, "b.msh", msh2_binary("<", several=True))), {"1": range(6)})


def test_a_face_of_solid_cells_is_in_the_group_of_its_triangle_else_of_its_cell(tmp_path):
    elements = [(1, 2, 2, 5, 1, *(TRIANGLES[0] + 1)), (2, 2, 2, 0, 1, *(TRIANGLES[2] + 1))]
    elements += [(3 + i, 4, 2, 9, 1, *(np.array(tet) + 1)) for i, tet in enumerate(TETS)]
    surface = load_surface(write(tmp_path, "a.msh", msh2(more=NAMED, elements=elements)))
    corners = [set(map(tuple, surface.vertices[face].tolist())) for face in surface.faces]
    (inlet,) = surface.groups["inlet"].tolist()
    assert corners[inlet] == {tuple(CUBE[i].tolist()) for i in TRIANGLES[0]}
    assert surface.groups["steel"].tolist() == [i for i in range(12) if i != inlet]


ENTITIES = "1 1 3 1\n1 0 0 0 0\n1 0 0 0 1 1 1 0 2 1 -1\n"  # a point, a curve
ENTITIES += "10 0 0 0 1 1 1 1 5 1 1\n11 0 0 0 1 1 1 2 5 8 0\n12 0 0 0 1 1 1 0 0\n"  # surfaces
ENTITIES += "1 0 0 0 1 1 1 1 9 3 10 11 12\n"


def test_physical_groups_of_msh_4_1(tmp_path):
    blocks = [(10, TRIANGLES[:2]), (11, TRIANGLES[2:6]), (12, TRIANGLES[6:])]
    elements, number = "3 12 1 12\n", 0
    for entity, triangles in blocks:
        elements += f"2 {entity} 2 {len(triangles)}\n" + rows(
            (number + i, *(f + 1)) for i, f in enumerate(triangles, 1)
        )
        number += len(triangles)
    nodes = "1 8 1 8\n2 1 0 8\n" + rows([i] for i in range(1, 9)) + rows(CUBE)
    form = section("MeshFormat", "4.1 0 8\n")
    text = form + NAMED + section("Entities", ENTITIES) + section("Nodes", nodes) + section("Elements", elements)
    check_groups(load_surface(write(tmp_path, "a.msh", text)), {"inlet": [0, 1, 2], "8": [1, 2]})
    with pytest.raises(MeshError, match=r"\$Entities of the \.msh promises"):
        load_surface(write(tmp_path, "b.msh", text.replace(ENTITIES, ENTITIES[:-10])))


@pytest.mark.parametrize("order", ["<", ">"])
def test_physical_groups_of_binary_msh_4_1(order, tmp_path):
    def packed(form, *values):
        return struct.pack(order + form, *values)

    entities = packed("4q", 1, 0, 2, 0) + packed("i3dq", 1, 0, 0, 0, 0)
    for entity, groups in ((10, [5]), (11, [])):
        entities += (
            packed("i6dq", entity, *[0.0] * 6, len(groups)) + packed(f"{len(groups)}i", *groups) + packed("q", 0)
        )
    nodes = packed("4q", 1, 8, 1, 8) + packed("3iq", 2, 1, 0, 8) + packed("8q", *range(1, 9))
    nodes += b"".join(packed("3d", *p) for p in CUBE)
    elements = packed("4q", 2, 12, 1, 12)
    for entity, triangles in ((10, TRIANGLES[:2]), (11, TRIANGLES[2:])):
        elements += packed("3iq", 2, entity, 2, len(triangles)) + b"".join(packed("4q", 1, *(f + 1)) for f in triangles)
    content = b"$MeshFormat\n4.1 1 8\n" + packed("i", 1) + b"\n$EndMeshFormat\n" + NAMED.encode()
    for name, body in ((b"Entities", entities), (b"Nodes", nodes), (b"Elements", elements)):
        content += b"$%b\n%b\n$End%b\n" % (name, body, name)
    check_groups(load_surface(write(tmp_path, "a.msh", content)), {"inlet": [0]})
    check_groups(load_surface(write(tmp_path, "b.msh", msh41_binary(order, 0))), {"5": range(6), "8": range(6)})


@pytest.mark.parametrize(("mode", "compressor"), [("ascii", None), ("binary", "ZLib"), ("appended", "LZ4")])
def test_whole_numbers_of_vtu_cells(mode, compressor, tmp_path):
    triangles = [(TYPES.TRIANGLE, face) for face in TRIANGLES[:4]]
    mesh = grid([(TYPES.QUAD, QUADS[2]), *triangles, *((TYPES.QUAD, row) for row in QUADS[3:])])
    mesh.cell_data["part"] = np.array([2, 0, 0, 1, 1, 3, 3, 3], dtype=np.int16)
    mesh.cell_data["heat"] = np.arange(8.0)
    mesh.cell_data["vector"] = np.ones((8, 3), dtype=int)
    surface = load_surface(save(mesh, tmp_path / "a.vtu", mode, compressor))
    check_groups(surface, {"part=0": [0], "part=1": [1], "part=2": [2], "part=3": [3, 4, 5]})


def test_a_vtu_of_solid_cells_gives_their_numbers_to_their_faces(tmp_path):
    box = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], dtype=float)
    cells = [(TYPES.HEXAHEDRON, [k, k + 1, k + 4, k + 3, k + 6, k + 7, k + 10, k + 9]) for k in (0, 1)]
    mesh = grid(cells, box)
    mesh.cell_data["part"] = [4, 6]
    surface = load_surface(save(mesh, tmp_path / "a.vtu"))
    middle = surface.vertices[surface.faces].mean(axis=1)[:, 0]
    assert surface.groups["part=4"].tolist() == np.flatnonzero(middle < 1).tolist()
    assert surface.groups["part=6"].tolist() == np.flatnonzero(middle > 1).tolist()
    assert len(surface.faces) == 20


def test_references_of_a_medit_file(tmp_path):
    triangles = rows((*(face + 1), i // 4) for i, face in enumerate(TRIANGLES))
    cells = rows((*(np.array(tet) + 1), 8) for tet in TETS)
    head = f"MeshVersionFormatted 2\nDimension 3\nVertices 8\n{rows((*place, 0) for place in CUBE)}"
    expected = {"ref=0": [0, 1], "ref=1": [2, 3], "ref=2": [4, 5]}
    check_groups(load_surface(write(tmp_path, "a.mesh", f"{head}Triangles 12\n{triangles}End\n")), expected)
    both = f"{head}Tetrahedra 6\n{cells}Triangles 12\n{triangles}End\n"
    surface = load_surface(write(tmp_path, "b.mesh", both))
    check_groups(surface, expected)


def test_numbers_of_meshes_in_memory():
    part = np.repeat([3, 1, 2], 4)
    expected = {"part=3": [0, 1], "part=1": [2, 3], "part=2": [4, 5]}
    attribute = trimesh.Trimesh(CUBE, TRIANGLES, face_attributes={"part": part}, process=False)
    noted = trimesh.Trimesh(CUBE, TRIANGLES, metadata={"part": part, "author": "made by code"}, process=False)
    for mesh in (attribute, noted):
        check_groups(load_surface(mesh), expected)
    lines = pyvista.PolyData(CUBE, np.column_stack([np.full(12, 3), TRIANGLES]), lines=[2, 0, 1])
    lines.cell_data["part"] = np.append([9], part)
    check_groups(load_surface(lines), expected)
    blocks = [("line", [[0, 1]]), ("quad", QUADS[:2]), ("triangle", TRIANGLES[4:])]
    data = {"part": [[9], [3, 3], part[4:]], "heat": [[0.5], [0.5, 0.5], np.ones(8)]}
    mesh = meshio.Mesh(CUBE, blocks, cell_data=data, cell_sets={"lid": [[], [1], []]})
    check_groups(load_surface(mesh), {**expected, "lid": [1]})


def test_groups_stay_with_their_faces_where_faces_are_dropped_and_turned():
    flat = [[0, 0, 1], [1, 2, 2]]
    given = np.concatenate([flat[:1], TRIANGLES[:6], flat[1:], TRIANGLES[6:]])
    given[3] = given[3][::-1]
    named = {name: np.concatenate([[0], np.flatnonzero(_on(given, k))]) for k, name in enumerate(NAMES)}
    surface = surface_from_arrays(CUBE, given, "cube", groups=named)
    assert len(surface.faces) == 12 and any("repaired" in notice for notice in surface.notices)
    check_groups(surface, {name: [k] for k, name in enumerate(NAMES)})
    inverted = surface_from_arrays(CUBE, given[:, ::-1], "cube", groups=named)
    check_groups(inverted, {name: [k] for k, name in enumerate(NAMES)})


def _on(triangles, side):
    axis, place = SIDES[side]
    return np.all(CUBE[triangles][:, :, axis] == place, axis=1)


def test_groups_of_other_components_are_dropped():
    places, triangles = joined(ball(center=(5.0, 0.0, 0.0)), (CUBE, TRIANGLES))
    named = {"ball": range(320), "top": [322, 323], "both": [0, 320]}
    surface = surface_from_arrays(places, triangles, component=1, groups=named)
    assert {name: numbers.tolist() for name, numbers in surface.groups.items()} == {"top": [2, 3], "both": [0]}


def test_decimation_gives_each_triangle_the_groups_of_the_old_one_there():
    fine = trimesh.Trimesh(CUBE, TRIANGLES).subdivide().subdivide().subdivide()
    sides = {
        name: np.flatnonzero(np.all(fine.triangles[:, :, axis] == place, axis=1))
        for name, (axis, place) in zip(NAMES, SIDES, strict=True)
    }
    surface = surface_from_arrays(fine.vertices, fine.faces, groups=sides)
    smaller = decimate(surface, 100)
    assert len(smaller.faces) <= 100 and sorted(smaller.groups) == sorted(NAMES)
    assert all(smaller.part.area(smaller.part.group(name)) == pytest.approx(1.0, rel=1e-6) for name in NAMES)
    assert sum(len(numbers) for numbers in smaller.groups.values()) == len(smaller.faces)


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ({"lid": [12]}, "surface: group 'lid' must hold face numbers from 0 to 11"),
        ({"lid": [-1]}, "surface: group 'lid' must hold face numbers from 0 to 11"),
        ({"lid": [[1, 2]]}, r"surface: group 'lid' must be a row of face numbers, got int64 \(1, 2\)"),
        ({"lid": [0.5]}, r"surface: group 'lid' must be a row of face numbers, got float64 \(1,\)"),
    ],
)
def test_groups_that_are_no_faces_are_refused(groups, message):
    with pytest.raises(MeshError, match=message):
        surface_from_arrays(CUBE, TRIANGLES, groups=groups)


def test_too_many_groups_are_left_out_with_a_notice(tmp_path):
    text = "g " + " ".join(f"n{i}" for i in range(MOST_GROUPS + 1)) + "\n" + obj()
    surface = load_surface(write(tmp_path, "a.obj", text))
    assert surface.groups == {} and surface.notices[0] == f"left out {MOST_GROUPS + 1} groups of faces, more than 1000"


def test_check_lists_groups_with_their_faces_and_areas(tmp_path, capsys):
    text = obj(CUBE * [1.0, 2.0, 3.0]).replace("f ", "g left\nf ", 1)
    path = write(tmp_path, "a.obj", text)
    assert main(["check", str(path)]) == 0
    assert "\ngroup:           left, 12 faces, area 22" in capsys.readouterr().out
    assert main(["check", str(path), "--json"]) == 0
    assert '"name": "left"' in capsys.readouterr().out


def test_by_value_takes_one_number_a_face_and_a_few_values():
    assert by_value({"a": [1, 1, 1], "b": [0.0, 1.0, 1.0], "c": [1, 2], "d": [[1], [2], [3]]}, 3) == {}
    assert list(by_value({"a": np.arange(65)}, 65)) == [] and len(by_value({"a": np.arange(64)}, 64)) == 64
    found = by_value({"is up": [True, False, True]}, 3)
    assert {name: rows.tolist() for name, rows in found.items()} == {"is up=0": [1], "is up=1": [0, 2]}


def test_the_same_name_gathers_and_numbers_are_carried():
    groups = gathered([("a", [3, 1]), ("b", []), ("a", [1, 0]), (" ", [2]), ("c", [2])])
    assert {name: rows.tolist() for name, rows in groups.items()} == {"a": [0, 1, 3], "c": [2]}
    carried = renumbered(groups, np.array([3, -1, 0, 5, 0]))
    assert {name: rows.tolist() for name, rows in carried.items()} == {"a": [0, 2, 4]}


def test_arrays_hold_groups():
    groups = gathered([("höher", [3, 1]), ("b", [2]), ("all", range(4))])
    arrays = as_arrays(groups)
    again = from_arrays(*arrays.values(), 4)
    assert list(again) == list(groups)
    assert all(np.array_equal(again[name], groups[name]) for name in groups)
    assert from_arrays(*as_arrays({}).values(), 4) == {}
    names, sizes, numbers = arrays.values()
    for wrong in [(names[:2], sizes, numbers), (sizes, sizes, numbers), (names, sizes - 5, numbers)]:
        with pytest.raises(MeshError, match="do not fit together"):
            from_arrays(*wrong, 4)
    with pytest.raises(MeshError, match="the groups hold 7 faces, 6 are given"):
        from_arrays(names, sizes, numbers[1:], 4)
    with pytest.raises(MeshError, match="face numbers from 0 to 2"):
        from_arrays(names, sizes, numbers, 3)
