"""Hexahedra of curved tetrahedra: cubic nodes, bounds of det J, smoothing, stepping back, and parts of CAD."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import iga_nn
from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.layouts.tetrahedra import mesher
from parameterize.layouts.tetrahedra.curving import LEAST, CurvedMesh, curved, stepped_back
from parameterize.layouts.tetrahedra.determinant import determinant_coefficients
from parameterize.layouts.tetrahedra.hexahedra import spline_of_tetrahedra
from parameterize.layouts.tetrahedra.mesh import EDGES, FACES, ORDER, THIRDS, TetrahedralMesh
from parameterize.layouts.tetrahedra.mesher import MesherError, Sizes, tetrahedra_of_brep
from parameterize.layouts.tetrahedra.part_mesh import curved_tetrahedra
from parameterize.layouts.tetrahedra.smoothing import distortion_of
from parameterize.layouts.tetrahedra.splitting import chords, split

BRACKET = Path(__file__).parent / "data" / "bracket.step"


def on_sphere(cells, outer):
    """Tetrahedra of the octahedron's vertices and its centre, whose faces without the vertices `outer` are curved."""
    points = np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    cells = np.array(cells)
    corners = points[cells]
    wrong = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    cells[wrong] = cells[wrong][:, [0, 1, 3, 2]]
    nodes = np.einsum("nk,tkx->tnx", THIRDS / ORDER, points[cells])
    curved_nodes = (THIRDS[:, outer] == 0).any(axis=1)
    nodes[:, curved_nodes] /= np.linalg.norm(nodes[:, curved_nodes], axis=2, keepdims=True)
    triangles = np.concatenate([np.delete(cells, column, axis=1) for column in outer])
    faces, segments = np.ones(len(triangles), dtype=int), np.empty((0, 2), dtype=int)
    solids = np.zeros(len(cells), dtype=int)
    return TetrahedralMesh(points, cells, solids, triangles, faces, segments, faces[:0], nodes)


def ball():
    """The eight octants of a ball."""
    return on_sphere([(0, a, b, c) for a in (1, 2) for b in (3, 4) for c in (5, 6)], [0])


def flat_ball():
    """Four quarters of a ball around an axis: each has two faces on the sphere, and det J is zero between them."""
    return on_sphere([(5, 6, a, b) for a in (1, 2) for b in (3, 4)], [0, 1])


def dented():
    """A cube with a node of one face far inside, so that no move of inner nodes unfolds it."""
    mesh = box()
    nodes = mesh.numbering.gathered(mesh.nodes)
    nodes[np.flatnonzero(mesh.on_part)[-1]] = 0.4
    return replace(mesh, nodes=nodes[mesh.numbering.cells])


def box():
    """A cube of six tetrahedra around its diagonal."""
    points = np.array(list(np.ndindex(2, 2, 2)), dtype=float)
    cells = np.array([(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)])
    nodes = np.einsum("nk,tkx->tnx", THIRDS / ORDER, points[cells])
    sides = np.sort(cells[:, FACES], axis=2).reshape(-1, 3)
    unique, counts = np.unique(sides, axis=0, return_counts=True)
    outer = unique[counts == 1]
    return TetrahedralMesh(
        points, cells, np.zeros(6, dtype=int), outer, np.ones(len(outer), dtype=int), outer[:0, :2], cells[:0, 0], nodes
    )


def cubic_det(nodes, weights):
    """det J of one cubic tetrahedron over that of the straight one, by differences of its polynomial."""
    powers = [tuple(row) for row in np.ndindex(4, 4, 4) if sum(row) <= 3]
    table = np.array([[np.prod(np.array(row[1:]) ** p) for p in map(np.array, powers)] for row in THIRDS / ORDER])
    solved = np.linalg.solve(table, nodes)
    step = 1e-6

    def at(x):
        return np.array([np.prod(x ** np.array(p)) for p in powers]) @ solved

    slopes = [(at(weights[1:] + step * e) - at(weights[1:] - step * e)) / (2 * step) for e in np.eye(3)]
    return np.linalg.det(slopes) / np.linalg.det(nodes[1:4] - nodes[0])


def test_nodes_of_common_edges_and_faces_are_one():
    mesh = box()
    numbering = mesh.numbering
    assert len(numbering) == 8 + 2 * len(numbering.edges) + len(numbering.faces)
    assert len(numbering.edges) == 19 and len(numbering.faces) == 18
    assert np.abs(mesh.straight[numbering.cells] - mesh.nodes).max() < 1e-15


def test_coefficients_bound_the_determinant_of_a_cubic_tetrahedron():
    mesh = ball()
    rows = determinant_coefficients(mesh.nodes)
    rng = np.random.default_rng(0)
    for weights in [*np.eye(4), *rng.dirichlet(np.ones(4), 5)]:
        value = cubic_det(mesh.nodes[0], weights)
        assert rows[0].min() - 1e-8 <= value <= rows[0].max() + 1e-8
    corner = cubic_det(mesh.nodes[0], np.eye(4)[1])
    assert np.abs(rows[0] - corner).min() < 1e-7  # a coefficient at a corner is the value there
    assert np.allclose(determinant_coefficients(box().nodes), 1.0)


