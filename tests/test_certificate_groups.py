"""Patches are certified in groups, with the verdicts and bounds that each has by itself."""

from dataclasses import replace

import numpy as np
import pytest
from rational_shapes import quarter_ring

from iga_nn import Body, BSplineVolume, certify
from parameterize.certificate import jacobian
from parameterize.spline.orientation import mirrored
from solve import benchmark_volume


def hexahedra(degree, count, roughness, seed=0):
    """Boxes of one span whose control points were moved at random, every third one left-handed."""
    rng = np.random.default_rng(seed)
    box = BSplineVolume.from_function(lambda u, v, w: (u, v, 2 * w), degree + 1, degree)
    for number in range(count):
        moved = replace(box, control_points=box.control_points + roughness * rng.normal(size=(*box.shape, 3)))
        yield mirrored(moved) if number % 3 == 0 else moved


def mixed():
    """Good, folded, flat, left-handed and rational patches, of several degrees and knots."""
    smooth = benchmark_volume(3)
    flat = replace(smooth, control_points=smooth.control_points * [1.0, 1.0, 0.0])
    ring = quarter_ring()
    heavier = replace(ring, weights=ring.weights * np.linspace(0.2, 3.0, ring.weights.size).reshape(ring.shape))
    return (
        *hexahedra(2, 12, 0.05),
        smooth,
        *hexahedra(3, 12, 0.15, seed=1),
        flat,
        benchmark_volume(4, amplitude=0.4),
        ring,
        *hexahedra(2, 12, 0.2, seed=2),
        heavier,
        mirrored(ring),
        mirrored(smooth),
    )


@pytest.mark.parametrize(("max_depth", "at_once"), [(0, 4096), (3, 5)])
def test_the_certificates_of_a_mixed_body_are_those_of_its_patches(max_depth, at_once, monkeypatch):
    monkeypatch.setattr(jacobian, "_PATCHES", at_once)
    patches = mixed()
    together = certify(Body(patches), max_depth=max_depth)
    assert {patch.verdict for patch in together.patches} == {"certified", "folded", "undecided"}
    for patch, found in zip(patches, together.patches, strict=True):
        alone = certify(patch, max_depth=max_depth).only
        assert (found.verdict, found.left_handed) == (alone.verdict, alone.left_handed)
        assert found.lower_bound == pytest.approx(alone.lower_bound, rel=1e-10)
        assert found.mean_det == pytest.approx(alone.mean_det, rel=1e-10)
        assert (found.witness, found.flat) == (alone.witness, alone.flat)
        np.testing.assert_array_equal(found.unproved, alone.unproved)


def test_of_many_defects_the_first_are_printed():
    thin = replace(benchmark_volume(2), control_points=benchmark_volume(2).control_points * [1.0, 1.0, 0.0])
    found = certify(Body((thin,) * 8), max_depth=0)
    assert len(found.defects) == 8
    assert str(found).startswith("undecided: p0: ") and str(found).endswith("; and 3 more") and "p5" not in str(found)
