"""The certificate against rational arithmetic: every float is a rational, so det J can be decided exactly."""

from fractions import Fraction

import numpy as np
import pytest
from bernstein import bernstein_coefficients, coefficients_and_errors
from exact_arithmetic import (
    exact_coefficients,
    exact_verdict,
    grid_of,
    random_volume,
    rational,
)

from parameterize.certificate.certify import certify
from parameterize.spline.bspline import open_uniform_knots
from parameterize.spline.orientation import mirrored
from parameterize.spline.volume import BSplineVolume

CASES = [
    ((1, 1, 1), (3, 2, 2), 0.16),
    ((1, 1, 1), (3, 3, 3), 0.13),
    ((2, 2, 2), (2, 2, 2), 0.10),
    ((1, 2, 3), (2, 2, 1), 0.10),
    ((3, 2, 1), (1, 2, 3), 0.09),
    ((2, 1, 2), (2, 3, 2), 0.09),
    ((3, 3, 3), (2, 1, 1), 0.09),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_agrees_with_rational_arithmetic(case):
    degrees, n_spans, amplitude = CASES[case]
    rng = np.random.default_rng(case)
    for factor in (0.5, 1.0, 1.5):
        volume = random_volume(rng, degrees, n_spans, factor * amplitude)
        exact = exact_coefficients(volume)
        spans = np.array(list(exact))
        values, errors = coefficients_and_errors(volume, spans)
        for span, value, error in zip(exact, values, errors, strict=True):
            off = np.abs(rational(value) - exact[span])
            assert off.max() <= Fraction(float(error))
        certificate = certify(volume)
        verdicts = {span: exact_verdict(c) for span, c in exact.items()}
        if certificate.verdict == "certified":
            assert set(verdicts.values()) == {True}
        if all(v is True for v in verdicts.values()):
            assert certificate.verdict == "certified" and certificate.witness is None
        if False in verdicts.values():
            assert certificate.verdict == "folded"
            assert np.linalg.det(volume.jacobian(certificate.witness)[0]) <= 0.0
        failed = {tuple(row) for row in certificate.unproved.tolist()}
        assert failed == {span for span, v in verdicts.items() if v is not True}


def test_the_cases_above_hold_both_verdicts():
    verdicts = set()
    for case, (degrees, n_spans, amplitude) in enumerate(CASES):
        rng = np.random.default_rng(case)
        verdicts |= {certify(random_volume(rng, degrees, n_spans, f * amplitude)).verdict for f in (0.5, 1.0, 1.5)}
    assert {"certified", "folded"} <= verdicts


def identity(n=6, degree=3):
    knots = open_uniform_knots(n, degree)
    return BSplineVolume.uniform(grid_of([knots] * 3, (degree,) * 3), degree)


def bump(depth, n=9, degree=3):
    """Identity with z - 1/2 shrunk in the middle by a smooth hill: a large `depth` turns det J negative there."""
    points = identity(n, degree).control_points.copy()
    x, y, z = np.moveaxis(points, -1, 0)
    points[..., 2] -= depth * (z - 0.5) * np.exp(-20.0 * ((x - 0.5) ** 2 + (y - 0.5) ** 2 + (z - 0.5) ** 2))
    return BSplineVolume.uniform(points, degree)


def test_identity_has_lower_bound_one():
    certificate = certify(identity())
    assert certificate.verdict == "certified"
    assert certificate.lower_bound == pytest.approx(1.0, abs=1e-12) and certificate.lower_bound <= 1.0
    assert certificate.mean_det == pytest.approx(1.0, abs=1e-14)
    assert certificate.witness is None and certificate.unproved.shape == (0, 3)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_affine_map_far_from_the_origin(degree):
    matrix = np.array([[2.0, 1.0, 0.0], [0.0, 3.0, 1.0], [1.0, 0.0, 0.5]])  # det = 3 + 1 = 4
    points = identity(5, degree).control_points @ matrix.T + np.array([1e3, -2e3, 5e2])
    certificate = certify(BSplineVolume.uniform(points, degree))
    assert certificate.verdict == "certified"
    assert certificate.mean_det == pytest.approx(4.0, rel=1e-11)
    assert certificate.lower_bound == pytest.approx(1.0, abs=1e-9)


@pytest.mark.exact
@pytest.mark.parametrize("factor", [1e-100, 1e-30, 1e30, 1e100])
def test_verdict_does_not_depend_on_units(factor):
    volume = bump(0.9)
    expected, scaled = certify(volume), certify(volume.transformed(factor, np.zeros(3)))
    assert scaled.verdict == expected.verdict == "certified"
    assert scaled.lower_bound == pytest.approx(expected.lower_bound, rel=1e-9)


def test_mean_is_the_signed_volume():
    points = identity().control_points.copy()
    points[..., 0] *= 1.0 + points[..., 1]  # x in [0, 1 + y]: volume 3/2, up to the spline's product
    volume = BSplineVolume.uniform(points)
    x, weights = np.polynomial.legendre.leggauss(5)
    nodes = np.concatenate([(a + (x + 1.0) / 2.0) / 3.0 for a in range(3)])
    weights = np.tile(weights / 6.0, 3)
    det = np.linalg.det(volume.grid_jacobian(nodes, nodes, nodes))
    assert certify(volume).mean_det == pytest.approx(
        np.einsum("ijk,i,j,k->", det, weights, weights, weights), rel=1e-12
    )


def test_a_mirror_image_is_certified_as_left_handed():
    """-det J is the det J of the map itself, so that all bounds and places are the same."""
    for volume in (identity(), bump(0.5), bump(2.5)):
        image = mirrored(volume)
        own, found = certify(volume), certify(image)
        assert (own.left_handed, found.left_handed) == (False, True)
        assert (found.verdict, found.lower_bound, found.witness) == (own.verdict, own.lower_bound, own.witness)
        assert found.mean_det == -own.mean_det and np.array_equal(found.unproved, own.unproved)
        assert (own.claim, found.claim) == ("det J > 0", "det J < 0")
    assert np.linalg.det(image.jacobian([found.witness])[0]) > 0.0  # the wrong sign there


def test_fold_in_the_middle_has_a_witness_there():
    volume = bump(2.5)
    certificate = certify(volume)
    assert certificate.verdict == "folded"
    assert np.linalg.det(volume.jacobian(certificate.witness)[0]) < 0.0
    assert np.linalg.norm(np.array(certificate.witness) - 0.5) < 0.3
    assert len(certificate.unproved) < 6**3


def squeezed(middle):
    """One span of degree 3 with dz/dw = 1 - (1 - middle) 4 w (1 - w): least at w = 1/2, equal to `middle` there."""
    rate = np.array([1.0, 2.0 * middle - 1.0, 1.0])  # Bernstein coefficients of dz/dw
    heights = np.concatenate([[0.0], np.cumsum(rate / 3.0)])
    points = identity(4).control_points.copy()
    points[..., 2] = heights
    return BSplineVolume.uniform(points)


def test_cutting_proves_what_the_first_bound_cannot():
    volume = squeezed(0.05)
    assert bernstein_coefficients(volume, [[0, 0, 0]]).min() < 0.0
    assert certify(volume, max_depth=0).verdict == "undecided"
    with pytest.raises(TypeError, match="volume must be a BSplineVolume, got str"):
        certify("volume.npz")
    certificate = certify(volume)
    assert certificate.verdict == "certified"
    mean = 1.0 - 0.95 * 4.0 / 6.0
    assert 0.5 * 0.05 / mean <= certificate.lower_bound <= 0.05 / mean


def test_fold_between_the_corners_of_a_span_is_found_by_cutting():
    volume = squeezed(-0.3)
    corners = np.linalg.det(volume.grid_jacobian([0.0, 1.0], [0.0, 1.0], [0.0, 1.0]))
    assert corners.min() > 0.0
    assert certify(volume, max_depth=0).verdict == "undecided"
    certificate = certify(volume)
    assert certificate.verdict == "folded" and certificate.unproved.tolist() == [[0, 0, 0]]
    assert certificate.witness[2] == 0.5
    assert np.linalg.det(volume.jacobian(certificate.witness)[0]) == pytest.approx(-0.3)


def test_zero_determinant_is_never_certified():
    assert certify(squeezed(0.0)).verdict != "certified"  # touches zero inside
    points = identity(5).control_points.copy()
    points[:2, 0, 0] = points[0, 0, 0]  # dF/du = 0 at a corner
    certificate = certify(BSplineVolume.uniform(points))
    assert certificate.verdict != "certified"
    assert [0, 0, 0] in certificate.unproved.tolist() and certificate.flat == (0.0, 0.0, 0.0)
    flat = identity(5).control_points * np.array([1.0, 1.0, 0.0])
    certificate = certify(BSplineVolume.uniform(flat))
    assert certificate.verdict == "undecided" and len(certificate.unproved) == 8


def test_rounding_noise_is_neither_proof_nor_fold():
    matrix = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]) / 7.0  # singular but for rounding
    certificate = certify(BSplineVolume.uniform(identity(5).control_points @ matrix.T))
    assert certificate.verdict == "undecided"


