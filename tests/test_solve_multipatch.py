"""Several patches are solved as one body: rates, iterations, data on faces, regions and patches, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from cube_grids import box, frame, held_at, plate, ring, two

import iga_nn
from parameterize.conjugate_gradients import conjugate_gradients

WAVE = "exp(X+Z)*sin(Y)"
BODIES = {"two": two, "plate": plate, "frame": frame, "ring": ring}


def last_rate(body, problem, levels=(0, 1)):
    return iga_nn.convergence(body, problem, refine=levels)[-1].rate_l2


@pytest.mark.parametrize("degree", [2, 3, 4])
@pytest.mark.parametrize("name", ["two", "plate", "ring"])
def test_rates_with_dirichlet_data(name, degree):
    spans, levels = (8, (0, 1)) if name == "ring" else (2, (1, 2))
    assert last_rate(BODIES[name](spans, degree), iga_nn.Poisson(exact=WAVE), levels) > degree + 0.8


@pytest.mark.parametrize("name", ["plate", "ring"])
def test_rates_with_natural_data_and_one_face_held(name):
    body = BODIES[name](8 if name == "ring" else 2, 2)
    law = iga_nn.Poisson(exact=WAVE, kappa="1+x*x", neumann=held_at(body, "p0_v0"))
    assert last_rate(body, law) > 2.7


@pytest.mark.slow
def test_rates_of_a_frame_of_genus_five():
    body = frame(2, 2)
    assert last_rate(body, iga_nn.Poisson(exact=WAVE)) > 2.9
    mixed = iga_nn.Poisson(exact=WAVE, kappa="1+x*x", neumann=held_at(body, "p0_v0"))
    assert last_rate(body, mixed, (1, 2)) > 2.9


@pytest.mark.parametrize(("degree", "share"), [(2, 1.06), (3, 1.04)])
def test_the_quadrature_beside_glued_faces_costs_little_accuracy(degree, share):
    """With the points of a single cube everywhere, the errors would be 1.20 times those of more points."""
    body = two(2, degree)
    law = iga_nn.Poisson(exact=WAVE, kappa="1+x*x", neumann=held_at(body, "p0_v0"))
    fewest, more = (iga_nn.solve(body, law, refine=2, quadrature=rule).report.l2 for rule in ("spline", "gauss+1"))
    assert fewest <= share * more


def test_rates_of_elasticity():
    body = plate(2, 2)
    law = iga_nn.Elasticity(exact=("x*y*z*z", "sin(y)", "x*z"), traction=held_at(body, "p0_v0"))
    assert last_rate(body, law, (1, 2)) > 2.8


def test_rates_of_a_law_that_is_not_symmetric():
    class Wind(iga_nn.Form):
        symmetric = False

        def flux(self, u, grad, x):
            return 0.5 * grad

        def react(self, u, grad, x):
            return grad[:, 0] + 2.0 * grad[:, 1]

    assert last_rate(plate(2, 2), iga_nn.Problem(Wind(), exact="sin(x)*y+z*z*z")) > 2.7


def iterations(body, problem):
    """To 1e-10 from a right-hand side without a pattern."""
    system = iga_nn.discretize(body, problem, threads=1)
    right = np.random.default_rng(0).uniform(-1.0, 1.0, system.right.shape)
    found = conjugate_gradients(system.product, right, system.precondition, 1e-10, 200)
    assert found.converged
    return found.iterations


@pytest.mark.parametrize(("name", "spans"), [("plate", 8), pytest.param("frame", 6, marks=pytest.mark.slow)])
def test_iterations_of_patches_in_a_grid(name, spans):
    body = BODIES[name](spans)
    assert iterations(body, iga_nn.Poisson(exact=WAVE)) <= 30
    assert iterations(body, iga_nn.Poisson(exact=WAVE, neumann=held_at(body, "p0_u0"))) <= 60


def test_jumps_of_the_material_take_few_more_iterations():
    body = plate(4)
    even, jumping = ({i: 1.0 if i % 2 else size for i in range(8)} for size in (1.0, 1e4))
    problems = (iga_nn.Poisson(exact="x+y", source="0", kappa=kappa) for kappa in (even, jumping))
    plain, with_jumps = (iterations(body, problem) for problem in problems)
    assert with_jumps <= plain + 5


def test_a_ring_of_one_patch_takes_few_iterations():
    assert iterations(ring(16), iga_nn.Poisson(exact=WAVE)) <= 40


def test_an_angle_is_no_solution_on_a_ring():
    """A function with a jump where the ring is glued: its error stays."""
    law = iga_nn.Poisson(exact=lambda x, y, z: np.arctan2(y, x), source="0", neumann={"v0": "0", "v1": "0"})
    errors = [iga_nn.solve(ring(8), law, refine=level).report.l2_relative for level in (1, 2)]
    assert min(errors) > 0.2 and errors[1] > 0.9 * errors[0]


def test_natural_data_alone_leave_the_constant_to_the_mean():
    body = ring(8, patches=4)
    law = iga_nn.Poisson(exact="x+2*y+z", neumann=held_at(body, ""))
    report = iga_nn.solve(body, law).report
    assert report.converged and report.l2_relative < 2e-3
    with pytest.raises(ValueError, match="incompatible Neumann data"):
        iga_nn.solve(body, iga_nn.Poisson(source="1", neumann={f"{a}{i}": "0" for a in "uvw" for i in (0, 1)}))


def test_a_rod_of_two_materials():
    """The heat that flows through 1 / 1 + 1 / 4 is 0.8; the bar stretches by 1 + 1 / 2."""
    body = two()
    heat = iga_nn.solve(body, iga_nn.Poisson(kappa={0: 1.0, 1: 4.0}, value={"p0_u0": "0", "p1_u1": "1"}))
    assert heat.probe([[1.0, 0.5, 0.5], [0.5, 0.2, 0.3], [3.0, 0.0, 0.0]]) == pytest.approx(
        [0.8, 0.4, np.nan], nan_ok=True
    )
    assert heat.report.balance.reactions["value 'p0_u0'"] == pytest.approx((-0.8,))
    assert heat.extremes("u").largest == pytest.approx(1.0)
    law = iga_nn.Elasticity(young={0: 1.0, 1: 2.0}, poisson_ratio=0.0, fix="p0_u0", load={"p1_u1": (1, 0, 0)})
    bar = iga_nn.solve(body, law)
    assert bar.probe([[2.0, 0.5, 0.5]])[0] == pytest.approx([1.5, 0.0, 0.0], abs=1e-8)
    assert bar.report.balance.load == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)
    assert bar.report.balance.imbalance < 1e-8


def test_regions_cross_patches():
    """A weak value and a load on regions that lie on several patches: the bar stretches by its length."""
    body = plate(2, 2)
    law = iga_nn.Elasticity(
        young=1.0, poisson_ratio=0.0, fix="x < 0.001 and nx < -0.5", load={"nx > 0.5 and x > 2.5": (1, 0, 0)}
    )
    solution = iga_nn.solve(body, law)
    assert solution.report.balance.load == pytest.approx((3.0, 0.0, 0.0), abs=1e-8)
    (reaction,) = solution.report.balance.reactions.values()
    assert reaction == pytest.approx((-3.0, 0.0, 0.0), abs=1e-6)


def test_a_field_on_several_patches_is_a_datum():
    body = two()
    given = iga_nn.solve(body, iga_nn.Poisson(exact="x*y"))
    found = iga_nn.solve(body, iga_nn.Poisson(source=given.field, boundary="0"))
    expected = iga_nn.solve(body, iga_nn.Poisson(source="x*y", boundary="0"))
    assert found.probe([[1.2, 0.5, 0.5]]) == pytest.approx(expected.probe([[1.2, 0.5, 0.5]]), rel=1e-5)
    with pytest.raises(ValueError, match="found on another volume"):
        iga_nn.solve(plate(2), iga_nn.Poisson(source=given.field, boundary="0"))


def test_modes_of_a_ring_that_is_cut():
    """The drum's frequencies do not depend on where the ring is cut."""
    whole, cut = (iga_nn.modes(ring(8, patches=n), iga_nn.Poisson(source="0"), n=2) for n in (1, 4))
    assert cut.frequencies == pytest.approx(whole.frequencies, rel=1e-3)
    assert np.isfinite(cut.shapes[0].probe([[1.5, 0.0, 0.5]])).all()


