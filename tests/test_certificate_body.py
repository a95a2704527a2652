"""The certificate of several patches: one verdict, and the patch or the interface that spoils it."""

import numpy as np
import pytest
from patches import SYMMETRIES, cells, frame, patch, plate_with_hole, ring, turned

from parameterize.certificate.certify import certify
from parameterize.spline.body import Body
from parameterize.spline.bspline import open_uniform_knots
from parameterize.spline.interface import Interface
from parameterize.spline.volume import FACE_NAMES, BSplineVolume

LEFT = patch(lambda u, v, w: (u, v + 0.1 * u * w, w))


def beside(u, v, w):
    return 1.0 + u, v + 0.1 * w, w


def folded_back(u, v, w):
    return 1.0 - 0.5 * u, v + 0.1 * w, w


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_two_patches_glued_in_every_orientation(symmetry):
    """The second patch is left-handed in half of them; the same patch laid back over the first is never taken."""
    good = Body.from_patches([LEFT, turned(patch(beside), symmetry)])
    found = certify(good)
    assert len(good.interfaces) == 1 and found.verdict == "certified" and found.misglued == ()
    assert found.volume == pytest.approx(2.0)
    bad = Body.from_patches([LEFT, turned(patch(folded_back), symmetry)])
    found = certify(bad)
    assert {one.verdict for one in found.patches} == {"certified"}
    assert found.verdict == "folded" and found.misglued == bad.interfaces
    assert str(found) == f"folded: both patches lie on the same side of {bad.interfaces[0]}"


def test_half_of_the_orientations_are_left_handed():
    signs = [certify(turned(LEFT, symmetry)).left_handed for symmetry in SYMMETRIES]
    assert signs.count(True) == signs.count(False) == 24


@pytest.mark.parametrize(
    ("body", "volume", "relative"),
    [
        (Body.from_patches(cells([(0, 0, 0), (1, 0, 0), (0, 1, 0)])), 3.0, 1e-12),
        (frame(), 20.0, 1e-12),
        (plate_with_hole(9), 4.0 - np.pi / 4.0, 2e-5),
        (Body.from_patches([patch(ring(0, 1), (24, 4, 4))]), 0.36 * 2.0 * np.pi, 1e-4),
        (Body.from_patches([patch(ring(k / 4, (k + 1) / 4), (9, 4, 4)) for k in range(4)]), 0.72 * np.pi, 1e-4),
    ],
)
def test_good_bodies(body, volume, relative):
    found = certify(body)
    assert found.verdict == "certified"
    assert found.volume == pytest.approx(volume, rel=relative)
    assert found.lower_bound == min(one.lower_bound for one in found.patches) > 0.0
    assert str(found) == f"certified, |det J| >= {found.lower_bound:.3g} of its mean"


def test_a_volume_is_certified_as_the_only_patch_of_a_body():
    alone, among = certify(LEFT), certify(Body((LEFT,))).patches[0]
    assert (alone.verdict, alone.lower_bound, alone.mean_det) == (among.verdict, among.lower_bound, among.mean_det)


def test_a_patch_laid_upon_its_copy_is_folded_at_every_face():
    """All six faces would leave no boundary; one of them is left out."""
    with pytest.raises(ValueError, match="every face is glued"):
        Body.from_patches([LEFT, LEFT])
    glued = tuple(Interface((0, name), (1, name)) for name in FACE_NAMES[1:])
    found = certify(Body((LEFT, LEFT), glued))
    assert found.verdict == "folded" and found.misglued == glued


def test_a_fold_is_named_by_its_patch_and_place():
    good = cells([(0, 0, 0), (1, 0, 0), (2, 0, 0)], 4, 3)
    points = good[2].control_points.copy()
    points[1:3, 1:3, 1:3, 0] -= 3.0  # the inner control points, pulled through the second patch
    body = Body.from_patches([*good[:2], BSplineVolume(good[2].degrees, good[2].knots, points)])
    found = certify(body)
    assert [one.verdict for one in found.patches] == ["certified", "certified", "folded"]
    assert found.verdict == "folded" and found.misglued == () and found.lower_bound < 0.0
    assert str(found).startswith("folded: p2: folded at (")
    assert np.linalg.det(body.patches[2].jacobian([found.patches[2].witness])[0]) < 0.0


@pytest.mark.exact
def test_what_is_not_proved_is_named_by_patch():
    """dz/dw of the second patch touches zero at w = 1/2."""
    heights = np.array([0.0, 1.0, 0.0, 1.0]) / 3.0
    knots = open_uniform_knots(4, 3)
    rows = np.linspace(0.0, 1.0, 4)
    points = np.stack(np.meshgrid(1.0 + rows, rows, heights, indexing="ij"), axis=-1)
    first = points - [1.0, 0.0, 0.0]
    body = Body.from_patches([BSplineVolume((3, 3, 3), (knots,) * 3, net) for net in (first, points)])
    found = certify(body)
    assert found.verdict == "undecided" and len(body.interfaces) == 1
    flat = "det J is zero, up to rounding, at (0.5, 0, 0.5)"
    assert str(found) == f"undecided: p0: {flat}; p1: {flat}"


def test_an_interface_of_a_patch_that_is_not_certified_is_not_judged():
    points = patch(folded_back).control_points.copy()
    points[1:3, 1:3, 1:3, 0] += 3.0
    body = Body.from_patches([LEFT, BSplineVolume.uniform(points)])
    found = certify(body)
    assert found.patches[1].verdict == "folded" and found.misglued == () and found.verdict == "folded"


def test_bad_arguments():
    with pytest.raises(ValueError, match="max_depth"):
        certify(frame(), max_depth=-1)
    with pytest.raises(TypeError, match="must be a BSplineVolume"):
        certify([LEFT])


def test_the_certificate_of_a_volume_has_what_is_known_of_its_patch():
    found = certify(LEFT)
    (patch,) = found.patches
    names = ("lower_bound", "mean_det", "witness", "unproved", "flat", "left_handed", "orientation", "claim")
    assert all(getattr(found, name) is getattr(patch, name) for name in names)
    assert str(found) == f"certified, |det J| >= {found.lower_bound:.3g} of its mean"
    two = certify(Body.from_patches(cells([(0, 0, 0), (1, 0, 0)])))
    with pytest.raises(ValueError, match=r"that of 2 patches: use certificate.patches\[i\]"):
        _ = two.witness