def test_coefficients_bound_the_determinant_and_meet_it_at_the_corners():
    rng = np.random.default_rng(3)
    volume = random_volume(rng, (3, 2, 3), (2, 3, 2), 0.1)
    values = bernstein_coefficients(volume, [[1, 2, 0]])
    assert values.shape == (1, 9, 6, 9)
    u, v, w = (np.unique(k) for k in volume.knots)
    rows = [np.linspace(a, b, 7) for a, b in ((u[1], u[2]), (v[2], v[3]), (w[0], w[1]))]
    rows = [np.clip(r, r[0], np.nextafter(r[-1], 0.0)) for r in rows]  # stay in the span
    det = np.linalg.det(volume.grid_jacobian(*rows))
    assert values.min() <= det.min() and det.max() <= values.max()
    assert values[0, ::8, ::5, ::8] == pytest.approx(det[::6, ::6, ::6], rel=1e-10)


def test_refinement_keeps_the_verdict_and_tightens_the_bound():
    volume = bump(0.9)
    coarse, fine = certify(volume, max_depth=0), certify(volume.refined(), max_depth=0)
    assert coarse.verdict == fine.verdict == "certified"
    assert coarse.lower_bound <= fine.lower_bound + 1e-12
    assert coarse.mean_det == pytest.approx(fine.mean_det, rel=1e-12)