def test_one_patch_of_several_is_the_volume():
    one = iga_nn.solve(iga_nn.Body((box((0, 0, 0)),)), iga_nn.Poisson(exact=WAVE))
    alone = iga_nn.solve(box((0, 0, 0)), iga_nn.Poisson(exact=WAVE))
    assert np.array_equal(one.patches[0].coefficients, alone.coefficients)
    assert one.report.l2 == alone.report.l2


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (lambda: iga_nn.Poisson(neumann={"p0_u1": None}), "p0_u1 is no outer face of the body"),
        (lambda: iga_nn.Poisson(source="1", value={"p7_u1": "0"}), "p7_u1 is no outer face"),
        (lambda: iga_nn.Poisson(source="1", boundary="0", kappa={0: 1.0}), "kappa has no entry for patch 1"),
        (lambda: iga_nn.Poisson(source="1", boundary="0", kappa=dict.fromkeys(range(3), 1.0)), "there is no patch 2"),
        (
            lambda: iga_nn.Elasticity(body_force=(0, 0, 1), young=dict.fromkeys((0, 1, 7), 1.0)),
            "young: there is no patch 7",
        ),
        (lambda: iga_nn.Elasticity(body_force=(0, 0, 1), young={1: 1.0}), "young has no entry for patch 0"),
    ],
)
def test_data_that_do_not_fit_the_patches_are_refused(law, says):
    with pytest.raises(ValueError, match=says):
        iga_nn.solve(two(), law())


