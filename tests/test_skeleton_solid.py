"""Skeletons of bodies whose loops, limbs and junctions are known."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree
from thick_bodies import at_volume_one, capsule, implicit, plate, ring, star, union

from parameterize.layouts.skeleton.curve_skeleton import skeleton_of
from parameterize.layouts.skeleton.graph import SkeletonError

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def checked(body):
    """Return the skeleton of a body after the checks that hold for all."""
    vertices, faces, genus = body
    skeleton = skeleton_of(vertices, faces, genus)
    assert skeleton.handles == genus and 0.0 < skeleton.tube <= 1.0
    for branch in skeleton.branches:
        assert branch.points[0] == pytest.approx(skeleton.nodes[branch.ends[0]], abs=1e-12)
        assert branch.points[-1] == pytest.approx(skeleton.nodes[branch.ends[1]], abs=1e-12)
        distance = np.sqrt(igl.point_mesh_squared_distance(branch.points, vertices, faces)[0])
        assert branch.radii == pytest.approx(distance, abs=1e-12)
        assert np.all(igl.fast_winding_number(vertices, faces, branch.points) > 0.5)
    assert max(skeleton.degrees, default=0) <= 6
    return skeleton


def test_a_torus_is_its_circle():
    vertices, faces, genus = implicit(lambda x: ring(x, 0.0, 1.0, 0.3), (1.4, 1.4, 0.4))
    skeleton = checked((vertices, faces, genus))
    major = (1.0 / (2.0 * np.pi**2 * 0.3**2)) ** (1.0 / 3.0)  # at volume 1
    (branch,) = skeleton.branches
    assert branch.ends == (0, 0) and skeleton.degrees == (2,)
    assert np.hypot(branch.points[:, 0], branch.points[:, 1]) == pytest.approx(major, rel=0.03)
    assert branch.length == pytest.approx(2.0 * np.pi * major, rel=0.03)
    assert branch.radii == pytest.approx(0.3 * major, rel=0.1)
    assert skeleton.tube > 0.9


def test_two_tori_meet_in_one_junction():
    skeleton = checked(
        implicit(lambda x: union(ring(x, -1.0, 0.8, 0.33), ring(x, 1.0, 0.8, 0.33)), (2.4, 1.4, 0.6), 60)
    )
    assert [branch.ends for branch in skeleton.branches] == [(0, 0), (0, 0)]


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_each_limb_of_a_star_has_a_tip_one_radius_from_its_end(count):
    vertices, faces, genus = star(AXES[:count])
    skeleton = checked((vertices, faces, genus))
    assert sorted(skeleton.degrees) == [1] * count + [count]
    scale = vertices.max() / (1.6 + 0.22)
    tips = skeleton.nodes[np.equal(skeleton.degrees, 1)] / scale
    ends = 1.6 * AXES[:count]
    gaps = np.linalg.norm(tips[:, None] - ends[None], axis=2)
    assert sorted(np.argmin(gaps, axis=1)) == list(range(count)) and gaps.min(axis=1).max() < 0.12


def test_a_hand_has_five_fingers():
    """The limbs of a flat body are side by side; the junctions between them are in its palm."""
    fingers = [((0.28 * i - 0.56, 0.4, 0.0), (0.34 * i - 0.68, 1.7, 0.0)) for i in range(5)]
    palm = [((-0.5, -0.2, 0), (0.5, -0.2, 0)), ((-0.5, 0.2, 0), (0.5, 0.2, 0))]
    skeleton = checked(
        implicit(
            lambda x: union(
                *(capsule(x, *ends, 0.1) for ends in fingers), *(capsule(x, *ends, 0.24) for ends in palm), sharpness=24
            ),
            (1.1, 2.0, 0.4),
            90,
        )
    )
    tips = skeleton.nodes[np.equal(skeleton.degrees, 1)]
    assert np.sum(tips[:, 1] > 0.8 * tips[:, 1].max()) == 5


def test_a_plate_has_loops_around_its_holes_and_no_ends_at_its_corners():
    skeleton = checked(plate([(x, y) for x in (-2, 2) for y in (-1, 1)]))
    assert min(skeleton.degrees) >= 3


def test_a_ball_is_a_single_node():
    skeleton = checked(implicit(lambda x: np.linalg.norm(x, axis=0) - 1.0, (1.2, 1.2, 1.2), 32))
    assert skeleton.branches == () and skeleton.degrees == (0,)
    assert skeleton.radii[0] == pytest.approx((0.75 / np.pi) ** (1.0 / 3.0), rel=0.05)


def test_a_rod_is_one_branch_with_two_tips():
    skeleton = checked(at_volume_one(trimesh.creation.capsule(height=6.0, radius=0.5, count=[24, 24])))
    assert skeleton.degrees == (1, 1)
    length = skeleton.branches[0].length / (np.pi * 0.25 * (6.0 + 2.0 / 3.0)) ** (-1.0 / 3.0)
    assert length == pytest.approx(6.0, abs=0.3)  # from the middle of one cap's ball to that of the other


def test_a_knotted_tunnel_is_refused_in_words():
    t = np.linspace(-np.pi, np.pi, 400)[20:-20]
    knot = np.stack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)], axis=1)
    up = np.linspace(0.0, 4.0, 120)[:, None]
    curve = np.concatenate([(knot[0] + up * (-0.25, -1.0, 0.6))[::-1], knot, knot[-1] + up * (0.25, -1.0, -0.6)])
    tree = cKDTree(curve)

    def body(x):
        tunnel = 0.4 - tree.query(x.reshape(3, -1).T)[0].reshape(x.shape[1:])
        return np.maximum(np.linalg.norm(x, axis=0) - 4.2, tunnel)

    vertices, faces, genus = implicit(body, (4.5, 4.5, 4.5), 60)
    assert genus == 1
    with pytest.raises(SkeletonError, match="knotted tunnel.*fill the tunnel"):
        skeleton_of(vertices, faces, genus)


def test_a_part_that_is_too_thin_is_named_with_its_place(monkeypatch):
    """A ring as thin as a wire on a ball, at a resolution that cannot hold it."""
    monkeypatch.setattr("parameterize.layouts.skeleton.lattice.MOST_POINTS", 100_000)
    vertices, faces, genus = implicit(
        lambda x: np.minimum(np.linalg.norm(x, axis=0) - 1.0, ring(x, 1.0, 0.8, 0.02)), (2.0, 1.1, 1.1), 200
    )
    assert genus == 1
    places = []
    with pytest.raises(SkeletonError, match=r"too thin near here: of 1 handles.*thicken") as error:
        skeleton_of(vertices, faces, genus, lambda place: places.append(place) or "here")
    assert "\n" not in str(error.value)
    scale = vertices[:, 0].max() / 1.82
    assert np.linalg.norm(places[0]) > 1.05 * scale and abs(places[0][2]) < 0.03 * scale  # on the wire


def test_a_foil_has_no_skeleton_and_says_so_at_once():
    """A prism over a triangle of height 1e-6: its box has 80 million points at the first resolution."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 1e-6]])
    points = np.concatenate([np.column_stack([corners, np.full(3, z)]) for z in (0.0, 1.0)])
    faces = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]
    with pytest.raises(SkeletonError, match="too thin: a lattice across it has far too many points"):
        skeleton_of(points * 5e-7 ** (-1.0 / 3.0), np.array(faces), 0)


def test_the_same_surface_has_the_same_bits():
    body = star(AXES[:3])
    first, second = skeleton_of(*body), skeleton_of(*body)
    assert first.nodes.tobytes() == second.nodes.tobytes()
    assert [a.points.tobytes() for a in first.branches] == [b.points.tobytes() for b in second.branches]
