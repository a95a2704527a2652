"""Sheets of a boundary that run into one another, on springs whose turns overlap by a known depth."""

from functools import cache

import numpy as np
import pytest
from volumes import bent, mapped

from parameterize.certificate.boundary import check_boundary
from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.optimization.contact import contact_penalty
from parameterize.spline.spline_map import SplineMap

GAP = 1e-3
TURNS = 1.5


@cache
def spring(gap):
    """The bar is 0.6 high; one turn lies `gap` above the one before."""
    return bent(TURNS, TURNS * (0.6 + gap))


def control_of(volume):
    return SplineMap.of(volume).control


@cache
def contact(volume, gap=GAP):
    return contact_penalty(SplineMap.of(volume), gap)


def distances(volume):
    return contact(volume).distances(control_of(volume))


@pytest.mark.parametrize("depth", [pytest.param(3e-2, marks=pytest.mark.slow), 1e-2])
def test_the_depth_is_that_by_which_the_turns_overlap(depth):
    found = distances(spring(-depth))
    assert len(found) > 100
    assert np.median(found) == pytest.approx(-depth, rel=0.1)


@pytest.mark.parametrize("volume", [spring(0.1), bent(0.9), mapped(lambda u, v, w: (u, v, w), (8, 8, 8))])
def test_what_is_apart_costs_nothing(volume):
    energy, gradient = contact(volume).energy_and_gradient(control_of(volume))
    assert energy == 0.0
    assert not gradient.any()


def test_gradient_and_curvature_are_those_of_the_energy():
    volume = spring(-1e-2)
    penalty, control = contact(volume), control_of(volume)
    direction = 1e-3 * np.random.default_rng(0).normal(size=control.shape)
    (before, _), (after, _) = (penalty.energy_and_gradient(control + sign * direction) for sign in (-1.0, 1.0))
    energy, gradient = penalty.energy_and_gradient(control)
    bend = float((penalty.curvature(control)(direction.astype(np.float32)) * direction).sum())
    assert energy > 0.0
    assert after - before == pytest.approx(2.0 * float((gradient * direction).sum()), rel=0.05)
    assert after - 2.0 * energy + before == pytest.approx(bend, rel=0.3)  # some samples enter or leave


def test_looking_near_the_last_contact_finds_what_looking_everywhere_does():
    before, control, everywhere = contact(spring(-1e-2)), control_of(spring(-8e-3)), contact(spring(-8e-3))
    near = contact_penalty(SplineMap.of(spring(-8e-3)), GAP, near=before.near)
    assert 0 < len(before.near) < 0.9 * 6 * 110**2
    assert np.array_equal(near.spans, everywhere.spans)
    assert near.energy_and_gradient(control)[0] == everywhere.energy_and_gradient(control)[0] > 0.0
    nothing = contact_penalty(SplineMap.of(spring(-8e-3)), GAP, near=before.near[:0])
    assert nothing.energy_and_gradient(control)[0] == 0.0


def test_turns_that_overlap_are_parted():
    volume = spring(-1e-2)
    assert check_boundary(volume).injective is False
    control = control_of(volume)
    for _ in range(4):
        penalty = contact_penalty(SplineMap.of(volume).with_control(control), GAP)
        _, gradient = penalty.energy_and_gradient(control)
        curvature = penalty.curvature(control)
        step = conjugate_gradients(
            lambda x, bend=curvature: bend(x) + 1e-6 * x, -gradient, lambda x: x, tolerance=1e-6, max_iterations=200
        )
        control = control + step.x
    parted = SplineMap.of(volume).with_control(control).volume
    assert check_boundary(parted).injective is True


def test_samples_are_looked_at_in_parts_with_the_same_result(monkeypatch):
    volume = spring(-1e-2)
    whole = contact(volume)
    monkeypatch.setattr("parameterize.optimization.contact._CHUNK", 37)
    parts = contact_penalty(SplineMap.of(volume), GAP)
    assert np.array_equal(parts.spans, whole.spans) and len(parts.spans) > 2 * 37
    assert np.array_equal(parts.normals, whole.normals)