def test_bad_arguments():
    with pytest.raises(ValueError, match="max_depth"):
        certify(identity(), max_depth=-1)
    with pytest.raises(ValueError, match="overflow"):
        certify(
            BSplineVolume(
                (1, 1, 1),
                (np.array([0.0, 0.0, 1e-310, 1.0, 1.0]),) * 3,
                1e-3 * np.ones((3, 3, 3, 3)) * np.arange(3)[:, None, None, None],
            )
        )


@pytest.mark.exact
@pytest.mark.filterwarnings("error")
def test_the_largest_coordinates_stay_within_double_precision():
    knots = (open_uniform_knots(6, 3),) * 3
    cube = BSplineVolume((3, 3, 3), knots, grid_of(knots, (3, 3, 3)))
    found = certify(cube.transformed(2e100, [-1e100] * 3))
    assert found.verdict == "certified" and found.mean_det == pytest.approx(8e300)


def axes_scaled(volume, exponents):
    return BSplineVolume(volume.degrees, volume.knots, np.ldexp(volume.control_points, exponents))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("case", range(len(CASES)))
def test_powers_of_two_along_the_axes_change_nothing(case):
    degrees, n_spans, amplitude = CASES[case]
    rng = np.random.default_rng(100 + case)
    for factor in (0.5, 1.0, 1.5):
        volume = random_volume(rng, degrees, n_spans, factor * amplitude)
        exponents = rng.integers(-300, 301, 3)
        expected, found = certify(volume), certify(axes_scaled(volume, exponents))
        assert (found.verdict, found.lower_bound) == (expected.verdict, expected.lower_bound)
        assert found.unproved.tolist() == expected.unproved.tolist()
        assert found.mean_det == np.ldexp(expected.mean_det, int(exponents.sum()))


def test_scales_of_all_magnitudes_against_rational_arithmetic():
    """Up to the limits of double precision: each digit that is kept in a coordinate counts."""
    rng = np.random.default_rng(5)
    seen = set()
    for amplitude in (0.08, 0.12, 0.16, 0.2, 0.24, 0.28, 0.32, 0.36):
        volume = random_volume(rng, (1, 1, 1), (2, 1, 1), amplitude)
        volume = axes_scaled(volume, rng.permutation([330, rng.integers(-300, 300), -740]))
        truth = {exact_verdict(c) for c in exact_coefficients(volume).values()}
        verdict = certify(volume).verdict
        assert verdict == ("folded" if False in truth else "certified") and None not in truth
        seen.add(verdict)
    assert seen == {"certified", "folded"}


@pytest.mark.parametrize(("heights", "verdict"), [([0, 100.49, -0.49, 100.51], "folded"), ([0, 1, 2, 3], "certified")])
def test_a_component_near_the_least_numbers_keeps_its_digits(heights, verdict):
    """x up to 1e100, z near 1e-223: scaled by one factor z would lose the digits that tell a fold."""
    knots = open_uniform_knots(2, 1), open_uniform_knots(2, 1), open_uniform_knots(4, 3)
    points = np.stack(np.meshgrid([0.0, 2.0**332], [0.0, 1.0], np.ldexp(heights, -741), indexing="ij"), axis=-1)
    volume = BSplineVolume((1, 1, 3), knots, points)
    found = certify(volume)
    assert found.verdict == verdict
    assert found.mean_det == pytest.approx(np.ldexp(heights[-1], 332 - 741))
