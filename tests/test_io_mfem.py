"""MFEM NURBS meshes of several patches: written ones are read by MFEM itself, those of MFEM here and there alike."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from bodies import exact_ring, ring, row_of, turned
from foreign_files import mfem_patches
from foreign_models import patch_files
from glued import POINTS, demand_same
from volumes import spans_at

import iga_nn
from iga_nn.io.mfem import read_mfem
from parameterize.spline.multipatch import as_multipatch
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
    return iga_nn.MultiPatch.from_patches(patches)


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
    iga_nn.MultiPatch.from_patches(doubled).save("ring.npz")
    with pytest.raises(iga_nn.InputError, match="multiply the weights of one by their ratio"):
        iga_nn.export("ring.npz", "mfem")


@pytest.mark.parametrize("kind", ["controlpoints", "controlpoints_homogeneous", "controlpoints_cartesian"])
def test_patches_with_their_own_control_points(kind, in_folder):
    Path("patches.mesh").write_text(mfem_patches(kind, weight=2))
    body = iga_nn.load_volume("patches.mesh")
    assert [str(interface) for interface in body.interfaces] == ["p0_u1 = p1_u1"]
    found, _ = in_mfem("patches.mesh", body)
    assert np.abs(found - [patch(POINTS) for patch in body]).max() < 1e-15


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
    body = iga_nn.MultiPatch.from_patches(list(as_multipatch(iga_nn.load_volume(path))))
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
