"""Tests of `solve.discretization.coupling`: a sector with cyclic symmetry is the whole body."""

import numpy as np
import pytest
from bodies import exact_ring
from rational_shapes import quarter_ring

import iga_nn
from parameterize.spline.volume import BSplineVolume
from solve.rigid import rigid_motions

FIRST, SECOND = "y < 0.001 and ny < -0.99", "x < 0.001 and nx < -0.99"
PLACES = np.array([[1.2, 0.3, 0.5], [0.8, 0.9, 0.7], [0.3, 1.3, 0.9], [1.5, 1e-6, 0.5]])


def turning(*more, **how):
    """A ring held below, twisted above and under pressure inside."""
    inside = iga_nn.Pressure("x*x + y*y < 1.0001 and nz*nz < 0.5", 1.0)
    acting = [iga_nn.Fix("nz < -0.99"), iga_nn.Load("nz > 0.99", ("-y", "x", "0.5")), inside]
    return iga_nn.Elasticity(young=100.0, conditions=[*acting, *more], **how)


def test_a_sector_with_equal_meshes_on_its_cuts_is_the_whole_ring_exactly():
    cut, how = iga_nn.Cyclic(FIRST, SECOND), {"degree": 2, "quadrature": "gauss+1", "tolerance": 1e-12}
    whole, part = iga_nn.solve(exact_ring(), turning(), **how), iga_nn.solve(quarter_ring(), turning(cut), **how)
    assert part.report.converged and part.report.iterations < 2 * whole.report.iterations
    wanted = whole.field.probe(PLACES)
    np.testing.assert_allclose(part.field.probe(PLACES), wanted, atol=1e-8 * np.abs(wanted).max())
    balance = part.report.balance
    assert balance.imbalance < 1e-8
    np.testing.assert_allclose(balance.load[2], 0.25 * whole.report.balance.load[2])
    np.testing.assert_allclose(balance.reactions[cut.role][2], 0.0, atol=1e-8)
    share = part.report.estimate.l2_relative / whole.report.estimate.l2_relative
    assert 0.3 < share < 2.0  # the cut adds little to the estimate


def unlike(shift):
    """A quarter of a ring whose two cuts have meshes that do not match: knots across are shifted on the way."""

    def place(u, v, w):
        angle, radius = 0.5 * np.pi * u, 1.0 + v + shift * u * v * (1.0 - v)
        return radius * np.cos(angle), radius * np.sin(angle), w + shift * u * w * (1.0 - w)

    return BSplineVolume.from_function(place, (7, 5, 5), 3)


def test_meshes_that_do_not_match_give_the_rates_of_those_that_do():
    exact = ("x*z + 0.2*(x*x+y*y)*y", "y*z - 0.2*(x*x+y*y)*x", "z*z + x*x + y*y")  # turns with the body
    cut, found = iga_nn.Cyclic(FIRST, SECOND), []
    for refine in (0, 1):
        law = iga_nn.Elasticity(
            exact=exact, young=10.0, conditions=[iga_nn.Fix("w0"), iga_nn.Load("w1 or v0 or v1", None), cut]
        )
        found.append(iga_nn.solve(unlike(0.6), law, refine=refine, formulation="displacement").report.l2_relative)
    assert found[1] < found[0] / 9.0


def test_a_sector_whose_cuts_have_other_meshes_has_the_reactions_of_the_ring():
    cut = iga_nn.Cyclic(FIRST, SECOND)
    part = iga_nn.solve(unlike(0.6), turning(cut), estimate=False)
    free = iga_nn.solve(unlike(0.6), turning(), estimate=False)
    assert part.report.converged and part.report.iterations <= 2 * free.report.iterations
    found = part.report.balance
    assert found.imbalance < 1e-8
    np.testing.assert_allclose(found.reactions["fix 'nz < -0.99'"][2], -found.load[2], rtol=1e-6)


def test_heat_is_equal_on_both_cuts():
    heated = iga_nn.Poisson(
        source="x*x + y*y", conditions=[iga_nn.Value("v0", 1.0), iga_nn.Flux("v1", "1"), iga_nn.Cyclic(FIRST, SECOND)]
    )
    field = iga_nn.solve(unlike(0.6), heated, refine=1).field
    turns = np.linspace(0.05, 0.45, 5) * np.pi
    rows = np.stack([1.5 * np.cos(turns), 1.5 * np.sin(turns), 0.4 + 0.0 * turns], axis=1)
    values = field.probe(rows)
    assert np.ptp(values) < 1e-4 * values.mean()  # nothing depends on the angle


