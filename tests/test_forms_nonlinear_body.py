"""Bodies of laws that are not linear: forces of their mass."""

import pytest

import iga_nn


def rod():
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (2.0 * u, v, w), control_points=3, degree=2)


def weighed(**data):
    law = iga_nn.NeoHookean(shear=1000.0, bulk=2000.0, fix="u0", **data)
    (found,) = iga_nn.solve(rod(), law, load_steps=1).report.balance.reactions.values()
    return found


def test_gravity_and_acceleration_act_by_the_density():
    found = weighed(density=0.5, gravity=(0, 0, -3.0), acceleration=(1.0, 0, 0))
    assert found[:3] == pytest.approx((1.0, 0.0, 3.0), abs=1e-6)


def test_a_spin_pulls_outwards():
    assert weighed(density=0.5, spin=((0, 0, 2.0), (0, 0.5, 0)))[0] == pytest.approx(-4.0)  # rho w^2 L^2 / 2


def test_a_mass_of_each_solid_and_one_that_is_missing():
    law = iga_nn.Plasticity(fix="u0", density={"p0": 2.0, "p1": 3.0}, gravity=(0, 0, -1))
    assert law.by_patch["body_force"] == {"p0", "p1"}
    with pytest.raises(ValueError, match="gravity: give the density of the body"):
        iga_nn.Plasticity(fix="u0", gravity=(0, 0, -1))
