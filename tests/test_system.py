"""The linear system in a user's hands, and fields as data."""

import numpy as np
import pytest
from scipy.sparse.linalg import cg

import iga_nn
from solve import BodyField, SplineField, benchmark_volume, solve_problem

WAVE = "exp(x+z)*sin(y)"
ROBIN = iga_nn.Poisson(exact=WAVE, reaction="1", robin={"u0": ("2", None)})
BODY = iga_nn.Elasticity(exact=("exp(x)*sin(y)", "cos(x*z)", "x*y*z"), traction={"u1": None})


@pytest.mark.parametrize("problem", [ROBIN, BODY], ids=["robin", "elasticity"])
def test_a_cg_of_ones_own_finds_the_same_solution(problem):
    system = iga_nn.discretize(benchmark_volume(2), problem, refine=1)
    x, failed = cg(system.operator, system.load, rtol=1e-12, M=system.preconditioner)
    assert not failed and system.load.shape == (system.operator.shape[0],)
    found = system.field(x)
    assert isinstance(found, BodyField)
    assert np.allclose(found.coefficients, system.solve(tolerance=1e-12).coefficients, atol=1e-9)


def test_free_coefficients_of_another_number_are_refused():
    system = iga_nn.discretize(benchmark_volume(4), ROBIN)
    with pytest.raises(ValueError, match=f"x must have {len(system.load)} entries, the free coefficients, got 2"):
        system.field([1.0, 2.0])


def test_operators_are_symmetric_and_the_mass_integrates():
    """1 is in the space where all faces are free: its mass is the volume of the map."""
    volume = benchmark_volume(3, degree=2)
    system = iga_nn.discretize(volume, iga_nn.Poisson(source="0", reaction="1", neumann=dict.fromkeys(
        ("u0", "u1", "v0", "v1", "w0", "w1"), "0")))  # fmt: skip
    rng, n = np.random.default_rng(0), system.operator.shape[0]
    a, b = rng.standard_normal((2, n))
    for matrix in (system.operator, system.mass, system.preconditioner):
        assert a @ (matrix @ b) == pytest.approx(b @ (matrix @ a), rel=1e-10)
        assert a @ (matrix @ a) > 0.0
    ones, x = np.ones(n), volume.control_points[..., 0].ravel()
    assert ones @ (system.operator @ ones) == pytest.approx(ones @ (system.mass @ ones))
    assert ones @ (system.mass @ ones) == pytest.approx(0.97, abs=0.01)
    stretch = x @ (system.operator @ x) - x @ (system.mass @ x)  # of grad x, and the volume again
    assert stretch == pytest.approx(ones @ (system.mass @ ones), rel=1e-3)


def test_a_step_of_the_heat_equation_by_the_mass_is_the_one_by_a_field():
    """u' = Laplace u, implicit Euler: (M / dt + K) u = M u_old / dt, with u = 0 on the boundary."""
    volume, dt = benchmark_volume(3, degree=2), 0.01
    start = solve_problem(volume, iga_nn.Poisson(source="1+x"))
    law = {"reaction": str(1.0 / dt), "boundary": "0"}
    by_field = solve_problem(volume, iga_nn.Poisson(source=_scaled(start.field, 1.0 / dt), **law), tolerance=1e-13)
    system = iga_nn.discretize(volume, iga_nn.Poisson(source="0", **law))
    old = system.vector(start)
    assert np.array_equal(old, start.coefficients[1:-1, 1:-1, 1:-1].ravel())
    new, _ = cg(system.operator, system.mass @ old / dt, rtol=1e-13, M=system.preconditioner)
    assert np.allclose(system.field(new).coefficients, by_field.coefficients, atol=1e-10)
    assert 0.3 < np.abs(new).max() / np.abs(old).max() < 0.95


def _scaled(field, factor):
    return SplineField(field.degrees, field.knots, factor * field.coefficients)