def test_a_sector_keeps_the_motions_along_and_about_its_axis():
    system = iga_nn.discretize(quarter_ring(), turning(iga_nn.Cyclic(FIRST, SECOND)), degree=2)
    assert rigid_motions(system).shape[1] == 0
    loose = iga_nn.Elasticity(
        young=100.0, conditions=[iga_nn.Load("nz > 0.99", (0, 0, 1)), iga_nn.Cyclic(FIRST, SECOND)]
    )
    sliding = iga_nn.Elasticity(young=100.0, conditions=[*loose.conditions, iga_nn.Roller("nz < -0.99")])
    with pytest.raises(ValueError, match=r"turns about x, y, z, .* is not held"):
        iga_nn.solve(quarter_ring(), sliding)
    found = iga_nn.modes(quarter_ring(), loose, n=1, degree=2)
    assert found.rigid == 2 and any("nodal diameter zero" in one for one in found.notices)


@pytest.mark.parametrize(
    ("cut", "said"),
    [
        (("nx < -5", SECOND), "no part of the boundary lies there"),
        ((FIRST, SECOND, "x"), "do not fit each other: the first, turned by -72 degrees, and the second lie"),
        ((FIRST, SECOND, "z", (0.3, 0.0, 0.0)), "no whole part of 360 degrees"),
        ((FIRST, "nz > 0.9"), "their areas are 1 and 2.35"),
        ((FIRST, f"{FIRST} or {SECOND}"), "overlap"),
        (("x > 1.5 and " + FIRST, "y < 1.5 and " + SECOND), "the second lie 0.5 apart"),
        ((FIRST, SECOND, "q"), "the axis is x, y, z or a vector"),
    ],
)
def test_regions_that_do_not_fit_are_refused(cut, said):
    with pytest.raises(ValueError, match=said):
        iga_nn.solve(quarter_ring(), turning(iga_nn.Cyclic(*cut)))


@pytest.mark.parametrize("kind", [iga_nn.Fix, lambda region: iga_nn.Load(region, (0, 0, 1))])
def test_a_condition_that_covers_a_part_of_a_cut_is_refused(kind):
    region, cut = "x*x + y*y < 1.5 and nz*nz < 0.5", iga_nn.Cyclic(FIRST, SECOND)
    remedy = f"where the whole body goes on: write '{region} and not ({FIRST})'"
    with pytest.raises(ValueError) as found:
        law = iga_nn.Elasticity(conditions=[iga_nn.Fix("nz < -0.99"), kind(region), cut])
        iga_nn.solve(quarter_ring(), law, degree=2)
    assert str(found.value).endswith(remedy) and f"acts on a cut of {cut.role}" in str(found.value)


def test_what_does_not_know_couplings_refuses_them():
    cut = iga_nn.Cyclic(FIRST, SECOND)
    with pytest.raises(ValueError, match="formulation='displacement' only"):
        iga_nn.solve(quarter_ring(), turning(cut, poisson_ratio=0.49), degree=2)
    answer = iga_nn.solve(quarter_ring(), turning(cut), degree=2, ask="energy").report.asked[0]
    assert "coupled by a cyclic symmetry" in str(answer)


def test_the_text_of_an_option_is_read():
    read = iga_nn.Cyclic.of("face(1, 2, 3) and x < 2, group:'a, b' about (0, 0, 2) through (1, 2, 3)")
    assert (str(read.region), str(read.other)) == ("face(1, 2, 3) and x < 2", "group:'a, b'")
    assert read.axis.direction == (0.0, 0.0, 1.0) and read.axis.point == (1.0, 2.0, 3.0)
    for text in ("u0, u1", "u0 about z", "u0, u1, v0 about z", "u0, u1 about zz", "u0, u1 about z through 1"):
        with pytest.raises(ValueError, match="REGION, REGION about z|an axis"):
            iga_nn.Cyclic.of(text)
    options = iga_nn.ElasticityOptions(load=("nz > 0.9=0;0;1",), fix=("nz < -0.9",), cyclic=("u0, u1 about z",))
    assert [one.kind for one in options.problem().conditions] == ["fix", "cyclic", "image", "load"]
