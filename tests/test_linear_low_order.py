"""The preconditioner of bodies: values at Greville points, coarser grids, and few iterations whatever the body."""

import numpy as np
import pytest

import iga_nn
from parameterize.conjugate_gradients import conjugate_gradients
from parameterize.spline.body import as_body
from solve.discretization.unknowns import Glued
from solve.linear import multigrid
from solve.linear.grids import Grid, on_nodes
from solve.linear.low_order import LowOrder, on_trilinear, trilinear
from solve.linear.nodal import NodalBasis, nodes
from solve.system import glued

SLENDER = 10.0  # times as long as thick is each cube of a rod


def rod(count=10, length=SLENDER, turned=True):
    """Return a rod of cubes along x; with `turned` every second one has its parameters reversed and exchanged."""

    def piece(i):
        def place(u, v, w):
            return length * (i + u), v, w

        def reversed_(u, v, w):
            return length * (i + 1.0 - v), u, w

        return iga_nn.BSplineVolume.from_function(reversed_ if turned and i % 2 else place, 6)

    return iga_nn.Body.from_patches([piece(i) for i in range(count)])


def elastic(**how):
    return iga_nn.Elasticity(young=1.0, poisson_ratio=0.3, body_force=("0", "0", "-1"), **how)


def iterations(body, problem, **how):
    system = iga_nn.discretize(body, problem, **how)
    assert isinstance(system.inverse, LowOrder) and not system.inverse.weakness
    return conjugate_gradients(system.product, system.right, system.precondition, 1e-8, 500).iterations


def test_values_at_greville_points_give_the_coefficients():
    body = rod(3, 1.0)
    field = iga_nn.solve(body, iga_nn.Poisson(source="x + y*z")).patches
    system = iga_nn.discretize(body, iga_nn.Poisson(source="x + y*z"))
    values = system.unknowns.chosen([nodal(one)[None] for one in field])
    found = NodalBasis.of(system.unknowns).coefficients(values)
    assert found == pytest.approx(
        system.unknowns.chosen([one.coefficients[None] for one in field]), rel=1e-9, abs=1e-12
    )


def nodal(field):
    """Return the values of a field at the Greville points of its patch."""
    u, v, w = (nodes(knots, degree) for knots, degree in zip(field.knots, field.degrees, strict=True))
    return np.asarray(field.grid(u, v, w))


def test_the_two_changes_of_basis_are_transposed():
    basis = NodalBasis.of(iga_nn.discretize(rod(3, 1.0), iga_nn.Poisson(source="1")).unknowns)
    one, other = np.random.default_rng(0).standard_normal((2, 2, *basis.unknowns.shape))
    assert np.vdot(basis.coefficients(one), other) == pytest.approx(np.vdot(one, basis.integrals(other)), rel=1e-10)


def test_coarser_grids_agree_at_interfaces_and_hold_linear_functions():
    body = rod()
    spaces = [patch.space for patch in iga_nn.discretize(body, elastic(fix="p0_u0"), refine=2).patches]
    grid = Grid.of(body, Glued.of(spaces, body.interfaces))
    while (coarser := grid.coarser()) is not None:
        assert coarser.count < grid.count
        fine, coarse = grid.points[:, 0], coarser.points[:, 0]  # x, which is zero at the fixed nodes
        assert grid.interpolation(coarser) @ coarse == pytest.approx(fine, abs=1e-9)
        grid = coarser
    assert {space.shape for space in grid.unknowns.spaces} == {(2, 2, 2)}


@pytest.mark.parametrize("problem", [elastic(fix="p0_u0"), elastic(spring={"x < 1e9": 1e-3})], ids=["held", "springs"])
def test_a_slender_rod_takes_few_iterations_on_every_level(problem):
    found = [iterations(rod(), problem, refine=refine) for refine in (0, 1)]
    assert max(found) <= 100 and found[1] <= 1.5 * found[0]


def test_materials_far_apart_take_few_iterations():
    body = rod(4, 1.0, turned=False)
    problem = iga_nn.Poisson(source="1", kappa="where(x > 1, where(x < 2, 1e5, 1), 1)", value={"p0_u0": "0"})
    assert iterations(body, problem) <= 60


def test_a_cycle_is_symmetric_and_positive(monkeypatch):
    monkeypatch.setattr(multigrid, "SMALL", 20)
    system = iga_nn.discretize(rod(4, 2.0), elastic(fix="p0_u0"), refine=1)
    cycle = system.inverse.cycle
    assert len(cycle.levels) > 1
    one, other = np.random.default_rng(0).standard_normal((2, *system.right.shape))
    assert np.vdot(cycle(one), other) == pytest.approx(np.vdot(one, cycle(other)), rel=1e-9)
    assert np.vdot(cycle(one), one) > 0.0


def test_an_elastic_cube_with_free_faces_has_the_preconditioner_of_bodies():
    cube = as_body(iga_nn.BSplineVolume.from_function(lambda u, v, w: (10.0 * u, v, w), 8))
    assert iterations(cube, elastic(fix="u0")) <= 40


class Sheared(iga_nn.Form):
    """A law of two components that is called at the points, with u in its flux and a reaction."""

    components, has_reaction = 2, True

    def flux(self, u, grad, x):
        return (1.0 + x[0] ** 2) * (grad + 0.3 * grad[::-1])

    def react(self, u, grad, x):
        return (2.0 + x[1]) * u


@pytest.mark.parametrize(
    "problem",
    [
        iga_nn.Poisson(source="1", kappa="1+x", reaction="y", value={"u0": "0"}),
        elastic(fix="u0"),
        iga_nn.Problem(Sheared(), source=("1", "0"), value={"u0": ("0", "0")}),
    ],
)
@pytest.mark.parametrize("count", [1, 3])
def test_the_matrix_of_trilinear_functions_is_that_of_their_products(problem, count):
    """The matrix is integrated cell by cell; patches alone and stacks have all kinds of laws."""
    body = rod(count, 1.0)
    system = iga_nn.discretize(body, problem)
    nodes_of_body = on_nodes(glued(system.unknowns))
    matrix = trilinear(nodes_of_body, system.matrix)
    x = np.random.default_rng(0).standard_normal((problem.form.components, *nodes_of_body.shape))
    expected = nodes_of_body.collect(on_trilinear(nodes_of_body, system.matrix).apply(nodes_of_body.spread(x)))
    found = (matrix @ x.T.ravel()).reshape(x.shape[::-1]).T
    assert found == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
