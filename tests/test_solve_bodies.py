"""Time and nonlinear laws on a rod of two patches: the answer of the same rod in one patch, whose space is the same."""

import numpy as np
import pytest
from cube_grids import box, ring, two
from example_files import load

import iga_nn
from parameterize.spline.bspline import with_full_knots
from solve.assembly import assemble_body_data
from solve.options import SolveOptions
from solve.preparation import prepared

NOTHING = ("0", "0", "0")
FREE = ("u1", "v0", "v1", "w0", "w1")
CUT = 0.5


def bent_rod():
    """A rod in one patch whose splines are only continuous in the middle, and the same rod cut there into two."""
    smooth = iga_nn.BSplineVolume.from_function(
        lambda u, v, w: (2.0 * u, v + 0.2 * np.sin(2.0 * u), w), control_points=(7, 4, 4)
    )
    u, v, w = smooth.knots
    whole = smooth.on_knots((with_full_knots(u, 3, [CUT]), v, w))
    return whole, iga_nn.Body.from_patches(whole.divided(u=[CUT]))


def demand_same(one, several, tolerance):
    """Demand the same coefficients of both, those in the middle once for each patch."""
    left, right = (patch.coefficients for patch in several.patches)
    assert np.allclose(one.coefficients[: len(left)], left, atol=tolerance)
    assert np.allclose(one.coefficients[-len(right) :], right, atol=tolerance)


def warming(time):
    return iga_nn.Poisson(source=f"x*cos({time})", boundary=f"sin({time})*y", neumann={"v1": "z"}, reaction="1")


@pytest.mark.parametrize("scheme", ["bdf2", "trapezoidal"])
def test_heat_in_two_patches_is_that_in_one(scheme):
    how = {"dt": 0.1, "steps": 5, "scheme": scheme, "capacity": 2.0, "tolerance": 1e-12}
    one, several = (iga_nn.march(body, warming, "1+x", **how) for body in bent_rod())
    for field, of_patches in zip(one.fields, several.fields, strict=True):
        demand_same(field, of_patches, 1e-9)
    assert several.fields[-1].probe([[0.5, 0.5, 0.5]])[0] == pytest.approx(one.fields[-1].probe([[0.5, 0.5, 0.5]])[0])


def on_regions(time):
    """Data of time on regions that no patch ends: an exchange whose surroundings warm up, a flux, and values."""
    held, heated = iga_nn.Value("u1", f"sin({time})*y"), iga_nn.Flux("v0 and x > 0.5", f"1+{time}*x")
    around = iga_nn.Exchange("z > 0.999 and x < 1.7", 2.0, f"{time}")
    return iga_nn.Problem(iga_nn.Poisson(source="0").form, source=f"x*{time}", conditions=[held, heated, around])


def test_data_of_time_on_regions_of_two_patches_are_those_of_one():
    how = {"dt": 0.1, "steps": 4, "tolerance": 1e-13}
    one, several = (iga_nn.march(body, on_regions, "1+x", **how).fields[-1] for body in bent_rod())
    demand_same(one, several, 1e-10)
    assert not np.allclose(one.coefficients[..., -1], one.coefficients[..., 0], atol=0.1)


def test_renewed_data_on_regions_are_those_that_are_assembled_anew():
    _, rod = bent_rod()
    options = SolveOptions()
    early, late = (prepared(rod, on_regions(time), options)[1] for time in (0.3, 0.7))
    renewed, anew = assemble_body_data(early, options).renewed(late), assemble_body_data(late, options)
    for name in ("loads", "known"):
        found, wanted = getattr(renewed, name).flat, getattr(anew, name).flat
        assert np.abs(wanted).max() > 0.0 and found == pytest.approx(wanted, abs=1e-14)


def test_a_march_goes_on_from_a_field_on_several_patches():
    _, rod = bent_rod()
    whole = iga_nn.march(rod, warming, "1", dt=0.1, steps=4, scheme="trapezoidal")
    half = iga_nn.march(rod, warming, "1", dt=0.1, steps=2, scheme="trapezoidal")
    rest = iga_nn.march(rod, warming, half.fields[-1], dt=0.1, steps=2, scheme="trapezoidal", first=0.2)
    for found, wanted in zip(rest.fields[-1].patches, whole.fields[-1].patches, strict=True):
        assert np.allclose(found.coefficients, wanted.coefficients, atol=1e-8)
    with pytest.raises(ValueError, match="the field has 2 patches, the body 4"):
        iga_nn.march(ring(8, patches=4), warming, half.fields[-1], dt=0.1, steps=1)


