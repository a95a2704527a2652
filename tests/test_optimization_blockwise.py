"""The terms of the energy on bodies of glued blocks whose side lengths are not 1."""

import numpy as np
import pytest
from bernstein import bernstein_coefficients
from block_bodies import BODIES, fan, ring, rod, sampled, surface_fit, uniform_nets, wavy

from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.optimization.bending import Fairness
from parameterize.optimization.contact import contact_penalty
from parameterize.optimization.determinant_penalty import DeterminantPenalty
from parameterize.optimization.distortion import DistortionTerm
from parameterize.optimization.energy import SplineEnergy
from parameterize.optimization.spans import in_blocks
from parameterize.optimization.term import Weights
from parameterize.quality.distortion import own_boxes
from parameterize.spline.spline_map import SplineMap
from parameterize.spline.volume import BSplineVolume


def all_spans(nets):
    return in_blocks([np.indices(counts).reshape(3, -1).T for counts in nets.spans])


def stretched(nets, boxes):
    """The knots of blocks in units of their side lengths (blocks, 3)."""
    pairs = zip(nets.knots, boxes, strict=True)
    return tuple(tuple(row * a for row, a in zip(rows, box, strict=True)) for rows, box in pairs)


def started(name, turn=7, amplitude=0.08):
    """The energy of a round on a wavy body within a surface a little larger, all terms active, and control points."""
    spline = wavy(BODIES[name](turn), amplitude)
    surface = sampled(BODIES[name](0), 6)
    middle = surface.points.mean(axis=0)
    fit = surface_fit(spline, middle + 1.1 * (surface.points - middle), surface.triangles)
    energy = SplineEnergy(spline.nets, fit, Weights())
    energy.determinants.activate(all_spans(spline.nets))
    energy.start_round(spline.control, 50.0)
    energy.anchors.aim(spline.control)
    energy.slide(spline.control)
    return energy, spline.control


def difference(term, control, direction, h=1e-6):
    ahead, behind = (term.energy_and_gradient(control + sign * h * direction)[0] for sign in (1.0, -1.0))
    return (ahead - behind) / (2.0 * h)


@pytest.mark.parametrize("name", BODIES)
def test_gradients_of_all_terms_against_finite_differences(name):
    """Without an interface: each control point of each block moves by itself."""
    energy, control = started(name)
    assert not np.allclose(energy.surface.sliding.boxes, 1.0, atol=0.1)
    assert len(energy.inner) == 3 and len(energy.outer) == 3
    for term in (*energy.inner, *energy.outer):
        value, gradient = term.energy_and_gradient(control)
        assert value > 0.0 and gradient.shape == control.shape
        for seed in range(2):
            direction = np.random.default_rng(seed).normal(size=control.shape)
            found = float((gradient * direction).sum())
            assert found == pytest.approx(difference(term, control, direction), rel=2e-4), type(term).__name__


def test_the_diagonal_of_every_second_derivative_is_that_of_its_products():
    energy, control = started("four blocks around an edge")
    like, chosen = control.astype(np.float32), np.random.default_rng(0).choice(control.shape[1], 12, replace=False)
    rows, columns = np.tril_indices(3)
    for term in (*energy.inner, *energy.outer):
        operator = term.curvature(control)
        blocks = operator.diagonal(like)
        assert blocks.shape == (6, control.shape[1])
        for point in chosen:
            units = np.zeros((3, *like.shape), np.float32)
            units[np.arange(3), np.arange(3), point] = 1.0
            expected = np.stack([operator(unit)[:, point] for unit in units])[rows, columns]
            assert blocks[:, point] == pytest.approx(expected, rel=2e-4, abs=2e-5 * float(np.abs(blocks).max()))


@pytest.mark.parametrize("name", BODIES)
def test_the_gradient_of_the_energy_is_that_of_moves_without_a_gap(name):
    energy, control = started(name)
    _, inner, _ = energy.volume_part(control)
    _, outer = energy.surface_part(control)
    for gradient in (inner, outer):
        assert np.allclose(energy.nets.merged(gradient), gradient, rtol=1e-12, atol=1e-15 * np.abs(gradient).max())
    move = energy.nets.merged(np.random.default_rng(0).normal(size=control.shape))
    moved = [control + sign * 1e-6 * move for sign in (1.0, -1.0)]
    slopes = [
        (energy.volume_part(moved[0])[0] - energy.volume_part(moved[1])[0]) / 2e-6,
        (energy.surface_part(moved[0])[0] - energy.surface_part(moved[1])[0]) / 2e-6,
    ]
    assert [float((g * move).sum()) for g in (inner, outer)] == pytest.approx(slopes, rel=2e-4)


def test_newton_direction_leads_down_and_opens_no_gap():
    energy, control = started("four blocks around an edge")
    gradient = energy.volume_part(control)[1] + energy.surface_part(control)[1]
    direction = energy.newton_direction(control, -gradient)
    assert np.array_equal(SplineMap(energy.nets, control + direction).body.interfaces, energy.nets.interfaces)
    assert float((gradient * direction).sum()) < 0.0
    before = energy.volume_part(control)[0] + energy.surface_part(control)[0]
    after = energy.volume_part(control + direction)[0] + energy.surface_part(control + direction)[0]
    assert after < 0.8 * before


