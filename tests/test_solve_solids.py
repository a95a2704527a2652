"""Solids of one body have a material each: bars in series stretch, plates in series conduct, as formulas say."""

from __future__ import annotations

import numpy as np
import pytest
from two_blocks import two_of_hexahedra, two_patches

import iga_nn

STIFF, SOFT = 210000.0, 8.0
E = {"steel": STIFF, "pad": SOFT}
HELD, PULLED = "nx < -0.9 and x < 0.5", "nx > 0.9 and x > 1.5"
BODIES = {"two patches": two_patches, "48 hexahedra": lambda: two_of_hexahedra(1)}


@pytest.fixture(params=BODIES, scope="module")
def body(request):
    return BODIES[request.param]()


def test_two_bars_in_series(body):
    """Under traction 1 the end moves by 1 / 210000 + 1 / 8."""
    law = iga_nn.Elasticity(young=E, poisson_ratio=0.0, fix=HELD, load={PULLED: (1, 0, 0)})
    found = iga_nn.solve(body, law, estimate=False)
    ends = found.probe([[1.0, 0.5, 0.5], [2.0, 0.5, 0.5]])[:, 0]
    assert ends == pytest.approx([1.0 / STIFF, 1.0 / STIFF + 1.0 / SOFT], rel=1e-7)


def test_two_plates_in_series(body):
    """Between 0 and 1 the interface has the share of the first resistance."""
    heat = iga_nn.solve(body, iga_nn.Poisson(kappa=E, value={HELD: "0", PULLED: "1"}), estimate=False)
    assert heat.probe([[1.0, 0.5, 0.5]])[0] == pytest.approx(SOFT / (STIFF + SOFT), rel=1e-6)


def test_a_jump_of_the_stiffness_costs_few_iterations(body):
    counts = []
    for young in (1.0, E):
        law = iga_nn.Elasticity(young=young, fix=HELD, load={PULLED: (0, 0, 1e-3)})
        counts.append(iga_nn.solve(body, law, estimate=False).report.iterations)
    assert counts[1] <= 1.5 * counts[0]


def test_data_by_solid_are_those_of_its_patches():
    body = two_patches()
    law = iga_nn.Elasticity(
        young=E, poisson_ratio={"pad": 0.4, "steel": 0.3}, body_force={"steel": (0, 0, -3), "pad": (0, 0, -1)}, fix=HELD
    )
    by_patch = iga_nn.Elasticity(
        young={0: STIFF, 1: SOFT}, poisson_ratio={0: 0.3, 1: 0.4}, body_force={0: (0, 0, -3), 1: (0, 0, -1)}, fix=HELD
    )
    found, expected = (iga_nn.solve(body, one) for one in (law, by_patch))
    assert found.report.balance.load == pytest.approx((0.0, 0.0, -4.0))
    for one, other in zip(found.patches, expected.patches, strict=True):
        assert np.array_equal(one.coefficients, other.coefficients)


def test_solids_of_equal_names_have_equal_materials():
    left, right = two_patches().patches
    body = iga_nn.Body.from_patches([left, right], solids=["bolt", "bolt"])
    law = iga_nn.Poisson(kappa={"bolt": 2.0}, value={HELD: "0", PULLED: "1"})
    assert iga_nn.solve(body, law).probe([[1.0, 0.5, 0.5]])[0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"steel": 1.0, "wood": 2.0}, "young: there is no solid 'wood'; the body has steel, pad"),
        ({"steel": 1.0}, "young has no entry for solid 'pad'; the body has steel, pad"),
        ({"steel": 1.0, "solid2": 2.0}, "there is no solid 'solid2'; the body has steel, pad"),
        ({"steel": 1.0, 1: 2.0}, "there is no solid 1; the body has steel, pad"),
    ],
)
def test_names_that_are_not_those_of_the_body_are_refused(given, says):
    with pytest.raises(ValueError, match=says):
        iga_nn.solve(two_patches(), iga_nn.Elasticity(young=given, fix=HELD, body_force=(0, 0, 1)))


def test_a_body_without_names_has_numbered_solids():
    body = iga_nn.Body.from_patches(two_patches().patches, solids=[0, 1])
    heat = iga_nn.Poisson(kappa={"solid1": 1.0, "solid2": 4.0}, value={HELD: "0", PULLED: "1"})
    assert iga_nn.solve(body, heat).probe([[1.0, 0.5, 0.5]])[0] == pytest.approx(0.8)
    with pytest.raises(ValueError, match="there is no solid 'steel'; the body has solid1, solid2"):
        iga_nn.solve(body, iga_nn.Poisson(kappa=E, value=HELD))