def test_a_start_that_is_no_spline_is_continuous_at_interfaces():
    _, rod = bent_rod()
    left, right = iga_nn.march(rod, warming, "exp(3*x)*sin(5*y)", dt=0.1, steps=1).fields[0].patches
    assert np.array_equal(left.coefficients[-1], right.coefficients[0])


def test_heat_in_a_ring_of_one_patch_is_that_of_four():
    law = iga_nn.Poisson(source="x", boundary="0")
    one, four = (iga_nn.march(ring(8, patches=patches), law, "x*y", dt=0.1, steps=3).fields[-1] for patches in (1, 4))
    points = [[1.5, 0.0, 0.5], [0.0, -1.4, 0.3]]
    assert np.allclose(one.probe(points), four.probe(points), atol=2e-3)


def test_a_series_of_several_patches_tells_them_apart(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    found = iga_nn.march(two(1), iga_nn.Poisson(source="0", boundary="0"), "1", dt=0.01, steps=1)
    found.save_pvd(tmp_path / "film.pvd")
    seen = pyvista.read(tmp_path / "film_0001.vtu")
    assert set(seen.cell_data["patch"].tolist()) == {0, 1} and 0.0 < seen["u"].max() < 1.1


class Warm(iga_nn.Form):
    """A conductivity 1 + u^2, and a reaction u^3."""

    linear = symmetric = False

    def flux(self, u, grad, x):
        return (1.0 + u[0] ** 2) * grad

    def react(self, u, grad, x):
        return u**3


def test_a_nonlinear_law_on_two_patches_has_the_solution_of_one():
    problem = iga_nn.Problem(Warm(), source="5*x", boundary="y", neumann={"w1": "1"}, robin={"v0": ("2", "1")})
    one, several = (iga_nn.newton(body, problem, tolerance=1e-13) for body in bent_rod())
    demand_same(one, several, 1e-10)
    assert one.report.dofs == several.report.dofs and one.report.iterations == several.report.iterations


def test_a_nonlinear_law_with_data_on_regions_of_two_patches_has_the_solution_of_one():
    conditions = [iga_nn.Exchange("z > 0.999 and x < 1.7", 2.0, "y"), iga_nn.Flux("v0 and x > 0.5", "1+x")]
    problem = iga_nn.Problem(Warm(), source="5*x", conditions=conditions)
    one, several = (iga_nn.newton(body, problem, tolerance=1e-13) for body in bent_rod())
    demand_same(one, several, 1e-10)


def test_a_rod_of_two_patches_bends_far_as_one():
    small = iga_nn.Elasticity(displacement=NOTHING, young=100.0, poisson_ratio=0.3)
    traction = {**dict.fromkeys(FREE, NOTHING), "u1": ("0", "0", "8")}
    problem = iga_nn.Problem(load("large_strain").NeoHookean(*small.constants), source=NOTHING, neumann=traction)
    one, several = (iga_nn.newton(body, problem, load_steps=2, tolerance=1e-12) for body in bent_rod())
    demand_same(one, several, 1e-8)
    assert several.probe([[2.0, 0.5, 0.5]])[0, 2] > 0.5


def test_a_nonlinear_solution_on_two_patches_is_a_start_with_known_errors():
    problem = iga_nn.Problem(Warm(), exact="exp(X+Z)*sin(Y)")
    coarse = iga_nn.newton(two(), problem)
    fine = iga_nn.newton(two(), problem, refine=1, start=coarse)
    assert fine.report.l2 < 0.2 * coarse.report.l2 and fine.report.residuals[0] < 0.1


def test_a_part_that_nothing_holds_is_named():
    apart = iga_nn.Body.from_patches([box((0, 0, 0)), box((2, 0, 0))])

    class Plain(iga_nn.Form):
        linear = False

        def flux(self, u, grad, x):
            return (1.0 + u[0] ** 2) * grad

    with pytest.raises(ValueError, match="nothing fixes the solution on p1, a part of its own"):
        iga_nn.newton(apart, iga_nn.Problem(Plain(), source="0", value={"p0_u0": "1"}))
