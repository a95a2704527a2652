"""MFEM NURBS meshes of several patches: written ones are read by MFEM itself, those of MFEM here and there alike."""

from dataclasses import replace
from importlib.util import find_spec
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from bodies import exact_ring, ring, row_of, turned
from foreign_files import mfem_patches, mfem_shuffled
from foreign_models import patch_files
from glued import POINTS, demand_same
from volumes import spans_at

import iga_nn
from iga_nn.io.mfem import read_mfem
from parameterize.spline.body import as_body
from parameterize.spline.orientation import orientation

CORNER = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
WAYS = [((0, 1, 2), (False, False, False)), ((1, 2, 0), (True, False, True)), ((2, 0, 1), (False, True, True))]
LEFT = [((0, 1, 2), (False, False, False)), ((1, 0, 2), (False, False, False)), ((0, 1, 2), (True, False, False))]
BLOCK = list(product((0, 1), repeat=3))
BODIES = {
    "corner": row_of(CORNER, WAYS),
    "left": row_of(CORNER, LEFT),
    "block": row_of(BLOCK, (WAYS * 3)[:8]),
    "three": ring(3),
    "exact": exact_ring(),
    "four, twisted": ring(4, shape=(6, 4, 4), degrees=(2, 2, 2), twist=2.0),
}


@pytest.fixture(params=BODIES)
def body(request, in_folder):
    BODIES[request.param].save("body.npz")
    return BODIES[request.param]


def upright(body):
    """The body as its mesh holds it: w is reversed in patches that are left-handed."""
    patches = [turned(patch, back=(False, False, orientation(patch) < 0)) for patch in body]
    return iga_nn.Body.from_patches(patches)


def in_mfem(path, body):
    """MFEM's own places of points of each patch, (patches, points, 3), and its mesh."""
    mfem = pytest.importorskip("mfem.ser")
    mesh, start, found = mfem.Mesh(str(path), 1, 0), 0, []
    for patch in body:
        places = []
        for number, local in zip(*spans_at(patch, POINTS), strict=True):
            point = mfem.IntegrationPoint()
            point.Set3(*local)
            places.append([*mesh.GetElementTransformation(int(start + number)).Transform(point)])
        start += np.prod([len(np.unique(row)) - 1 for row in patch.knots])
        found.append(places)
    assert mesh.GetNE() == start
    return np.array(found), mesh


def test_what_was_written_is_read_again(body):
    demand_same(iga_nn.load_volume(iga_nn.export("body.npz", "mfem")), upright(body))


def test_mfem_reads_its_mesh(body):
    path = iga_nn.export("body.npz", "mfem")
    found, mesh = in_mfem(path, upright(body))
    for places, patch in zip(found, upright(body), strict=True):
        assert np.abs(places - patch(POINTS)).max() < 1e-12
    outer = sum(len(faces) for faces in body.outer)
    assert len(set(mesh.GetBdrAttributeArray())) == outer
    assert set(mesh.GetAttributeArray()) == set(range(1, len(body) + 1))


def test_control_points_of_interfaces_are_one(body):
    """As many in MFEM's space as there are distinct ones."""
    mfem = pytest.importorskip("mfem.ser")
    mesh = mfem.Mesh(str(iga_nn.export("body.npz", "mfem")), 1, 0)
    points = np.concatenate([patch.control_points.reshape(-1, 3) for patch in body])
    assert mesh.GetNodes().FESpace().GetNDofs() == len(np.unique(points, axis=0))


def test_a_mesh_that_mfem_wrote_is_read(body):
    mfem = pytest.importorskip("mfem.ser")
    mfem.Mesh(str(iga_nn.export("body.npz", "mfem")), 1, 0).Print("printed.mesh", 17)
    demand_same(iga_nn.load_volume("printed.mesh"), upright(body))


def test_coordinates_may_come_one_after_the_other(body):
    """Ordering 0: all x, then all y, then all z."""
    text = iga_nn.export("body.npz", "mfem").read_text()
    head, _, rows = text.partition("Ordering: 1")
    columns = np.array([row.split() for row in rows.split("\n") if row]).T
    Path("columns.mesh").write_text(head + "Ordering: 0\n\n" + "\n".join(columns.ravel()) + "\n")
    demand_same(iga_nn.load_volume("columns.mesh"), upright(body))


@pytest.mark.parametrize("patches", [1, 2])
def test_a_ring_whose_edges_mfem_cannot_tell_apart_is_refused(patches, in_folder):
    ring(patches).save("ring.npz")
    with pytest.raises(iga_nn.InputError, match="divide its patches, or export it --to gismo"):
        iga_nn.export("ring.npz", "mfem")


def test_a_moebius_strip_is_refused(in_folder):
    """The thickness v comes back the other way round."""
    ring(3, twist=1.0).save("strip.npz")
    with pytest.raises(iga_nn.InputError, match="as on a Moebius strip"):
        iga_nn.export("strip.npz", "mfem")