def test_densities_of_solids():
    """A bar of two parts of one speed of sound and impedances 4 : 1, held at its end: tan^2 k = 4 / 1."""
    law = iga_nn.Poisson(kappa={"steel": 4.0, "pad": 1.0}, value=HELD)
    found = iga_nn.modes(two_patches(), law, {"steel": 4.0, "pad": 1.0}, n=1)
    assert found.frequencies[0] == pytest.approx(np.arctan(2.0) / (2.0 * np.pi), rel=1e-4)
    assert found.shapes[0].probe([[2.0, 0.5, 0.5]])[0] == pytest.approx(1.0, rel=1e-4)  # of unit mass
    with pytest.raises(ValueError, match="density has no entry for solid 'pad'"):
        iga_nn.modes(two_patches(), law, {"steel": 4.0})
    with pytest.raises(ValueError, match="density must be a positive number, got -1"):
        iga_nn.modes(two_patches(), law, {"steel": 4.0, "pad": -1})


@pytest.mark.parametrize("scheme", ["bdf2", "trapezoidal"])
def test_capacities_of_solids(scheme):
    """Where each solid is heated in proportion to its capacity, all of the body is as warm as the time is late."""
    free = dict.fromkeys(("u0", "u1", "v0", "v1", "w0", "w1"), "0")
    warmed = iga_nn.Poisson(source={"steel": "4", "pad": "1"}, neumann=free)
    how = {"dt": 0.1, "steps": 5, "scheme": scheme, "capacity": {"steel": 4.0, "pad": 1.0}}
    end = iga_nn.march(two_patches(), warmed, {"steel": "1", "pad": "1"}, **how).fields[-1]
    assert end.probe([[0.3, 0.2, 0.5], [1.7, 0.9, 0.1]]) == pytest.approx([1.5, 1.5], rel=1e-8)
    with pytest.raises(ValueError, match="start: there is no solid 'wood'"):
        iga_nn.march(two_patches(), warmed, {"steel": "1", "wood": "1"}, **how)
    with pytest.raises(ValueError, match="capacity has no entry for solid 'pad'"):
        iga_nn.march(two_patches(), warmed, "1", **how | {"capacity": {"steel": 1.0}})


class Conducting(iga_nn.Form):
    """A conductivity that falls or grows with the temperature."""

    linear = symmetric = False

    def __init__(self, kappa, slope=0.0):
        self.kappa, self.slope = kappa, slope

    def flux(self, u, grad, x):
        return self.kappa * (1.0 + self.slope * u[0]) * grad


def test_solids_have_laws_of_their_own():
    """Plates of 1 + u and of 2 in series: the first has the temperature t at its end, t + t^2 / 2 = 2 (1 - t)."""
    law = {"steel": Conducting(1.0, 1.0), "pad": Conducting(2.0)}
    found = iga_nn.newton(two_patches(), iga_nn.Problem(law, source="0", value={"p0_u0": "0", "p1_u1": "1"}), refine=1)
    assert found.probe([[1.0, 0.5, 0.5]])[0] == pytest.approx(np.sqrt(13.0) - 3.0, rel=1e-5)
    flux = found.quantity("flux", [[0.5, 0.5, 0.5], [1.5, 0.5, 0.5]])[:, 0, 0]
    assert flux == pytest.approx(2.0 * (4.0 - np.sqrt(13.0)), rel=1e-3)
    with pytest.raises(ValueError, match="form has no entry for solid 'pad'; the body has steel, pad"):
        iga_nn.newton(two_patches(), iga_nn.Problem({"steel": law["steel"]}, source="0", value={"p0_u0": "0"}))


def test_laws_of_solids_agree_in_their_kind():
    class Elsewhere(iga_nn.Form):
        components = 3

    with pytest.raises(ValueError, match="form: the laws of a body must agree in components"):
        iga_nn.Problem({"steel": Conducting(1.0), "pad": Elsewhere()}, source="0", value="u0")
    with pytest.raises(TypeError, match="form must be an instance of a subclass of Form, got 8"):
        iga_nn.Problem({"steel": Conducting(1.0), "pad": 8.0}, source="0", value="u0")
