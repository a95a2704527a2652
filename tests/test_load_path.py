"""Load steps: rods with numbers by hand, limit loads, interruptions, and what is told."""

import numpy as np
import pytest
from scipy.optimize import brentq, fsolve

import iga_nn
from solve import ConvergenceError
from solve.load_path import InterruptedPath

HELD = ("nx < -0.9", "ny < -0.9", "nz < -0.9")  # regions, not faces: stiff supports
YOUNG, YIELD, HARDENING = 200.0, 1.0, 20.0


def rod():
    """One element of degree 2."""
    return iga_nn.BSplineVolume.from_function(lambda u, v, w: (2.0 * u, v, w), control_points=3, degree=2)


def pulled(law, force, **numbers):
    supports = [iga_nn.Roller(region) for region in HELD]
    return law(conditions=[*supports, iga_nn.Load("nx > 0.9", (force, 0, 0))], **numbers)


def metal(force, hardening=HARDENING):
    return pulled(iga_nn.Plasticity, force, young=YOUNG, yield_strength=YIELD, hardening=hardening)


def long(solution):
    return float(solution([[1.0, 0.5, 0.5]])[0, 0] - solution([[0.0, 0.5, 0.5]])[0, 0]) / 2.0


def test_a_rod_of_metal_hardens_as_its_curve_says():
    solution = iga_nn.solve(rod(), metal(1.5), load_steps=3)
    plastic = 0.5 / HARDENING
    assert long(solution) == pytest.approx(1.5 / YOUNG + plastic, rel=1e-6)
    assert solution.quantity("plastic_strain", [[0.3, 0.6, 0.2]])[0] == pytest.approx(plastic, rel=1e-6)
    assert solution.quantity("von_mises", [[0.3, 0.6, 0.2]])[0] == pytest.approx(1.5, rel=1e-6)
    report = solution.report
    assert report.converged and report.load_factor == 1.0 and len(report.load_steps) == 3
    assert report.load_steps[-1].plastic_strain == pytest.approx(plastic, rel=1e-6)
    assert report.balance.reactions[f"roller '{HELD[0]}'"][0] == pytest.approx(-1.5, rel=1e-6)


def test_a_rod_without_hardening_carries_its_yield_strength_alone():
    report = iga_nn.solve(rod(), metal(1.25, 0.0), load_steps=4).report
    assert 0.79 < report.load_factor <= 0.8 + 1e-9 and not report.converged
    assert any(notice.startswith("the body carries 0.79") or "carries 0.8 " in notice for notice in report.notices)


RUBBERS = {
    "neo-Hooke": (iga_nn.NeoHookean, {"shear": 0.8}),
    "Mooney": (iga_nn.MooneyRivlin, {"c10": 0.3, "c01": 0.1}),
    "Yeoh": (iga_nn.Yeoh, {"c10": 0.4, "c20": -0.02, "c30": 0.01}),
}


@pytest.mark.parametrize("name", RUBBERS)
def test_a_rod_of_rubber_is_as_long_as_in_the_book(name):
    """Of an incompressible rod P = 2 (a - a^-2) (w1 + w2 / a), Bonet and Wood; here K is 100 mu."""
    kind, numbers = RUBBERS[name]
    solution = iga_nn.solve(rod(), pulled(kind, 1.2, bulk=80.0, **numbers), load_steps=2)
    form = kind(fix="u0", bulk=80.0, **numbers)

    def nominal(stretches):
        grad = np.diag([stretches[0], stretches[1], stretches[1]]) - np.eye(3)
        stress = form.flux(None, grad[:, :, None], None)
        return stress[0, 0, 0] - 1.2, stress[1, 1, 0]

    def force(stretch):
        one, two = form.slopes(stretch**2 + 2.0 / stretch - 3.0, 2.0 * stretch + stretch**-2 - 3.0)
        return 2.0 * (stretch - stretch**-2) * (one + two / stretch)

    found = 1.0 + long(solution)
    assert found == pytest.approx(fsolve(nominal, [1.5, 0.8], xtol=1e-12)[0], rel=1e-6)
    assert found == pytest.approx(brentq(lambda a: force(a) - 1.2, 1.0, 4.0), rel=0.01)
    assert solution.report.load_factor == 1.0


class Kept:
    """Keep the last step, and interrupt after some of them."""

    def __init__(self, steps):
        self.steps, self.last = steps, None

    def save(self, arrays, state):
        self.last, self.steps = ({name: array.copy() for name, array in arrays.items()}, state), self.steps - 1
        if self.steps == 0:
            raise KeyboardInterrupt("stop")

    def load(self):
        return self.last


def test_an_interrupted_solve_goes_on_after_its_last_step():
    kept = Kept(2)
    with pytest.raises(InterruptedPath, match="stop") as caught:
        iga_nn.solve(rod(), metal(1.5), load_steps=4, keep=kept)
    partial = caught.value.solution
    assert partial.report.load_factor == 0.5 and partial.report.interrupted and not partial.report.converged
    assert long(partial) == pytest.approx(0.75 / YOUNG, rel=1e-6)
    assert "interrupted: this is the solution under 0.5 of the load" in partial.report.notices[0]
    resumed = iga_nn.solve(rod(), metal(1.5), load_steps=4, keep=kept)
    whole = iga_nn.solve(rod(), metal(1.5), load_steps=4)
    assert np.array_equal(resumed.coefficients, whole.coefficients)
    assert resumed.report.load_steps == whole.report.load_steps


def test_what_is_kept_of_another_mesh_is_left():
    kept = Kept(9)
    iga_nn.solve(rod(), metal(0.5), load_steps=1, keep=kept)
    again = iga_nn.solve(rod(), metal(0.5), load_steps=1, keep=kept, degree=3)
    assert len(again.report.load_steps) == 1 and again.report.dofs == 192


def test_given_displacements_grow_with_the_load():
    held = [iga_nn.Roller(HELD[1]), iga_nn.Roller(HELD[2]), iga_nn.Roller(HELD[0]), iga_nn.Roller("nx > 0.9", 0.1)]
    law = iga_nn.Plasticity(young=YOUNG, yield_strength=YIELD, hardening=HARDENING, conditions=held)
    solution = iga_nn.solve(rod(), law, load_steps=2)
    stress = (0.05 + YIELD / HARDENING) / (1.0 / YOUNG + 1.0 / HARDENING)
    assert solution.quantity("von_mises", [[0.5, 0.5, 0.5]])[0] == pytest.approx(stress, rel=1e-3)
    assert long(solution) == pytest.approx(0.05, rel=1e-3)


def test_what_no_step_can_reach_is_an_error():
    law = iga_nn.NeoHookean(shear=1.0, bulk=1.0, fix="u0", load={"u1": (0, 0, 1e12)})
    with pytest.raises(ConvergenceError, match="newton: no convergence"):
        iga_nn.solve(rod(), law, load_steps=1)


def test_options_of_linear_laws_are_refused():
    with pytest.raises(ValueError, match="ask 'ux at .*intervals are known of linear laws only"):
        iga_nn.solve(rod(), metal(1.0), ask="ux at (1, 0, 0)")
    with pytest.raises(ValueError, match="load_steps must be a whole number, at least 1, got 0"):
        iga_nn.solve(rod(), metal(1.0), load_steps=0)
