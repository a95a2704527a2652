"""Tests of parameterize.spline.spline_stack and of solve.field_groups: many splines at once equal each alone."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import ring

import iga_nn
from parameterize.spline.patch_groups import groups_of as groups_of_patches
from solve.field_groups import groups_of
from solve.quantities import all_extremes


@pytest.fixture(params=[False, True], ids=["polynomial", "rational"])
def patches(request):
    random = np.random.default_rng(1)
    cube = iga_nn.BSplineVolume.from_function(lambda u, v, w: (u, v, w), (4, 5, 6))
    weights = np.exp(random.normal(0.0, 0.1, (3, 4, 5, 6))) if request.param else [None] * 3
    nets = cube.control_points + random.normal(0.0, 0.02, (3, 4, 5, 6, 3))
    return [replace(cube, control_points=net, weights=weight) for net, weight in zip(nets, weights, strict=True)]


def test_a_stack_has_the_values_and_slopes_of_its_splines(patches):
    (group,) = groups_of_patches(patches)
    stack, rows = group.stack, (np.linspace(0, 1, 3), np.array([0.2, 0.7]), np.array([1.0]))
    owners, where = np.array([2, 0, 1, 2]), np.random.default_rng(2).random((4, 3))
    values, slopes = stack.at(owners, where), stack.slopes_at(owners, where)
    for number, patch in enumerate(patches):
        np.testing.assert_allclose(stack.grid(*rows)[number], patch.grid(*rows), atol=1e-14)
        np.testing.assert_allclose(stack.grid_slopes(*rows)[number], patch.grid_jacobian(*rows), atol=1e-13)
        own = owners == number
        np.testing.assert_allclose(values[own], patch(where[own]), atol=1e-14)
        np.testing.assert_allclose(slopes[own], patch.jacobian(where[own]), atol=1e-13)
    assert len(stack.take(np.array([2, 0]))) == 2


def test_patches_of_other_laws_are_other_groups():
    body = ring(4)
    one = iga_nn.solve(body, iga_nn.Poisson(source="x", boundary="0"))
    assert [group.numbers.tolist() for group in groups_of(one)] == [[0, 1, 2, 3]]
    two = iga_nn.solve(body, iga_nn.Elasticity(fix="p0_v0", load={"p2_v1": (1, 0, 0)}, young={0: 1, 1: 2, 2: 1, 3: 2}))
    assert [group.numbers.tolist() for group in groups_of(two)] == [[0, 2], [1, 3]]
    of_fields = iga_nn.solve(body, iga_nn.Poisson(source=one.field, boundary="0"))
    assert len(groups_of(of_fields)) == 4


def test_the_extremes_of_a_body_are_the_outermost_of_its_patches():
    """The stress of each patch has its own Young's modulus, the flux is that of a field as conductivity."""
    body = ring(4)
    stiff = iga_nn.solve(
        body, iga_nn.Elasticity(fix="p0_v0", load={"p2_v1": (1, 0, 0)}, young={0: 1, 1: 9, 2: 1, 3: 2})
    )
    kappa = iga_nn.solve(body, iga_nn.Poisson(exact="4+x")).field
    heat = iga_nn.solve(body, iga_nn.Poisson(source="1", boundary="0", kappa=kappa))
    for solution, name in ((stiff, "von_mises"), (heat, "flux_magnitude")):
        found, each = all_extremes(solution)[name], [patch.extremes(name) for patch in solution.patches]
        top = max(each, key=lambda one: one.largest)
        assert found.largest == pytest.approx(top.largest, rel=1e-6)
        np.testing.assert_allclose(found.largest_at, top.largest_at, atol=1e-3)
        assert found.least == pytest.approx(min(one.least for one in each), rel=1e-6, abs=1e-9)