def test_a_coarser_solution_is_a_start():
    body, law = ring(8, patches=4), iga_nn.Poisson(exact=WAVE)
    coarse = iga_nn.solve(body, law)
    fine, started = (iga_nn.solve(body, law, refine=1, start=start).report for start in (None, coarse))
    assert started.iterations < fine.iterations and started.l2 == pytest.approx(fine.l2, rel=1e-6)
    with pytest.raises(ValueError, match="the field has 2 patches, the body 4"):
        iga_nn.solve(body, law, refine=1, start=iga_nn.solve(two(), law))


def test_data_by_patch_of_a_volume_are_those_of_its_only_patch():
    with pytest.raises(ValueError, match="kappa: there is no patch 1; the body has 1"):
        iga_nn.solve(box((0, 0, 0)), iga_nn.Poisson(source="1", boundary="0", kappa={0: 1.0, 1: 2.0}))
    given, alone = (iga_nn.Elasticity(young=young, fix="u0", load={"u1": (1, 0, 0)}) for young in ({0: 2.0}, 2.0))
    found, expected = (iga_nn.solve(box((0, 0, 0)), law).patches[0].coefficients for law in (given, alone))
    assert np.array_equal(found, expected)


def test_a_part_that_nothing_holds_is_named():
    apart = iga_nn.Body.from_patches([box((0, 0, 0)), box((2, 0, 0))])
    with pytest.raises(ValueError, match="nothing fixes the solution on p1, a part of its own"):
        iga_nn.solve(apart, iga_nn.Poisson(source="0", value={"p0_u0": "1"}))
    with pytest.raises(ValueError, match="p1: no support holds the body"):
        iga_nn.solve(apart, iga_nn.Elasticity(fix="p0_u0", load={"p1_u1": (1, 0, 0)}))
    both = iga_nn.solve(apart, iga_nn.Poisson(exact="x*y"))
    assert both.report.converged and both.report.l2_relative < 1e-6


def test_integrals_over_several_patches():
    body = plate()
    assert iga_nn.integrate(body) == pytest.approx(8.0)
    assert iga_nn.integrate(body, over="nz > 0.5") == pytest.approx(8.0)
    assert iga_nn.integrate(body, over="p0_u0") == pytest.approx(1.0)
    solution = iga_nn.solve(body, iga_nn.Poisson(exact="x"))
    assert iga_nn.integrate(solution, "u")[0] == pytest.approx(12.0)
    assert iga_nn.resultant(solution, over="nx > 0.5 and x > 2") == pytest.approx([3.0])


def test_quantities_at_points_of_several_patches():
    solution = iga_nn.solve(plate(), iga_nn.Poisson(exact="x*y"))
    gradients = solution.quantity("gradient", [[0.5, 2.5, 0.5], [2.5, 0.5, 0.5], [1.5, 1.5, 0.5]])[:, 0]
    assert gradients[:2] == pytest.approx(np.array([[2.5, 0.5, 0.0], [0.5, 2.5, 0.0]]), abs=1e-6)
    assert np.isnan(gradients[2]).all()


def test_a_space_without_unknowns_is_refused():
    with pytest.raises(ValueError, match="leaves no unknown inside the volume: raise refine or degree"):
        iga_nn.solve(box((0, 0, 0), 1, 1), iga_nn.Poisson(exact="x"))
    report = iga_nn.solve(two(1, 1), iga_nn.Poisson(exact="x"), refine=1).report
    assert report.converged


def test_a_body_of_two_free_parts_has_twelve_rigid_motions():
    free = {f"{axis}{side}": ("0", "0", "0") for axis in "uvw" for side in (0, 1)}
    apart = iga_nn.Body.from_patches([box((0, 0, 0), 1, 2), box((2, 0, 0), 1, 2)])
    found = iga_nn.modes(apart, iga_nn.Elasticity(traction=free), n=2)
    assert found.rigid == 12 and found.frequencies[0] > 0.01


def test_a_face_that_holds_a_patch_by_rounding_alone_leaves_it_free():
    """The roller of the upper one of two boxes is off its axis by rounding; only the lower one is held along x."""

    def part(low, high):
        def place(u, v, w):
            return 8.0 * u + 1e-13 * 30.0 * v, 30.0 * v - 1e-13 * 8.0 * u, low + (high - low) * w

        return iga_nn.BSplineVolume.from_function(place, 7, 3)

    law = iga_nn.Elasticity(roller="ny < -0.999", fix="nz < -0.999", load={"nx > 0.99": (0, 0, 1)})
    report = iga_nn.solve(iga_nn.Body.from_patches([part(0.0, 8.0), part(8.0, 50.0)]), law, refine=0).report
    assert report.converged and report.iterations < 150


def test_a_long_solve_says_how_far_it_is(monkeypatch, caplog):
    monkeypatch.setattr("solve.system.TOLD", 0.0)
    with caplog.at_level("INFO", "solve"):
        report = iga_nn.solve(two(2, 2), iga_nn.Poisson(exact=WAVE)).report
    lines = [record.getMessage() for record in caplog.records if "iterations in" in record.getMessage()]
    assert lines[-1] == f"solving: {report.iterations - 1} iterations in 0 seconds"
