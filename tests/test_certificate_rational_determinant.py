"""The certificate of rational volumes against rational arithmetic, and on circles and spheres by formula."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from exact_arithmetic import exact_coefficients, exact_verdict, random_volume, rational
from rational_shapes import bent_bar, octant, quarter_ring

from parameterize.certificate.certify import certify
from parameterize.certificate.rational_determinant import RationalDeterminantForm
from parameterize.spline.orientation import mirrored
from parameterize.spline.patch_groups import group_of
from parameterize.spline.volume import BSplineVolume

CASES = [((1, 1, 1), (2, 2, 1), 0.1), ((2, 1, 1), (2, 1, 1), 0.1), ((1, 2, 2), (1, 1, 1), 0.15)]


def random_rational(case, factor):
    rng = np.random.default_rng(case)
    degrees, n_spans, amplitude = CASES[case]
    volume = random_volume(rng, degrees, n_spans, factor * amplitude)
    return replace(volume, weights=rng.uniform(0.5, 2.0, volume.shape)).transformed(1.0, [3.0, -1.0, 0.0])


@pytest.mark.parametrize("case", range(len(CASES)))
@pytest.mark.parametrize("factor", [0.5, 1.5, 3.0])
def test_agrees_with_rational_arithmetic(case, factor):
    volume = random_rational(case, factor)
    form, exact = RationalDeterminantForm(group_of(volume)), exact_coefficients(volume)
    values, permanents = form.coefficients(np.insert(list(exact), 0, 0, axis=1))
    scale = Fraction(float(volume.weights.max())) ** 4 * Fraction(2) ** int(form.exponents[0])
    for k, error in enumerate(form.errors(permanents)):
        off = np.abs(rational(values[..., k]) - list(exact.values())[k] / scale)
        assert off.max() <= Fraction(float(error)) and error < 1e-11
    certificate = certify(volume)
    verdicts = {span: exact_verdict(c) for span, c in exact.items()}
    if all(v is True for v in verdicts.values()):
        assert certificate.verdict == "certified"
    if False in verdicts.values():
        assert certificate.verdict == "folded"
        assert np.linalg.det(volume.jacobian(certificate.witness)[0]) <= 0.0
    failed = {tuple(row) for row in certificate.unproved.tolist()}
    assert failed == {span for span, v in verdicts.items() if v is not True}


def test_the_cases_above_hold_both_verdicts():
    verdicts = {certify(random_rational(case, factor)).verdict for case in range(len(CASES)) for factor in (0.5, 3.0)}
    assert verdicts >= {"certified", "folded"}


@pytest.mark.parametrize(
    "volume", [quarter_ring(), quarter_ring(0.1, 50.0, 1e-3), quarter_ring().refined(2), bent_bar()]
)
def test_the_bound_is_below_the_least_value(volume):
    certificate = certify(volume)
    dets = np.linalg.det(volume.grid_jacobian(*[np.linspace(0.0, 1.0, 23)] * 3))
    assert certificate.verdict == "certified"
    assert 0.0 < certificate.lower_bound <= dets.min() / certificate.mean_det


def test_the_mean_is_the_volume():
    assert certify(quarter_ring(1.0, 3.0, 2.0)).mean_det == pytest.approx(4.0 * np.pi, rel=1e-14)
    assert certify(mirrored(quarter_ring())).mean_det == pytest.approx(-0.75 * np.pi, rel=1e-14)


def test_left_handed_scaled_and_moved_volumes_have_the_same_verdict():
    ring = quarter_ring()
    for other in (
        mirrored(ring),
        ring.transformed(1e-60, [0.0, 0.0, 0.0]),
        ring.transformed(1e80, [1e85, 0.0, -1e85]),
        replace(ring, weights=1e-80 * ring.weights),
    ):
        certificate = certify(other)
        assert certificate.verdict == "certified"
        assert certificate.lower_bound == pytest.approx(certify(ring).lower_bound, rel=1e-6)


@pytest.mark.parametrize(("weight", "verdict"), [(0.2, "certified"), (1.0, "certified"), (5.0, "folded")])
def test_weights_alone_may_fold_a_map(weight, verdict):
    """Along u the control points are 0, 0.9, 0.1, 1: the two in the middle fold the map where they weigh more."""
    points = np.stack(np.meshgrid([0.0, 0.9, 0.1, 1.0], [0.0, 1.0], [0.0, 1.0], indexing="ij"), axis=-1)
    line = np.array([0.0, 0.0, 1.0, 1.0])
    weights = np.broadcast_to(np.array([1.0, weight, weight, 1.0])[:, None, None], (4, 2, 2))
    volume = BSplineVolume((3, 1, 1), (np.repeat([0.0, 1.0], 4), line, line), points, weights)
    assert certify(volume).verdict == verdict


def test_a_face_that_shrinks_to_an_edge_is_undecided():
    certificate = certify(octant())
    assert certificate.verdict == "undecided" and len(certificate.unproved) == 1