def test_weights_in_proportion_have_no_place(in_folder):
    body = exact_ring()
    doubled = [replace(patch, weights=(1 + number % 2) * patch.weights) for number, patch in enumerate(body)]
    iga_nn.Body.from_patches(doubled).save("ring.npz")
    with pytest.raises(iga_nn.InputError, match="multiply the weights of one by their ratio"):
        iga_nn.export("ring.npz", "mfem")


@pytest.mark.parametrize("kind", ["controlpoints", "controlpoints_homogeneous", "controlpoints_cartesian"])
def test_patches_with_their_own_control_points(kind, in_folder):
    Path("patches.mesh").write_text(mfem_patches(kind, weight=2))
    body = iga_nn.load_volume("patches.mesh")
    assert [str(interface) for interface in body.interfaces] == ["p0_u1 = p1_u1"]
    found, _ = in_mfem("patches.mesh", body)
    assert np.abs(found - [patch(POINTS) for patch in body]).max() < 1e-14


def test_rules_for_a_later_refinement_are_passed_over(in_folder):
    ring(3).save("ring.npz")
    text = iga_nn.export("ring.npz", "mfem").read_text()
    later = text.replace("v1.0", "v1.1").replace("weights\n", "spacing\n2\n0 5 3 1 1 0 1 10.0\n1 0 0 0\n\nweights\n")
    Path("later.mesh").write_text(later)
    demand_same(iga_nn.load_volume("later.mesh"), iga_nn.load_volume("ring.mesh"))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("elements\n2\n", "elements\n3\n1 5 0 1 4 3 6 7 10 9\n", "3 elements have the face of the vertices"),
        ("knotvectors\n3", "knotvectors\n2", "patch 0 must have three knot vectors"),
        ("1 5 5 4 1 2 11 10 7 8", "1 5 4 1 2 5 10 7 8 11", "p0_u1 = p1_v0: the file says that they are one"),
        ("2.0 1.0 0.0 1", "2.0 1.0 nan 1", "the control points of patch 1 must be finite"),
        ("2.0 1.0 0.0 1", "2.0 1.0 0.0 -1", "patch 1: weights must be positive"),
        ("2.0 1.0 0.0 1.0", "2e99 1.0 0.0 1e-300", "patch 1: control_points must be finite"),
        ("dimension\n3\n\ncontrolpoints", "dimension\n2\n\ncontrolpoints", "patch 0 must have control points of 3"),
    ],
)
def test_faults_of_patches_are_told(old, new, says, in_folder):
    text = mfem_patches()
    assert old in text
    Path("bad.mesh").write_text(text.replace(old, new, 1))
    with pytest.raises(iga_nn.InputError, match=rf"bad\.mesh: .*{says}"):
        iga_nn.load_volume("bad.mesh")


def test_neighbours_with_other_numbers_of_control_points_are_refused(in_folder):
    """The edges of a face have other knot vectors on the side of its second patch."""
    row_of(CORNER[:2], WAYS[:2]).save("two.npz")
    text = iga_nn.export("two.npz", "mfem").read_text()
    head, edges, rest = text.partition("edges\n")
    Path("bad.mesh").write_text(head + edges + rest.replace("\n1 ", "\n0 ", 1))
    with pytest.raises(iga_nn.InputError, match=r"bad\.mesh: element 0: its edges in one direction have different"):
        iga_nn.load_volume("bad.mesh")


def demand_alike(path, patches, interfaces):
    body = iga_nn.Body.from_patches(list(as_body(iga_nn.load_volume(path))))
    assert (len(body), len(body.interfaces)) == (patches, interfaces)
    found, _ = in_mfem(path, body)
    assert np.abs(found - [patch(POINTS) for patch in body]).max() < 1e-12


@pytest.mark.parametrize(("name", "patches", "interfaces"), [("beam-hex-nurbs.mesh", 2, 1), ("pipe-nurbs.mesh", 4, 4)])
def test_models_of_mfem_open(name, patches, interfaces):
    for path in patch_files(name):
        assert len(list(read_mfem(path.read_text())[1])) == interfaces
        demand_alike(path, patches, interfaces)


@pytest.mark.parametrize(
    ("name", "patches", "interfaces"),
    [("ball-nurbs", 7, 18), ("cube-nurbs", 1, 0), ("pipe-nurbs-log", 4, 4), ("beam-hex-nurbs", 2, 1)],
)
def test_meshes_that_come_with_mfem_open(name, patches, interfaces):
    """The unit ball of seven rational patches of degree 4 among them."""
    package = pytest.importorskip("mfem")
    path = Path(package.__file__).parent / "external" / "ser" / "data" / f"{name}.mesh"
    if not path.is_file():
        pytest.skip(f"{path} does not come with this MFEM")
    demand_alike(path, patches, interfaces)


def uneven(place, turn):
    """A bent box of which no knot vector is the same from both ends, turned."""
    knots = [np.array([0.0, 0.0, 0.0, inner, 1.0, 1.0, 1.0]) for inner in (0.25, 0.375, 0.125)]
    net = np.stack(np.meshgrid(*[(row[1:5] + row[2:6]) / 2 for row in knots], indexing="ij"), axis=-1) + place
    bent = net + 0.1 * np.roll(net, 1, axis=-1) ** 2
    return turned(iga_nn.BSplineVolume((2, 2, 2), tuple(knots), bent), *turn)