def test_straight_blocks_in_their_own_boxes_have_no_distortion():
    spline = rod(7, lengths=(1.0, 2.0, 0.6))
    nets = spline.nets
    own = DistortionTerm(nets, stretched(nets, own_boxes(spline.body)))
    assert own.energy_and_gradient(spline.control)[0] == pytest.approx(0.0, abs=1e-20)
    assert DistortionTerm(nets, nets.knots).energy_and_gradient(spline.control)[0] > 0.1


def test_terms_of_a_cut_block_are_those_of_the_whole():
    """A bent block, and the same one cut into two in the middle, each half in a box of its own."""
    whole = BSplineVolume.from_function(lambda u, v, w: (2.0 * u + 0.1 * v * w, v + 0.2 * u * u, w + 0.1 * u * v), 7)
    halves = [
        BSplineVolume.from_function(
            lambda u, v, w, a=a: (u + a + 0.1 * v * w, v + 0.05 * (u + a) ** 2, w + 0.05 * (u + a) * v), (5, 7, 7)
        )
        for a in (0.0, 1.0)
    ]
    one, nets = SplineMap.of(whole), uniform_nets((2, 4, 4), (2, 4, 4))
    control = nets.joined([SplineMap.of(half).control for half in halves])
    cut = stretched(nets, np.ones((2, 3)))
    uncut = stretched(one.nets, np.array([[2.0, 1.0, 1.0]]))
    for term, other in (
        (Fairness(nets, cut, 1.0), Fairness(one.nets, uncut, 1.0)),
        (DistortionTerm(nets, cut), DistortionTerm(one.nets, uncut)),
    ):
        found, expected = term.energy_and_gradient(control)[0], other.energy_and_gradient(one.control)[0]
        assert expected > 1e-4
        assert found == pytest.approx(expected, rel=1e-2)  # the rule has more points at the ends of a block


@pytest.mark.parametrize("name", BODIES)
def test_determinants_are_the_shortfalls_of_the_certificates_coefficients(name):
    spline = wavy(BODIES[name](7), 0.12)
    nets, boxes = spline.nets, own_boxes(spline.body)
    penalty, spans = DeterminantPenalty(nets, stretched(nets, boxes), 0.8), all_spans(spline.nets)
    penalty.activate(spans[::2])
    weights = np.random.default_rng(0).uniform(0.5, 2.0, len(spans)) * penalty.weights
    penalty.weigh(weights)
    expected = 0.0
    for block, box in enumerate(boxes):
        own = spans[:, 0] == block
        coefficients = bernstein_coefficients(spline.patch(block), spans[own, 1:]) / np.prod(box)
        expected += weights[own] @ (np.maximum(0.8 - coefficients, 0.0) ** 2).mean(axis=(1, 2, 3))
    assert expected / len(spans) > 1e-4
    assert penalty.energy_and_gradient(spline.control)[0] == pytest.approx(expected / len(spans), rel=1e-9)


def test_spans_that_are_stiffened_have_neighbours_in_the_next_block():
    nets = ring(7).nets
    penalty = DeterminantPenalty(nets, nets.knots)
    (p, face), (q, other) = nets.interfaces[0].first, nets.interfaces[0].second
    at = np.array([[p, 1, 1, 1]])
    axis, side = "uvw".index(face[0]), int(face[1])
    at[0, 1 + axis] = 2 * side
    penalty.stiffen(at, 5.0, 20.0)
    first, second = (penalty.weights[nets.first_spans[k] : nets.first_spans[k + 1]].reshape(3, 3, 3) for k in (p, q))
    assert (first == 5.0).sum() == 18 and (second == 5.0).sum() == 9
    layer = np.take(second, 2 * int(other[1]), axis="uvw".index(other[0]))
    assert (layer == 5.0).all() and (penalty.weights > 0.0).sum() == 27


def test_blocks_that_overlap_around_an_edge_are_parted():
    """Five kites around an edge turn by more than a whole turn: the last one lies in the first one."""
    spline = fan(5, 7, angle=366.0)
    penalty = contact_penalty(spline, gap=1e-3)
    assert set(penalty.spans[:, 0]) == {0, 4}
    control = spline.control
    value, gradient = penalty.energy_and_gradient(control)
    direction = np.random.default_rng(0).normal(size=control.shape)
    assert value > 0.0
    assert float((gradient * direction).sum()) == pytest.approx(difference(penalty, control, direction), rel=1e-3)
    merged = spline.nets.merged
    step = conjugate_gradients(
        lambda x: merged(penalty.curvature(control)(x)) + 1e-6 * x,
        -merged(gradient),
        lambda x: x,
        tolerance=1e-6,
        max_iterations=100,
    )
    assert penalty.energy_and_gradient(control + step.x)[0] < 0.1 * value