def test_octants_of_a_ball_are_proved_on_the_sphere():
    found = curved(ball())
    assert found.is_proved and found.farthest == 0.0
    certificate = certify(spline_of_tetrahedra(found, 3).body)
    assert certificate.verdict == "certified" and certificate.volume == pytest.approx(4 / 3 * np.pi, rel=0.05)


def test_quarters_of_a_ball_are_flat_between_their_faces_until_an_inner_edge_is_split():
    mesh = flat_ball()
    assert determinant_coefficients(mesh.nodes).min() < LEAST
    found = curved(mesh)
    assert found.is_proved and len(found.mesh.cells) == 8


def test_nodes_that_fold_a_tetrahedron_step_back():
    back = stepped_back(curved(dented()))
    assert back.is_proved and back.farthest > 0.1
    assert certify(spline_of_tetrahedra(back, 3).body).verdict == "certified"


def test_smoothing_follows_the_slope_of_its_energy():
    mesh = split(box(), np.ones((6, 6), dtype=bool))
    cells, nodes = mesh.numbering.cells, mesh.straight
    found = distortion_of(cells, nodes, np.ones(len(cells), dtype=bool), mesh.on_part)
    assert len(found.free)
    rng = np.random.default_rng(1)
    moved = nodes.copy()
    moved[found.free] += 0.02 * rng.normal(size=(len(found.free), 3))
    energy, slope = found.value(moved, 0.1)
    way = np.zeros_like(moved)
    way[found.free] = rng.normal(size=(len(found.free), 3))
    change = (found.value(moved + 1e-6 * way, 0.1)[0] - found.value(moved - 1e-6 * way, 0.1)[0]) / 2e-6
    assert change == pytest.approx((slope * way[found.free]).sum(), rel=1e-6)
    assert found.value(found.smoothed(moved, 0.1), 0.1)[0] < energy


def test_a_split_edge_is_an_inner_one_and_the_volume_stays():
    mesh = box()
    bad = np.ones(len(mesh.cells), dtype=bool)
    wanted = chords(mesh, bad)
    on_part = mesh.on_part[mesh.numbering.cells[:, 4 : 4 + 2 * len(EDGES) : 2]]
    assert not (wanted & on_part).any()
    finer = split(mesh, ~on_part)
    assert len(finer.cells) == 12 and len(finer.points) == 9  # the diagonal is in all six
    assert finer.volumes.sum() == pytest.approx(1.0) and finer.volumes.min() > 0.0


@pytest.mark.parametrize("degree", [1, 2, 3, 4])
def test_hexahedra_of_straight_tetrahedra_are_a_proved_body(degree):
    mesh = box()
    spline = spline_of_tetrahedra(CurvedMesh(mesh, mesh.straight, np.zeros(len(mesh.straight))), degree)
    certificate = certify(spline.body)
    assert len(spline.body.patches) == 24 and certificate.verdict == "certified"
    assert certificate.volume == pytest.approx(1.0)
    assert len(spline.body.outer_faces) == 3 * len(mesh.triangles)
    assert check_boundary(spline.body).injective is True


def test_solids_of_tetrahedra_are_those_of_their_hexahedra():
    mesh = replace(box(), solids=np.array([0, 0, 0, 1, 1, 1]))
    found = CurvedMesh(mesh, mesh.straight, np.zeros(len(mesh.straight)))
    body = spline_of_tetrahedra(found, 1, ("steel", "pad")).body
    assert body.solids.has("pad").sum() == 12


def test_nodes_that_step_back_call_for_shorter_edges_there():
    asked = []

    def mesh_of(sizes):
        asked.append(sizes)
        return ball() if len(sizes.places) else dented()

    found = curved_tetrahedra(mesh_of, 2.0 * np.sqrt(3.0))
    assert found.is_proved and found.farthest == 0.0
    assert [len(sizes.places) > 0 for sizes in asked] == [False, True]


def test_a_mesher_that_fails_is_asked_for_finer_tetrahedra_and_then_refused():
    asked = []

    def mesh_of(sizes):
        asked.append(sizes.largest)
        raise MesherError("no tetrahedra")

    with pytest.raises(MesherError, match="no tetrahedra"):
        curved_tetrahedra(mesh_of, 1.0)
    assert len(asked) == 3 and asked == sorted(asked, reverse=True)


@pytest.mark.parametrize("text", [b"", b"no shape", b"DBRep_DrawableShape\n\nCASCADE Topology V1"])
def test_a_text_that_is_no_part_is_refused(text):
    with pytest.raises(MesherError):
        tetrahedra_of_brep(text, Sizes(1.0, 8.0))


def test_a_mesher_that_takes_too_long_is_ended(monkeypatch):
    monkeypatch.setattr(mesher, "PATIENCE", 0.01)
    with pytest.raises(MesherError, match="takes more than"):
        tetrahedra_of_brep(b"", Sizes(1.0, 8.0))


def test_a_part_from_cad_keeps_its_edges_and_is_proved():
    surface = iga_nn.load_surface(BRACKET)
    result = iga_nn.parameterize(surface, ways="hexahedra")
    assert result.origin == "hexahedra" and result.certificate.verdict == "certified"
    assert result.quality.boundary_check.injective is True
    assert result.certificate.volume == pytest.approx(24_000 + 16_000 - np.pi * 8**2 * 10, rel=1e-4)