def test_fields_as_data_are_the_functions_they_hold():
    """On the map itself x, y and z are splines; every datum but the source's derivative is one of them here."""
    volume = benchmark_volume(3, degree=2)
    x, y, z = (SplineField(volume.degrees, volume.knots, volume.control_points[..., i]) for i in range(3))
    three = SplineField(volume.degrees, volume.knots, 3.0 + volume.control_points[..., 0])
    fields = iga_nn.Poisson(
        source=x, boundary=y, kappa=three, reaction=three, neumann={"u1": z}, robin={"w0": (three, y)}
    )
    formulas = iga_nn.Poisson(
        source="x", boundary="y", kappa="3+x", reaction="3+x", neumann={"u1": "z"}, robin={"w0": ("3+x", "y")}
    )
    found, wanted = (solve_problem(volume, p, refine=1, tolerance=1e-12).coefficients for p in (fields, formulas))
    assert np.allclose(found, wanted, atol=1e-10)
    place = SplineField(volume.degrees, volume.knots, volume.control_points)
    body = iga_nn.Elasticity(body_force=place, displacement=(x, "y", lambda x, y, z: z))
    written = iga_nn.Elasticity(body_force=("x", "y", "z"), displacement=("x", "y", "z"))
    found, wanted = (solve_problem(volume, p, estimate=True) for p in (body, written))
    assert np.allclose(found.coefficients, wanted.coefficients, atol=1e-8)
    assert found.report.error_estimate == pytest.approx(wanted.report.error_estimate, rel=1e-6)


def test_a_law_may_read_a_field():
    """Picard's step: the conductivity 1 + T^2 of a field T, beside the same as a formula."""
    volume = benchmark_volume(3, degree=2)
    field = SplineField(volume.degrees, volume.knots, volume.control_points[..., 1])

    class Conductivity(iga_nn.Form):
        def flux(self, u, grad, x):
            return (1.0 + field.at(x) ** 2) * grad

    found = solve_problem(volume, iga_nn.Problem(Conductivity(), source="1"), tolerance=1e-12)
    wanted = solve_problem(volume, iga_nn.Poisson(source="1", kappa="1+y*y"), tolerance=1e-12)
    assert np.allclose(found.coefficients, wanted.coefficients, atol=1e-11)
    assert found.report.error_estimate is None
    with pytest.raises(ValueError, match=r"function of the parameters: evaluate with field\(uvw\)"):
        field.at(np.zeros((3, 4)))


def test_a_vector_of_a_coarser_field_is_the_same_spline():
    """Zero on the boundary on both levels: knot insertion changes nothing."""
    body = iga_nn.Elasticity(body_force=("1", "x", "y"))
    coarse, fine = (iga_nn.discretize(benchmark_volume(2), body, refine=level) for level in (0, 1))
    field, where = coarse.solve().field, ([0.3, 0.9], [0.5], [0.6])
    assert np.allclose(fine.field(fine.vector(field)).grid(*where), field.grid(*where), rtol=1e-12)
    with pytest.raises(ValueError, match="not contained in the trial space"):
        coarse.vector(fine.solve())


def test_a_field_of_other_components_is_refused():
    volume = benchmark_volume(2)
    field = SplineField(volume.degrees, volume.knots, volume.control_points)
    with pytest.raises(ValueError, match=r"source: the field must have 1 component"):
        iga_nn.Poisson(source=field)


def test_a_field_of_another_volume_is_refused():
    """The twisted cubes of 2 and 3 spans are different maps; a map that is equal, or that nobody knows, will do."""
    field = solve_problem(benchmark_volume(2), iga_nn.Poisson(source="1")).field
    problem = iga_nn.Poisson(source=field)
    for volume in (benchmark_volume(3), benchmark_volume(2, amplitude=0.05)):
        with pytest.raises(ValueError, match="source: the field was found on another volume; give one of the volume"):
            solve_problem(volume, problem)
        loose = SplineField(field.degrees, field.knots, field.coefficients)
        assert solve_problem(volume, iga_nn.Poisson(source=loose)).report.converged
    assert solve_problem(benchmark_volume(2), problem).report.converged
