"""Solving on rational volumes: circles and spheres stay exact, in every law and on every level."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from rational_shapes import LINEAR, bent_bar, octant, quarter_ring

import iga_nn
from parameterize.certificate.boundary import check_boundary
from parameterize.spline.body import Body
from parameterize.spline.orientation import mirrored
from solve import Elasticity, Poisson, convergence, solve_problem
from solve.discretization.quadrature import gauss_rule, map_planes
from solve.discretization.space import trial_space
from solve.forms.frame import UnitFrame

WAVE = "exp(x)*sin(y+z)"
MOVED = ("exp(x)*sin(y)", "cos(x*z)", "x*y*z+sin(z)")


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize(
    "problem",
    [Poisson(exact=WAVE, neumann={"u1": None}), Elasticity(exact=MOVED, traction={"u1": None}, young=210.0)],
    ids=["poisson", "elasticity"],
)
def test_errors_on_a_ring_fall_with_the_order_of_the_degree(degree, problem):
    rows = convergence(quarter_ring(), problem, degree=degree, refine=range(3, 5))
    assert degree + 0.9 < rows[-1].rate_l2 < degree + 1.5
    assert degree - 0.1 < rows[-1].rate_h1 < degree + 0.5


def test_volume_and_areas_are_those_of_the_formula():
    ring, shell = quarter_ring(1.0, 3.0, 2.0), octant(1.0, 2.0)
    assert iga_nn.integrate(ring) == pytest.approx(4.0 * pi, rel=1e-14)
    assert iga_nn.integrate(ring, over="u1") == pytest.approx(3.0 * pi, rel=1e-14)
    assert iga_nn.integrate(shell) == pytest.approx(7.0 * pi / 6.0, rel=1e-14)
    assert iga_nn.integrate(shell, over="u1") == pytest.approx(2.0 * pi, rel=1e-13)
    assert iga_nn.integrate(ring, lambda x: x[0]) == pytest.approx(26.0 / 3.0 * 2.0, rel=1e-13)
    assert UnitFrame.of(ring).length ** 3 == pytest.approx(4.0 * pi, rel=1e-14)


@pytest.mark.parametrize("refine", [0, 1, 3])
def test_a_solution_has_the_volume_of_the_exact_body(refine):
    solution = solve_problem(quarter_ring(), Poisson(exact="1+x"), degree=2, refine=refine)
    assert iga_nn.integrate(solution) == pytest.approx(0.75 * pi, rel=1e-14)
    assert iga_nn.integrate(solution, over="v0") == pytest.approx(1.0, rel=1e-14)


def test_planes_of_the_map_are_its_values_and_gradients():
    volume = bent_bar()
    rule = gauss_rule(trial_space(volume, refine=1))
    for q, fields, x in map_planes(volume, rule, (0, 5, 9)):
        at = rule.points[0][q : q + 1], *rule.points[1:]
        np.testing.assert_allclose(x, volume.grid(*at)[0].transpose(2, 1, 0), atol=1e-14)
        np.testing.assert_allclose(fields[:, 1:], volume.grid_jacobian(*at)[0].transpose(2, 3, 1, 0), atol=1e-12)


def test_the_estimated_error_is_near_the_true_one():
    for exact in (WAVE, "sin(5*x)*cos(4*y)+z**3"):
        report = solve_problem(quarter_ring(), Poisson(exact=exact), degree=3, refine=2, estimate=True).report
        assert 0.5 < report.error_estimate / report.l2 < 2.0


def test_loads_on_regions_and_weak_supports():
    """Lame's thick tube under inner pressure, plane strain: u_r = c ((1 - 2 nu) r + b^2 / r)."""
    young, nu, inner, outer, pressure = 210.0, 0.3, 1.0, 2.0, 3.0
    tube = Elasticity(
        young=young,
        poisson_ratio=nu,
        symmetry=["nx < -0.9 and x < 1e-6", "v0", "w0 or w1"],
        pressure={"nx*x + ny*y < -0.5": str(pressure)},
    )
    factor = (1.0 + nu) / young * pressure * inner**2 / (outer**2 - inner**2)
    known = [factor * ((1.0 - 2.0 * nu) * radius + outer**2 / radius) for radius in (inner, outer)]
    field = solve_problem(quarter_ring(inner, outer), tube, degree=3, refine=3).field
    found = np.linalg.norm(field([[0.0, 0.37, 0.5], [1.0, 0.37, 0.5]]), axis=1)
    np.testing.assert_allclose(found, known, rtol=2e-5)


def test_a_left_handed_ring_has_the_same_solution():
    problem = Poisson(exact="x*x+y")  # of the mirror image in x, too
    right, left = (solve_problem(v, problem, degree=3, refine=1) for v in (quarter_ring(), mirrored(quarter_ring())))
    assert left.report.l2 == pytest.approx(right.report.l2, rel=1e-6)


def test_a_field_belongs_to_the_weights_too():
    ring = quarter_ring()
    field = solve_problem(ring, Poisson(exact="x"), degree=2, refine=1).field
    assert field.fits(quarter_ring()) and not field.fits(replace(ring, weights=None))


@pytest.mark.parametrize("degree", [2, 3])
def test_errors_on_a_ring_of_four_rational_patches_fall_with_the_order_of_the_degree(degree):
    body = Body.from_patches([turned(quarter_ring(), k) for k in range(4)])
    off = [solve_problem(body, Poisson(exact=WAVE), degree=degree, refine=refine).report.l2 for refine in (2, 3)]
    assert degree + 0.8 < np.log2(off[0] / off[1]) < degree + 2.0
    area = sum(iga_nn.integrate(patch, over="u1") for patch in body)
    assert area == pytest.approx(4.0 * pi, rel=1e-14)


def test_a_rational_and_a_polynomial_patch_are_glued():
    bar = iga_nn.BSplineVolume(
        (1, 1, 1), (LINEAR,) * 3, np.stack(np.meshgrid([1.0, 2.0], [-1.0, 0.0], [0.0, 1.0], indexing="ij"), axis=-1)
    )
    body = Body.from_patches([bar, quarter_ring()])
    assert [str(interface) for interface in body.interfaces] == ["p0_v1 = p1_v0"]
    assert iga_nn.certify(body).verdict == "certified" and check_boundary(body).injective is True
    off = [solve_problem(body, Poisson(exact=WAVE), degree=3, refine=refine).report.l2 for refine in (2, 3)]
    assert off[1] < off[0] / 2.0**3.8


def turned(volume, quarters):
    """The volume after some quarter turns about z."""
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    return replace(volume, control_points=volume.control_points @ np.linalg.matrix_power(quarter, quarters))
