"""Limbs that leave a flat part side by side begin in a row, and the blocks of the flat part are cut into strips."""

from collections import Counter

import numpy as np
import pytest
from block_bodies import glued
from test_rods_layout_automatic import GRAPHS
from thick_graphs import curve, exposed_genus, thick

from parameterize.certificate.boundary import check_boundary
from parameterize.certificate.certify import certify
from parameterize.layouts.rods import along_skeleton
from parameterize.layouts.rods.along_skeleton import blocks_along
from parameterize.layouts.rods.rows import with_rows
from parameterize.layouts.rods.strips import BlockCuts, Crossing, cut_into_strips
from parameterize.surface.solid import Solid

X, Y, Z = np.eye(3)


def finger(lateral):
    """From the origin into the flat part, side by side with the others there, and away from them."""
    bend, knuckle = np.array([0.3, 0.9 * lateral, 0.0]), np.array([0.9, 1.2 * lateral, 0.0])
    tip = np.array([1.9, 2.6 * lateral, 0.0])
    return np.concatenate([curve(0 * X, bend)[:-1], curve(bend, knuckle)[:-1], curve(knuckle, tip)])


LATERAL = (-0.42, -0.14, 0.14, 0.42)
ARM, THUMB = curve(0 * X, -1.2 * X), curve(0 * X, [0.2, -1.1, 0.0])


def hand(*others):
    """A palm with fingers, and what else begins in its middle."""
    curves = [*map(finger, LATERAL), *others]
    return thick(
        [0 * X, *(path[-1] for path in curves)], [(0, k, path) for k, path in enumerate(curves, start=1)], cells=70
    )


def rows_of(skeleton, vertices, faces):
    return with_rows(skeleton, Solid(vertices, faces))


@pytest.mark.parametrize("others", [(ARM,), (ARM, THUMB)], ids=["arm", "arm_and_thumb"])
def test_fingers_begin_in_a_row_before_the_gaps(others):
    found, rows = rows_of(*hand(*others))
    ((node, row),) = rows.items()
    begins = np.array([found.branches[number].points[0] for number, _ in row.limbs])
    assert np.all(np.abs(begins[:, 0] - 0.9) < 0.4)  # the tubes part at a distance of .4: about there
    laterals = begins[:, 1] * np.sign(begins[-1, 1])
    assert np.all(np.diff(laterals) > 0.2)
    assert np.allclose(found.nodes[node], begins.mean(axis=0))
    stem, end = row.stem
    assert np.array_equal(found.branches[stem].points[-1 if end else 0], found.nodes[node])
    tips = len(others) + len(LATERAL)
    hubs = [5] if len(others) == 1 else [3, 5]  # an arm alone is the stem's other end
    assert sorted(found.degrees) == [1] * tips + hubs
    assert found.handles == 0


@pytest.mark.parametrize("name", ["three limbs", "two legs", "five limbs", "six limbs", "eight limbs", "frame"])
def test_limbs_that_part_at_once_have_no_row(name):
    skeleton, vertices, faces = thick(*GRAPHS[name], cells=60)
    found, rows = rows_of(skeleton, vertices, faces)
    assert not rows and [one.ends for one in found.branches] == [one.ends for one in skeleton.branches]


@pytest.mark.parametrize("others", [(ARM,), (ARM, THUMB)], ids=["arm", "arm_and_thumb"])
def test_the_flat_part_is_cut_into_a_strip_for_each_finger(others):
    skeleton, vertices, faces = hand(*others)
    blocks = blocks_along(skeleton, vertices, faces)
    body = blocks.body
    certificate = certify(body)
    assert certificate.verdict == "certified" and not any(patch.left_handed for patch in certificate.patches)
    assert check_boundary(body).injective
    assert Solid(vertices, faces).contains(blocks.points).all()
    assert exposed_genus(blocks) == 0 and len(body.parts) == 1
    strips = Counter(name.partition(", strip")[0] for name in blocks.names)
    assert set(strips.values()) <= {1, len(LATERAL)} and len(LATERAL) in strips.values()
    fingers = [k for k in range(len(blocks)) if blocks.straight(k)([[0.5, 0.5, 1.0]])[0, 0] > 1.5]
    neighbours = {
        q
        for one in blocks.interfaces
        for p, q in ((one.first[0], one.second[0]), (one.second[0], one.first[0]))
        if p in fingers
    }
    assert len(fingers) == len(LATERAL) == len(neighbours)  # each on a strip of its own


def test_limbs_are_laid_without_a_row_where_its_strips_do_not_fit(monkeypatch):
    def cross(*_):
        raise Crossing

    graph = GRAPHS["hand"]  # which has blocks without a row, too
    skeleton, vertices, faces = thick(*graph, cells=60)
    assert any("strip" in name for name in blocks_along(skeleton, vertices, faces).names)
    monkeypatch.setattr(along_skeleton, "cut_into_strips", cross)
    assert not any("strip" in name for name in blocks_along(skeleton, vertices, faces).names)


def chain_of_cubes():
    """Three unit cubes in a row along x; the last one is turned about x by a right angle."""
    cube = np.stack(np.meshgrid(*[[0.0, 1.0]] * 3, indexing="ij"), axis=-1).transpose(2, 0, 1, 3)  # [w][u][v]
    turned = np.stack([cube[..., 0] + 2.0, 1.0 - cube[..., 2], cube[..., 1]], axis=-1)
    return glued(*((str(k), one, (2, 2, 2)) for k, one in enumerate((cube, cube + X, turned))))


def test_strips_go_on_through_glued_faces_and_turn_with_them():
    blocks = chain_of_cubes()
    cuts = BlockCuts(1, np.array([[0.75, 0.25]]))  # across y, at a quarter
    strips, parents = cut_into_strips(blocks, [(0, cuts)])
    assert parents.tolist() == [0, 0, 1, 1, 2, 2]
    corners = strips.points[strips.hexahedra]
    assert [sorted(set(strip[..., 1].ravel().tolist())) for strip in corners[:4]] == [[0.0, 0.25], [0.25, 1.0]] * 2
    assert len(strips.interfaces) == 4 + 3  # two along x for each strip, one between the two
    with pytest.raises(Crossing):
        cut_into_strips(blocks, [(0, cuts), (1, BlockCuts(2, np.array([[0.5, 0.5]])))])


def test_a_block_that_nothing_reaches_stays_whole():
    blocks = chain_of_cubes()
    strips, _ = cut_into_strips(blocks, [(0, BlockCuts(0, np.array([[0.5, 0.5]])))])
    assert strips.names == ("0, strip 0", "0, strip 1", "1", "2")