TWO_WAYS = [((0, 1, 2), (False, False, False)), ((2, 0, 1), (True, True, False)), ((0, 1, 2), (True, True, False))]
UNEVEN = {
    "corner": iga_nn.Body.from_patches(list(map(uneven, CORNER, TWO_WAYS))),
    "block": iga_nn.Body.from_patches(list(map(uneven, BLOCK, (TWO_WAYS * 3)[:8]))),
}


@pytest.mark.parametrize("name", UNEVEN)
def test_knots_that_differ_from_their_reverse_run_the_right_way(name, in_folder):
    """In what MFEM reads of an export, and in what is read of MFEM's own mesh with vertices in any order."""
    body = UNEVEN[name]
    body.save("body.npz")
    path = iga_nn.export("body.npz", "mfem")
    assert np.abs(in_mfem(path, body)[0] - [patch(POINTS) for patch in body]).max() < 1e-12
    assert (
        np.abs(np.array([patch(POINTS) for patch in iga_nn.load_volume(path)]) - in_mfem(path, body)[0]).max() < 1e-12
    )


@pytest.mark.parametrize("name", UNEVEN)
@pytest.mark.parametrize("seed", range(3))
def test_a_mesh_of_mfem_with_shuffled_vertices_is_read(name, seed, in_folder):
    """MFEM lists every edge from its lower vertex: the four edges of a patch in one direction run different ways."""
    body = UNEVEN[name]
    Path("patches.mesh").write_text(mfem_shuffled(body, seed))
    mfem = pytest.importorskip("mfem.ser")
    mfem.Mesh("patches.mesh", 1, 0).Print("printed.mesh", 17)
    ways = {start < end for start, end in edges_of("printed.mesh")}
    assert ways == {True}
    for one, other in zip(iga_nn.load_volume("printed.mesh"), body, strict=True):
        assert np.abs(one(POINTS) - other(POINTS)).max() < 1e-12


def edges_of(path):
    """The edges that a mesh lists, start and end."""
    rows = Path(path).read_text().split("edges\n")[1].splitlines()
    return [tuple(map(int, row.split()))[1:] for row in rows[1 : 1 + int(rows[0])]]


def test_edges_from_their_lower_vertices_say_nothing_of_the_way_of_knots(in_folder):
    """MFEM takes it from the edges between vertices 0 and 1, 1 and 2, 0 and 4: here 7 and 2, so u runs from u1 to u0.

    The knots in u are 0, 3/4, 1 from vertex 2 on, and the control points there lie at x = 1, 1/4 and 0.
    """
    element = [7, 2, 3, 6, 0, 5, 4, 1]
    along = {
        0: [(0, 1), (3, 2), (4, 5), (7, 6)],
        1: [(0, 3), (1, 2), (4, 7), (5, 6)],
        2: [(0, 4), (1, 5), (2, 6), (3, 7)],
    }
    edges = [(axis, *sorted((element[a], element[b]))) for axis, pairs in along.items() for a, b in pairs]
    places = [[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    rows = [places[element.index(number)] for number in range(8)]
    rows += [[0.25, *rows[start][1:]] for axis, start, _ in edges if axis == 0]
    lines = ["MFEM NURBS mesh v1.0", "dimension", "3", "elements", "1", f"1 5 {spaced(element)}", "boundary", "0"]
    lines += ["edges", "12", *map(spaced, edges), "vertices", "8", "knotvectors", "3", "1 3 0 0 0.75 1 1"]
    lines += ["1 2 0 0 1 1"] * 2 + ["unitweights", "FiniteElementSpace", "FiniteElementCollection: NURBS1"]
    Path("one.mesh").write_text("\n".join([*lines, "VDim: 3", "Ordering: 1", *map(spaced, rows), ""]))
    volume = iga_nn.load_volume("one.mesh")
    assert volume.knots[0].tolist() == [0.0, 0.0, 0.25, 1.0, 1.0]
    assert np.abs(volume(POINTS) - POINTS).max() < 1e-15
    if find_spec("mfem"):
        assert np.abs(in_mfem("one.mesh", [volume])[0] - POINTS).max() < 1e-12


def spaced(row):
    return " ".join(map(str, row))


@pytest.mark.parametrize("section", ["periodic\n1\n1\n1\n3\n", "mesh_elements\n1\n0\n"])
def test_sections_that_change_the_mesh_are_refused_by_name(section, in_folder):
    ring(3).save("ring.npz")
    text = iga_nn.export("ring.npz", "mfem").read_text()
    Path("bad.mesh").write_text(text.replace("weights\n", section + "\nweights\n"))
    with pytest.raises(
        iga_nn.InputError, match=rf"bad\.mesh: line .*got '{section.split()[0]}'.*: save the mesh without"
    ):
        iga_nn.load_volume("bad.mesh")
