"""Random volumes between folded and not: what is called certified is so, in exact arithmetic."""

import numpy as np
import pytest
from exact_arithmetic import exact_coefficients, exact_verdict, random_volume

from parameterize.certificate.certify import certify
from parameterize.spline.volume import BSplineVolume

DEPTH = 8  # of the exact subdivision: deeper than the certificate's own, so that nothing certified stays undecided
SHAPES = [((1, 1, 1), (2, 1, 1)), ((1, 1, 1), (2, 2, 1)), ((2, 1, 1), (1, 1, 2)), ((1, 2, 1), (2, 1, 1))]


def between(start, end, share):
    return BSplineVolume(start.degrees, start.knots, (1.0 - share) * start.control_points + share * end.control_points)


def near_the_border(rng, halvings):
    """A random volume, moved towards the undisturbed one until the certificate's answer is about to change."""
    degrees, spans = SHAPES[rng.integers(len(SHAPES))]
    seed = int(rng.integers(2**32))
    calm, wild = (random_volume(np.random.default_rng(seed), degrees, spans, size) for size in (0.0, 0.6))
    low, high = 0.0, 1.0
    for _ in range(halvings):
        middle = (low + high) / 2.0
        proved = certify(between(calm, wild, middle)).verdict == "certified"
        low, high = (middle, high) if proved else (low, middle)
    return between(calm, wild, low), between(calm, wild, high)


def judge(rng):
    """Verdicts on both sides of a border, each with what is true: a list of (ours, exact)."""
    found = []
    for volume in near_the_border(rng, int(rng.integers(4, 30))):
        exact = {exact_verdict(c, DEPTH) for c in exact_coefficients(volume).values()}
        truth = False if False in exact else None if None in exact else True
        found.append((certify(volume).verdict, truth))
    return found


def check(pairs):
    for ours, truth in pairs:
        assert not (ours == "certified" and truth is not True)
        assert not (ours == "folded" and truth is True)
    assert sum(ours == "certified" for ours, _ in pairs) > len(pairs) // 4  # the rule is put to the test
    assert sum(ours == "folded" for ours, _ in pairs) > len(pairs) // 5
    return pairs


def test_nothing_is_certified_that_is_folded():
    rng = np.random.default_rng(7)
    check([pair for _ in range(15) for pair in judge(rng)])


@pytest.mark.slow
def test_two_thousand_volumes_near_the_border():
    rng = np.random.default_rng(2000)
    pairs = check([pair for _ in range(1000) for pair in judge(rng)])
    assert len(pairs) == 2000
