"""Tests of `solve.motions`: a rigid region moves as the loads on it demand."""

import numpy as np
import pytest

import iga_nn
from iga_nn.report import balance
from parameterize.spline.volume import BSplineVolume

LENGTH, YOUNG, END = 6.0, 1000.0, "nx > 0.9"


def bar(**given):
    """A slender bar along x, with a square of side 1 and a rigid end."""
    law = {"young": YOUNG, "poisson_ratio": 0.0, "fix": "nx < -0.9", "rigid": END}
    volume = BSplineVolume.from_function(lambda u, v, w: (LENGTH * u, v - 0.5, w - 0.5), (6, 4, 4), 3)
    return iga_nn.solve(volume, iga_nn.Elasticity(**law | given), formulation="displacement", estimate=False).report


def test_a_remote_force_bends_a_bar_whose_end_stays_rigid():
    force, arm, inertia = 10.0, 2.0, 1.0 / 12.0
    report = bar(remote_force={END: ((0, 0, -force), (LENGTH + arm, 0, 0))})
    (motion,) = report.rigid
    turn = force * LENGTH * (0.5 * LENGTH + arm) / (YOUNG * inertia)
    shear = force * LENGTH / (5.0 / 6.0 * 0.5 * YOUNG)
    shift = force * LENGTH**2 * (LENGTH / 3.0 + 0.5 * arm) / (YOUNG * inertia) + shear
    np.testing.assert_allclose(motion.turn, [0.0, turn, 0.0], atol=1e-3 * turn)
    np.testing.assert_allclose(motion.shift, [0.0, 0.0, -shift], atol=2e-3 * shift)
    role = f"rigid '{END}'"
    assert motion.residual < 1e-8 and report.converged and role in str(report)
    np.testing.assert_allclose(report.balance.reactions[role], [0.0, 0.0, -force], atol=1e-8 * force)
    moment = force * (LENGTH + arm)
    np.testing.assert_allclose(report.balance.moments.reactions[role], [0.0, moment, 0.0], atol=1e-8 * moment)
    np.testing.assert_allclose(report.balance.reactions["fix 'nx < -0.9'"], [0.0, 0.0, force], atol=1e-6 * force)


def test_a_moment_twists_a_bar_between_ends_that_do_not_warp():
    moment = 10.0
    (motion,) = bar(moment={END: (moment, 0, 0)}).rigid
    free = moment * LENGTH / (0.140577 * 0.5 * YOUNG)  # Saint-Venant's, of a square; held warping stiffens the ends
    assert 0.9 * free < motion.turn[0] < free
    np.testing.assert_allclose(motion.shift, 0.0, atol=1e-6)


def test_a_given_displacement_leaves_what_is_left_out_to_the_loads():
    report = bar(rigid={END: (None, 0.0, 0.0)}, total_force={END: (500.0, 0.0, 0.0)})
    np.testing.assert_allclose(report.rigid[0].shift, [500.0 * LENGTH / YOUNG, 0.0, 0.0], atol=1e-6)
    assert report.rigid[0].turn == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"fix": None, "roller": "nx < -0.9"}, "nothing else holds the body"),
        ({"spring": {END: 1.0}}, "give springs on other regions"),
        ({"pressure": {END: 1.0}}, "give one of them"),
        ({"rigid": {END: (1, 2)}}, "as three numbers, or nothing"),
    ],
)
def test_what_a_rigid_region_does_not_carry_is_refused(given, says):
    with pytest.raises(ValueError, match=says):
        bar(**given)


def test_all_else_than_a_solve_refuses_a_rigid_region():
    volume, law = BSplineVolume.from_function(lambda u, v, w: (u, v, w), 4), iga_nn.Elasticity(fix="u0", rigid="u1")
    for ask in (lambda: iga_nn.modes(volume, law, n=1), lambda: iga_nn.discretize(volume, law)):
        with pytest.raises(ValueError, match="rigid 'u1': only iga_nn.solve"):
            ask()
    with pytest.raises(ValueError, match="it goes without rigid regions"):
        cut = iga_nn.Cyclic("v0", "v1", "z")
        iga_nn.solve(volume, iga_nn.Elasticity(conditions=[iga_nn.Fix("u0"), iga_nn.Rigid("u1"), cut]))


def test_a_report_states_the_motion():
    motion = {"region": "rigid 'u1'", "centre": [1, 0, 0], "shift": [0, 0, -2], "turn": [0, 1e-3, 0], "residual": 1e-12}
    level = {"load": [0, 0, 0], "reactions": {"rigid 'u1'": [0, 0, -5]}, "rigid": [motion]}
    said = "rigid 'u1' shifts by (0, 0, -2) at (1, 0, 0), turns by (0, 0.001, 0) rad, its loads balanced to 1e-12"
    assert said in balance.lines({"levels": [level]})
    assert ["Shift of rigid 'u1' [mm]", "0", "0", "-2"] in balance.table({"levels": [level], "unit": "mm"})
