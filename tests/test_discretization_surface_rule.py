"""Quadrature on parts of faces: areas known by hand, on rims that no knot meets."""

import numpy as np
import pytest
from volumes import mapped

from parameterize.spline.patch_groups import groups_of
from parameterize.spline.volume import FACE_NAMES, BSplineVolume
from solve.discretization.space import trial_space
from solve.discretization.surface_rule import Faces, surface_rule, surface_rules
from solve.forms.region import Region


def plate(turn=1.0):
    return BSplineVolume.from_function(lambda u, v, w: (turn * u, v, 0.1 * w), 7)


def rules(volume, text, space=None):
    region, found = Region(text), {}
    for i, name in enumerate(FACE_NAMES):
        axis, side = divmod(i, 2)
        codes = lambda x, n, owners, name=name: region.holds(x, n, name).astype(np.int64)  # noqa: E731
        rule = surface_rule(volume, space or trial_space(volume), axis, side, codes)
        if rule is not None:
            found[name] = rule
    return found


@pytest.mark.parametrize(
    ("text", "area"),
    [
        ("x < 0.37 and nz > 0.9", 0.37),
        ("y < 0.37 and nz > 0.9", 0.37),
        ("x + y < 0.8 and nz > 0.9", 0.32),
        ("x*x + y*y < 0.49 and nz > 0.9", np.pi * 0.49 / 4.0),
        ("(x - 0.5)**2 + (y - 0.5)**2 < 0.01 and nz > 0.9", np.pi * 0.01),
        ("(x - 0.5)**2 + (y - 0.5)**2 > 0.01 and nz > 0.9", 1.0 - np.pi * 0.01),
        ("box(0.21, 0.33, -1, 0.77, 0.61, 0.05)", 0.56 * 0.28),
        ("nz < -0.9", 1.0),
        ("w0", 1.0),
    ],
)
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_areas_are_right_to_one_in_ten_thousand(text, area, turn):
    found = rules(plate(turn), text.replace("x", "(-x)") if turn < 0 and "box" not in text else text)
    if "box" in text and turn < 0:
        assert not found
        return
    total = sum(rule.weights.sum() for rule in found.values())
    assert total == pytest.approx(area, rel=1e-4)


def test_the_points_of_a_part_have_its_code_and_outward_normals():
    codes = lambda x, n, owners: (x[0] < 0.4).astype(np.int64) + 2 * (x[1] > 0.7)  # noqa: E731
    rule = surface_rule(plate(), trial_space(plate()), 2, 1, codes)
    assert rule is not None
    x, y, z = rule.at.x
    assert np.array_equal(rule.codes, (x < 0.4) + 2 * (y > 0.7)) and np.allclose(z, 0.1)
    assert np.allclose(rule.at.normal, [[0.0], [0.0], [1.0]])
    areas = {code: rule.weights[rule.codes == code].sum() for code in (1, 2, 3)}
    assert areas == pytest.approx({1: 0.4 * 0.7, 2: 0.6 * 0.3, 3: 0.4 * 0.3}, rel=1e-4)


def test_moments_on_a_curved_face_are_those_of_the_closed_surface():
    volume = mapped(lambda u, v, w: (u + 0.2 * v * v, v + 0.1 * u * w, w + 0.2 * u * v))
    parts = {}
    for text in ("x + y < 0.9", "not (x + y < 0.9)", "x < 1e9"):
        found = rules(volume, text)
        flux = sum((rule.weights * (rule.at.x * rule.at.normal).sum(axis=0)).sum() for rule in found.values())
        area = sum(rule.weights.sum() for rule in found.values())
        parts[text] = np.array([flux, area])
    low, high, whole = parts.values()
    assert low + high == pytest.approx(whole, rel=1e-4)
    t, weights = np.polynomial.legendre.leggauss(6)
    rows = [(b[:-1, None] + (b[1:] - b[:-1])[:, None] * (t + 1) / 2).ravel() for b in map(np.unique, volume.knots)]
    sizes = [((b[1:] - b[:-1])[:, None] * weights / 2).ravel() for b in map(np.unique, volume.knots)]
    inside = np.einsum("i,j,k,ijk->", *sizes, np.linalg.det(volume.grid_jacobian(*rows)))
    assert whole[0] == pytest.approx(3.0 * inside, rel=1e-10)


def test_a_part_of_no_point_has_no_rule():
    assert rules(plate(), "x > 2") == {}


def test_faces_of_many_patches_are_cut_as_one_by_one():
    patches = [
        BSplineVolume.from_function(lambda u, v, w, k=k: (u + k, v + 0.1 * k * u * v, 0.1 * w + 0.01 * k * u), 4)
        for k in range(4)
    ]
    codes = lambda x, n, owners: ((x[0] - 1.0) ** 2 + x[1] ** 2 < 0.7).astype(np.int64)  # noqa: E731
    (group,), space = groups_of(patches), trial_space(patches[0])
    together = surface_rules(Faces.of(group, 2, 1), space, codes, 2.0)
    alone = [surface_rule(patch, space, 2, 1, codes, 2.0) for patch in patches]
    assert alone[3] is None and set(together.at.owners) == {0, 1}
    for owner in (0, 1):
        own = together.part(np.flatnonzero(together.at.owners == owner))
        x, single = own.at.x, alone[owner]
        found = [(own.weights * row).sum() for row in (x[0], x[1], own.at.normal[2])]
        expected = [(single.weights * row).sum() for row in (single.at.x[0], single.at.x[1], single.at.normal[2])]
        assert len(own.weights) == len(single.weights) and found == pytest.approx(expected, rel=1e-12)
